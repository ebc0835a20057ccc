//! Raising and lowering: when they may begin, a tick of them, and how they end.

use super::Firmware;
use crate::board::{Inputs, Output};
use crate::control::motion::Player;
use crate::supervision::calibration::links_hang;
use crate::supervision::envelope;
use crate::supervision::inhibits::Inhibits;
use crate::supervision::supervisor::State;
use crate::table::{Law, MotionTable, SwingUp};

impl<const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'_, NX, NY, S> {
    /// What prevents the next motion: lowering while the rig balances, else raising; without [`Inhibits::HELD`], which
    /// is only known when it is tried.
    pub fn swing_up_inhibits(&self) -> Inhibits {
        let Some(motions) = self.swing_up.motions() else { return Inhibits::NO_SWING_UP };
        match self.supervisor.state() {
            State::Balancing => self.lowering_inhibits(&motions.lower),
            _ => self.raising_inhibits(&motions.raise),
        }
    }

    fn raising_inhibits(&self, motion: &MotionTable<'_>) -> Inhibits {
        let limits = &self.table.limits;
        let counts = self.controller.encoders().counts();
        let position = self.controller.positions().iter().next().copied().unwrap_or_default();
        self.inhibits_with_motor_off()
            .union(Inhibits::NOT_HANGING.when(!links_hang(counts, limits)))
            .union(Inhibits::NO_ROOM.when(!self.has_room(motion, position)))
            .union(Inhibits::OTHER_LAW.when(self.controller.law() != Law::Lqr))
    }

    fn lowering_inhibits(&self, motion: &MotionTable<'_>) -> Inhibits {
        if self.supervisor.state() != State::Balancing {
            return Inhibits::NOT_BALANCING;
        }
        let setpoint = self.controller.law_state().setpoint;
        let limits = &self.table.limits;
        let lean = self.largest_lean(&limits.within_half_a_turn(self.controller.encoders().counts()));
        let settled = setpoint == self.controller.setpoint() && lean <= limits.arm_angle_rad;
        Inhibits::UNSETTLED.when(!settled).union(Inhibits::NO_ROOM.when(!self.has_room(motion, setpoint)))
    }

    /// Whether `motion` stays within the soft limits of the rail when it begins at `position` (m).
    fn has_room(&self, motion: &MotionTable<'_>, position: f32) -> bool {
        let ([low, high], [lowest, highest]) = (self.table.limits.rail_m, motion.travel_m);
        position + lowest >= low && position + highest <= high
    }

    /// Starts to raise the links, which hang at rest. `id` is that of the command.
    pub(super) fn raise(&mut self, id: u64) -> Result<(), Inhibits> {
        let Some(motions) = self.swing_up.motions() else { return Err(Inhibits::NO_SWING_UP) };
        let inhibits = self.raising_inhibits(&motions.raise).union(self.held_inhibit(id));
        self.supervisor.raise(inhibits)?;
        // Whole turns that the links have made by hand do not count.
        let limits = &self.table.limits;
        let mut counts = *self.controller.encoders().counts();
        counts
            .iter_mut()
            .zip(&limits.rest_counts)
            .for_each(|(count, rest)| *count = count.wrapping_sub(*rest));
        counts = limits.within_half_a_turn(&counts);
        counts
            .iter_mut()
            .zip(&limits.rest_counts)
            .for_each(|(count, rest)| *count = count.wrapping_add(*rest));
        if self.start_controller(&counts) {
            let position = self.controller.law_state().setpoint;
            self.moving = Some(Player::new(motions.raise, position));
        }
        Ok(())
    }

    /// Starts to lower the balancing links.
    pub(super) fn lower(&mut self) -> Result<(), Inhibits> {
        let Some(motions) = self.swing_up.motions() else { return Err(Inhibits::NO_SWING_UP) };
        self.supervisor.lower(self.lowering_inhibits(&motions.lower))?;
        self.moving = Some(Player::new(motions.lower, self.controller.law_state().setpoint));
        self.restart_supervision();
        Ok(())
    }

    /// A tick of a motion. Faults are checked in the order of [`Fault::PRECEDENCE`].
    ///
    /// [`Fault::PRECEDENCE`]: crate::supervision::fault::Fault::PRECEDENCE
    pub(super) fn move_links(&mut self, inputs: &Inputs<NY>) -> Output {
        let (Some(motions), Some(player)) = (self.swing_up.motions(), &self.moving) else {
            return Output::OFF;
        };
        let (detection, course) = (&mut self.detection, player.now());
        let mut finding = None;
        let command = self.controller.control_on_course(&inputs.raw_counts, course, |counts, y, e| {
            finding = detection.test(motions.thresholds, counts, y, e);
        });
        let exceeded = envelope::exceeded_in_motion(
            motions.limits,
            self.controller.estimate().as_slice(),
            course.x.as_slice(),
            command.requested_n,
        );
        self.drive_or_trip(inputs, &command, exceeded, finding)
    }

    /// Predicts the next tick of a motion; at its end, hands over to the control law or turns the motor off.
    pub(super) fn predict_motion(&mut self) {
        let (Some(motions), Some(player)) = (self.swing_up.motions(), &mut self.moving) else { return };
        let (swing_up, tick_s) = (self.swing_up, self.table.tick_s);
        let has_ended = player.advance();
        let end = player.now().x.as_slice().first().copied().unwrap_or_default();
        let (detection, test) = (&mut self.detection, &motions.thresholds.motor);
        self.controller.predict_on_course(
            |corrected, force| detection.finish_tick(test, corrected, force),
            |state, force| swing_up.predict(state, force, tick_s),
        );
        if has_ended {
            self.moving = None;
            self.supervisor.finish_motion();
            self.controller.hand_over(end);
            self.hold_setpoint();
            self.restart_supervision();
        }
    }
}
