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
    /// Innovation `e = y - C x̂⁻`, formed explicitly: a merged `Ad - L C` would cost most of the digits of u in f32.
    #[inline]
    pub fn innovation(&self, y: &SVector<f32, NY>, predicted: &SVector<f32, NX>) -> SVector<f32, NY> {
        let mut e = *y;
        for (e, &state) in e.iter_mut().zip(&self.measured) {
            // A checked table only names states that exist.
            *e -= predicted.get(state as usize).copied().unwrap_or_default();
        }
        e
    }

    /// Current estimate `x̂ = x̂⁻ + L e`.
    #[inline]
    pub fn correct(&self, predicted: &SVector<f32, NX>, e: &SVector<f32, NY>) -> SVector<f32, NX> {
        let mut x = *predicted;
        for (column, e) in self.l.column_iter().zip(e.iter()) {
            for (x, l) in x.iter_mut().zip(column.iter()) {
                *x += l * e;
            }
        }
        x
    }

    /// Prediction for the next tick `x̂⁻ = Ad x̂ + Bd u`, with the force `u` (N) that is really applied.
    #[inline]
    pub fn predict(&self, x: &SVector<f32, NX>, u: f32) -> SVector<f32, NX> {
        // Column by column, in a fixed order: the same bits on every machine.
        let mut next = self.bd;
        for next in next.iter_mut() {
            *next *= u;
        }
        for (column, x) in self.ad.column_iter().zip(x.iter()) {
            for (next, a) in next.iter_mut().zip(column.iter()) {
                *next += a * x;
            }
        }
        next
    }

    pub(crate) fn values(&self) -> impl Iterator<Item = f32> {
        let matrices = self.ad.iter().chain(self.bd.iter()).chain(self.l.iter());
        matrices.chain(self.step.iter()).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{matrix, vector};

    #[test]
    fn the_estimate_follows_the_equations() {
        let observer = ObserverGains {
            ad: matrix![1.0, 0.5; 0.0, 1.0],
            bd: vector![0.125, 0.5],
            l: matrix![0.5; 2.0],
            measured: [0],
            step: vector![1.0],
        };
        let e = observer.innovation(&vector![3.0], &vector![1.0, -1.0]);
        assert_eq!(e, vector![2.0]);
        let x = observer.correct(&vector![1.0, -1.0], &e);
        assert_eq!(x, vector![2.0, 3.0]);
        assert_eq!(observer.predict(&x, 8.0), vector![4.5, 7.0]);
    }
}
