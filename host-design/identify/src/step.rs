//! One integration step with its derivatives, and the measurement equations.

use core::f64::consts::PI;

use crate::cart_force::CartForce;
use crate::model::{Accelerations, Model};
use crate::rows::{add_multiple, set_multiple};

/// A step of the classical Runge–Kutta method, with derivatives by the state at its start and by the parameters.
#[derive(Debug, Clone)]
pub(crate) struct Step {
    local: Accelerations,
    /// Number of columns: s, or s and the number of parameters of the motion.
    pub(crate) columns: usize,
    /// State at the end, s entries.
    pub(crate) end: Vec<f64>,
    /// Its derivatives, s rows of `columns`.
    pub(crate) by: Vec<f64>,
    /// State after the jump of the cart's speed at the start, and its derivatives.
    start: Vec<f64>,
    start_by: Vec<f64>,
    at: Vec<f64>,
    at_by: Vec<f64>,
    rate: Vec<f64>,
    rate_by: Vec<f64>,
}

/// Each stage: its fraction of the step, and the weight of its rate.
const STAGES: [(f64, f64); 4] = [(0.0, 1.0 / 6.0), (0.5, 1.0 / 3.0), (0.5, 1.0 / 3.0), (1.0, 1.0 / 6.0)];

impl Step {
    /// Storage for a step with derivatives by the state, and by the parameters if `parameters`.
    pub(crate) fn new(model: &Model, parameters: bool) -> Self {
        let s = model.states();
        let columns = s + if parameters { model.layout.of_motion() } else { 0 };
        let (of_state, of_columns) = (vec![0.0; s], vec![0.0; s * columns]);
        Self {
            local: Accelerations::new(model, parameters),
            columns,
            end: of_state.clone(),
            by: of_columns.clone(),
            start: of_state.clone(),
            start_by: of_columns.clone(),
            at: of_state.clone(),
            at_by: of_columns.clone(),
            rate: of_state,
            rate_by: of_columns,
        }
    }

    /// Integrates from `start` over `dt` (s) under `input`; the result is in `end` and `by`.
    pub(crate) fn take(&mut self, model: &Model, p: &[f64], start: &[f64], input: &CartForce, dt: f64) {
        self.begin(model, p, start, input.jump);
        let mut is_first = input.jump == 0.0;
        for _ in 0..model.substeps {
            self.advance(model, p, input, dt / model.substeps as f64, is_first);
            is_first = false;
            core::mem::swap(&mut self.start, &mut self.end);
            core::mem::swap(&mut self.start_by, &mut self.by);
        }
        core::mem::swap(&mut self.start, &mut self.end);
        core::mem::swap(&mut self.start_by, &mut self.by);
    }

    /// Integrates from `self.start` over `dt` (s); `is_first` if its derivatives are the identity.
    fn advance(&mut self, model: &Model, p: &[f64], input: &CartForce, dt: f64, is_first: bool) {
        let (m, s, columns) = (model.coordinates(), model.states(), self.columns);
        let start_by = (!is_first).then_some(self.start_by.as_slice());
        self.end.copy_from_slice(&self.start);
        self.by.copy_from_slice(&self.start_by);
        self.rate.fill(0.0);
        self.rate_by.fill(0.0);
        for (part, weight) in STAGES {
            let h = part * dt;
            (0..s).for_each(|i| self.at[i] = self.start[i] + h * self.rate[i]);
            set_multiple(&mut self.at_by, h, &self.rate_by);
            match start_by {
                None => (0..s).for_each(|i| self.at_by[i * columns + i] += 1.0),
                Some(start_by) => add_multiple(&mut self.at_by, 1.0, start_by),
            }
            bend(model, p, (&self.start, start_by), &mut self.at, &mut self.at_by);
            self.local.differentiate(model, p, &self.at, input);
            self.rate[..m].copy_from_slice(&self.at[m..2 * m]);
            self.rate[m..2 * m].copy_from_slice(&self.local.acceleration);
            self.rate_by[..m * columns].copy_from_slice(&self.at_by[m * columns..2 * m * columns]);
            let accelerations = &mut self.rate_by[m * columns..2 * m * columns];
            for (row, local) in
                accelerations.chunks_exact_mut(columns).zip(self.local.jacobian.chunks_exact(columns))
            {
                row[..s].fill(0.0);
                row[s..].copy_from_slice(&local[s..]);
                // No acceleration depends on x.
                for (factor, of_state) in local[1..s].iter().zip(self.at_by.chunks_exact(columns).skip(1)) {
                    add_multiple(row, *factor, of_state);
                }
            }
            let h = weight * dt;
            add_multiple(&mut self.end, h, &self.rate);
            add_multiple(&mut self.by, h, &self.rate_by);
        }
        bend(model, p, (&self.start, start_by), &mut self.end, &mut self.by);
    }

    /// Sets the state at the start, after the cart's speed has jumped by `jump` (m/s). Rates are linear in an imposed
    /// acceleration: the difference that 1 m/s² makes is the jump of the rates for one of 1 m/s.
    fn begin(&mut self, model: &Model, p: &[f64], start: &[f64], jump: f64) {
        let (m, s, columns) = (model.coordinates(), model.states(), self.columns);
        self.start.copy_from_slice(start);
        self.start_by.fill(0.0);
        (0..s).for_each(|i| self.start_by[i * columns + i] = 1.0);
        if jump == 0.0 {
            return;
        }
        for (force, share) in [(1.0, jump), (0.0, -jump)] {
            self.local.differentiate(model, p, start, &CartForce { force, ..CartForce::default() });
            add_multiple(&mut self.start[m..2 * m], share, &self.local.acceleration);
            add_multiple(&mut self.start_by[m * columns..2 * m * columns], share, &self.local.jacobian);
        }
    }

    /// `next = F by + [0 F_p]` with the derivatives `[F F_p]` of the step; `by` and `next` have as many columns.
    pub(crate) fn propagate(&self, by: &[f64], next: &mut [f64]) {
        let (s, columns) = (self.end.len(), self.columns);
        for (row, local) in next.chunks_exact_mut(columns).zip(self.by.chunks_exact(columns)) {
            row[..s].fill(0.0);
            row[s..].copy_from_slice(&local[s..]);
            for (factor, from) in local[..s].iter().zip(by.chunks_exact(columns)) {
                add_multiple(row, *factor, from);
            }
        }
    }

    /// Accelerations per unit of force and torque at the last stage of the step; see [`Accelerations::inputs`].
    pub(crate) fn inputs(&self) -> Vec<f64> {
        self.local.inputs()
    }
}

/// Sets the bristle deflections of the state `at`, and their derivatives in `by`, after the travel since `start`, whose
/// derivatives are the identity if they are not given.
fn bend(
    model: &Model,
    p: &[f64],
    (start, start_by): (&[f64], Option<&[f64]>),
    at: &mut [f64],
    by: &mut [f64],
) {
    let columns = by.len() / at.len();
    for contact in 0..model.contacts() {
        let index = 2 * model.coordinates() + contact;
        // A joint turns by its link less the link below it.
        let below = contact.checked_sub(1).filter(|below| *below > 0);
        let turned = |state: &[f64]| state[contact] - below.map_or(0.0, |below| state[below]);
        let (travel, length) = (turned(at) - turned(start), model.bristle_length(p, contact));
        let direction = 1f64.copysign(travel);
        let left = libm::exp(-travel.abs() / length);
        let off = start[index] - direction;
        let by_travel = -direction * off * left / length;
        at[index] = direction + off * left;
        let (others, row) = by.split_at_mut(index * columns);
        let row = &mut row[..columns];
        set_multiple(row, by_travel, &others[contact * columns..][..columns]);
        let mut add = |factor: f64, of: usize| match start_by {
            None => row[of] += factor,
            Some(start_by) => add_multiple(row, factor, &start_by[of * columns..][..columns]),
        };
        add(-by_travel, contact);
        add(left, index);
        if let Some(below) = below {
            add(by_travel, below);
            add_multiple(row, -by_travel, &others[below * columns..][..columns]);
        }
        if let Some(joint) = contact.checked_sub(1)
            && columns > at.len()
        {
            row[at.len() + model.layout.presliding(joint)] += off * left * travel.abs() / (length * length);
        }
    }
}

/// Predicted measurement of one channel (0: cart, then the joints) as deviation from hanging, and terms of its
/// derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Measured {
    pub(crate) value: f64,
    /// Derivative by the coordinate of this channel; that by the coordinate below has the opposite sign.
    pub(crate) by_angle: f64,
    /// Sine and cosine of a joint's angle, and of twice the angle, less those of hanging.
    harmonics: [[f64; 2]; 2],
}

impl Model {
    /// What channel `channel` measures at `state`: for the cart its position over the travel per count, as a multiple
    /// of that of the file; for a joint `θ + o + s (sin θ - sin h) + c (cos θ - cos h) - h`, with θ from the vertical
    /// and h the hanging angle, and the same of twice the angle.
    pub(crate) fn measure(&self, p: &[f64], state: &[f64], channel: usize) -> Measured {
        let layout = self.layout;
        let Some(joint) = channel.checked_sub(1) else {
            let by_angle = 1.0 / p[layout.travel()];
            return Measured { value: by_angle * state[0], by_angle, harmonics: [[0.0; 2]; 2] };
        };
        let hanging = if joint == 0 { PI } else { 0.0 };
        let below = if joint == 0 { -p[layout.tilt()] } else { state[joint] };
        let theta = state[joint + 1] - below;
        let (sine, cosine) = libm::sincos(theta);
        let (sine_2, cosine_2) = (2.0 * sine * cosine, 1.0 - 2.0 * sine * sine);
        let (s, c) = (p[layout.sine(joint)], p[layout.cosine(joint)]);
        let (s_2, c_2) = (p[layout.twice_sine(joint)], p[layout.twice_cosine(joint)]);
        let cosine_less = cosine - if joint == 0 { -1.0 } else { 1.0 };
        let once = s * sine + c * cosine_less;
        let twice = s_2 * sine_2 + c_2 * (cosine_2 - 1.0);
        Measured {
            value: theta - hanging + p[layout.zero(joint)] + once + twice,
            by_angle: 1.0 + s * cosine - c * sine + 2.0 * (s_2 * cosine_2 - c_2 * sine_2),
            harmonics: [[sine, cosine_less], [sine_2, cosine_2 - 1.0]],
        }
    }

    /// Derivatives of a measurement by the parameters that it depends on directly: index and derivative of each.
    pub(crate) fn measured_by(&self, channel: usize, measured: &Measured) -> [(usize, f64); 6] {
        let layout = self.layout;
        let [once, twice] = measured.harmonics;
        match channel.checked_sub(1) {
            None => {
                let mut by = [(0, 0.0); 6];
                by[0] = (layout.travel(), -measured.value * measured.by_angle);
                by
            }
            Some(joint) => [
                (layout.zero(joint), 1.0),
                (layout.sine(joint), once[0]),
                (layout.cosine(joint), once[1]),
                (layout.twice_sine(joint), twice[0]),
                (layout.twice_cosine(joint), twice[1]),
                (layout.tilt(), if joint == 0 { measured.by_angle } else { 0.0 }),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::tests::triple;

    #[test]
    fn the_derivatives_of_a_step_agree_with_differences() {
        derivatives_agree(false, None);
        derivatives_agree(true, None);
        derivatives_agree(false, Some(0.02));
    }

    fn derivatives_agree(has_bristles: bool, creeping: Option<f64>) {
        let (mut model, mut p, _) = triple();
        (model.has_bristles, model.creeping) = (has_bristles, creeping);
        (0..3).for_each(|joint| p[model.layout.presliding(joint)] = 0.01);
        // The cart moves by a fraction of the length of its bristle; at 0 its travel is exact.
        let start = [0.0, 2.0, -1.1, 0.4, -0.005, 3.0, -5.0, 1.5, 0.4, 0.9, -0.5, 0.2];
        let (states, start) = (model.states(), &start[..model.states()]);
        let input = CartForce { force: 3.0, ..CartForce::default() };
        let after = |p: &[f64], start: &[f64]| {
            let mut step = Step::new(&model, true);
            step.take(&model, p, start, &input, 0.002);
            step
        };
        let exact = after(&p, start);
        let check = |column: usize, high: Step, low: Step, width: f64| {
            for row in 0..states {
                let wanted = (high.end[row] - low.end[row]) / width;
                let found = exact.by[row * exact.columns + column];
                assert!(
                    (found - wanted).abs() < 1e-5 * (1.0 + wanted.abs()),
                    "{row} {column}: {found} {wanted}"
                );
            }
        };
        for i in 0..states {
            let moved = |by: f64| {
                let mut start = start.to_vec();
                start[i] += by;
                after(&p, &start)
            };
            check(i, moved(1e-6), moved(-1e-6), 2e-6);
        }
        for i in (0..model.layout.of_motion())
            .filter(|&i| i != model.layout.delay() && i != model.layout.dead_zone())
        {
            let width = 1e-6 * p[i].abs().max(1e-2);
            let moved = |by: f64| {
                let mut p = p.clone();
                p[i] += by;
                after(&p, start)
            };
            check(states + i, moved(width), moved(-width), 2.0 * width);
        }
    }
}
