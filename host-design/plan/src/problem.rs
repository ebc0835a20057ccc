//! The problem that a trajectory solves: ends, limits, cost.

use super::dynamics::Dynamics;
use upright_design::number::rounded;
use upright_design::numerics::Matrix;

/// Bounds of a trajectory. Each holds at every knot.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bounds {
    /// Name of what the drive imposes.
    pub(crate) name: &'static str,
    /// Largest force (N) or acceleration (m/s²).
    pub(crate) input: f64,
    /// Force of the motor at standstill (N) and its loss by back-EMF (N·s/m): `|u + loss ẋ| <= force`.
    pub(crate) motor: Option<[f64; 2]>,
    /// Largest speed of the cart (m/s).
    pub(crate) speed_m_per_s: Option<f64>,
    /// Speed above that of the cart which a drive with lag is commanded per acceleration (s); it is limited, too.
    pub(crate) lead_s: f64,
    /// Ends of the rail (m).
    pub(crate) rail_m: Option<[f64; 2]>,
}

/// One linear limit: `position x + speed ẋ + input u <= bound`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlanLimit {
    pub(crate) position: f64,
    pub(crate) speed: f64,
    pub(crate) input: f64,
    pub(crate) bound: f64,
    /// Name of the limit for a user.
    pub(crate) name: &'static str,
}

impl PlanLimit {
    /// Distance of a state and an input from the limit; negative beyond it.
    pub(crate) fn room(&self, x: &[f64], u: f64) -> f64 {
        self.bound - self.position * x[0] - self.speed * x[1] - self.input * u
    }
}

impl Bounds {
    /// All bounds, each as one-sided limits.
    pub(crate) fn limits(&self) -> Vec<PlanLimit> {
        let free = PlanLimit { position: 0.0, speed: 0.0, input: 0.0, bound: 0.0, name: "" };
        let mut limits = Vec::new();
        for sign in [1.0, -1.0] {
            limits.push(PlanLimit { input: sign, bound: self.input, name: self.name, ..free });
            if let Some([stall, loss]) = self.motor {
                limits.push(PlanLimit {
                    input: sign,
                    speed: sign * loss,
                    bound: stall,
                    name: "motor voltage",
                    ..free
                });
            }
            if let Some(speed) = self.speed_m_per_s {
                let input = sign * self.lead_s;
                limits.push(PlanLimit { speed: sign, input, bound: speed, name: "cart speed", ..free });
            }
            if let Some([low, high]) = self.rail_m {
                let bound = if sign > 0.0 { high } else { -low };
                limits.push(PlanLimit { position: sign, bound, name: "rail", ..free });
            }
        }
        limits
    }

    /// The bounds multiplied by a factor.
    #[must_use]
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self {
            name: self.name,
            input: self.input * factor,
            motor: self.motor.map(|[stall, loss]| [stall * factor, loss]),
            speed_m_per_s: self.speed_m_per_s.map(|speed| speed * factor),
            lead_s: self.lead_s,
            rail_m: self.rail_m.map(|ends| ends.map(|end| end * factor)),
        }
    }
}

/// A trajectory from one state of rest to another.
pub(crate) struct TrajectoryProblem<'a> {
    pub(crate) dynamics: &'a dyn Dynamics,
    /// Time between knots (s) and number of steps.
    pub(crate) knot_s: f64,
    pub(crate) steps: usize,
    pub(crate) start: Vec<f64>,
    pub(crate) end: Vec<f64>,
    pub(crate) limits: Vec<PlanLimit>,
    /// Cost per second: `xᵀ Q x + r_u u² + r_du u̇²`.
    pub(crate) state_weights: Matrix<f64>,
    pub(crate) input_weight: f64,
    pub(crate) rate_weight: f64,
}

/// States at the knots (steps + 1) and inputs at the knots (steps + 1), linear between them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Knots {
    pub(crate) x: Vec<Vec<f64>>,
    pub(crate) u: Vec<f64>,
}

impl Knots {
    /// The knots rounded as they are stored, so that a stored file gives the same motion to the last bit.
    pub(crate) fn rounded(&self) -> Self {
        let round = |values: &Vec<f64>| values.iter().map(|&value| rounded(value, DIGITS)).collect();
        Self { x: self.x.iter().map(round).collect(), u: round(&self.u) }
    }
}

/// Significant digits of stored numbers: few are enough, as the refinement only starts from them.
const DIGITS: usize = 9;
