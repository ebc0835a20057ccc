//! Characteristic figures of a run.

use core::fmt;

use serde::{Deserialize, Serialize};
use upright::supervision::fault::Fault;

use super::scenario::Scenario;
use super::trace::Trace;
use crate::number::significant;
use crate::plant::absolute_angles;
use crate::rig::{Base, CartInput, PlantDescription, Quantity, Rig};

/// Loss of balance, which ends a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Fall {
    /// Time of the fall (s).
    pub at_s: f64,
    /// Kind of the fall.
    pub kind: FallKind,
}

/// Kind of a loss of balance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FallKind {
    /// This link (from 1) leans further than the horizontal.
    Link(usize),
    /// The cart left its rail.
    EndOfRail,
    /// A state of a linear model grew beyond a million.
    Diverged,
    /// A state is NaN or infinite.
    NotFinite,
    /// The firmware turned the motor off, with this fault.
    MotorOff(Fault),
    /// The firmware never let the motor balance: it refused to arm, or the motor could not push the cart to check its
    /// sign.
    NotArmed,
}

impl Fall {
    /// The fall at the time `at_s`, if `state` is one: a link below the horizontal, the cart off its rail, a model's
    /// state beyond a million, or a value that is not finite.
    pub fn of(rig: &Rig, at_s: f64, state: &[f64]) -> Option<Self> {
        let is_finite = state.iter().fold(true, |all, value| all & value.is_finite());
        let kind = match &rig.plant {
            _ if !is_finite => FallKind::NotFinite,
            PlantDescription::Chain(chain) => {
                let is_up = |angle: f64| angle.abs() <= core::f64::consts::FRAC_PI_2;
                let [left, right] = chain.cart.travel_m;
                // Without branches, because nearly always all links are up.
                if !absolute_angles(state).fold(true, |all, angle| all & is_up(angle)) {
                    FallKind::Link(1 + absolute_angles(state).take_while(|&angle| is_up(angle)).count())
                } else if state[0] < left || state[0] > right {
                    FallKind::EndOfRail
                } else {
                    return None;
                }
            }
            PlantDescription::Model(_) if state.iter().any(|value| value.abs() > 1e6) => FallKind::Diverged,
            PlantDescription::Model(_) => return None,
        };
        Some(Self { at_s, kind })
    }
}

impl fmt::Display for Fall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} at {:.3} s", self.kind, self.at_s)
    }
}

impl fmt::Display for FallKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Link(link) => write!(f, "link {link} fell"),
            Self::EndOfRail => f.write_str("the cart left its rail"),
            Self::Diverged => f.write_str("the state diverged"),
            Self::NotFinite => f.write_str("the state is no longer finite"),
            Self::MotorOff(fault) => write!(f, "fault {fault}"),
            Self::NotArmed => f.write_str("not armed"),
        }
    }
}

/// Share of the speed at which a motor has voltage left from which on it counts as reached.
const SPENT: f64 = 0.9;

/// Figures of one run. The settling band is 2 % of the step around the set-point, and at least 1 mm (of the output, for
/// a model).
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// The loss of balance, if there was one.
    pub fall: Option<Fall>,
    /// Largest speed at which the motor has voltage left (m/s), if the cart ran at it before the fall.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub out_of_volts_m_per_s: Option<f64>,
    /// Whether the output is within the settling band when the run ends.
    pub settled: bool,
    /// Time after the step from which the run stays settled (s).
    pub settling_time_s: Option<f64>,
    /// Largest excursion beyond the step (% of the step).
    pub overshoot_percent: Option<f64>,
    /// Largest excursion against the step (% of the step).
    pub undershoot_percent: Option<f64>,
    /// Largest absolute relative angle of each link (rad).
    pub peak_angles_rad: Vec<f64>,
    /// What the drive imposes on the cart.
    #[serde(skip_serializing_if = "CartInput::is_force")]
    pub input: CartInput,
    /// What carries the links.
    #[serde(skip_serializing_if = "Base::is_cart")]
    pub base: Base,
    /// Largest absolute force on the cart (N), or acceleration of the cart (m/s²) where the drive imposes that.
    pub peak_force_n: f64,
    /// Largest absolute force or acceleration that the law requested.
    pub peak_requested_force_n: f64,
    /// Set-point minus output at the end (m).
    pub final_error_m: f64,
}

impl Summary {
    /// The figures of a run of `rig` through `scenario`, recorded in `trace`, that ended with `fall`.
    pub fn of(rig: &Rig, scenario: &Scenario, trace: &Trace, fall: Option<Fall>) -> Self {
        let output = rig.output();
        let step = scenario.step_m;
        let band = (0.02 * step.abs()).max(1e-3);
        let is_chain = rig.chain().is_some();
        let angles = |state: &[f64]| -> Vec<f64> {
            if is_chain {
                state.iter().skip(2).step_by(2).map(|angle| angle.abs()).collect()
            } else {
                Vec::new()
            }
        };
        let mut peak_angles_rad = angles(&scenario.start);
        let (mut peak_force_n, mut peak_requested_force_n) = (0.0f64, 0.0f64);
        let (mut beyond, mut against) = (0.0f64, 0.0f64);
        let (mut last_outside, mut final_error_m, mut fastest) = (None, 0.0, 0.0f64);
        for sample in trace.samples() {
            let lean = angles(sample.state);
            for (peak, angle) in peak_angles_rad.iter_mut().zip(&lean) {
                *peak = peak.max(*angle);
            }
            fastest = fastest.max(sample.state.get(1).map_or(0.0, |speed| speed.abs()));
            peak_force_n = peak_force_n.max(sample.force.abs());
            peak_requested_force_n = peak_requested_force_n.max(sample.requested.abs());
            let y = sample.state[output];
            final_error_m = sample.target - y;
            if sample.t >= scenario.step_at_s {
                beyond = beyond.max((y - step) * step.signum());
                against = against.max(-y * step.signum());
            }
            // Written so that NaN counts as outside.
            if (y - step).abs().partial_cmp(&band) != Some(core::cmp::Ordering::Less) {
                last_outside = Some(sample.t);
            }
        }
        let end = trace.samples().last().map_or(0.0, |sample| sample.t);
        let settled = fall.is_none() && last_outside != Some(end);
        let settling_time_s = settled
            .then(|| last_outside.map_or(0.0, |t| (t + rig.tick.period_s - scenario.step_at_s).max(0.0)));
        let percent = |excursion: f64| (step != 0.0).then(|| 100.0 * excursion / step.abs());
        let motor = rig.actuator.motor().filter(|_| fall.is_some());
        let reach = motor.map(|motor| (motor.supply_v - motor.dead_zone_v) / motor.volts_per_speed());
        Self {
            fall,
            out_of_volts_m_per_s: reach.filter(|reach| fastest >= SPENT * reach),
            settled,
            settling_time_s,
            overshoot_percent: percent(beyond),
            undershoot_percent: percent(against),
            peak_angles_rad,
            input: rig.actuator.input(),
            base: rig.base(),
            peak_force_n,
            peak_requested_force_n,
            final_error_m,
        }
    }

    /// The fall, and what the motor has to do with it.
    pub fn fall_in_words(&self) -> Option<String> {
        let fall = self.fall.as_ref()?;
        let fall = self.base.words(&fall.to_string());
        let Some(reach) = self.out_of_volts_m_per_s else { return Some(fall) };
        let (reach, pulley) = (
            self.base.speed().of(&significant(reach, 3)),
            match self.base {
                Base::Cart => ", a larger pulley",
                Base::Arm => "",
            },
        );
        Some(format!(
            "{fall}: the motor has no voltage left at {reach} (a smaller gear_ratio{pulley} or supply_v make it faster)"
        ))
    }

    /// A model has no angles, and units of its own.
    fn is_of_model(&self) -> bool {
        self.peak_angles_rad.is_empty()
    }

    /// What moved the plant.
    pub fn input_quantity(&self) -> Quantity {
        if self.is_of_model() { Quantity::OF_MODEL } else { self.input.quantity(self.base) }
    }

    /// Whether the rig is still up at the end of the run.
    pub fn survives(&self) -> bool {
        self.fall.is_none()
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.fall_in_words(), self.settling_time_s) {
            (Some(fall), _) => writeln!(f, "FALLS: {fall}")?,
            (None, Some(time)) => writeln!(f, "survives, settled after {time:.3} s")?,
            (None, None) => writeln!(f, "survives, not settled when the run ends")?,
        }
        if let (Some(over), Some(under)) = (self.overshoot_percent, self.undershoot_percent) {
            writeln!(f, "  overshoot      {over:.2} %   (undershoot: {under:.2} %)")?;
        }
        for (index, angle) in self.peak_angles_rad.iter().enumerate() {
            writeln!(f, "  peak theta{}    {:.4} rad ({:.2} deg)", index + 1, angle, angle.to_degrees())?;
        }
        let input = self.input_quantity();
        let output = if self.is_of_model() { Quantity::OF_MODEL } else { self.base.position() };
        let [peak, requested] =
            [self.peak_force_n, self.peak_requested_force_n].map(|x| input.of(&format!("{x:.3}")));
        // As wide as "peak theta1".
        let name = if input.name.len() > 6 { &input.name[..5] } else { input.name };
        writeln!(f, "  peak {name:<9} {peak} (requested: {requested})")?;
        write!(f, "  final error    {}", output.of(&format!("{:.2e}", self.final_error_m)))
    }
}
