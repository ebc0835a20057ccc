//! The state estimate: a steady-state Kalman filter in filter form.
//!
//! ```text
//! e = y - C x̂⁻,   x̂ = x̂⁻ + L e,   x̂⁻(next tick) = Ad x̂ + Bd u
//! ```

use crate::table::{ObserverGains, Scalar, SensorRow};

impl<const NX: usize, const NY: usize, T: Scalar> ObserverGains<NX, NY, T> {
    /// The entries of Ad that the prediction uses without multiplying.
    pub fn pattern(&self) -> PredictionPattern {
        PredictionPattern::of(&self.ad.data.0)
    }
}

/// Whether sensor i measures state 2i, as in every chain, and as it is in this tick. Then no index has to be looked up.
fn are_in_order<T: Scalar>(sensors: &[SensorRow<T>]) -> bool {
    let is_at = |sensor: &SensorRow<T>, state: u32| sensor.state == state && sensor.delay_s == T::default();
    sensors.iter().zip(0..).all(|(sensor, number)| is_at(sensor, 2 * number))
}

/// The observer of a table, with the pattern of its Ad, which saves operations in every tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Observer<'t, const NX: usize, const NY: usize, T: Scalar = f32> {
    gains: &'t ObserverGains<NX, NY, T>,
    pub(crate) sensors: &'t [SensorRow<T>; NY],
    pattern: PredictionPattern,
    /// Whether sensor i measures state 2i, without delay.
    is_in_order: bool,
}

/// Entries of Ad that are known in advance. They make the prediction faster; the result is the same, bit for bit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PredictionPattern {
    /// No entry is known.
    Any,
    /// The first column is 1, 0, 0 …, as in every chain: the motion does not depend on the position of the cart.
    SameEverywhere,
    /// A chain without friction. The motion does not depend on the speed of the cart either, so the second column is 0
    /// below its first two entries. And the motion is reversible in time, so both diagonal entries of each block of
    /// position and rate are equal: one load serves both.
    Frictionless,
}

impl PredictionPattern {
    fn of<T: Scalar, const NX: usize>(ad: &[[T; NX]; NX]) -> Self {
        let (zero, one) = (T::default(), T::from_f32(1.0));
        let zero_from = |first: usize, column: usize| {
            ad.get(column).is_some_and(|entries| entries.iter().skip(first).all(|&entry| entry == zero))
        };
        let (joints, alone) = ad.as_chunks::<2>();
        let diagonals_agree = joints.iter().all(|[from_position, from_rate]| {
            let mut blocks = from_position.as_chunks::<2>().0.iter().zip(from_rate.as_chunks::<2>().0);
            blocks.all(|([of_position, _], [_, of_rate])| of_position == of_rate)
        });
        let starts_with_one = ad.as_flattened().first() == Some(&one);
        match starts_with_one && zero_from(1, 0) {
            true if alone.is_empty() && diagonals_agree && zero_from(2, 1) => PredictionPattern::Frictionless,
            true => PredictionPattern::SameEverywhere,
            false => PredictionPattern::Any,
        }
    }
}

impl<'t, const NX: usize, const NY: usize, T: Scalar> Observer<'t, NX, NY, T> {
    pub(crate) fn new(gains: &'t ObserverGains<NX, NY, T>, sensors: &'t [SensorRow<T>; NY]) -> Self {
        Self { gains, sensors, pattern: gains.pattern(), is_in_order: are_in_order(sensors) }
    }

    /// Innovation `e = y - C x̂⁻` (m or rad): measurement minus prediction, for the measured positions y. It is
    /// computed explicitly: a merged `Ad - L C` would cost most of the digits of u in f32.
    #[inline(always)]
    pub(crate) fn innovation(&self, y: &[T; NY], estimate: &[T; NX]) -> [T; NY] {
        let (mut innovation, measured) = (*y, self.measured(estimate));
        for (sensor, e) in innovation.iter_mut().enumerate() {
            *e -= measured[sensor];
        }
        innovation
    }

    /// What the sensors measure, `C x̂` (m or rad): each its state, less what it has moved since an old reading.
    #[inline(always)]
    pub(crate) fn measured(&self, estimate: &[T; NX]) -> [T; NY] {
        if !self.is_in_order {
            return self.measured_looking_up(estimate);
        }
        let mut measured = [T::default(); NY];
        for (sensor, measured) in measured.iter_mut().enumerate() {
            *measured = estimate.get(2 * sensor).copied().unwrap_or_default();
        }
        measured
    }

    #[cold]
    #[inline(never)]
    fn measured_looking_up(&self, estimate: &[T; NX]) -> [T; NY] {
        let mut measured = [T::default(); NY];
        for (sensor, measured) in measured.iter_mut().enumerate() {
            *measured = self.looked_up(sensor, estimate);
        }
        measured
    }

    /// What a sensor measures. Not inlined into the unrolled loop over the sensors, it takes half of the code.
    #[inline(never)]
    fn looked_up(&self, sensor: usize, estimate: &[T; NX]) -> T {
        let Some(SensorRow { state, delay_s, .. }) = self.sensors.get(sensor) else { return T::default() };
        // A checked table names only states that exist.
        match estimate.get(*state as usize..) {
            Some([value, rate, ..]) => *value - *delay_s * *rate,
            Some([value]) => *value,
            _ => T::default(),
        }
    }

    /// Replaces the prediction x̂⁻ by the current estimate `x̂ = x̂⁻ + L e`. Calls `corrected` for each joint, with
    /// its number, while the joint's states are still in registers.
    #[inline(always)]
    pub(crate) fn correct(
        &self,
        innovation: &[T; NY],
        estimate: &mut [T; NX],
        mut corrected: impl FnMut(usize, &[T]),
    ) {
        let l = &self.gains.l.data.0;
        let (joints, last) = estimate.as_chunks_mut::<2>();
        for (joint, estimate) in joints.iter_mut().enumerate() {
            let [mut position, mut rate] = *estimate;
            for (sensor, e) in innovation.iter().enumerate() {
                if let Some([to_position, to_rate]) = l[sensor].as_chunks::<2>().0.get(joint) {
                    // Both products before both sums, so that no instruction waits for the one before it.
                    let (a, b) = (*to_position * *e, *to_rate * *e);
                    position += a;
                    rate += b;
                }
            }
            *estimate = [position, rate];
            corrected(joint, estimate);
        }
        if let [x] = last {
            for (sensor, e) in innovation.iter().enumerate() {
                *x += l[sensor].last().copied().unwrap_or_default() * *e;
            }
            corrected(NX / 2, last);
        }
    }

    /// Prediction for the next tick, `x̂⁻ = Ad x̂ + Bd u`, with the force `u` (N) actually applied.
    ///
    /// The terms of an entry are added in a fixed order, column by column, so every machine computes the same bits.
    // Factors stay references until they are multiplied, so that each is loaded where it is used: this saves 13 cycles
    // in a tick with five sensors.
    #[inline(always)]
    pub(crate) fn predict(&self, estimate: &mut [T; NX], u: T) {
        let mut next = self.gains.bd.data.0[0];
        for next in &mut next {
            *next *= u;
        }
        if self.pattern == PredictionPattern::Frictionless {
            self.add_frictionless(&mut next, estimate);
        } else {
            let (mut columns, mut states) = (&self.gains.ad.data.0[..], &estimate[..]);
            if let (PredictionPattern::SameEverywhere, [_, others @ ..], [x, rest @ ..]) =
                (self.pattern, columns, states)
            {
                next[0] += *x;
                (columns, states) = (others, rest);
            }
            for (column, x) in columns.iter().zip(states) {
                for (row, next) in next.iter_mut().enumerate() {
                    *next += column[row] * *x;
                }
            }
        }
        *estimate = next;
    }

    #[inline(always)]
    fn add_frictionless(&self, next: &mut [T; NX], estimate: &[T; NX]) {
        let (columns, states) = (self.gains.ad.data.0.as_chunks::<2>().0, estimate.as_chunks::<2>().0);
        let next = next.as_chunks_mut::<2>().0;
        for (joint, [position, rate]) in states.iter().enumerate() {
            let [from_position, from_rate] = &columns[joint];
            let (from_position, from_rate) = (from_position.as_chunks::<2>().0, from_rate.as_chunks::<2>().0);
            if joint == 0 {
                // The cart's position and speed affect only the cart, through the block 1, T; 0, 1.
                let [to_position, _] = from_rate[0];
                next[0] = [next[0][0] + *position + to_position * *rate, next[0][1] + *rate];
                continue;
            }
            for (row, next) in next.iter_mut().enumerate() {
                let ([diagonal, to_rate], [to_position, _]) = (&from_position[row], &from_rate[row]);
                // All products before the sums, so that no instruction waits for the one before it.
                let (a, b) = (*diagonal * *position, *to_rate * *position);
                let (c, d) = (*to_position * *rate, *diagonal * *rate);
                let [p, v] = [next[0] + a, next[1] + b];
                *next = [p + c, v + d];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{SMatrix, matrix, vector};

    #[test]
    fn the_estimate_follows_the_equations() {
        let gains = ObserverGains {
            ad: matrix![1.0f32, 0.5; 0.0, 1.0],
            bd: vector![0.125, 0.5],
            l: matrix![0.5; 2.0],
        };
        let sensors = [SensorRow::default()];
        let observer = Observer::new(&gains, &sensors);
        let mut x = [1.0, -1.0];
        let e = observer.innovation(&[3.0], &x);
        observer.correct(&e, &mut x, |joint, x| assert_eq!((joint, x), (0, &[2.0, 3.0][..])));
        assert_eq!((x, e), ([2.0, 3.0], [2.0]));
        observer.predict(&mut x, 8.0);
        assert_eq!(x, [4.5, 7.0]);
    }

    #[test]
    fn an_old_reading_is_compared_with_where_the_sensor_was() {
        let gains = ObserverGains {
            ad: matrix![1.0f32, 0.5; 0.0, 1.0],
            bd: vector![0.125, 0.5],
            l: matrix![0.5; 2.0],
        };
        let of = |delay_s: f32| [SensorRow { delay_s, ..SensorRow::default() }];
        let (old, new) = (of(0.25), of(0.0));
        let estimate = [3.0, -2.0];
        assert_eq!(Observer::new(&gains, &old).innovation(&[4.0], &estimate), [0.5]);
        assert_eq!(Observer::new(&gains, &new).innovation(&[4.0], &estimate), [1.0]);
    }

    #[test]
    fn a_shortcut_is_taken_only_where_every_entry_allows_it() {
        let pattern = |ad: SMatrix<f32, 4, 4>| PredictionPattern::of(&ad.data.0);
        let frictionless = matrix![
            1.0, 0.1, 0.2, 0.3;
            0.0, 1.0, 0.4, 0.2;
            0.0, 0.0, 1.5, 0.7;
            0.0, 0.0, 0.8, 1.5
        ];
        assert_eq!(pattern(frictionless), PredictionPattern::Frictionless);
        for (row, column) in (0..4).flat_map(|row| (0..4).map(move |column| (row, column))) {
            let mut other = frictionless;
            other[(row, column)] += 0.01;
            let expected = match (row, column) {
                (_, 0) => PredictionPattern::Any,
                // The blocks' diagonals have to agree, and the links must not depend on the cart's speed.
                (2 | 3, 1) | (0, 2) | (1, 3) | (2, 2) | (3, 3) | (1, 1) => PredictionPattern::SameEverywhere,
                _ => PredictionPattern::Frictionless,
            };
            assert_eq!(pattern(other), expected, "{row} {column}");
        }
        assert_eq!(PredictionPattern::of(&[[1.0f32]]), PredictionPattern::SameEverywhere);
        assert_eq!(
            PredictionPattern::of(&SMatrix::<f32, 3, 3>::identity().data.0),
            PredictionPattern::SameEverywhere
        );
    }
}
