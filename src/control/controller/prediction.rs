//! What takes the place of a sample that is known to be bad.

use super::{Controller, Mode};
use crate::table::Scalar;

impl<const NX: usize, const NY: usize, T: Scalar> Controller<'_, NX, NY, T> {
    /// The reading of a sensor that the observer predicts for the next tick, to the nearest count; while the controller
    /// does not run, the last reading. None for a sensor that does not exist.
    pub fn predicted_reading(&self, sensor: usize) -> Option<u32> {
        let mut position = *self.encoders.counts().get(sensor)?;
        if let Mode::Running(observer) = &self.mode {
            let predicted = *observer.measured(&self.estimate.data.0[0]).get(sensor)?;
            let counts = predicted / self.table.sensors.get(sensor)?.step;
            position = libm::floorf(counts.to_f32() + 0.5) as i32;
        }
        self.encoders.reading_at(sensor, position)
    }
}
