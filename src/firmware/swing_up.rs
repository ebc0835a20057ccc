//! Planned motions from one equilibrium to another: the conditions for their start, one tick, and their end.

use super::Firmware;
use crate::board::{Inputs, Output};
use crate::control::motion::Playback;
use crate::supervision::calibration::links_hang;
use crate::supervision::envelope;
use crate::supervision::inhibits::Inhibits;
use crate::supervision::supervisor::State;
use crate::table::{Equilibrium, Law, MotionTable, SwingUp};

impl<'t, const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'t, NX, NY, S> {
    /// Inhibits of the next motion: to hanging while the rig balances, otherwise to upright. Without
    /// [`Inhibits::HELD`], which is only known once a command arrives.
    pub fn swing_up_inhibits(&self) -> Inhibits {
        let to = match self.supervisor.state() {
            State::Balancing => Equilibrium::HANGING,
            _ => Equilibrium::UPRIGHT,
        };
        self.transition(to).map_or_else(|inhibits| inhibits, |motion| self.motion_inhibits(motion))
    }

    /// The motion from the present equilibrium to the equilibrium `to`.
    fn transition(&self, to: Equilibrium) -> Result<&'t MotionTable<'t>, Inhibits> {
        let swing_up = self.swing_up;
        let Some(motions) = swing_up.motions() else { return Err(Inhibits::NO_SWING_UP) };
        let (from, to) = (self.equilibrium(), to.of_links(NY - 1));
        if from == to {
            let is_balanced = self.supervisor.state().controls();
            return Err(if is_balanced { Inhibits::RUNNING } else { Inhibits::NOT_BALANCING });
        }
        motions.between(from, to).ok_or(Inhibits::NO_TRANSITION)
    }

    /// The present equilibrium: the one at which the links are balanced; hanging, if they are not balanced.
    fn equilibrium(&self) -> Equilibrium {
        match self.supervisor.state() {
            State::Balancing => Equilibrium::UPRIGHT,
            State::Holding => self.goal,
            _ => Equilibrium::hanging(NY - 1),
        }
    }

    /// Inhibits of `motion`, which begins at the present equilibrium.
    fn motion_inhibits(&self, motion: &MotionTable<'_>) -> Inhibits {
        match self.supervisor.state() {
            State::Balancing | State::Holding => self.leaving_inhibits(motion),
            _ => self.raising_inhibits(motion),
        }
    }

    fn raising_inhibits(&self, motion: &MotionTable<'_>) -> Inhibits {
        let counts = self.controller.encoders().counts();
        let position = self.controller.positions().iter().next().copied().unwrap_or_default();
        self.inhibits_with_motor_off()
            .union(Inhibits::NOT_HANGING.when(!links_hang(counts, &self.table.sensors)))
            .union(Inhibits::NO_ROOM.when(!self.has_room(motion, position)))
            .union(Inhibits::OTHER_LAW.when(self.controller.law() != Law::Lqr))
    }

    fn leaving_inhibits(&self, motion: &MotionTable<'_>) -> Inhibits {
        let setpoint = self.controller.law_state().setpoint;
        let limits = &self.table.limits;
        let lean =
            self.largest_lean(&self.table.from_rest(self.controller.encoders().counts(), self.equilibrium()));
        let settled = setpoint == self.controller.setpoint() && lean <= limits.arm_angle_rad;
        Inhibits::UNSETTLED.when(!settled).union(Inhibits::NO_ROOM.when(!self.has_room(motion, setpoint)))
    }

    /// Whether `motion` stays within the soft limits of the rail when it begins at `position` (m), and that is one
    /// where the cart may be balanced.
    fn has_room(&self, motion: &MotionTable<'_>, position: f32) -> bool {
        let ([low, high], [lowest, highest]) = (self.table.limits.rail_m, motion.travel_m);
        let [first, last] = self.table.limits.setpoints_m();
        let may_be_balanced = (first..=last).contains(&position);
        may_be_balanced && position + lowest >= low && position + highest <= high
    }

    /// Begins the motion to the equilibrium `to`. `id` is that of the command.
    pub(super) fn go_to(&mut self, to: Equilibrium, id: u64) -> Result<(), Inhibits> {
        let motion = self.transition(to)?;
        let (from, to) = (self.equilibrium(), to.of_links(NY - 1));
        let inhibits = self.motion_inhibits(motion);
        let counts = self.table.unwound(self.controller.encoders().counts(), from);
        if let State::Balancing | State::Holding = self.supervisor.state() {
            if to == Equilibrium::hanging(NY - 1) {
                self.supervisor.lower(inhibits)?;
            } else {
                self.supervisor.move_on(inhibits)?;
            }
            self.controller.unwind(&self.raw_counts, &counts);
            self.restart_supervision();
        } else {
            let held = self.held_inhibit(id);
            self.supervisor.raise(inhibits.union(held))?;
            if !self.start_controller(&counts) {
                return Ok(());
            }
        }
        self.goal = to;
        self.moving = Some(Playback::new(*motion, self.controller.law_state().setpoint));
        Ok(())
    }

    /// A tick of a motion. Faults are checked in the order of [`Fault::PRECEDENCE`].
    ///
    /// [`Fault::PRECEDENCE`]: crate::supervision::fault::Fault::PRECEDENCE
    pub(super) fn move_links(&mut self, inputs: &Inputs<NY>) -> Output {
        let (Some(motions), Some(playback)) = (self.swing_up.motions(), &self.moving) else {
            return Output::OFF;
        };
        let (detection, reference) = (&mut self.detection, playback.now());
        let mut finding = None;
        let command = self.controller.control_on_reference(&inputs.raw_counts, reference, |counts, y, e| {
            finding = detection.test(motions.thresholds, counts, y, e);
        });
        let exceeded = envelope::exceeded_in_motion(
            motions.limits,
            self.controller.estimate().as_slice(),
            reference.x.as_slice(),
            command.requested_n,
        );
        self.act_or_trip(inputs, &command, exceeded, finding)
    }

    /// Predicts the next tick of a motion; at its end, hands over to the control law, holds, or turns the motor off.
    pub(super) fn predict_motion(&mut self) {
        let (Some(motions), Some(playback)) = (self.swing_up.motions(), &mut self.moving) else { return };
        let (swing_up, tick_s) = (self.swing_up, self.table.tick_s);
        let has_ended = playback.advance();
        let end = playback.now().x.as_slice().first().copied().unwrap_or_default();
        let (detection, test) = (&mut self.detection, &motions.thresholds.motor);
        self.controller.predict_on_reference(
            |counts, corrected, force| detection.finish_tick(test, counts, corrected, force),
            |state, force| swing_up.predict(state, force, tick_s),
        );
        if self.supervisor.state() == State::Holding {
            playback.stay_at(self.controller.govern());
        } else if has_ended {
            let is_upright = self.goal == Equilibrium::UPRIGHT;
            self.supervisor.finish_motion(is_upright);
            self.controller.hand_over(end);
            self.hold_setpoint();
            if self.supervisor.state() != State::Holding {
                self.moving = None;
                let counts = self.table.unwound(self.controller.encoders().counts(), self.goal);
                self.controller.unwind(&self.raw_counts, &counts);
            }
            self.restart_supervision();
        }
    }
}
