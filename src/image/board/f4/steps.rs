//! Step pulses, in place of the motor's PWM: for a drive that imposes the cart's acceleration.
//!
//! Timer 1 gives the pulses of a tick, evenly, and then stops: one-pulse mode with the repetition counter (RM0090,
//! 17.3.10, 17.3.3). When ticks stop, so do the pulses, without any code. Each interval begins with the output inactive
//! (PWM mode 2, 17.3.9), so the first pulse comes half an interval after the direction has changed.
//!
//! A restart would cut what is left of the pulses, and nothing tells how many that is: the repetition counter cannot be
//! read (17.4.13). So they end before the next tick is due, and a tick that finds the timer still running turns the
//! drive off.

use upright::board::Output;
use upright::boards::f4::PULSES;

use super::motor::Motor;
use super::pins;

/// Least number of processor cycles between the end of the pulses and the next start: the time of a tick's code before
/// its start, so that the pulses belong to one tick. In long ticks it is a fiftieth of the tick.
const LEAST_REST: u32 = super::CLOCK_HZ / 1_000_000 * 20;

/// The number of pulses so far.
pub(super) struct Steps {
    /// Processor cycles for the pulses of a tick; timer 1 counts at the same rate.
    cycles: u32,
    given: u32,
    was_late: bool,
}

impl Steps {
    /// No pulses yet, in ticks of so many processor cycles.
    pub(super) fn new(tick_cycles: u32) -> Self {
        let cycles = tick_cycles - LEAST_REST.max(tick_cycles / 50);
        Self { cycles, given: 0, was_late: false }
    }

    /// Number of all pulses so far, with those of the last tick.
    pub(super) fn given(&self) -> u32 {
        self.given
    }

    /// Whether a tick has found the pulses of the one before still running, since the last call.
    pub(super) fn was_late(&mut self) -> bool {
        core::mem::take(&mut self.was_late)
    }

    /// Gives the pulses of a tick, positive along +x, or lets go of the cart.
    pub(super) fn drive(&mut self, motor: &mut Motor, output: &Output) {
        let is_late = motor.timer.cr1().read().cen().bit_is_set();
        self.was_late |= is_late & output.enable;
        if !motor.may_drive(output.enable & !is_late) {
            return;
        }
        let pulses = output.pulses();
        let number = pulses.unsigned_abs().min(PULSES);
        if let Some(interval) = self.cycles.checked_div(number) {
            self.given = self.given.wrapping_add(if pulses > 0 { number } else { number.wrapping_neg() });
            let divider = interval >> 16;
            let clocks = interval / (divider + 1);
            // An update loads them; the timer stands still.
            let loads = [divider, clocks - 1, number - 1, clocks / 2];
            if !motor.load(loads) {
                return;
            }
        }
        // Sets the counter to 0, too, where a train that was turned off may have left it within a pulse.
        motor.timer.egr().write(|w| w.ug().set_bit());
        pins::push_along_x(pulses > 0);
        motor.timer.cr1().write(|w| w.opm().set_bit().cen().bit(number != 0));
        motor.turn_on();
    }
}
