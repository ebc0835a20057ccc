//! How fast a drive that imposes the cart's acceleration has to follow its command.

use core::fmt;
use core::ops::RangeInclusive;

use super::Design;
use crate::numerics::{Matrix, Real, exponential, spectral_radius};
use crate::rig::Rig;

/// Damping ratio of a servo of second order.
const SERVO_DAMPING: f64 = 0.7;
/// Fastest and slowest drive that are tried (Hz), and the ratio from one to the next.
const SPEEDS_HZ: [f64; 2] = [5e3, 0.1];
const RATIO: f64 = 1.03;

/// How slow the drive may be, and how fast, for the linear loop of the LQR, without integral action, to be stable.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct DriveLimits {
    /// Least resonance of a step motor with the cart (Hz), with the damping of `[reality]`; none for a servo with a
    /// bandwidth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resonance_hz: Option<f64>,
    /// Least bandwidth of a servo that follows its speed with a lag of first order (Hz).
    pub bandwidth_hz: f64,
    /// Least natural frequency of a servo that follows its speed as a system of second order with the damping ratio 0.7
    /// (Hz); none if the design makes up for a lag.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub second_order_hz: Option<f64>,
    /// Largest one of first order, for a design that makes up for a lag; none if a servo without lag is stable, too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest_bandwidth_hz: Option<f64>,
}

impl DriveLimits {
    /// The limits of `design` for `rig`; none with another kind of drive, without LQR or observer, or where the drive
    /// that was designed for is not stable: the fastest one, or that with the file's bandwidth.
    pub fn of(rig: &Rig, design: &Design<f64>) -> Option<Self> {
        let drive = rig.actuator.pulses()?;
        let of = |follower: Follower| is_stable(rig, design, follower).unwrap_or(false);
        let servo = |rate: f64| of(Follower::Spring([0.0, rate]));
        let damping = 0.01 * rig.reality.step_motor.motor_damping_percent;
        let motor = |rate: f64| of(Follower::Spring([rate * rate, 2.0 * damping * rate]));
        let second_order = |rate: f64| of(Follower::SecondOrder(rate));
        let [fastest_hz, slowest_hz] = SPEEDS_HZ;
        let Some(designed_hz) = drive.bandwidth_hz else {
            return Some(Self {
                resonance_hz: Some(last_stable(fastest_hz, slowest_hz, motor)?),
                bandwidth_hz: last_stable(fastest_hz, slowest_hz, servo)?,
                second_order_hz: last_stable(fastest_hz, slowest_hz, second_order),
                largest_bandwidth_hz: None,
            });
        };
        let largest_hz = last_stable(designed_hz, fastest_hz.max(designed_hz), servo)?;
        Some(Self {
            resonance_hz: None,
            second_order_hz: None,
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

/// How a drive follows the commanded position x_c and speed v_c.
#[derive(Debug, Clone, Copy)]
enum Follower {
    /// With the acceleration `stiffness (x_c - x) + damping (v_c - v)`.
    Spring([f64; 2]),
    /// With an acceleration a that follows as `ȧ = ω² (v_c - v) - 2 ζ ω a`.
    SecondOrder(f64),
}

impl Follower {
    /// The plant with further states: a (with a spring, one that decays), x_c and v_c.
    fn moving(self, design: &Design<f64>) -> Matrix<f64> {
        let s = design.a.rows();
        let (acceleration, x_c, v_c) = (s, s + 1, s + 2);
        let b = design.b.above(&Matrix::zeros(3, 1));
        let mut follows = Matrix::zeros(1, s + 3);
        let mut moving = Matrix::zeros(s + 3, s + 3).with_block(0, 0, &design.a);
        moving[(acceleration, acceleration)] = -1.0;
        let depends_on_position = match self {
            Self::Spring([stiffness, damping]) => {
                for (column, gain) in [(0, -stiffness), (1, -damping), (x_c, stiffness), (v_c, damping)] {
                    follows[(0, column)] = gain;
                }
                stiffness != 0.0
            }
            Self::SecondOrder(rate) => {
                follows[(0, acceleration)] = 1.0;
                let gains =
                    [(1, -rate * rate), (v_c, rate * rate), (acceleration, -2.0 * SERVO_DAMPING * rate)];
                for (column, gain) in gains {
                    moving[(acceleration, column)] = gain;
                }
                false
            }
        };
        moving = &moving + &(&b * &follows);
        moving[(x_c, v_c)] = 1.0;
        if !depends_on_position {
            // Nothing depends on the real position: its own integrator must not look like a loop that is not stable.
            moving[(0, 0)] = -1.0;
        }
        moving
    }
}

/// Whether the loop is stable with this drive.
///
/// The state is the plant's, the drive's, and the observer's prediction x̂⁻. In each tick, with x̂ the corrected
/// estimate and `a = -K x̂`, the command begins at `x̂_0 + lag x̂_1` and has the speed `x̂_1 + lead a`.
fn is_stable(rig: &Rig, design: &Design<f64>, follower: Follower) -> Option<bool> {
    let (law, kalman) = (design.sampled.lqr.as_ref()?, design.kalman.as_ref()?);
    let (s, period_s) = (design.a.rows(), rig.tick.period_s);
    let real = s + 1;
    let after = exponential(&follower.moving(design).scaled(&period_s));
    // Rows of x̂ and of the command's speed, from the real state and x̂⁻.
    let corrected = &kalman.l_filter * &rig.measurement();
    let estimate = corrected.beside(&Matrix::zeros(s, 1)).beside(&(&Matrix::identity(s) - &corrected));
    let drive = rig.actuator.pulses()?;
    let mut speed = law.k.scaled(&-drive.lead_s(period_s));
    speed[(0, 1)] += 1.0;
    let speed = &speed * &estimate;
    let row = |row: usize| estimate.block(row, 0, 1, real + s);
    let begin = &row(0) + &row(1).scaled(&drive.lag_s());
    let plant = after.block(0, 0, real, real).beside(&Matrix::zeros(real, s));
    let plant = &(&plant + &(&after.block(0, real, real, 1) * &begin))
        + &(&after.block(0, real + 1, real, 1) * &speed);
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
        if let Some(second_order_hz) = self.second_order_hz {
            write!(f, " ({second_order_hz:.1} Hz of second order)")?;
        }
        self.largest_bandwidth_hz.map_or(Ok(()), |largest_hz| write!(f, ", at most {largest_hz:.1} Hz"))
    }
}
