//! The state estimate: a steady-state Kalman filter in current (filter) form.

use nalgebra::{SMatrix, SVector};
/// Model and gain of the observer for `NX` states and `NY` sensors.
#[derive(Debug, Clone, PartialEq)]
pub struct ObserverGains<const NX: usize, const NY: usize> {
    /// Ad: `x⁺ = Ad x + Bd u` over one tick.
    pub ad: SMatrix<f32, NX, NX>,
    /// Bd.
    pub bd: SVector<f32, NX>,
    /// L, filter form: `x̂ = x̂⁻ + L e`.
    pub l: SMatrix<f32, NX, NY>,
    /// Which state each sensor measures.
    pub measured: [u32; NY],
    /// Travel per count of each sensor (m or rad).
    pub step: SVector<f32, NY>,
}

impl<const NX: usize, const NY: usize> ObserverGains<NX, NY> {
    pub(crate) fn values(&self) -> impl Iterator<Item = f32> {
        let matrices = self.ad.iter().chain(self.bd.iter()).chain(self.l.iter());
        matrices.chain(self.step.iter()).copied()
    }
}

/// The observer of a table, with what the zeros of this table save in every tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Observer<'t, const NX: usize, const NY: usize> {
    pub(crate) gains: &'t ObserverGains<NX, NY>,
    /// Sensor i measures state 2i, as in every chain: its entry of x̂⁻ needs no look-up.
    pub(crate) sensors_in_order: bool,
    without_friction: bool,
}

impl<'t, const NX: usize, const NY: usize> Observer<'t, NX, NY> {
    pub(crate) fn new(gains: &'t ObserverGains<NX, NY>) -> Self {
        Self {
            gains,
            sensors_in_order: gains.measured.iter().zip(0..).all(|(&state, sensor)| state == 2 * sensor),
            without_friction: is_without_friction(&gains.ad),
        }
    }

    /// Takes the encoders' positions y: innovation `e = y - C x̂⁻`, formed explicitly because a merged `Ad - L C` would
    /// cost most of the digits of u in f32, and current estimate `x̂ = x̂⁻ + L e` in place of the prediction x̂⁻.
    ///
    /// `measured` says which state a sensor measures.
    #[inline(always)]
    pub(crate) fn correct(
        &self,
        measured: impl Fn(usize) -> usize,
        y: &[f32; NY],
        estimate: &mut [f32; NX],
        innovation: &mut [f32; NY],
    ) {
        let mut x = *estimate;
        let mut e = *y;
        for (sensor, e) in e.iter_mut().enumerate() {
            // A checked table only names states that exist.
            *e -= estimate.get(measured(sensor)).copied().unwrap_or_default();
        }
        for (state, x) in x.iter_mut().enumerate() {
            for (column, &e) in self.gains.l.data.0.iter().zip(&e) {
                *x += column[state] * e;
            }
        }
        (*estimate, *innovation) = (x, e);
    }

    /// Prediction for the next tick `x̂⁻ = Ad x̂ + Bd u`, with the force `u` (N) that is really applied.
    ///
    /// The terms of an entry are added in a fixed order, that of the columns: every machine gets the same bits.
    #[inline(always)]
    pub(crate) fn predict(&self, estimate: &mut [f32; NX], u: f32) {
        let mut next = self.gains.bd.data.0[0].map(|b| b * u);
        if self.without_friction {
            self.add_without_friction(&mut next, estimate);
        } else {
            for (column, &x) in self.gains.ad.data.0.iter().zip(estimate.iter()) {
                add_scaled(&mut next, column, x);
            }
        }
        *estimate = next;
    }

    #[inline(always)]
    fn add_without_friction(&self, next: &mut [f32; NX], estimate: &[f32; NX]) {
        let joints = self.gains.ad.data.0.chunks(2).zip(estimate.chunks(2));
        for (joint, from) in joints.enumerate() {
            let ([from_position, from_rate], [position, rate]) = from else { continue };
            let rows = if joint == 0 { 2 } else { NX };
            let entries = from_position.chunks(2).zip(from_rate.chunks(2));
            for (next, entries) in next.chunks_mut(2).zip(entries).take(rows/2) {
                if let ([next_position, next_rate], ([both, to_rate], [to_position, _])) = (next, entries) {
                    let (a, b) = (both * position, to_rate * position);
                    let (c, d) = (to_position * rate, both * rate);
                    let (p, v) = (*next_position + a, *next_rate + b);
                    (*next_position, *next_rate) = (p + c, v + d);
                }
            }
        }
    }
}

fn is_without_friction<const NX: usize>(ad: &SMatrix<f32, NX, NX>) -> bool {
    let same = (0..NX).step_by(2).all(|i| (0..NX).step_by(2).all(|j| match (ad.get((i, j)), ad.get((i + 1, j + 1))) {
        (Some(a), Some(b)) => a == b,
        _ => false,
    }));
    same && (2..NX).all(|i| (0..2).all(|j| ad.get((i, j)) == Some(&0.0)))
}

#[inline(always)]
fn add_scaled<const N: usize>(sum: &mut [f32; N], column: &[f32; N], factor: f32) {
    for (sum, entry) in sum.iter_mut().zip(column) {
        *sum += entry * factor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{matrix, vector};

    #[test]
    fn the_estimate_follows_the_equations() {
        let gains = ObserverGains {
            ad: matrix![1.0, 0.5; 0.0, 1.0],
            bd: vector![0.125, 0.5],
            l: matrix![0.5; 2.0],
            measured: [0],
            step: vector![1.0],
        };
        let observer = Observer::new(&gains);
        let e = observer.innovation(&vector![3.0], &vector![1.0, -1.0]);
        assert_eq!(e, vector![2.0]);
        let x = observer.correct(&vector![1.0, -1.0], &e);
        assert_eq!(x, vector![2.0, 3.0]);
        assert_eq!(observer.predict(&x, 8.0), vector![4.5, 7.0]);
    }
}
