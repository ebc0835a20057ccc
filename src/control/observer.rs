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
    /// Whether sensor i measures state 2i, as in every chain, so that nothing has to be looked up.
    pub(crate) fn sensors_are_in_order(&self) -> bool {
        self.measured.iter().zip(0..).all(|(&state, sensor)| state == 2 * sensor)
    }

    pub(crate) fn values(&self) -> impl Iterator<Item = f32> {
        let matrices = self.ad.iter().chain(self.bd.iter()).chain(self.l.iter());
        matrices.chain(self.step.iter()).copied()
    }
}

/// The observer of a table, with what the pattern of its matrices saves in every tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Observer<'t, const NX: usize, const NY: usize> {
    pub(crate) gains: &'t ObserverGains<NX, NY>,
    motion: Motion,
}

/// What an Ad is beyond being a matrix. It decides how a prediction is computed, not what comes out.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Motion {
    Any,
    /// The first column is 1, 0, 0 …, as in every chain: where the cart is moves nothing.
    SameEverywhere,
    /// A chain without friction. It moves in the same way at every speed of the cart, so the second column, too, is 0 below
    /// its first two entries. And it moves in the same way backwards in time, so in each block of position and rate both
    /// entries on the diagonal are equal: one load serves both.
    Frictionless,
}

impl Motion {
    fn of<const NX: usize>(ad: &[[f32; NX]; NX]) -> Self {
        let zero_from = |first: usize, column: usize| {
            ad.get(column).is_some_and(|entries| entries.iter().skip(first).all(|&entry| entry == 0.0))
        };
        let (joints, alone) = ad.as_chunks::<2>();
        let diagonals_agree = joints.iter().all(|[from_position, from_rate]| {
            let mut blocks = from_position.as_chunks::<2>().0.iter().zip(from_rate.as_chunks::<2>().0);
            blocks.all(|([of_position, _], [_, of_rate])| of_position == of_rate)
        });
        let starts_with_one = ad.as_flattened().first() == Some(&1.0);
        match starts_with_one && zero_from(1, 0) {
            true if alone.is_empty() && diagonals_agree && zero_from(2, 1) => Motion::Frictionless,
            true => Motion::SameEverywhere,
            false => Motion::Any,
        }
    }
}

impl<'t, const NX: usize, const NY: usize> Observer<'t, NX, NY> {
    pub(crate) fn new(gains: &'t ObserverGains<NX, NY>) -> Self {
        Self { gains, motion: Motion::of(&gains.ad.data.0) }
    }

    /// Innovation `e = y - C x̂⁻` of the positions y that the sensors show, formed explicitly: a merged `Ad - L C` would cost
    /// most of the digits of u in f32. `measured` says which state a sensor measures.
    #[inline(always)]
    pub(crate) fn innovation(
        &self,
        measured: impl Fn(usize) -> usize,
        y: &[f32; NY],
        estimate: &[f32; NX],
    ) -> [f32; NY] {
        let mut innovation = *y;
        for (sensor, e) in innovation.iter_mut().enumerate() {
            // A checked table only names states that exist.
            *e -= estimate.get(measured(sensor)).copied().unwrap_or_default();
        }
        innovation
    }

    /// Current estimate `x̂ = x̂⁻ + L e` in place of the prediction x̂⁻. `corrected` gets it joint by joint, with the number
    /// of the joint, while it still is in registers.
    #[inline(always)]
    pub(crate) fn correct(
        &self,
        innovation: &[f32; NY],
        estimate: &mut [f32; NX],
        mut corrected: impl FnMut(usize, &[f32]),
    ) {
        let (joints, last) = estimate.as_chunks_mut::<2>();
        for (joint, estimate) in joints.iter_mut().enumerate() {
            let [mut position, mut rate] = *estimate;
            for (column, e) in self.gains.l.data.0.iter().zip(innovation) {
                if let Some([to_position, to_rate]) = column.as_chunks::<2>().0.get(joint) {
                    // Both products before both sums: no instruction waits for the one before it.
                    let (a, b) = (to_position * e, to_rate * e);
                    position += a;
                    rate += b;
                }
            }
            *estimate = [position, rate];
            corrected(joint, estimate);
        }
        if let [x] = last {
            for (column, e) in self.gains.l.data.0.iter().zip(innovation) {
                *x += column.last().copied().unwrap_or_default() * e;
            }
            corrected(NX / 2, last);
        }
    }

    /// Prediction for the next tick `x̂⁻ = Ad x̂ + Bd u`, with the force `u` (N) that is really applied.
    ///
    /// The terms of an entry are added in a fixed order, that of the columns: every machine gets the same bits.
    #[inline(always)]
    pub(crate) fn predict(&self, estimate: &mut [f32; NX], u: f32) {
        let mut next = self.gains.bd.data.0[0].map(|b| b * u);
        if self.motion == Motion::Frictionless {
            self.add_frictionless(&mut next, estimate);
        } else {
            for (state, (column, x)) in self.gains.ad.data.0.iter().zip(estimate.iter()).enumerate() {
                if state == 0 && self.motion == Motion::SameEverywhere {
                    next[0] += x;
                } else {
                    for (next, a) in next.iter_mut().zip(column) {
                        *next += a * x;
                    }
                }
            }
        }
        *estimate = next;
    }

    #[inline(always)]
    fn add_frictionless(&self, next: &mut [f32; NX], estimate: &[f32; NX]) {
        let from = self.gains.ad.data.0.as_chunks::<2>().0.iter().zip(estimate.as_chunks::<2>().0);
        for (joint, ([from_position, from_rate], [position, rate])) in from.enumerate() {
            let blocks = from_position.as_chunks::<2>().0.iter().zip(from_rate.as_chunks::<2>().0);
            let mut rows = next.as_chunks_mut::<2>().0.iter_mut().zip(blocks);
            if joint == 0 {
                // The cart moves itself alone, by a block of 1, T; 0, 1.
                if let Some((next, (_, [to_position, _]))) = rows.next() {
                    *next = [next[0] + position + to_position * rate, next[1] + rate];
                }
                continue;
            }
            for (next, ([diagonal, to_rate], [to_position, _])) in rows {
                // All products before the sums: no instruction waits for the one before it.
                let (a, b) = (diagonal * position, to_rate * position);
                let (c, d) = (to_position * rate, diagonal * rate);
                let [p, v] = [next[0] + a, next[1] + b];
                *next = [p + c, v + d];
            }
        }
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
        let mut x = [1.0, -1.0];
        let e = observer.innovation(|sensor| 2 * sensor, &[3.0], &x);
        observer.correct(&e, &mut x, |joint, x| assert_eq!((joint, x), (0, &[2.0, 3.0][..])));
        assert_eq!((x, e), ([2.0, 3.0], [2.0]));
        observer.predict(&mut x, 8.0);
        assert_eq!(x, [4.5, 7.0]);
    }

    #[test]
    fn a_shortcut_is_taken_only_where_every_entry_allows_it() {
        let motion = |ad: SMatrix<f32, 4, 4>| Motion::of(&ad.data.0);
        let frictionless = matrix![
            1.0, 0.1, 0.2, 0.3;
            0.0, 1.0, 0.4, 0.2;
            0.0, 0.0, 1.5, 0.7;
            0.0, 0.0, 0.8, 1.5
        ];
        assert_eq!(motion(frictionless), Motion::Frictionless);
        for (row, column) in (0..4).flat_map(|row| (0..4).map(move |column| (row, column))) {
            let mut other = frictionless;
            other[(row, column)] += 0.01;
            let expected = match (row, column) {
                (_, 0) => Motion::Any,
                // Only the diagonals of the blocks are repeated, and only the links must not feel the cart.
                (2 | 3, 1) | (0, 2) | (1, 3) | (2, 2) | (3, 3) | (1, 1) => Motion::SameEverywhere,
                _ => Motion::Frictionless,
            };
            assert_eq!(motion(other), expected, "{row} {column}");
        }
        assert_eq!(Motion::of(&[[1.0]]), Motion::SameEverywhere);
        assert_eq!(Motion::of(&SMatrix::<f32, 3, 3>::identity().data.0), Motion::SameEverywhere);
    }
}
