//! Linear limits in an interior-point method: a slack and a multiplier for every limit at every knot.

use super::problem::{Knots, PlanLimit};
use super::riccati::Stage;

/// Slack s > 0 and multiplier ν > 0 of each limit, knot by knot.
#[derive(Debug, Clone)]
pub(crate) struct Slacks {
    s: Vec<Vec<f64>>,
    nu: Vec<Vec<f64>>,
}

/// Changes of slacks and multipliers.
pub(crate) struct SlackStep {
    s: Vec<Vec<f64>>,
    nu: Vec<Vec<f64>>,
}

/// Largest share of the distance to the boundary that a step may cover.
const TO_BOUNDARY: f64 = 0.99;

impl Slacks {
    /// Slacks as large as the room that the knots leave, but at least a tenth of the bound; multipliers for the
    /// barrier parameter `mu`.
    pub(crate) fn new(limits: &[PlanLimit], knots: &Knots, mu: f64) -> Self {
        let slack = |limit: &PlanLimit, x: &[f64], u: f64| limit.room(x, u).max(0.1 * limit.bound);
        let s: Vec<Vec<f64>> = knots
            .x
            .iter()
            .zip(&knots.u)
            .map(|(x, &u)| limits.iter().map(|limit| slack(limit, x, u)).collect())
            .collect();
        let nu = s.iter().map(|s| s.iter().map(|s| mu / s).collect()).collect();
        Self { s, nu }
    }

    /// The same slacks with the multipliers for the barrier parameter `mu`.
    pub(crate) fn centred(&self, mu: f64) -> Self {
        let nu = self.s.iter().map(|s| s.iter().map(|s| mu / s).collect()).collect();
        Self { s: self.s.clone(), nu }
    }

    /// Mean of s ν.
    pub(crate) fn complementarity(&self) -> f64 {
        let products = self.s.iter().flatten().zip(self.nu.iter().flatten()).map(|(s, nu)| s * nu);
        let count = self.s.iter().map(Vec::len).sum::<usize>();
        products.sum::<f64>() / count.max(1) as f64
    }

    /// Largest difference between a slack and the room that the knots leave, relative to the bound.
    pub(crate) fn infeasibility(&self, limits: &[PlanLimit], knots: &Knots) -> f64 {
        let mut largest: f64 = 0.0;
        for ((x, &u), s) in knots.x.iter().zip(&knots.u).zip(&self.s) {
            for (limit, s) in limits.iter().zip(s) {
                largest = largest.max((limit.room(x, u) - s).abs() / limit.bound);
            }
        }
        largest
    }

    /// `- Σ ln s`.
    pub(crate) fn barrier(&self) -> f64 {
        -self.s.iter().flatten().map(|&s| libm::log(s)).sum::<f64>()
    }

    /// Adds the limits of knot `knot` to the cost of its stage, for the barrier parameter `mu`. The force is the last
    /// entry of z.
    pub(crate) fn add_to(
        &self,
        limits: &[PlanLimit],
        knots: &Knots,
        knot: usize,
        mu: f64,
        stage: &mut Stage,
    ) {
        let force = stage.q_linear.len() - 1;
        let (x, u) = (&knots.x[knot], knots.u[knot]);
        for ((limit, s), nu) in limits.iter().zip(&self.s[knot]).zip(&self.nu[knot]) {
            let left = limit.room(x, u) - s;
            let (weight, slope) = (nu / s, mu / s - nu / s * left);
            let along = [(0, limit.position), (1, limit.speed), (force, limit.input)];
            for (i, a) in along {
                stage.q_linear[i] += slope * a;
                for (j, b) in along {
                    stage.q[(i, j)] += weight * a * b;
                }
            }
        }
    }

    /// The step that belongs to the change `z` of states and forces, and the largest shares of it that keep the slacks
    /// and the multipliers positive.
    pub(crate) fn step(
        &self,
        limits: &[PlanLimit],
        knots: &Knots,
        z: &[Vec<f64>],
        mu: f64,
    ) -> (SlackStep, f64, f64) {
        let mut step = SlackStep { s: Vec::new(), nu: Vec::new() };
        let (mut most_s, mut most_nu) = (1.0f64, 1.0f64);
        for (knot, z) in z.iter().enumerate() {
            let (x, u) = (&knots.x[knot], knots.u[knot]);
            let (mut ds, mut dnu) = (Vec::new(), Vec::new());
            for ((limit, &s), &nu) in limits.iter().zip(&self.s[knot]).zip(&self.nu[knot]) {
                let moved = limit.position * z[0] + limit.speed * z[1] + limit.input * z[z.len() - 1];
                let change = limit.room(x, u) - s - moved;
                let change_nu = mu / s - nu - nu / s * change;
                if change < 0.0 {
                    most_s = most_s.min(-TO_BOUNDARY * s / change);
                }
                if change_nu < 0.0 {
                    most_nu = most_nu.min(-TO_BOUNDARY * nu / change_nu);
                }
                ds.push(change);
                dnu.push(change_nu);
            }
            step.s.push(ds);
            step.nu.push(dnu);
        }
        (step, most_s, most_nu)
    }

    /// The slacks after a share of a step.
    pub(crate) fn moved(&self, step: &SlackStep, share_s: f64, share_nu: f64) -> Self {
        let moved = |from: &[Vec<f64>], by: &[Vec<f64>], share: f64| {
            from.iter()
                .zip(by)
                .map(|(from, by)| from.iter().zip(by).map(|(a, b)| a + share * b).collect())
                .collect()
        };
        Self { s: moved(&self.s, &step.s, share_s), nu: moved(&self.nu, &step.nu, share_nu) }
    }
}
