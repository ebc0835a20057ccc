//! Whether the rig stands so that balancing may begin.

use super::Firmware;
use crate::board::Contacts;
use crate::supervision::inhibits::Reasons;
use crate::supervision::sign_check::Signs;
use crate::supervision::supervisor::State;

impl<const NX: usize, const NY: usize> Firmware<'_, NX, NY> {
    /// Largest angle of a link from the vertical at these counts (rad); 0 where there are no turns.
    pub(super) fn largest_lean(&self, counts: &[i32; NY]) -> f32 {
        let Some(observer) = &self.table.observer else { return 0.0 };
        let (mut angle, mut largest) = (0.0, 0.0f32);
        let joints = counts.iter().zip(observer.step.iter()).zip(&self.table.limits.turn_counts);
        for ((&count, step), _) in joints.filter(|(_, turn)| **turn > 0) {
            angle += step * count as f32;
            largest = largest.max(f32::abs(angle));
        }
        largest
    }

    pub(super) fn off_centre(&self, counts: &[i32; NY]) -> Reasons {
        let [low, high] = self.table.limits.rail_m;
        let step = self
            .table
            .observer
            .as_ref()
            .map_or(0.0, |observer| observer.step.iter().next().copied().unwrap_or_default());
        let position = step * counts.first().copied().unwrap_or_default() as f32;
        Reasons::OFF_CENTRE.when(position < low || position > high)
    }

    pub(super) fn against_by_inputs(&self) -> Reasons {
        let Contacts { limit_low, limit_high, emergency_stop, driver_fault, .. } = self.contacts;
        let supply_is_good = self.supply_v >= self.table.limits.supply_min_v && self.supply_v.is_finite();
        Reasons::LIMIT_SWITCH
            .when(limit_low || limit_high)
            .and(Reasons::EMERGENCY_STOP.when(emergency_stop))
            .and(Reasons::DRIVER.when(driver_fault))
            .and(Reasons::SUPPLY.when(!supply_is_good))
    }

    /// Everything that stands against arming now, but for the table, which is only read when it is tried.
    pub fn against_arming(&mut self) -> Reasons {
        let state = self.supervisor.against_arming();
        if self.supervisor.state() == State::Balancing {
            return state;
        }
        let limits = &self.table.limits;
        let counts = *self.controller.encoders_mut().counts();
        let lean = self.largest_lean(&limits.within_half_a_turn(&counts));
        state
            .and(Reasons::SIGNS.when(self.calibration.signs() != Signs::Checked))
            .and(Reasons::TILTED.when(lean > limits.arm_angle_rad))
            .and(Reasons::MOVING.when(self.calibration.slow_ticks() < limits.arm_ticks / 4))
            .and(self.off_centre(&counts))
            .and(self.against_by_inputs())
            .and(Reasons::NO_OBSERVER.when(self.table.observer.is_none()))
    }
}
