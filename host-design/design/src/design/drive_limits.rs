//! How fast a drive that imposes the cart's acceleration has to follow its command.

use super::Design;
use crate::numerics::{Matrix, Real, exponential, spectral_radius};
use crate::rig::Rig;

/// Damping ratio of a step motor's resonance.
const DAMPING: f64 = 0.1;
/// Fastest and slowest drive that are tried (Hz), and the ratio from one to the next.
const SPEEDS_HZ: [f64; 2] = [5e3, 0.1];
const RATIO: f64 = 1.03;

/// The slowest drives with which the linear loop of the LQR, without integral action, is stable; the design does not
/// know that they are slow.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct DriveLimits {
    /// Least resonance of a step motor with the cart (Hz).
    pub resonance_hz: f64,
    /// Least bandwidth of a servo that follows its speed with a lag of first order (Hz).
    pub bandwidth_hz: f64,
}

impl DriveLimits {
    /// The limits of `design` for `rig`; none with another kind of drive, without LQR or observer, or where even the
    /// fastest drive is too slow.
    pub fn of(rig: &Rig, design: &Design<f64>) -> Option<Self> {
        rig.actuator.acceleration.as_ref()?;
        Some(Self {
            resonance_hz: slowest(|rate| {
                is_stable(rig, design, [rate * rate, 2.0 * DAMPING * rate]).unwrap_or(false)
            })?,
            bandwidth_hz: slowest(|rate| is_stable(rig, design, [0.0, rate]).unwrap_or(false))?,
        })
    }
}

/// The slowest drive (Hz) above which all that are tried are stable; `is_stable` takes 2π times that.
fn slowest(is_stable: impl Fn(f64) -> bool) -> Option<f64> {
    let [fastest, slowest] = SPEEDS_HZ;
    let mut found = None;
    let mut tried_hz = fastest;
    while tried_hz > slowest && is_stable(core::f64::consts::TAU * tried_hz) {
        found = Some(tried_hz);
        tried_hz /= RATIO;
    }
    found
}

/// Whether the loop is stable if the drive gives the cart the acceleration
/// `stiffness (x_c - x) + damping (v_c - v)` for the commanded position x_c and speed v_c.
///
/// The state is the plant's, and the observer's prediction x̂⁻. In each tick, with x̂ the corrected estimate and
/// `a = -K x̂`, the command begins at x̂_0 and has the speed `x̂_1 + a T/2`.
fn is_stable(rig: &Rig, design: &Design<f64>, [stiffness, damping]: [f64; 2]) -> Option<bool> {
    let (law, kalman) = (design.sampled.lqr.as_ref()?, design.kalman.as_ref()?);
    let (s, period_s) = (design.a.rows(), rig.tick.period_s);
    let mut follows = Matrix::zeros(1, s + 2);
    for (column, gain) in [(0, -stiffness), (1, -damping), (s, stiffness), (s + 1, damping)] {
        follows[(0, column)] = gain;
    }
    let mut moving = Matrix::zeros(s + 2, s + 2).with_block(0, 0, &design.a);
    moving = &moving + &(&design.b.above(&Matrix::zeros(2, 1)) * &follows);
    moving[(s, s + 1)] = 1.0;
    if stiffness == 0.0 {
        // Nothing depends on the real position: its own integrator must not look like a loop that is not stable.
        moving[(0, 0)] = -1.0;
    }
    let after = exponential(&moving.scaled(&period_s));
    // Rows of x̂ and of the command's speed, from the plant's state and x̂⁻.
    let sensors = rig.sensors();
    let c = Matrix::from_fn(sensors.len(), s, |i, j| f64::from(u8::from(sensors[i].state == j)));
    let corrected = &kalman.l_filter * &c;
    let estimate = corrected.beside(&(&Matrix::identity(s) - &corrected));
    let mut speed = law.k.scaled(&(-0.5 * period_s));
    speed[(0, 1)] += 1.0;
    let speed = &speed * &estimate;
    let begin = estimate.block(0, 0, 1, 2 * s);
    let plant = after.block(0, 0, s, s).beside(&Matrix::zeros(s, s));
    let plant = &(&plant + &(&after.block(0, s, s, 1) * &begin)) + &(&after.block(0, s + 1, s, 1) * &speed);
    let predicted = &(&design.ad - &(&design.bd * &law.k)) * &estimate;
    Some(spectral_radius(&plant.above(&predicted)).ok()? < f64::one())
}
