//! Samples that a board knows to be bad: the prediction takes their place, and three in a row are a fault.

use super::Firmware;
use crate::board::Inputs;
use crate::supervision::fault::Fault;
use crate::supervision::finding::IN_A_ROW;
use crate::table::SwingUp;

/// The sensors whose samples were bad in the last ticks, the latest first: bit i for sensor i.
pub(super) type BadSamples = [u32; IN_A_ROW as usize - 1];

impl<const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'_, NX, NY, S> {
    /// Replaces the samples of the sensors `bad`, before the inputs are used. Returns the first sensor whose samples
    /// were bad in all of the last ticks.
    #[inline(never)]
    pub(super) fn replace_bad_samples(
        &mut self,
        inputs: &mut Inputs<NY>,
        bad: u32,
        before: &mut BadSamples,
    ) -> Option<u8> {
        for (sensor, reading) in inputs.raw_counts.iter_mut().enumerate() {
            if bad & 1 << sensor != 0
                && let Some(predicted) = self.controller.predicted_reading(sensor)
            {
                *reading = predicted;
                self.detection.count_rejected();
            }
        }
        let lost = before.iter().fold(bad, |lost, &bad| lost & bad);
        before.rotate_right(1);
        before[0] = bad;
        (lost != 0).then(|| lost.trailing_zeros() as u8)
    }

    /// Turns the motor off, because a sensor has given no good sample for too long.
    #[cold]
    pub(super) fn lose_sensor(&mut self, sensor: u8) {
        self.trip(Fault::Encoder, Some(sensor));
    }
}
