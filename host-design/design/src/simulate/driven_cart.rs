//! The cart while its drive moves it.

use crate::plant::Plant;

/// The cart in a tick, with the links on it.
pub(super) struct DrivenCart<'a> {
    pub(super) plant: &'a mut dyn Plant,
    pub(super) state: &'a mut [f64],
    /// Torques at the joints (N·m).
    pub(super) torques: &'a [f64],
    pub(super) period_s: f64,
    /// Integration steps of a tick.
    pub(super) substeps: usize,
}

impl DrivenCart<'_> {
    /// Advances it by `length_s` (s) under a force (N), or an acceleration (m/s²) where the drive imposes that.
    pub(super) fn advance(&mut self, force: f64, length_s: f64, substeps: usize) {
        self.plant.advance(force, self.torques, length_s, substeps);
        self.plant.write_state(self.state);
    }

    /// Speed of the motor, converted to speed of the cart (m/s).
    pub(super) fn motor_speed(&self) -> f64 {
        self.plant.motor_speed().or(self.state.get(1).copied()).unwrap_or_default()
    }

    /// Number of integration steps in a part of a tick, in proportion to its length (s).
    pub(super) fn substeps_in(&self, length_s: f64) -> usize {
        if length_s == self.period_s {
            return self.substeps;
        }
        (self.substeps as f64 * length_s / self.period_s).ceil().max(1.0) as usize
    }
}
