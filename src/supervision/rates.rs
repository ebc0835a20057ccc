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
    /// Whether the first difference is the rate, instead of 0 with a filter.
    is_moving: bool,
    /// Rates in the last tick, and filtered ones (m/s, rad/s).
    latest: [f32; NY],
    rates: [f32; NY],
}

impl<const NY: usize> Default for Rates<NY> {
    fn default() -> Self {
        Self::at_rest(&[0; NY])
    }
}

impl<const NY: usize> Rates<NY> {
    /// Begins with everything at rest at these counts.
    pub fn at_rest(counts: &[i32; NY]) -> Self {
        Self { last: *counts, is_moving: false, latest: [0.0; NY], rates: [0.0; NY] }
    }

    /// Begins at these counts, with rates that are known after a tick.
    pub fn moving(counts: &[i32; NY]) -> Self {
        Self { is_moving: true, ..Self::at_rest(counts) }
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
        let share = if core::mem::take(&mut self.is_moving) { 1.0 } else { (tick_s / FILTER_S).min(1.0) };
        let counts = counts.iter().zip(&before).zip(self.latest.iter_mut().zip(&mut self.rates));
        for (sensor, (row, ((&count, &before), (latest, filtered)))) in (0..).zip(sensors.iter().zip(counts))
        {
            let rate = row.step * count.wrapping_sub(before) as f32 / tick_s;
            let most = if sensor == 0 { fastest[0] } else { fastest[1] };
            if f32::abs(rate) > most {
                return Err((Fault::Encoder, Some(sensor)));
            }
            *latest = rate;
            *filtered += (rate - *filtered) * share;
        }
        Ok(())
    }

    /// The rates in the last tick, as the counts say (m/s, rad/s).
    pub fn latest(&self) -> &[f32; NY] {
        &self.latest
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
