//! Balancing: the wait for upright links, the start of the controller, and one tick.

use super::Firmware;
use crate::board::{Inputs, Output};
use crate::control::controller::MotorCommand;
use crate::supervision::envelope;
use crate::supervision::fault::Fault;
use crate::supervision::finding::Finding;
use crate::table::SwingUp;

impl<const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'_, NX, NY, S> {
    /// A tick of balancing. Faults are checked in the order of [`Fault::PRECEDENCE`].
    pub(super) fn balance(&mut self, inputs: &Inputs<NY>) -> Output {
        let table = self.table;
        let (detection, thresholds) = (&mut self.detection, &table.thresholds);
        let mut finding = None;
        let command = self.controller.control_with(&inputs.raw_counts, |counts, y, e| {
            finding = detection.test(thresholds, counts, y, e);
        });
        let exceeded =
            envelope::exceeded(&table.limits, self.controller.estimate().as_slice(), command.requested_n);
        self.act_or_trip(inputs, &command, exceeded, finding)
    }

    /// The output for `command`, unless there is a fault: of the inputs, of the limits on the state (`exceeded`), of
    /// the tests of the innovation (`finding`) or of the force.
    #[inline(always)]
    pub(super) fn act_or_trip(
        &mut self,
        inputs: &Inputs<NY>,
        command: &MotorCommand,
        exceeded: Option<Fault>,
        finding: Option<Finding>,
    ) -> Output {
        let table = self.table;
        (self.requested_n, self.applied_n) = (command.requested_n, command.applied_n);
        let of_inputs = self.debounce.check_inputs(&table.limits, table.drive.supply_max_v(), inputs);
        let of_force = self.debounce.check_force(&table.limits, command.requested_n != command.applied_n);
        if let Some(fault) = of_inputs.or(exceeded) {
            self.trip(fault, None);
        } else if let Some(Finding { fault, sensor }) = finding {
            self.trip(fault, Some(sensor));
        } else if let Some(fault) = of_force {
            self.trip(fault, None);
        } else {
            return Output::on(command.drive, &table.drive);
        }
        Output::OFF
    }

    /// A tick while armed: balancing starts when all links have been upright and slow for long enough.
    pub(super) fn tick_armed(&mut self, counts: &[i32; NY]) {
        let limits = &self.table.limits;
        let upright = self.table.within_half_a_turn(counts);
        let lean = self.largest_lean(&upright);
        if lean > limits.angle_rad
            || !self.input_inhibits().union(self.off_centre_inhibit(counts, limits.setpoints_m())).is_empty()
        {
            self.supervisor.cancel_arming();
        } else if lean > limits.arm_angle_rad {
            self.calibration.restart_slow(counts);
        } else if self.calibration.slow_ticks() >= limits.arm_ticks && self.is_checked {
            self.start_balancing(&upright);
        }
    }

    /// Starts balancing at these counts, which are within half a turn.
    pub(super) fn start_balancing(&mut self, counts: &[i32; NY]) {
        if self.start_controller(counts) {
            self.hold_setpoint();
            self.supervisor.start_balancing();
        }
    }

    /// Starts the controller at rest at these counts, and restarts the tests and counters that supervise it. Returns
    /// whether the controller has started.
    pub(super) fn start_controller(&mut self, counts: &[i32; NY]) -> bool {
        self.controller.encoders_mut().home(&self.raw_counts, counts);
        let started = self.controller.start(&self.raw_counts).is_ok();
        self.is_controlled = true;
        self.restart_supervision();
        started
    }

    /// Restarts the tests of encoders and motor, and the counters of ticks towards a fault.
    pub(super) fn restart_supervision(&mut self) {
        let counts = *self.controller.encoders().counts();
        self.detection.start(&counts, &self.controller.positions().data.0[0]);
        self.debounce.start();
    }

    /// Requests the position of the governed set-point, unless the host has commanded another.
    pub(super) fn hold_setpoint(&mut self) {
        if !self.setpoint_commanded {
            let here = self.controller.law_state().setpoint;
            // Never refused: a position from the encoders is finite.
            let _ = self.controller.set_setpoint(here);
        }
    }

    /// Predicts the next tick of balancing.
    pub(super) fn predict_balancing(&mut self) {
        let (detection, test) = (&mut self.detection, &self.table.thresholds.motor);
        self.controller
            .predict_with(|counts, corrected, force| detection.finish_tick(test, counts, corrected, force));
    }
}
