//! Plays back a planned motion: reference state, force and gains of each tick, interpolated between the knots of the
//! table.

use nalgebra::{SMatrix, SVector};

use crate::table::MotionTable;

/// What the controller follows in one tick of a planned motion: reference and gains.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference<const NX: usize, const NY: usize> {
    /// Reference state (m, m/s, rad, rad/s …).
    pub x: SVector<f32, NX>,
    /// Reference force (N).
    pub u: f32,
    /// State feedback K of `u - K (x̂ - x)` (N/m, N s/m, N/rad, N s/rad …).
    pub k: SVector<f32, NX>,
    /// Observer gain L of `x̂ = x̂⁻ + L e`: a column for each sensor, a row for each state.
    pub l: SMatrix<f32, NX, NY>,
}

/// Steps through a planned motion, tick by tick.
#[derive(Debug, Clone)]
pub struct Playback<'t, const NX: usize, const NY: usize> {
    motion: MotionTable<'t>,
    tick: u32,
    /// Offset added to the planned positions of the cart (m), so that a motion can begin anywhere: the equations of
    /// motion are the same everywhere on the rail.
    shift_m: f32,
    now: Reference<NX, NY>,
}

impl<'t, const NX: usize, const NY: usize> Playback<'t, NX, NY> {
    /// Starts at the beginning of `motion`, shifted along the rail so that its first cart position is `position_m`
    /// (m).
    pub fn new(motion: MotionTable<'t>, position_m: f32) -> Self {
        let now = Reference { x: SVector::zeros(), u: 0.0, k: SVector::zeros(), l: SMatrix::zeros() };
        let mut playback = Self { motion, tick: 0, shift_m: 0.0, now };
        playback.interpolate_reference();
        playback.shift_m = position_m - playback.now.x.as_slice().first().copied().unwrap_or_default();
        playback.interpolate_reference();
        (0..NY).for_each(|sensor| playback.interpolate_filter(sensor));
        playback
    }

    /// Reference and gains of the current tick.
    pub fn now(&self) -> &Reference<NX, NY> {
        &self.now
    }

    /// Ticks since the beginning of the motion; stops at its duration.
    pub fn tick(&self) -> u32 {
        self.tick
    }

    /// Goes to the next tick. Returns `true` once the motion has ended; [`now`](Self::now) then stays at its end.
    pub fn advance(&mut self) -> bool {
        self.tick = self.tick.saturating_add(1).min(self.motion.ticks);
        self.interpolate_reference();
        // The filter gains change slowly: updating those of one sensor per tick is enough.
        if let Some(sensor) = (self.tick as usize).checked_rem(NY) {
            self.interpolate_filter(sensor);
        }
        self.tick == self.motion.ticks
    }

    /// Shifts the motion along the rail so that its current cart position is `position_m` (m).
    pub fn stay_at(&mut self, position_m: f32) {
        if let Some(position) = self.now.x.as_mut_slice().first_mut() {
            self.shift_m += position_m - *position;
            *position = position_m;
        }
    }

    fn interpolate_reference(&mut self) {
        let MotionTable { reference, reference_units, reference_ticks, .. } = self.motion;
        let columns = Columns { values: reference, units: reference_units };
        let window = columns.window(self.tick, reference_ticks);
        columns.blend(&window, 0, self.now.x.as_mut_slice());
        columns.blend(&window, NX, core::slice::from_mut(&mut self.now.u));
        columns.blend(&window, NX + 1, self.now.k.as_mut_slice());
        if let Some(position) = self.now.x.as_mut_slice().first_mut() {
            *position += self.shift_m;
        }
    }

    fn interpolate_filter(&mut self, sensor: usize) {
        let MotionTable { filter, filter_units, filter_ticks, .. } = self.motion;
        let columns = Columns { values: filter, units: filter_units };
        let window = columns.window(self.tick, filter_ticks);
        if let Some(column) = self.now.l.data.0.get_mut(sensor) {
            columns.blend(&window, NX * sensor, column);
        }
    }
}

/// The weight 1 in fixed point. The weighted sums of entries are exact integers: they stay below 1.7 · 2³⁰.
const ONE: i32 = 1 << 14;

/// Columns of a motion, each with its values at all knots.
#[derive(Debug, Clone, Copy)]
struct Columns<'t> {
    values: &'t [i16],
    units: &'t [f32],
}

/// The four knots nearest to a tick, and their interpolation weights.
#[derive(Debug, Clone, Copy)]
struct KnotWindow {
    /// Length of a column.
    knots: usize,
    /// The first of the four nearest knots.
    first: usize,
    /// Weights of these knots: those of the cubic through four equidistant points. Their sum is exactly [`ONE`], so
    /// that a constant column is reproduced exactly.
    weights: [i32; 4],
}

impl Columns<'_> {
    fn window(&self, tick: u32, ticks_per_knot: u32) -> KnotWindow {
        let knots = self.values.len() / self.units.len().max(1);
        // A checked table has at least four knots.
        let last = knots.saturating_sub(4) as u32;
        let first = (tick / ticks_per_knot.max(1)).saturating_sub(1).min(last);
        let p = tick.saturating_sub(first * ticks_per_knot) as f32 / ticks_per_knot as f32;
        let [a, b, c, d] = [p, p - 1.0, p - 2.0, p - 3.0];
        let cubics = [b * c * d * (-1.0 / 6.0), a * b * d * -0.5, a * b * c * (1.0 / 6.0)];
        let [w_a, w_c, w_d] = cubics.map(|weight| (weight * ONE as f32) as i32);
        KnotWindow { knots, first: first as usize, weights: [w_a, ONE - w_a - w_c - w_d, w_c, w_d] }
    }

    /// Interpolates the columns from number `column` on and writes them to `to`, in SI units.
    // Not inlined: a copy for each number of columns would have to be fetched from flash in every tick.
    #[inline(never)]
    fn blend(&self, window: &KnotWindow, column: usize, to: &mut [f32]) {
        let KnotWindow { knots, first, weights: [w_a, w_b, w_c, w_d] } = *window;
        let columns = self.values.get(column * knots..).unwrap_or_default().chunks_exact(knots.max(1));
        let units = self.units.get(column..).unwrap_or_default();
        for ((to, column), unit) in to.iter_mut().zip(columns).zip(units) {
            let Some([a, b, c, d]) = column.get(first..).and_then(|rest| rest.first_chunk()) else { return };
            let [a, b, c, d] = [*a, *b, *c, *d].map(i32::from);
            let sum = w_a * a + w_b * b + w_c * c + w_d * d;
            *to = sum as f32 * (1.0 / ONE as f32) * unit;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// A reference that is a cubic of time, for a rig with two states and one sensor.
    fn cubic(t: f32) -> f32 {
        0.125 * t * t * t - t * t + 0.5 * t + 2.0
    }

    /// Unit of an entry in each column; all knots below are whole multiples of it.
    const UNITS: [f32; 5] = [0.0625, 0.125, 0.03125, 0.0625, 0.125];

    fn motion<'t>(reference: &'t [i16], filter: &'t [i16]) -> MotionTable<'t> {
        MotionTable {
            ticks: 20,
            reference_ticks: 4,
            filter_ticks: 5,
            travel_m: [0.0; 2],
            reference_units: &UNITS,
            reference,
            filter_units: &UNITS[..2],
            filter,
        }
    }

    fn columns(ticks_per_knot: u32, columns: usize) -> Vec<i16> {
        let value = |column: usize, knot: u32| cubic((knot * ticks_per_knot) as f32) + column as f32;
        let column = |column: usize| {
            (0..=20 / ticks_per_knot).map(move |knot| (value(column, knot) / UNITS[column]) as i16)
        };
        (0..columns).flat_map(column).collect()
    }

    #[test]
    fn a_cubic_is_followed_between_its_knots_and_ends_in_the_last_one() {
        let (reference, filter) = (columns(4, 5), columns(5, 2));
        let mut playback = Playback::<2, 1>::new(motion(&reference, &filter), 7.0);
        for tick in 0..20 {
            let (now, wanted) = (playback.now(), cubic(tick as f32));
            assert_eq!(playback.tick(), tick);
            // Three weights are rounded by 2^-14 each; knots are up to 580 apart.
            let near = |found: f32, wanted: f32| (found - wanted).abs() < 0.05;
            assert!(near(now.x[0], wanted - cubic(0.0) + 7.0), "the cart starts where it is");
            assert!(near(now.x[1], wanted + 1.0) && near(now.u, wanted + 2.0));
            assert!(near(now.k[0], wanted + 3.0) && near(now.k[1], wanted + 4.0));
            assert!(near(now.l[0], wanted) && near(now.l[1], wanted + 1.0));
            assert_eq!(playback.advance(), tick == 19);
        }
        assert_eq!(playback.now().x[1], cubic(20.0) + 1.0);
    }

    #[test]
    fn what_is_constant_stays_constant_to_the_last_bit() {
        let (reference, filter) = ([-1234; 6 * 5], [32_767; 5 * 2]);
        let mut playback = Playback::<2, 1>::new(motion(&reference, &filter), -1234.0 * UNITS[0]);
        let first = playback.now().clone();
        assert_eq!((first.u, first.l[1]), (-1234.0 * UNITS[2], 32_767.0 * UNITS[1]));
        while !playback.advance() {
            assert_eq!(playback.now(), &first);
        }
    }

    #[test]
    fn the_gains_from_each_sensor_are_renewed_in_turn() {
        // Two states, two sensors: knots 5 ticks apart that rise by 10 each.
        let reference = [0; 6 * 5];
        let filter: Vec<i16> = (0..4).flat_map(|_| (0..5).map(|knot| 10 * knot)).collect();
        let table = MotionTable { filter_units: &[1.0; 4], ..motion(&reference, &filter) };
        let mut playback = Playback::<2, 2>::new(table, 0.0);
        for tick in 1..=20 {
            playback.advance();
            let columns = playback.now().l;
            let renewed = |sensor: i32| tick - (tick - sensor).rem_euclid(2);
            let wanted = [renewed(0), renewed(1)].map(|tick| 2.0 * tick as f32);
            for (sensor, wanted) in wanted.into_iter().enumerate() {
                assert!((columns[(0, sensor)] - wanted).abs() < 0.01, "tick {tick}: {columns}");
            }
        }
    }

    #[test]
    fn a_wrong_spacing_of_the_knots_is_another_motion() {
        let (reference, filter) = (columns(4, 5), columns(5, 2));
        let wrong = MotionTable { reference_ticks: 5, ..motion(&reference, &filter) };
        let mut playback = Playback::<2, 1>::new(wrong, 2.0);
        (0..10).for_each(|_| {
            playback.advance();
        });
        assert!((playback.now().x[0] - cubic(10.0)).abs() > 1.0);
    }
}
