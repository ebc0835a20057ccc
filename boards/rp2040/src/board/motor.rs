//! The motor: enable, and PWM with direction, or step pulses.

use hal::pac::PWM;
use upright::board::Output;

use super::chip::CLOCK_HZ;
use super::guard::{self, Guard};
use super::pins;
use super::steps::Steps;

/// PWM frequency (Hz): above hearing.
const PWM_HZ: u32 = 20_000;
/// Clocks per period.
const PERIOD: u32 = CLOCK_HZ / PWM_HZ;
/// Shortest inactive time of the output in each period (clocks): power stages with a bootstrap supply need the pause.
const LEAST_PAUSE: u32 = PERIOD / 50;
/// Slice of the PWM pin; output A.
const SLICE: usize = (pins::PWM / 2) % 8;

/// The pins of the power stage.
pub(super) struct Motor {
    guard: Guard,
    steps: Option<Steps>,
    on: bool,
    is_positive: bool,
}

impl Motor {
    /// Starts the PWM with a duty of 0 and the power stage disabled. A drive that takes pulses has `steps`.
    pub(super) fn set_up(pwm: &PWM, guard: Guard, steps: Option<Steps>) -> Self {
        let slice = pwm.ch(SLICE);
        // SAFETY, here and below: values within the widths of the fields (4.5.3).
        unsafe {
            slice.div().write(|w| w.bits(1 << 4));
            slice.top().write(|w| w.bits(PERIOD - 1));
            slice.cc().write(|w| w.bits(0));
            slice.csr().write(|w| w.bits(1));
        }
        Self { guard, steps, on: false, is_positive: false }
    }

    /// Whether a state machine does not run.
    pub(super) fn has_failed(&self) -> bool {
        self.guard.has_stopped() | self.steps.as_ref().is_some_and(Steps::have_stopped)
    }

    /// The number of all pulses, for a drive that takes them.
    pub(super) fn pulses(&self) -> Option<u32> {
        self.steps.as_ref().map(Steps::given)
    }

    /// Drives the motor for at most three ticks, or lets it coast.
    pub(super) fn drive(&mut self, output: &Output) {
        if !output.enable {
            set_level(0);
            if let Some(steps) = &self.steps {
                steps.stop();
            }
            // Once: when it is off, it waits for the next time.
            if self.on {
                self.guard.release();
            }
            self.on = false;
            return;
        }
        if let Some(steps) = &mut self.steps {
            steps.give(output.pulses());
        } else {
            self.turn(output.duty);
        }
        self.guard.hold();
        self.on = true;
    }

    fn turn(&mut self, duty: f32) {
        let is_positive = duty > 0.0;
        let active = (duty.abs() * PERIOD as f32 + 0.5) as u32;
        set_level(active.min(PERIOD - LEAST_PAUSE));
        if is_positive != self.is_positive {
            // The last clock of the period: the output is low, and the new level counts from the next clock on.
            set_counter(PERIOD - 1);
            pins::set_direction(is_positive);
            self.is_positive = is_positive;
        }
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
