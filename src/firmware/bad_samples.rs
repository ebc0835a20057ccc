//! Samples that a board knows to be bad: the prediction takes their place, and three in a row are a fault. So is a
//! reading of a noisy sensor that stays the same.

use super::Firmware;
use crate::board::{BadSamples, Inputs};
use crate::supervision::fault::Fault;
use crate::supervision::finding::Finding;
use crate::table::{SensorRow, SwingUp, without_errors};

/// A sensor with this much of [`still_counts`](crate::table::SensorRow::still_counts) or more has noise of a count.
const NOISY_STILL_COUNTS: i32 = 8;
/// While the motor is on, the reading of a noisy sensor stays the same for less time (s). By noise alone, that happens
/// in no machine's life; the time allows for a file that states too much noise, and for a link that hardly moves.
const LONGEST_EQUAL_S: f32 = 0.2;

impl<const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'_, NX, NY, S> {
    /// Takes the errors out of the readings of parts, and replaces bad samples, before the inputs are used. Returns
    /// what has failed: the first sensor whose samples were bad in all of the last ticks, or whose reading stands
    /// still.
    #[inline(never)]
    pub(super) fn replace_bad_samples(
        &mut self,
        inputs: &mut Inputs<NY>,
        bad: &mut BadSamples<NY>,
    ) -> Option<Finding> {
        without_errors(&self.table.sensors, &mut inputs.raw_counts);
        let frozen = self.stands_still(&bad.equal_ticks(&inputs.raw_counts, !self.output.enable));
        for (sensor, reading) in inputs.raw_counts.iter_mut().enumerate() {
            if bad.now & 1 << sensor != 0
                && let Some(predicted) = self.controller.predicted_reading(sensor)
            {
                *reading = predicted;
                self.detection.count_rejected();
            }
        }
        let lost = bad.finish().map(|sensor| Finding { fault: Fault::Encoder, sensor });
        lost.or(frozen.map(|sensor| Finding { fault: Fault::Frozen, sensor }))
    }

    /// The first sensor whose noise would have changed its reading within so many ticks.
    fn stands_still(&self, equal_ticks: &[u16; NY]) -> Option<u8> {
        let table = self.table;
        let mut sensors = equal_ticks.iter().zip(&table.sensors).zip(&table.thresholds.frozen);
        let is_still = |((&ticks, row), &threshold): ((&u16, &SensorRow), &f32)| {
            let is_tested = row.still_counts >= NOISY_STILL_COUNTS && threshold < f32::MAX;
            is_tested && f32::from(ticks) * table.tick_s > LONGEST_EQUAL_S
        };
        let sensor = sensors.position(is_still)?;
        Some(sensor as u8)
    }

    /// Turns the motor off, because a sensor has failed.
    #[cold]
    pub(super) fn lose_sensor(&mut self, found: Finding) {
        self.trip(found.fault, Some(found.sensor));
    }
}
