//! Rates of the sensors from their counts, without a model: for states in which no observer runs.

use crate::supervision::fault::Fault;
use crate::table::SensorRow;

/// Time constant of the filter (s).
const FILTER_S: f32 = 0.005;

/// A fault, and the sensor, if it concerns one.
pub type Found = (Fault, Option<u8>);

/// Filtered rates of `NY` sensors: the cart's, then those of the joints.
#[derive(Debug, Clone)]
pub struct Rates<const NY: usize> {
    last: [i32; NY],
    /// Rates (m/s, rad/s).
    rates: [f32; NY],
}

impl<const NY: usize> Default for Rates<NY> {
    fn default() -> Self {
        Self { last: [0; NY], rates: [0.0; NY] }
    }
}

impl<const NY: usize> Rates<NY> {
    /// Begins with everything at rest at these counts.
    pub fn at_rest(counts: &[i32; NY]) -> Self {
        Self { last: *counts, rates: [0.0; NY] }
    }

    /// Takes the counts of a tick of `tick_s` (s), in which the cart (m/s) and a joint (rad/s) move no faster than
    /// `fastest`.
    ///
    /// # Errors
    /// [`Fault::Encoder`] and the sensor, if it counts faster.
    pub fn update(
        &mut self,
        counts: &[i32; NY],
        sensors: &[SensorRow; NY],
        fastest: [f32; 2],
        tick_s: f32,
    ) -> Result<(), Found> {
        let before = core::mem::replace(&mut self.last, *counts);
        let counts = counts.iter().zip(&before).zip(&mut self.rates);
        for (sensor, (row, ((&count, &before), filtered))) in (0..).zip(sensors.iter().zip(counts)) {
            let rate = row.step * count.wrapping_sub(before) as f32 / tick_s;
            let most = if sensor == 0 { fastest[0] } else { fastest[1] };
            if f32::abs(rate) > most {
                return Err((Fault::Encoder, Some(sensor)));
            }
            *filtered += (rate - *filtered) * (tick_s / FILTER_S).min(1.0);
        }
        Ok(())
    }

    /// The rates (m/s, rad/s).
    pub fn all(&self) -> &[f32; NY] {
        &self.rates
    }

    /// Speed of the cart (m/s).
    pub fn speed_m_per_s(&self) -> f32 {
        self.rates.first().copied().unwrap_or_default()
    }
}
