//! The equations of motion with smoothed dry friction, and their derivatives by the state and by every parameter.

// The indices are those of the equations.
#![allow(clippy::needless_range_loop)]

use crate::cart_force::CartForce;
use crate::parameters::Layout;
use crate::rows::{factorise, solve};
use crate::stribeck;

/// The chain in the notation of `ChainParameters`, for any number of links n, in the m = n + 1 coordinates x, φ_1 …
/// φ_n.
///
/// The state has s = 2m + 1 entries: coordinates, their rates, and the bristle deflection ζ of the cart's friction;
/// with bristles in the joints, too, s = 3m.
/// Angles are absolute and measured from the normal of the rail, which rises at the angle α. With `b_jk = l_j a_k` for
/// j < k and `b_jj = J_j` the equations are
///
/// ```text
/// M_t ẍ - Σ a_j cos φ_j φ̈_j + Σ a_j sin φ_j φ̇_j² = u - (d_0 + e) ẋ - c_0 ζ - g M_t sin α
/// -a_j cos φ_j ẍ + Σ_k b_jk (cos(φ_j - φ_k) φ̈_k + sin(φ_j - φ_k) φ̇_k²) - g a_j sin(φ_j + α)
///     = τ_j - τ_{j+1} - q_j |φ̇_j| φ̇_j
/// τ_i = -d_i θ̇_i - c_i tanh(θ̇_i/ε),   θ̇_i = φ̇_i - φ̇_{i-1}
/// dζ/dx = (1 - ζ sgn ẋ)/δ
/// ```
///
/// with ζ_i of the joint instead of the tanh if it has a bristle, δ_i long. If the friction at rest is larger than in
/// motion, c_0 and c_i have a factor ([`stribeck::factor`]). Here
/// e is the damping by the motor's back-EMF, and q_j the air drag of link j. If the motion of the cart is imposed,
/// ẍ is given instead of the first equation; it is 0 for a cart that is clamped. A cart that reverses is held by its
/// friction until the bristle has reversed, too (P. R. Dahl, "Solid friction damping of mechanical
/// vibrations", AIAA Journal 14(12), 1976); with a friction model without memory it would creep instead.
#[derive(Debug, Clone)]
pub(crate) struct Model {
    pub(crate) layout: Layout,
    pub(crate) gravity: f64,
    /// δ of the cart (m) and ε of the joints (rad/s).
    pub(crate) smoothing: [f64; 2],
    /// Speed v (m/s) above which the dry friction of the cart is about constant, if it has no bristle: it is then
    /// `c_0 tanh(ẋ/v)`.
    pub(crate) creeping: Option<f64>,
    /// Excess of the friction at rest of the cart and of the joints, as a share of the friction in motion; not of
    /// joints that have a bristle.
    pub(crate) excess: [f64; 2],
    /// The largest excess of the joints that the record does not rule out.
    pub(crate) joints_excess_at_most: f64,
    /// Speed of the cart (m/s) and rate of the joints (rad/s) at which half of the excess is left.
    pub(crate) half_at: [f64; 2],
    /// Whether the cart's motion is imposed, by a drive or by a clamp.
    pub(crate) is_imposed: bool,
    /// Parts of an integration step.
    pub(crate) substeps: usize,
    /// Whether the friction of each joint has a bristle, as that of the cart has.
    pub(crate) has_bristles: bool,
}

/// Accelerations at one state, and their derivatives.
#[derive(Debug, Clone)]
pub(crate) struct Accelerations {
    /// Number of columns of `jacobian`: s, or s and the number of parameters of the motion.
    columns: usize,
    /// ẍ, φ̈_1 …, m entries.
    pub(crate) acceleration: Vec<f64>,
    /// Derivatives of the accelerations by state and parameters, m rows of `columns`.
    pub(crate) jacobian: Vec<f64>,
    /// L and D of the mass matrix, m×m: below the diagonal L, on it 1/D.
    factors: Vec<f64>,
    sine: Vec<f64>,
    cosine: Vec<f64>,
    /// Sine and cosine of the tilt.
    slope: (f64, f64),
    /// Of the cart, [`Model::cart_friction`]; of each joint, [`Model::friction`].
    cart_friction: [f64; 3],
    friction: Vec<[f64; 3]>,
}

impl Model {
    /// Number of coordinates, m.
    pub(crate) fn coordinates(&self) -> usize {
        self.layout.links + 1
    }

    /// Number of states, s.
    pub(crate) fn states(&self) -> usize {
        2 * self.coordinates() + self.contacts()
    }

    /// Number of bristles: that of the cart, and those of the joints.
    pub(crate) fn contacts(&self) -> usize {
        if self.has_bristles { self.coordinates() } else { 1 }
    }

    /// Length of a bristle (m, rad).
    pub(crate) fn bristle_length(&self, p: &[f64], contact: usize) -> f64 {
        contact.checked_sub(1).map_or(self.smoothing[0], |joint| p[self.layout.presliding(joint)])
    }

    /// `b_jk` (kg·m²).
    fn coupling(&self, p: &[f64], j: usize, k: usize) -> f64 {
        let (low, high) = (j.min(k), j.max(k));
        if low == high {
            return p[self.layout.second_moment(j)];
        }
        p[self.layout.length(low)] * p[self.layout.first_moment(high)]
    }

    /// Friction in a joint of the state `at` that turns at `rate` (rad/s): torque (N·m), its derivative by the rate,
    /// and the tanh or the bristle deflection.
    fn friction(&self, p: &[f64], at: &[f64], joint: usize, rate: f64) -> [f64; 3] {
        let smoothing = self.smoothing[1];
        let (viscous, dry) = (p[self.layout.viscous(joint + 1)], p[self.layout.dry(joint + 1)]);
        if self.has_bristles {
            let bristle = at[2 * self.coordinates() + 1 + joint];
            return [viscous * rate + dry * bristle, viscous, bristle];
        }
        let [factor, by_rate] = stribeck::factor(self.excess[1], self.half_at[1], rate);
        let direction = libm::tanh(rate / smoothing);
        let slope = factor * (1.0 - direction * direction) / smoothing + by_rate * direction;
        [viscous * rate + dry * factor * direction, viscous + dry * slope, factor * direction]
    }
}

impl Accelerations {
    /// Storage for derivatives by the state, and by the parameters if `parameters`.
    pub(crate) fn new(model: &Model, parameters: bool) -> Self {
        let m = model.coordinates();
        let columns = model.states() + if parameters { model.layout.of_motion() } else { 0 };
        Self {
            columns,
            acceleration: vec![0.0; m],
            jacobian: vec![0.0; m * columns],
            factors: vec![0.0; m * m],
            sine: vec![0.0; m],
            cosine: vec![0.0; m],
            slope: (0.0, 1.0),
            cart_friction: [0.0; 3],
            friction: vec![[0.0; 3]; m - 1],
        }
    }

    /// Accelerations at the state `at` with the parameters `p`.
    pub(crate) fn accelerate(&mut self, model: &Model, p: &[f64], at: &[f64], input: &CartForce) {
        let (n, m, layout) = (model.layout.links, model.coordinates(), model.layout);
        let (v, w, bristle) = (at[m], &at[m + 1..2 * m], at[2 * m]);
        self.slope = libm::sincos(p[layout.tilt()]);
        self.cart_friction = model.cart_friction(v, bristle);
        let (total, (slope_sine, slope_cosine)) = (p[Layout::TOTAL_MASS], self.slope);
        for j in 0..n {
            (self.sine[j], self.cosine[j]) = libm::sincos(at[1 + j]);
        }
        let (sine, cosine) = (&self.sine, &self.cosine);
        let right = &mut self.acceleration;
        self.factors[0] = total;
        right[0] = input.force
            - (p[layout.viscous(0)] + input.back_emf) * v
            - p[layout.dry(0)] * self.cart_friction[0]
            - model.gravity * total * slope_sine;
        let mut below = 0.0;
        for j in 0..n {
            let a = p[layout.first_moment(j)];
            right[0] -= a * sine[j] * w[j] * w[j];
            self.factors[(j + 1) * m] = -a * cosine[j];
            let mut torque = model.gravity * a * (sine[j] * slope_cosine + cosine[j] * slope_sine);
            for k in 0..n {
                let b = model.coupling(p, j, k);
                torque -= b * (sine[j] * cosine[k] - cosine[j] * sine[k]) * w[k] * w[k];
                if k <= j {
                    self.factors[(j + 1) * m + k + 1] = b * (cosine[j] * cosine[k] + sine[j] * sine[k]);
                }
            }
            self.friction[j] = model.friction(p, at, j, w[j] - below);
            let friction = self.friction[j][0];
            below = w[j];
            right[j + 1] = torque - friction - p[layout.drag(j)] * w[j].abs() * w[j];
            if j > 0 {
                right[j] += friction;
            }
        }
        if model.is_imposed {
            (self.factors[0], right[0]) = (1.0, input.force);
            for row in 1..m {
                right[row] -= core::mem::take(&mut self.factors[row * m]) * input.force;
            }
        }
        factorise(&mut self.factors, m);
        solve(&self.factors, m, 1, &mut self.acceleration);
    }

    /// Accelerations, and their derivatives: with the equations written r = 0, `-M⁻¹ ∂r`.
    pub(crate) fn differentiate(&mut self, model: &Model, p: &[f64], at: &[f64], input: &CartForce) {
        self.accelerate(model, p, at, input);
        self.jacobian.fill(0.0);
        self.by_state(model, p, at, input);
        if self.columns > model.states() {
            self.by_parameters(model, p, at, input);
        }
        if model.is_imposed {
            self.jacobian[..self.columns].fill(0.0);
            if self.columns > model.states() {
                self.by_travel(model, p, input);
            }
        }
        solve(&self.factors, model.coordinates(), self.columns, &mut self.jacobian);
    }

    /// `-∂r` by the state.
    fn by_state(&mut self, model: &Model, p: &[f64], at: &[f64], input: &CartForce) {
        let (n, m, layout, columns) = (model.layout.links, model.coordinates(), model.layout, self.columns);
        let w = &at[m + 1..2 * m];
        let (xdd, wdot) = (self.acceleration[0], &self.acceleration[1..]);
        let (sine, cosine, by) = (&self.sine, &self.cosine, &mut self.jacobian);
        let (slope_sine, slope_cosine) = self.slope;
        let [_, by_speed, by_bristle] = self.cart_friction;
        by[m] -= input.back_emf + p[layout.viscous(0)] + p[layout.dry(0)] * by_speed;
        by[2 * m] -= p[layout.dry(0)] * by_bristle;
        for j in 0..n {
            let (a, row) = (p[layout.first_moment(j)], (j + 1) * columns);
            by[1 + j] -= a * (sine[j] * wdot[j] + cosine[j] * w[j] * w[j]);
            by[m + 1 + j] -= 2.0 * a * sine[j] * w[j];
            by[row + 1 + j] +=
                model.gravity * a * (cosine[j] * slope_cosine - sine[j] * slope_sine) - a * sine[j] * xdd;
            for k in 0..n {
                let b = model.coupling(p, j, k);
                let along = b * (cosine[j] * cosine[k] + sine[j] * sine[k]);
                let across = b * (sine[j] * cosine[k] - cosine[j] * sine[k]);
                let turn = across * wdot[k] - along * w[k] * w[k];
                by[row + 1 + j] += turn;
                by[row + 1 + k] -= turn;
                by[row + m + 1 + k] -= 2.0 * across * w[k];
            }
            let slope = self.friction[j][1];
            by[row + m + 1 + j] -= slope + 2.0 * p[layout.drag(j)] * w[j].abs();
            if j > 0 {
                by[row + m + j] += slope;
                by[row - columns + m + 1 + j] += slope;
                by[row - columns + m + j] -= slope;
            }
            if model.has_bristles {
                let (dry, bristle) = (p[layout.dry(j + 1)], 2 * m + 1 + j);
                by[row + bristle] -= dry;
                if j > 0 {
                    by[row - columns + bristle] += dry;
                }
            }
        }
    }

    /// `-∂r` by the parameters.
    fn by_parameters(&mut self, model: &Model, p: &[f64], at: &[f64], input: &CartForce) {
        let (n, m, layout, columns) = (model.layout.links, model.coordinates(), model.layout, self.columns);
        let (v, w, s, gravity) = (at[m], &at[m + 1..2 * m], model.states(), model.gravity);
        let (xdd, wdot) = (self.acceleration[0], &self.acceleration[1..]);
        let (sine, cosine, by) = (&self.sine, &self.cosine, &mut self.jacobian);
        let (slope_sine, slope_cosine) = self.slope;
        by[s + Layout::TOTAL_MASS] -= xdd + gravity * slope_sine;
        by[s + layout.viscous(0)] -= v;
        by[s + layout.dry(0)] -= self.cart_friction[0];
        by[s + layout.tilt()] -= gravity * p[Layout::TOTAL_MASS] * slope_cosine;
        by[s + layout.delay()] += input.by_delay;
        by[s + layout.dead_zone()] += input.by_dead_zone;
        let mut below = 0.0;
        for j in 0..n {
            let (a, row) = (p[layout.first_moment(j)], (j + 1) * columns + s);
            let lever = sine[j] * slope_cosine + cosine[j] * slope_sine;
            let moment = layout.first_moment(j);
            by[s + moment] += cosine[j] * wdot[j] - sine[j] * w[j] * w[j];
            by[row + moment] += cosine[j] * xdd + gravity * lever;
            by[row + layout.second_moment(j)] -= wdot[j];
            by[row + layout.tilt()] += gravity * a * (cosine[j] * slope_cosine - sine[j] * slope_sine);
            for i in 0..j {
                let row_i = (i + 1) * columns + s;
                let along = cosine[i] * cosine[j] + sine[i] * sine[j];
                let across = sine[i] * cosine[j] - cosine[i] * sine[j];
                let on_i = along * wdot[j] + across * w[j] * w[j];
                let on_j = along * wdot[i] - across * w[i] * w[i];
                let length = layout.length(i);
                by[row_i + moment] -= p[length] * on_i;
                by[row + moment] -= p[length] * on_j;
                by[row_i + length] -= a * on_i;
                by[row + length] -= a * on_j;
            }
            let rate = w[j] - below;
            below = w[j];
            let direction = self.friction[j][2];
            by[row + layout.drag(j)] -= w[j].abs() * w[j];
            by[row + layout.viscous(j + 1)] -= rate;
            by[row + layout.dry(j + 1)] -= direction;
            if j > 0 {
                by[row - columns + layout.viscous(j + 1)] += rate;
                by[row - columns + layout.dry(j + 1)] += direction;
            }
        }
    }

    /// `-∂r` by the travel per step, to which an imposed acceleration is proportional.
    fn by_travel(&mut self, model: &Model, p: &[f64], input: &CartForce) {
        let (column, share) =
            (model.states() + model.layout.travel(), input.force / p[model.layout.travel()]);
        self.jacobian[column] = share;
        for (link, cosine) in self.cosine.iter().enumerate().take(model.layout.links) {
            self.jacobian[(link + 1) * self.columns + column] =
                p[model.layout.first_moment(link)] * cosine * share;
        }
    }

    /// Accelerations of the coordinates per unit of force on the cart and of torque in each joint, at the state of the
    /// last call: m×m, row by row.
    pub(crate) fn inputs(&self) -> Vec<f64> {
        let m = self.acceleration.len();
        let mut columns = vec![0.0; m * m];
        for i in 0..m {
            columns[i * m + i] = 1.0;
            if i > 1 {
                columns[(i - 1) * m + i] = -1.0;
            }
        }
        solve(&self.factors, m, m, &mut columns);
        columns
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::path::Path;

    use upright_design::plant::{ChainPlant, WideChainState};
    use upright_design::rig::Rig;

    use super::*;
    use crate::parameters::{SMOOTHING, priors};

    pub(crate) fn triple() -> (Model, Vec<f64>, ChainPlant<3>) {
        let rig = Rig::from_path(Path::new("../../rigs/triple-glueck-eder-kugi.toml")).unwrap();
        let chain = rig.chain().unwrap();
        let model = Model {
            layout: Layout { links: 3 },
            gravity: chain.gravity_m_per_s2,
            smoothing: SMOOTHING,
            creeping: None,
            excess: [0.3, 0.2],
            joints_excess_at_most: 0.0,
            half_at: stribeck::HALF_AT,
            is_imposed: false,
            substeps: 1,
            has_bristles: false,
        };
        let mut p: Vec<f64> = priors(&rig, chain, true).iter().map(|prior| prior.value).collect();
        (0..3).for_each(|link| p[Layout { links: 3 }.drag(link)] = 0.02);
        (model, p, ChainPlant::of(chain).unwrap())
    }

    const AT: [f64; 12] = [0.1, 2.0, -1.1, 0.4, -0.7, 3.0, -5.0, 1.5, 0.4, 0.9, -0.5, 0.2];

    #[test]
    fn without_dry_friction_and_tilt_it_is_the_plant() {
        let (model, mut p, plant) = triple();
        (0..=3).for_each(|contact| p[model.layout.dry(contact)] = 0.0);
        (0..3).for_each(|link| p[model.layout.drag(link)] = 0.0);
        let mut local = Accelerations::new(&model, false);
        local.accelerate(&model, &p, &AT, &CartForce { force: 17.0, ..CartForce::default() });
        let state = WideChainState { x: 0.1, xdot: -0.7, phi: [2.0, -1.1, 0.4], phidot: [3.0, -5.0, 1.5] };
        let rate = plant.derivative(&state, 17.0, &[0.0; 3]);
        let wanted = [rate.xdot, rate.phidot[0], rate.phidot[1], rate.phidot[2]];
        for (found, wanted) in local.acceleration.iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-9 * wanted.abs(), "{found} {wanted}");
        }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        derivatives_agree(false, false);
        derivatives_agree(true, false);
        derivatives_agree(false, true);
    }

    fn derivatives_agree(has_bristles: bool, is_imposed: bool) {
        let (mut model, mut p, _) = triple();
        (model.has_bristles, model.is_imposed) = (has_bristles, is_imposed);
        p[model.layout.tilt()] = 0.1;
        let mut exact = Accelerations::new(&model, true);
        exact.differentiate(
            &model,
            &p,
            &AT,
            &CartForce { force: 17.0, by_delay: 2.0, by_dead_zone: -3.0, back_emf: 0.7, jump: 0.0 },
        );
        let states = model.states();
        let columns = states + model.layout.of_motion();
        let mut other = Accelerations::new(&model, false);
        let mut at = |p: &[f64], state: &[f64], force: f64| {
            other.accelerate(&model, p, state, &CartForce { force, back_emf: 0.7, ..CartForce::default() });
            other.acceleration.clone()
        };
        for column in 0..columns {
            let mut ends = [1.0, -1.0].map(|sign| {
                let (mut p, mut state, mut force) = (p.clone(), AT.to_vec(), 17.0);
                let step = if column < states { 1e-6 } else { 1e-6 * p[column - states].abs().max(1e-2) };
                match column.checked_sub(states) {
                    None => state[column] += sign * step,
                    Some(index) if is_imposed && index == model.layout.travel() => force *= 1.0 + sign * step,
                    Some(index) if is_imposed && index >= model.layout.delay() => {}
                    Some(index) if index == model.layout.delay() => force += sign * step * 2.0,
                    Some(index) if index == model.layout.dead_zone() => force -= sign * step * 3.0,
                    Some(index) => p[index] += sign * step,
                }
                at(&p, &state, force).into_iter().map(|value| value / (2.0 * step)).collect::<Vec<_>>()
            });
            let low = std::mem::take(&mut ends[1]);
            for (row, (high, low)) in ends[0].iter().zip(low).enumerate() {
                let (found, wanted) = (exact.jacobian[row * columns + column], high - low);
                assert!(
                    (found - wanted).abs() < 1e-5 * (1.0 + wanted.abs()),
                    "{row} {column}: {found} {wanted}"
                );
            }
        }
    }
}
