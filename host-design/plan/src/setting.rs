//! What the rig file says about swing-up, with every default filled in.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use upright::table::Equilibrium;

use super::SwingUpError;
use super::dynamics::{Dynamics, dynamics};
use super::hold::tick;
use super::problem::Bounds;
use super::tracking::{Noise, PathFilter, stationary};
use upright_design::motion::{Transition, rest};
use upright_design::numerics::Matrix;
use upright_design::rig::{Chain, KalmanNoise, Motor, Rig, Sensor, SwingUpRules};
use upright_design::simulate::Disturbance;
use upright_trust::verify::{fewest_runs, wilson};

/// Number of random runs that judge a motion, with the seeds from 1 on. The rounds use the seeds after them.
pub(crate) const JUDGING_RUNS: usize = 200;

/// Process noise that the filter expects in motion, as multiples of the rig's: wrong masses disturb it more in motion
/// than at rest.
const JOINT_NOISE: f64 = 100.0;
const INPUT_NOISE: f64 = 10.0;
/// That of the joints of a long chain on a stepper, and the factor on its input's weight along a motion: its loop is so
/// fast that a faster filter takes the spring of the motor for motion of the links, and faster feedback excites it.
const JOINT_NOISE_ON_STEPPER: f64 = 20.0;
const INPUT_WEIGHT_ON_STEPPER: f64 = 8.0;
/// Least number of links of such a chain.
const LONG_ON_STEPPER: usize = 3;
/// Time after which the filter at rest has settled (s).
const SETTLE_S: f64 = 2.0;

/// Everything that searching and judging needs to know about a rig.
pub(crate) struct Setting<'a> {
    pub(crate) rig: &'a Rig,
    pub(crate) rules: SwingUpRules,
    pub(crate) chain: &'a Chain,
    pub(crate) dynamics: Box<dyn Dynamics>,
    pub(crate) tick_s: f64,
    /// Limits of the actuator and the rail; a plan keeps a distance from them.
    pub(crate) actuator: Bounds,
    pub(crate) disturbance: Disturbance,
    pub(crate) noise: Noise,
    /// Travel per count of each sensor (m, rad).
    pub(crate) steps: Vec<f64>,
    pub(crate) weights: Matrix<f64>,
    /// Weight of the input along a motion.
    pub(crate) input_weight: f64,
    rests: BTreeMap<Equilibrium, AtRest>,
}

/// Stationary law and filter about a state of rest.
pub(crate) struct AtRest {
    /// Cost-to-go, s×s.
    pub(crate) cost: Matrix<f64>,
    /// Gain K, 1×s.
    pub(crate) k: Matrix<f64>,
    /// Gain L of the filter, s×p.
    pub(crate) l: Matrix<f64>,
    /// Covariance of the settled filter.
    pub(crate) covariance: Matrix<f64>,
}

/// Whether the runs that judge a motion can show this share, if all of them arrive.
fn can_be_judged(needed: f64) -> Result<(), SwingUpError> {
    let (runs, most) = (JUDGING_RUNS, 100.0 * wilson(JUDGING_RUNS, JUDGING_RUNS)[0]);
    if needed <= most {
        return Ok(());
    }
    // One decimal, so that what is said is enough.
    let most = (10.0 * most).floor() / 10.0;
    Err(SwingUpError::TooFewRuns { needed, runs, fewest: fewest_runs(0, 0.01 * needed), most })
}

impl<'a> Setting<'a> {
    /// The setting for raising and lowering.
    pub(crate) fn of(rig: &'a Rig) -> Result<Self, SwingUpError> {
        Self::with_transitions(rig, &Transition::BOTH)
    }

    /// The setting for these transitions.
    pub(crate) fn with_transitions(rig: &'a Rig, transitions: &[Transition]) -> Result<Self, SwingUpError> {
        let Some(chain) = rig.chain() else { return Err(SwingUpError::NotAChain) };
        let (Some(lqr), Some(kalman)) = (&rig.lqr, &rig.kalman) else {
            return Err(SwingUpError::Needs("[lqr] and [kalman]"));
        };
        let input = rig.actuator.largest_input();
        let input = input.ok_or(SwingUpError::Needs("force_limit_n in [actuator], or a motor"))?;
        if rig.tick.delay_ticks != 0 {
            return Err(SwingUpError::Delay);
        }
        let sensors = rig.sensors();
        if sensors.len() != chain.links.len() + 1 {
            return Err(SwingUpError::Needs("an encoder at every link"));
        }
        let (dynamics, tick_s) = (dynamics(chain)?, rig.tick.period_s);
        let drive = rig.actuator.pulses();
        let steps: Vec<f64> = sensors.iter().map(|sensor| sensor.step()).collect();
        let rules = rig.swing_up.clone().unwrap_or_default();
        can_be_judged(rules.success_percent)?;
        let errors = |sensor: &Sensor| (sensor.state, sensor.variance());
        let noise = noise(chain, kalman, &rules, sensors.iter().map(errors).collect());
        let weights = Matrix::from_f64_rows(&lqr.weights().0);
        let (states, input_weight) = (rig.states(), lqr.force_weight);
        let at_rest = |at: Equilibrium| -> Result<AtRest, SwingUpError> {
            let state = rest(at, states);
            let tick = tick(&*dynamics, &state, 0.0, tick_s);
            let (cost, k) = stationary(&tick, &weights, input_weight, tick_s);
            let mut filter = PathFilter::new(&*dynamics, &noise, states, tick_s);
            let l = filter.settle(&state, &tick, (SETTLE_S / tick_s) as usize)?;
            Ok(AtRest { cost, k, l, covariance: filter.covariance })
        };
        let links = chain.links.len();
        let mut rests = BTreeMap::new();
        for at in transitions.iter().flat_map(|transition| [transition.from(links), transition.to(links)]) {
            if let Entry::Vacant(vacant) = rests.entry(at) {
                vacant.insert(at_rest(at)?);
            }
        }
        Ok(Self {
            actuator: Bounds {
                name: rig.input_quantity().name,
                input,
                motor: rig.actuator.motor().map(motor),
                speed_m_per_s: rig.actuator.largest_speed_m_per_s(tick_s),
                lead_s: drive.filter(|drive| drive.lag_s() > 0.0).map_or(0.0, |drive| drive.lead_s(tick_s)),
                rail_m: Some(chain.cart.travel_m),
            },
            disturbance: Disturbance::of(rig),
            rig,
            rules,
            chain,
            tick_s,
            noise,
            steps,
            weights,
            input_weight: if is_fast(chain) { INPUT_WEIGHT_ON_STEPPER } else { 1.0 } * input_weight,
            rests,
            dynamics,
        })
    }

    /// Law and filter at the start of one of the transitions.
    pub(crate) fn at_start(&self, transition: Transition) -> &AtRest {
        &self.rests[&transition.from(self.chain.links.len())]
    }

    /// Law and filter at the end of one of the transitions.
    pub(crate) fn at_end(&self, transition: Transition) -> &AtRest {
        &self.rests[&transition.to(self.chain.links.len())]
    }
}

/// Whether the loop is so fast that a motor's spring disturbs it.
fn is_fast(chain: &Chain) -> bool {
    !chain.input.is_force() && chain.links.len() >= LONG_ON_STEPPER
}

/// The noise that the filter expects in motion; `sensors` are the states that are measured, and the variances of their
/// rounding errors.
fn noise(chain: &Chain, kalman: &KalmanNoise, rules: &SwingUpRules, sensors: Vec<(usize, f64)>) -> Noise {
    let wrong = rules.friction_spread_percent / 100.0;
    let of_links = chain.links.iter().map(|link| link.friction_n_m_s_per_rad);
    // A drive that imposes the cart's motion overcomes its friction.
    let of_cart = if chain.input.is_force() { chain.cart.friction_n_s_per_m } else { 0.0 };
    let frictions = [of_cart].into_iter().chain(of_links);
    let more = if is_fast(chain) { JOINT_NOISE_ON_STEPPER } else { JOINT_NOISE };
    let joints = kalman.joint_noise.iter().map(|intensity| more * intensity);
    Noise {
        friction_errors: frictions.map(|friction| wrong * friction).collect(),
        knows_cart: !chain.input.is_force(),
        intensities: [INPUT_NOISE * kalman.force_noise_n2_s].into_iter().chain(joints).collect(),
        sensors,
    }
}

/// Force at standstill with the voltage beyond the dead zone (N), and its loss with speed by back-EMF (N·s/m).
fn motor(motor: &Motor) -> [f64; 2] {
    let newtons_per_volt = motor.newtons_per_volt();
    [newtons_per_volt * (motor.supply_v - motor.dead_zone_v), newtons_per_volt * motor.volts_per_speed()]
}
