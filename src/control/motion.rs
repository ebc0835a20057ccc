//! Where a planned motion is: its reference, force and gains, tick by tick, interpolated between the knots of the
//! table.

use nalgebra::{SMatrix, SVector};

use crate::table::MotionTable;

/// What the controller follows in one tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Course<const NX: usize, const NY: usize> {
    /// Reference state (m, m/s, rad, rad/s …).
    pub x: SVector<f32, NX>,
    /// Reference force (N).
    pub u: f32,
    /// K of `u - K (x̂ - x)`.
    pub k: SVector<f32, NX>,
    /// L of `x̂ = x̂⁻ + L e`.
    pub l: SMatrix<f32, NX, NY>,
}

/// A motion that is being followed.
#[derive(Debug, Clone)]
pub struct Player<'t, const NX: usize, const NY: usize> {
    motion: MotionTable<'t>,
    tick: u32,
    /// Distance from the planned positions of the cart to those that are followed (m): the equations of motion are the
    /// same everywhere on the rail.
    shift_m: f32,
    now: Course<NX, NY>,
}

impl<'t, const NX: usize, const NY: usize> Player<'t, NX, NY> {
    /// The beginning of `motion`, with the cart at `position_m`.
    pub fn new(motion: MotionTable<'t>, position_m: f32) -> Self {
        let now = Course { x: SVector::zeros(), u: 0.0, k: SVector::zeros(), l: SMatrix::zeros() };
        let mut player = Self { motion, tick: 0, shift_m: 0.0, now };
        player.interpolate();
        player.shift_m = position_m - player.now.x.as_slice().first().copied().unwrap_or_default();
        player.interpolate();
        player
    }

    /// What to follow in this tick.
    pub fn now(&self) -> &Course<NX, NY> {
        &self.now
    }

    /// Ticks since the beginning.
    pub fn tick(&self) -> u32 {
        self.tick
    }

    /// Goes to the next tick. After the last one, `now` is where the motion ends, and the result is `true`.
    pub fn advance(&mut self) -> bool {
        self.tick = self.tick.saturating_add(1).min(self.motion.ticks);
        self.interpolate();
        self.tick == self.motion.ticks
    }

    fn interpolate(&mut self) {
        let width = MotionTable::course_width(NX);
        let (rows, weights) = around(self.motion.course, width, self.tick, self.motion.course_ticks);
        blend(&rows, 0, &weights, self.now.x.as_mut_slice());
        blend(&rows, NX, &weights, core::slice::from_mut(&mut self.now.u));
        blend(&rows, NX + 1, &weights, self.now.k.as_mut_slice());
        let (rows, weights) = around(self.motion.filter, NX * NY, self.tick, self.motion.filter_ticks);
        blend(&rows, 0, &weights, self.now.l.as_mut_slice());
        if let Some(position) = self.now.x.as_mut_slice().first_mut() {
            *position += self.shift_m;
        }
    }
}

/// The four rows nearest to `tick`, and their weights: those of the cubic through four equidistant points.
fn around(values: &[f32], width: usize, tick: u32, ticks_per_row: u32) -> ([&[f32]; 4], [f32; 4]) {
    // A checked table has at least four rows.
    let last = (values.len() / width.max(1)).saturating_sub(4) as u32;
    let first = (tick / ticks_per_row.max(1)).saturating_sub(1).min(last);
    let p = tick.saturating_sub(first * ticks_per_row) as f32 / ticks_per_row as f32;
    let [a, b, c, d] = [p, p - 1.0, p - 2.0, p - 3.0];
    let weights = [b * c * d * (-1.0 / 6.0), a * c * d * 0.5, a * b * d * -0.5, a * b * c * (1.0 / 6.0)];
    let row = |index: usize| {
        let begin = (first as usize + index) * width;
        values.get(begin..begin + width).unwrap_or_default()
    };
    ([row(0), row(1), row(2), row(3)], weights)
}

/// The weighted sum of the rows' entries from `offset` on.
fn blend(rows: &[&[f32]; 4], offset: usize, weights: &[f32; 4], to: &mut [f32]) {
    let [a, b, c, d] = rows.map(|row| row.get(offset..).unwrap_or_default());
    let [w_a, w_b, w_c, w_d] = *weights;
    for ((((to, a), b), c), d) in to.iter_mut().zip(a).zip(b).zip(c).zip(d) {
        *to = (w_a * a + w_b * b) + (w_c * c + w_d * d);
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

    fn motion<'t>(course: &'t [f32], filter: &'t [f32]) -> MotionTable<'t> {
        MotionTable { ticks: 20, course_ticks: 4, filter_ticks: 5, travel_m: [0.0; 2], course, filter }
    }

    fn rows(ticks_per_row: u32, width: usize) -> Vec<f32> {
        let row = |row: u32| (0..width).map(move |entry| cubic((row * ticks_per_row) as f32) + entry as f32);
        (0..=20_u32.div_ceil(ticks_per_row)).flat_map(row).collect()
    }

    #[test]
    fn a_cubic_is_followed_exactly_between_its_knots_and_ends_in_the_last_one() {
        let (course, filter) = (rows(4, 5), rows(5, 2));
        let mut player = Player::<2, 1>::new(motion(&course, &filter), 7.0);
        for tick in 0..20 {
            let (now, wanted) = (player.now(), cubic(tick as f32));
            assert_eq!(player.tick(), tick);
            let near = |found: f32, wanted: f32| (found - wanted).abs() < 1e-3;
            assert!(near(now.x[0], wanted - cubic(0.0) + 7.0), "the cart starts where it is");
            assert!(near(now.x[1], wanted + 1.0) && near(now.u, wanted + 2.0));
            assert!(near(now.k[0], wanted + 3.0) && near(now.k[1], wanted + 4.0));
            assert!(near(now.l[0], wanted) && near(now.l[1], wanted + 1.0));
            assert_eq!(player.advance(), tick == 19);
        }
        assert!((player.now().x[1] - cubic(20.0) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_wrong_spacing_of_the_knots_is_another_motion() {
        let (course, filter) = (rows(4, 5), rows(5, 2));
        let wrong = MotionTable { course_ticks: 5, ..motion(&course, &filter) };
        let mut player = Player::<2, 1>::new(wrong, 2.0);
        (0..10).for_each(|_| {
            player.advance();
        });
        assert!((player.now().x[0] - cubic(10.0)).abs() > 1.0);
    }
}
