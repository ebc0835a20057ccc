//! Samples that a board knows to be bad: the prediction takes their place, and three in a row are a fault.

use super::Firmware;
use crate::board::{BadSamples, Inputs};
use crate::supervision::fault::Fault;
use crate::table::SwingUp;

impl<const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'_, NX, NY, S> {
    /// Replaces bad samples, before the inputs are used. Returns the first sensor whose samples were bad in all of the
    /// last ticks.
    #[inline(never)]
    pub(super) fn replace_bad_samples(
        &mut self,
        inputs: &mut Inputs<NY>,
        bad: &mut BadSamples,
    ) -> Option<u8> {
        for (sensor, reading) in inputs.raw_counts.iter_mut().enumerate() {
            if bad.now & 1 << sensor != 0
                && let Some(predicted) = self.controller.predicted_reading(sensor)
            {
                *reading = predicted;
                self.detection.count_rejected();
            }
        }
        bad.finish()
    }

    /// Turns the motor off, because a sensor has given no good sample for too long.
    #[cold]
    pub(super) fn lose_sensor(&mut self, sensor: u8) {
        self.trip(Fault::Encoder, Some(sensor));
    }
}
