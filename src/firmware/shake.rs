//! Shaking the rig: the conditions for its start, and one tick of it.

use super::Firmware;
use crate::board::{Inputs, Output};
use crate::control::actuator::Drive;
use crate::control::state_feedback::saturate;
use crate::protocol::message::{Answer, InvalidRequest};
use crate::supervision::calibration::links_hang;
use crate::supervision::inhibits::Inhibits;
use crate::supervision::shaking::{FORCES, SPEED_SHARE, Shaking};
use crate::supervision::supervisor::State;
use crate::table::{DriveMap, StepMap, SwingUp};

/// At the start, the cart has to be within this fraction of the rail's soft limits.
const CENTRE: f32 = 0.25;

impl<const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'_, NX, NY, S> {
    /// Begins to shake the rig. `id` is that of the command.
    pub(super) fn begin_shaking(&mut self, shaking: Shaking, id: u64) -> Answer {
        if !shaking.is_sound(self.table.drive.largest_input()) {
            return Answer::Rejected(InvalidRequest::Shaking);
        }
        let counts = *self.controller.encoders().counts();
        let limits = &self.table.limits;
        let position_m = self.controller.positions().iter().next().copied().unwrap_or_default();
        let [low, high] = limits.rail_m.map(|end| CENTRE * end);
        // Without a cart there is nothing to shake.
        let hangs = links_hang(&counts, &self.table.sensors) && self.table.witness_sign_counts() > 0;
        let inhibits = self
            .inhibits_with_motor_off()
            .union(self.held_inhibit(id))
            .union(Inhibits::NOT_HANGING.when(!hangs))
            .union(Inhibits::OFF_CENTRE.when(!(low..=high).contains(&position_m)));
        if let Err(inhibits) = self.supervisor.start_identifying(inhibits) {
            return Answer::NotNow(inhibits);
        }
        self.debounce.start();
        self.last_volts = 0.0;
        self.shaker.begin(shaking, &counts);
        Answer::Done
    }

    /// Takes the forces for coming ticks.
    pub(super) fn take_forces(&mut self, first: u16, forces: &[i8; FORCES]) -> Answer {
        if self.supervisor.state() != State::Identifying {
            return Answer::NotNow(Inhibits::NOT_SHAKEN);
        }
        self.shaker.take(self.tick, first, forces);
        Answer::Done
    }

    /// A tick in which the rig is shaken.
    // Not inlined into the tick: the tool that computes the bound on the stack has to follow every jump there.
    #[inline(never)]
    pub(super) fn shake(&mut self, inputs: &Inputs<NY>) {
        let table = self.table;
        let counts = self.follow();
        if let Some(fault) = self.debounce.check_inputs(&table.limits, table.drive.supply_max_v(), inputs) {
            return self.trip(fault, None);
        }
        match self.shaker.update(self.tick, &counts, &table.sensors, &table.limits, table.tick_s) {
            Ok(Some(force_n)) => {
                let most = SPEED_SHARE * table.limits.speed_m_per_s;
                let (drive, applied_n) = self.actuate(force_n, self.shaker.speed_m_per_s(), most);
                (self.requested_n, self.applied_n) = (force_n, applied_n);
                self.output = Output::on(drive, &self.table.drive);
            }
            Ok(None) => self.supervisor.disarm(),
            Err((fault, sensor)) => self.trip(fault, sensor),
        }
    }

    /// The motor command for this force (N) on the cart at this speed (m/s), and the force that it produces (N); for a
    /// drive with pulses, those of an acceleration (m/s²) that makes the cart no faster than `most_m_per_s`.
    pub(super) fn actuate(&mut self, force_n: f32, speed_m_per_s: f32, most_m_per_s: f32) -> (Drive, f32) {
        match &self.table.drive {
            DriveMap::Force(map) => {
                let applied_n = saturate(force_n, map.limit_n);
                (Drive::Force(applied_n), applied_n)
            }
            DriveMap::Volts(motor) => {
                let limited_n = saturate(force_n, motor.force.limit_n);
                let (volts, applied_n) = motor.volts_and_force(limited_n, speed_m_per_s, self.last_volts);
                self.last_volts = volts;
                (Drive::Duty(motor.duty(volts)), applied_n)
            }
            DriveMap::Pulses(steps) => {
                let map =
                    StepMap { speed_limit_m_per_s: steps.speed_limit_m_per_s.min(most_m_per_s), ..*steps };
                let (applied, pulses) = self.slow_drive.accelerate(force_n, &map, self.table.tick_s);
                (Drive::Steps(pulses), applied)
            }
        }
    }
}
