//! The board, as the firmware sees it: inputs, output and the trait [`Board`], the boundary between firmware and
//! hardware.
//!
//! To use your own board, implement [`Board`] in your own crate. The boards of this project are part of the image
//! (`src/image/board/`), not of this library.
//!
//! ```
//! use upright::board::{Board, Contacts, Inputs, Output};
//! use upright::control::encoder::CounterWidth;
//!
//! /// A counter for the cart's encoder, and the registers of a power stage.
//! struct Bench {
//!     counter: u16,
//!     duty: f32,
//!     enable: bool,
//! }
//!
//! impl Board<1> for Bench {
//!     const WIDTHS: [CounterWidth; 1] = [CounterWidth::Bits16];
//!     fn tick_s(&self) -> f32 {
//!         0.001
//!     }
//!     fn inputs(&mut self) -> Inputs<1> {
//!         Inputs { raw_counts: [self.counter.into()], supply_v: 24.0, contacts: Contacts::default() }
//!     }
//!     fn drive(&mut self, output: &Output) {
//!         (self.enable, self.duty) = (output.enable, output.duty);
//!     }
//!     fn feed_watchdog(&mut self) {}
//!     fn cycles(&self) -> u32 {
//!         0
//!     }
//! }
//!
//! let mut bench = Bench { counter: 7, duty: 0.5, enable: true };
//! bench.drive(&Output::OFF);
//! assert!(!bench.enable && bench.duty == 0.0);
//! assert_eq!(bench.inputs().raw_counts, [7]);
//! ```

use serde::{Deserialize, Serialize};

use crate::control::actuator::Drive;
use crate::control::encoder::CounterWidth;
use crate::table::DriveMap;

/// All inputs, read at the start of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inputs<const NY: usize> {
    /// Raw readings of the encoder counters. With a drive that takes pulses, the first one is the number of all pulses
    /// given so far.
    pub raw_counts: [u32; NY],
    /// Supply voltage of the motor's power stage (V).
    pub supply_v: f32,
    /// Contacts and flags.
    pub contacts: Contacts,
}

/// Samples that a board knows to be bad, by parity, an error flag or the end of a range. What the observer predicts
/// takes the place of a bad sample; the third in a row of a sensor is
/// [`Fault::Encoder`](crate::supervision::fault::Fault::Encoder). The reading of a noisy sensor that stays the same is
/// [`Fault::Frozen`](crate::supervision::fault::Fault::Frozen).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BadSamples<const NY: usize> {
    /// The sensors whose samples are bad in this tick: bit i for sensor i.
    pub now: u32,
    /// Those of the ticks before, the latest first.
    before: [u32; 2],
    /// Last reading of each sensor, and the ticks for which it has been the same.
    readings: [(u32, u16); NY],
}

impl<const NY: usize> Default for BadSamples<NY> {
    fn default() -> Self {
        Self { now: 0, before: [0; 2], readings: [(0, 0); NY] }
    }
}

impl<const NY: usize> BadSamples<NY> {
    /// Ends a tick: the next one is good. Returns the first sensor whose samples were bad in all of the last ticks.
    pub(crate) fn finish(&mut self) -> Option<u8> {
        let bad = core::mem::take(&mut self.now);
        let lost = self.before.iter().fold(bad, |lost, bad| lost & bad);
        self.before.rotate_right(1);
        self.before[0] = bad;
        (lost != 0).then(|| lost.trailing_zeros() as u8)
    }

    /// Counts the ticks for which each reading has been the same, in a row; from 0 if `anew`. Returns them.
    pub(crate) fn equal_ticks(&mut self, raw_counts: &[u32; NY], anew: bool) -> [u16; NY] {
        let mut ticks = [0; NY];
        for ((last, &reading), ticks) in self.readings.iter_mut().zip(raw_counts).zip(&mut ticks) {
            *ticks = if anew || last.0 != reading { 0 } else { last.1.saturating_add(1) };
            *last = (reading, *ticks);
        }
        ticks
    }
}

/// Contacts and flags of a tick; all are false in the healthy state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Contacts {
    /// The limit switch at the low end of the rail is pressed, or its wire is open.
    pub limit_low: bool,
    /// The limit switch at the high end of the rail is pressed, or its wire is open.
    pub limit_high: bool,
    /// The emergency stop is pressed, or its wire is open.
    pub emergency_stop: bool,
    /// The power stage has reported a fault since the last tick, even briefly.
    pub driver_fault: bool,
    /// The previous tick was still running when this one was due.
    pub overrun: bool,
    /// The processor's clock did not start or has stopped: ticks have the wrong length, or one came before the
    /// pulses of the one before had ended.
    pub clock_fault: bool,
    /// The chip is not the one that the image is for, a register lost what was written to it, or the chip's own supply
    /// was low.
    pub board_fault: bool,
}

/// The output to the power stage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Whether the power stage is enabled; false lets the motor coast.
    pub enable: bool,
    /// Duty cycle from -1 to 1, positive along +x; 0 whenever `enable` is false. It is all that a board needs, unless
    /// its drive takes [`pulses`](Self::pulses).
    pub duty: f32,
    /// The same as the control law has computed it, for simulations; [`Drive::OFF`] whenever `enable` is false.
    pub drive: Drive,
}

impl Output {
    /// Motor off.
    pub const OFF: Self = Self { enable: false, duty: 0.0, drive: Drive::OFF };

    /// Pulses of this tick, positive along +x, to be spread evenly over it, the first one half an interval after its
    /// beginning; 0 for a drive without pulses.
    pub fn pulses(&self) -> i32 {
        if let Drive::Steps(pulses) = self.drive { pulses } else { 0 }
    }

    /// Motor on, with a command to the drive `map` of the gain table: see [`Drive::duty`].
    #[inline(always)]
    pub fn on(drive: Drive, map: &DriveMap) -> Self {
        Self { enable: true, duty: drive.duty(map), drive }
    }
}

/// The hardware. Each board implements this trait; so do the simulations on the host.
pub trait Board<const NY: usize> {
    /// Widths of the encoder counters.
    const WIDTHS: [CounterWidth; NY];
    /// Whether the board gives the pulses of [`Output::pulses`]. If it does not and the gain table's drive needs them,
    /// the motor stays off.
    const GIVES_PULSES: bool = false;
    /// Whether the board itself finds, between ticks, a bit of the tables that changes. Then the control task reads the
    /// gain table only before arming.
    const CHECKS_TABLES: bool = false;

    /// The tick to which the timer is set that starts the control task (s). If the gain table is for another one,
    /// the motor stays off.
    fn tick_s(&self) -> f32;

    /// Whether the image in flash has another [checksum](crate::flash_image) than the one that it carries. Then the
    /// motor stays off. A board that does not look says no.
    fn image_is_damaged(&self) -> bool {
        false
    }

    /// Reads all inputs. Waits for nothing but the bus of sensors, for a time that does not depend on them.
    fn inputs(&mut self) -> Inputs<NY>;

    /// The samples of the last [`inputs`](Self::inputs) that are known to be bad; none, if the board cannot tell:
    /// then a tick does not pay for it.
    fn bad_samples(&mut self) -> Option<&mut BadSamples<NY>> {
        None
    }

    /// Drives the motor with the duty of `output` until the next call, or gives its pulses, once. A drive with pulses
    /// that is enabled without pulses holds the cart.
    fn drive(&mut self, output: &Output);

    /// Called at the end of every tick: the time to note what the next [`inputs`](Self::inputs) report, such as whether
    /// the next tick is already due. By default, it does nothing.
    fn end_tick(&mut self) {}

    /// Restarts the independent watchdog. The control task calls this after [`end_tick`](Self::end_tick), but not while
    /// three ticks in a row were late, by [`Contacts::overrun`]. If the watchdog is not restarted in time, it resets
    /// the microcontroller, which turns the motor off.
    fn feed_watchdog(&mut self);

    /// A free-running counter of processor cycles.
    fn cycles(&self) -> u32;
}
