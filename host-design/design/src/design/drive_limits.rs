//! How fast a drive that imposes the cart's acceleration has to follow its command.

use core::fmt;
use core::ops::RangeInclusive;

use super::Design;
use crate::numerics::{Matrix, Real, exponential, spectral_radius};
use crate::rig::Rig;

/// Damping ratio of a step motor's resonance.
const DAMPING: f64 = 0.1;
/// Fastest and slowest drive that are tried (Hz), and the ratio from one to the next.
const SPEEDS_HZ: [f64; 2] = [5e3, 0.1];
const RATIO: f64 = 1.03;

/// How slow the drive may be, and how fast, for the linear loop of the LQR, without integral action, to be stable.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct DriveLimits {
    /// Least resonance of a step motor with the cart (Hz); none for a servo with a bandwidth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resonance_hz: Option<f64>,
    /// Least bandwidth of a servo that follows its speed with a lag of first order (Hz).
    pub bandwidth_hz: f64,
    /// Largest one, for a design that makes up for a lag; none if a servo without lag is stable, too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest_bandwidth_hz: Option<f64>,
}

impl DriveLimits {
    /// The limits of `design` for `rig`; none with another kind of drive, without LQR or observer, or where the drive
    /// that was designed for is not stable: the fastest one, or that with the file's bandwidth.
    pub fn of(rig: &Rig, design: &Design<f64>) -> Option<Self> {
        let drive = rig.actuator.acceleration.as_ref()?;
        let servo = |rate: f64| is_stable(rig, design, [0.0, rate]).unwrap_or(false);
        let motor = |rate: f64| is_stable(rig, design, [rate * rate, 2.0 * DAMPING * rate]).unwrap_or(false);
        let [fastest_hz, slowest_hz] = SPEEDS_HZ;
        let Some(designed_hz) = drive.bandwidth_hz else {
            return Some(Self {
                resonance_hz: Some(last_stable(fastest_hz, slowest_hz, motor)?),
                bandwidth_hz: last_stable(fastest_hz, slowest_hz, servo)?,
                largest_bandwidth_hz: None,
            });
        };
        let largest_hz = last_stable(designed_hz, fastest_hz.max(designed_hz), servo)?;
        Some(Self {
            resonance_hz: None,
            bandwidth_hz: last_stable(designed_hz, slowest_hz.min(designed_hz), servo)?,
            largest_bandwidth_hz: Some(largest_hz).filter(|&largest_hz| largest_hz * RATIO < fastest_hz),
        })
    }

    /// The bandwidths (Hz) with which the loop is stable.
    pub fn bandwidths_hz(&self) -> RangeInclusive<f64> {
        self.bandwidth_hz..=self.largest_bandwidth_hz.unwrap_or(f64::INFINITY)
    }
}

/// The last drive (Hz) on the way from one to another, before the first one that is not stable; `is_stable` takes 2π
/// times that. None if already the first is not.
fn last_stable(from_hz: f64, to_hz: f64, is_stable: impl Fn(f64) -> bool) -> Option<f64> {
    let steps = ((to_hz / from_hz).ln().abs() / RATIO.ln()).floor() as i32;
    let ratio = if to_hz > from_hz { RATIO } else { 1.0 / RATIO };
    let tried_hz = (0..=steps).map(|step| from_hz * ratio.powi(step));
    tried_hz.take_while(|hz| is_stable(core::f64::consts::TAU * hz)).last()
}

/// Whether the loop is stable if the drive gives the cart the acceleration
/// `stiffness (x_c - x) + damping (v_c - v)` for the commanded position x_c and speed v_c.
///
/// The state is the plant's, and the observer's prediction x̂⁻. In each tick, with x̂ the corrected estimate and
/// `a = -K x̂`, the command begins at `x̂_0 + lag x̂_1` and has the speed `x̂_1 + lead a`.
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
    let corrected = &kalman.l_filter * &rig.measurement();
    let estimate = corrected.beside(&(&Matrix::identity(s) - &corrected));
    let drive = rig.actuator.acceleration.as_ref()?;
    let mut speed = law.k.scaled(&-drive.lead_s(period_s));
    speed[(0, 1)] += 1.0;
    let speed = &speed * &estimate;
    let begin = &estimate.block(0, 0, 1, 2 * s) + &estimate.block(1, 0, 1, 2 * s).scaled(&drive.lag_s());
    let plant = after.block(0, 0, s, s).beside(&Matrix::zeros(s, s));
    let plant = &(&plant + &(&after.block(0, s, s, 1) * &begin)) + &(&after.block(0, s + 1, s, 1) * &speed);
    let predicted = &(&design.ad - &(&design.bd * &law.k)) * &estimate;
    Some(spectral_radius(&plant.above(&predicted)).ok()? < f64::one())
}

/// What the drive has to be, in words.
impl fmt::Display for DriveLimits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(resonance_hz) = self.resonance_hz {
            write!(f, "resonance at least {resonance_hz:.1} Hz, or ")?;
        }
        write!(f, "a servo with a bandwidth of at least {:.1} Hz", self.bandwidth_hz)?;
        self.largest_bandwidth_hz.map_or(Ok(()), |largest_hz| write!(f, ", at most {largest_hz:.1} Hz"))
    }
}
