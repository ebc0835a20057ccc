//! Telemetry: when it is sent, and what is in it.

use heapless::Vec;

use super::Firmware;
use crate::control::motion::Playback;
use crate::protocol::message::Telemetry;
use crate::table::SwingUp;

impl<const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'_, NX, NY, S> {
    /// Counts a message that was dropped because its queue was full.
    pub(crate) fn message_dropped(&mut self) {
        self.statistics.dropped = self.statistics.dropped.saturating_add(1);
    }

    /// Whether telemetry is sent in this tick.
    pub(super) fn telemetry_is_due(&self) -> bool {
        self.ticks_to_telemetry == 0 && self.telemetry_period_ticks > 0
    }

    /// Counts a tick towards the next telemetry.
    pub(super) fn count_to_telemetry(&mut self) {
        let next = self.telemetry_period_ticks.saturating_sub(1);
        self.ticks_to_telemetry = self.ticks_to_telemetry.checked_sub(1).unwrap_or(next);
    }

    /// The telemetry of this tick.
    // Not inlined: most ticks do not need the registers and the stack that it takes.
    #[inline(never)]
    pub(super) fn telemetry(&self) -> Telemetry<NX, NY> {
        Telemetry {
            tick: self.tick,
            state: self.supervisor.state(),
            law: self.controller.law(),
            fault: self.supervisor.fault(),
            cause_tick: self.supervisor.cause().map_or(0, |cause| cause.tick),
            homing: self.calibration.homing(),
            signs: self.calibration.signs(),
            motor: self.motor_sign(),
            arming_inhibits: self.arming_inhibits(),
            swing_up_inhibits: self.swing_up_inhibits(),
            motion_tick: self.moving.as_ref().map_or(0, Playback::tick),
            contacts: self.contacts,
            supply_v: self.supply_v,
            counts: Vec::from_slice(self.controller.encoders().counts()).unwrap_or_default(),
            estimate: Vec::from_slice(self.controller.estimate().as_slice()).unwrap_or_default(),
            innovation: Vec::from_slice(self.controller.innovation().as_slice()).unwrap_or_default(),
            setpoint_m: self.controller.law_state().setpoint,
            requested_n: self.requested_n,
            applied_n: self.applied_n,
            drive: self.output.drive.value(),
            cycles: self.cycles,
            worst_cycles: self.worst_cycles,
        }
    }
}
