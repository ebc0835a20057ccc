//! Stability with a tick other than the designed one: longer, shorter, or with jitter.

use serde::Serialize;

use super::loop_model::{ControllerModel, LoopModel, Numbers, PlantModel};
use super::margins::{Grid, first_failure};
use super::{VerifyError, radius};
use upright_design::design::{Certified, integrated_quadratic};
use upright_design::numerics::Matrix;

/// Limits on the tick for an unchanged table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TickLimits {
    /// Longest period (s) up to which the loop stays stable when the same table runs slower than it was designed for,
    /// the plant sampled at that period; none: stable up to 30 times the tick.
    pub longest_stable_s: Option<f64>,
    /// The unstable period just above it (s): the bisection ends there.
    pub shortest_unstable_s: Option<f64>,
    /// Shortest period (s) down to which it stays stable when the table runs faster; none: down to a thirtieth.
    pub shortest_stable_s: Option<f64>,
    /// Jitter (ticks) that is tolerated: each force may be late by any time up to this, differently in every tick.
    /// By the small-gain criterion of Kao and Lincoln: sufficient only.
    pub jitter_ticks: f64,
    /// Tolerated jitter (s).
    pub jitter_s: f64,
    /// Delay in whole ticks that may vary freely between 0 and this many, by the criterion for sampled loops
    /// `N |T(z)| |z - 1| < 1`; sufficient only.
    pub varying_delay_ticks: f64,
}

/// The loop with the same table run every `period` seconds.
pub(super) fn loop_at(certified: &Certified, numbers: &Numbers<f64>, period: f64) -> LoopModel<f64> {
    let (a, b) = certified.double.driven();
    let plant = PlantModel::delayed(&a, &b, period, numbers.delay_ticks() as f64, &numbers.c);
    LoopModel::of(&plant, &ControllerModel::of(numbers))
}

/// Limits on the tick of a stable loop.
///
/// Jitter (C.-Y. Kao, B. Lincoln, *Automatica* 40, 2004, theorem for continuous plants and sampled controllers): a
/// force late by δ < J ticks differs from the one in time by `u(k) - u(k-1)` for at most J h seconds, so
/// `‖w‖₂ <= √(J h) ‖u(k) - u(k-1)‖₂`. With h(z) from impulses on the states to u and `W = ∫₀ʰ e^(Aτ) B Bᵀ e^(Aᵀτ) dτ`
/// (their sum over aliases, in closed form) the loop from w to u(k) - u(k-1) has the gain
/// `|z - 1| √(h(z) W h(z)*)`, and the small-gain theorem requires
///
/// ```text
/// J h max |z - 1|² h(z) W h(z)* < 1,   J <= 1
/// ```
///
/// and, for J = N + g beyond one tick, the same with `(N² + 2 N g + g)` in place of J.
pub(super) fn limits(
    certified: &Certified,
    numbers: &Numbers<f64>,
    grid: &Grid<'_>,
    tick_s: f64,
) -> Result<TickLimits, VerifyError> {
    let unstable = |period: f64| Ok(radius(&loop_at(certified, numbers, period))? >= 1.0);
    let longer = first_failure(unstable, |i| tick_s * 1.02f64.powi(i as i32), 172, 1e-9)?;
    let shorter = first_failure(unstable, |i| tick_s * 0.96f64.powi(i as i32), 84, 1e-9)?;

    let (a, b) = certified.double.driven();
    let spread = integrated_quadratic(&a.transpose(), &(&b * &b.transpose()), &tick_s);
    let difference = |omega: f64| 2.0 * (0.5 * omega).sin();
    let (_, gain) = grid.maximum(|omega, r| {
        let (re, im): (Vec<f64>, Vec<f64>) = r.kick_to_force.iter().map(|h| (h.re, h.im)).unzip();
        let power = quadratic(&spread, &re) + quadratic(&spread, &im);
        difference(omega) * (tick_s * power.max(0.0)).sqrt()
    });
    let (_, whole) = grid.maximum(|omega, r| difference(omega) * r.t.norm_sqr().sqrt());
    let jitter_ticks = jitter(1.0 / (gain * gain));
    Ok(TickLimits {
        longest_stable_s: longer.map(|bracket| bracket.0),
        shortest_unstable_s: longer.map(|bracket| bracket.1),
        shortest_stable_s: shorter.map(|bracket| bracket.0),
        jitter_ticks,
        jitter_s: jitter_ticks * tick_s,
        varying_delay_ticks: 1.0 / whole,
    })
}

/// The J = N + g with `N² + 2 N g + g = squared`.
fn jitter(squared: f64) -> f64 {
    let whole = squared.sqrt().floor();
    whole + (squared - whole * whole) / (2.0 * whole + 1.0)
}

fn quadratic(matrix: &Matrix<f64>, x: &[f64]) -> f64 {
    let row = |i: usize| x.iter().enumerate().map(|(j, x)| matrix[(i, j)] * x).sum::<f64>();
    x.iter().enumerate().map(|(i, x)| x * row(i)).sum()
}
