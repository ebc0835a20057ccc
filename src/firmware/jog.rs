//! The jog: the conditions for its start, and one tick of it.

use super::Firmware;
use crate::board::{Inputs, Output};
use crate::control::actuator::Drive;
use crate::supervision::calibration::links_hang;
use crate::supervision::inhibits::Inhibits;
use crate::supervision::supervisor::State;
use crate::table::{DriveMap, SwingUp};

impl<const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'_, NX, NY, S> {
    /// A command to jog: continues the jog in progress, or starts one, along +x or against it.
    pub(super) fn hold_jog(&mut self, along: bool) -> Result<(), Inhibits> {
        let is_jogging = self.supervisor.state() == State::Jogging;
        if is_jogging && along != self.jog.is_along() {
            return Err(Inhibits::RUNNING);
        }
        let is_released = self.jog.is_released(self.table.tick_s);
        self.jog.hold();
        if is_jogging {
            return Ok(());
        }
        let counts = self.controller.encoders().counts();
        let inhibits = self
            .inhibits_before_motor_check()
            .union(Inhibits::HELD.when(!is_released))
            .union(Inhibits::NOT_HANGING.when(!links_hang(counts, &self.table.sensors)))
            .union(self.off_centre_inhibit(counts, self.table.limits.rail_m));
        let answer = self.answer_to_jog(counts);
        self.supervisor.start_jogging(inhibits)?;
        self.debounce.start();
        self.jog.begin(along, answer);
        Ok(())
    }

    /// A tick of the jog.
    // Not inlined into the tick: the tool that computes the bound on the stack has to follow every jump there.
    #[inline(never)]
    pub(super) fn push_cart(&mut self, inputs: &Inputs<NY>) {
        let table = self.table;
        let counts = self.follow();
        if let Some(fault) = self.debounce.check_inputs(&table.limits, table.drive.supply_max_v(), inputs) {
            return self.trip(fault, None);
        }
        let answer = self.answer_to_jog(&counts);
        match self.jog.update(answer, table.witness_sign_counts(), table.tick_s) {
            Some(share) => self.output = self.jog_output(share),
            None => self.supervisor.disarm(),
        }
    }

    fn jog_output(&mut self, share: f32) -> Output {
        let force_n = share * self.table.limits.jog_force_n;
        let drive = match &self.table.drive {
            DriveMap::Force(_) => Drive::Force(force_n),
            DriveMap::Volts(motor) => Drive::Duty(motor.duty_at_rest(force_n)),
            DriveMap::Pulses(steps) => return self.jog_drive(share, steps),
        };
        (self.requested_n, self.applied_n) = (force_n, force_n);
        Output::on(drive, &self.table.drive)
    }
}
