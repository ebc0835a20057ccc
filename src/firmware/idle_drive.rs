//! A drive with pulses while no control law commands it.
//!
//! Its pulses are the only measurement of the cart, so the cart's position is known as long as the drive holds it. It
//! holds the cart from homing on, moves it while it is homed or jogged, and lets go of it after a fault and when it is
//! disarmed; then the position is lost. Before it lets go, it brings the cart to rest, unless the fault forbids that.

use super::Firmware;
use crate::board::{Contacts, Output};
use crate::control::actuator::Drive;
use crate::supervision::homing::WrongTravel;
use crate::supervision::inhibits::Inhibits;
use crate::supervision::jog::cart;
use crate::supervision::slow_drive::{HOMING_M_PER_S, JOG_M_PER_S};
use crate::supervision::supervisor::State;
use crate::table::{StepMap, SwingUp};

/// The sensor of the first link.
const FIRST_LINK: usize = 1;

impl<const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'_, NX, NY, S> {
    /// The output for a drive with pulses in a tick without the control law.
    // Not inlined into the tick, whose registers it would take.
    #[cold]
    #[inline(never)]
    pub(super) fn idle(&mut self, steps: &StepMap) -> Output {
        if core::mem::take(&mut self.is_controlled) {
            self.slow_drive.take_over(self.controller.estimate().get(1).copied().unwrap_or_default());
        }
        if self.cuts_drive() {
            self.slow_drive.stop();
            return Output::OFF;
        }
        let state = self.supervisor.state();
        let holds = matches!(state, State::Homing | State::Calibrated | State::Armed | State::Stilling);
        if !holds && !self.slow_drive.is_moving() {
            return Output::OFF;
        }
        let pulses = self.slow_drive.pulses(steps, self.table.tick_s);
        Output::on(Drive::Steps(pulses), &self.table.drive)
    }

    /// Whether the drive has to let go of the cart at once, even if it moves.
    fn cuts_drive(&self) -> bool {
        let Contacts { emergency_stop, driver_fault, clock_fault, board_fault, .. } = self.contacts;
        emergency_stop
            || driver_fault
            || clock_fault
            || board_fault
            || (self.supervisor.state() == State::Fault
                && self.supervisor.fault().is_some_and(|fault| !fault.leaves_drive_working()))
    }

    /// A drive with pulses is to let go of the cart: nobody knows where it is from then on.
    #[cold]
    #[inline(never)]
    pub(super) fn let_go(&mut self) {
        if self.table.drive.pulses().is_some() {
            self.slow_drive.want(0.0);
            self.supervisor.lose_positions();
            self.calibration.forget_homing();
        }
    }

    /// Moves the cart of a drive with pulses to both limit switches and then to the middle. Returns whether it is
    /// there; always for other drives, whose cart a person moves.
    ///
    /// # Errors
    /// [`WrongTravel`] if a switch is not where it should be.
    pub(super) fn drive_to_switches(&mut self, counts: &[i32; NY]) -> Result<bool, WrongTravel> {
        let Some(steps) = self.table.drive.pulses() else { return Ok(true) };
        let (direction, left) = self.calibration.homing_way(cart(counts), &self.table.limits)?;
        let of_a_tick = HOMING_M_PER_S * self.table.tick_s / steps.step_m;
        let is_there = left.is_some_and(|left| (left.unsigned_abs() as f32) <= 1.0 + of_a_tick);
        self.slow_drive.want(if is_there { 0.0 } else { HOMING_M_PER_S * direction as f32 });
        Ok(is_there)
    }

    /// A tick in which a drive with pulses jogs the cart with this share of its largest speed.
    pub(super) fn jog_drive(&mut self, share: f32, steps: &StepMap) -> Output {
        self.slow_drive.want(share * JOG_M_PER_S);
        let pulses = self.slow_drive.pulses(steps, self.table.tick_s);
        self.slow_drive.want(0.0);
        Output::on(Drive::Steps(pulses), &self.table.drive)
    }

    /// The counts that show the direction of a jog: the cart's, or for a drive with pulses, which has no other sensor
    /// of the cart, those of the first link, which stays behind while it hangs.
    pub(super) fn answer_to_jog(&self, counts: &[i32; NY]) -> i32 {
        if self.table.drive.pulses().is_none() {
            return cart(counts);
        }
        let link = counts.get(FIRST_LINK).copied().unwrap_or_default();
        // Upright, it turns by this for an acceleration along +x; hanging, by the opposite.
        let upright = self.table.observer.as_ref().and_then(|observer| observer.bd.get(2 * FIRST_LINK + 1));
        if upright.is_some_and(|&change| change < 0.0) { link } else { link.wrapping_neg() }
    }

    /// What keeps a drive with pulses from moving the cart to the switches.
    pub(super) fn homing_inhibits(&self) -> Inhibits {
        if self.table.drive.pulses().is_some() { self.input_inhibits() } else { Inhibits::NONE }
    }
}
