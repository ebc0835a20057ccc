//! The motor: PWM, direction and enable.

use hal::pac::PWM;
use upright::board::Output;

use super::CLOCK_HZ;
use super::guard::{self, Guard};
use super::pins;

/// PWM frequency (Hz): above hearing.
const PWM_HZ: u32 = 20_000;
/// Clocks per period.
const PERIOD: u32 = CLOCK_HZ / PWM_HZ;
/// Shortest inactive time of the output in each period (clocks): power stages with a bootstrap supply need the pause.
const LEAST_PAUSE: u32 = PERIOD / 50;
/// Slice of the PWM pin; output A.
const SLICE: usize = (pins::PWM / 2) % 8;

/// The PWM and the pins of the power stage.
pub(super) struct Motor {
    guard: Guard,
    on: bool,
    is_positive: bool,
}

impl Motor {
    /// Starts the PWM with a duty of 0 and the power stage disabled.
    pub(super) fn set_up(pwm: &PWM, guard: Guard) -> Self {
        let slice = pwm.ch(SLICE);
        // SAFETY, here and below: values within the widths of the fields (4.5.3).
        unsafe {
            slice.div().write(|w| w.bits(1 << 4));
            slice.top().write(|w| w.bits(PERIOD - 1));
            slice.cc().write(|w| w.bits(0));
            slice.csr().write(|w| w.bits(1));
        }
        Self { guard, on: false, is_positive: false }
    }

    /// Whether the dead man's switch does not run.
    pub(super) fn has_failed(&self) -> bool {
        self.guard.has_stopped()
    }

    /// Drives the motor for at most three ticks, or lets it coast.
    pub(super) fn drive(&mut self, output: &Output) {
        if !output.enable {
            set_level(0);
            // Once: when it is off, it waits for the next time.
            if self.on {
                self.guard.release();
            }
            self.on = false;
            return;
        }
        let is_positive = output.duty > 0.0;
        let active = (output.duty.abs() * PERIOD as f32 + 0.5) as u32;
        set_level(active.min(PERIOD - LEAST_PAUSE));
        if is_positive != self.is_positive {
            // The last clock of the period: the output is low, and the new level counts from the next clock on.
            set_counter(PERIOD - 1);
            pins::set_direction(is_positive);
            self.is_positive = is_positive;
        }
        self.guard.hold();
        self.on = true;
    }
}

/// Turns the motor off, when nothing else runs any more.
pub(super) fn off() {
    set_level(0);
    guard::release();
}

fn set_level(level: u32) {
    // SAFETY: at most the period; only the control task writes it.
    unsafe { (*PWM::PTR).ch(SLICE).cc().write(|w| w.bits(level)) };
}

fn set_counter(count: u32) {
    // SAFETY: within the period.
    unsafe { (*PWM::PTR).ch(SLICE).ctr().write(|w| w.bits(count)) };
}
