//! A motion in closed loop: encoders, filter with the nonlinear model, feedback, actuator, and a plant that may differ
//! from the model.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use super::SwingUpError;
use super::problem::Bounds;
use super::setting::Setting;
use upright_design::motion::{PlannedMotion, Transition};
use upright_design::numerics::Matrix;
use upright_design::plant::{Plant, absolute_angles, chain_plant};
use upright_design::rig::Chain;
use upright_design::rig::defaults::ANGLE_RAD;

/// Deviation of a link from its reference beyond which the motion counts as lost (rad).
pub(crate) const LOST_RAD: f64 = ANGLE_RAD;
/// Deviation at the end of a run below which it has arrived upright (rad).
const ARRIVED_RAD: f64 = 0.1;

/// Conditions of one run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TrackingTrial {
    /// The chain that is simulated.
    pub(crate) chain: Chain,
    /// Its state at the start.
    pub(crate) start: Vec<f64>,
    /// Zero error of each encoder: reading minus true position (m, rad).
    pub(crate) zero_error: Vec<f64>,
    /// Whether readings are rounded to whole counts.
    pub(crate) counts: bool,
    /// Seed of the disturbances; without one there are no disturbances.
    pub(crate) seed: Option<u64>,
    /// Duration of balancing, or hanging, after the motion (s).
    pub(crate) after_s: f64,
}

/// Result of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TrackingResult {
    /// Whether it arrived and stayed.
    pub(crate) arrived: bool,
    /// Largest deviation of a link from its reference during the motion (rad).
    pub(crate) deviation_rad: f64,
    /// Largest deviation of the cart (m).
    pub(crate) deviation_m: f64,
}

/// A trial in progress.
struct ClosedLoop<'a> {
    setting: &'a Setting<'a>,
    trial: &'a TrackingTrial,
    plant: Box<dyn Plant>,
    random: Option<Pcg64>,
    torques: Vec<f64>,
    /// The true state.
    state: Vec<f64>,
    /// Estimate of this tick, and its prediction for the next.
    estimate: Vec<f64>,
    predicted: Vec<f64>,
}

/// The law of a tick: `u = u_k - K (x̂ - x_k)`, with the filter gain L. Without K there is no force.
struct TickLaw<'a> {
    x: &'a [f64],
    u: f64,
    k: Option<&'a Matrix<f64>>,
    l: &'a Matrix<f64>,
}

impl<'a> ClosedLoop<'a> {
    /// A trial whose filter starts from the prediction `predicted`.
    ///
    /// # Errors
    /// [`SwingUpError`] if the chain cannot be simulated.
    fn new(
        setting: &'a Setting<'a>,
        trial: &'a TrackingTrial,
        predicted: &[f64],
    ) -> Result<Self, SwingUpError> {
        let mut plant = chain_plant(&trial.chain)?;
        plant.set_state(&trial.start);
        Ok(Self {
            setting,
            trial,
            plant,
            random: trial.seed.map(Pcg64::seed_from_u64),
            torques: vec![0.0; setting.chain.links.len()],
            state: trial.start.clone(),
            estimate: predicted.to_vec(),
            predicted: predicted.to_vec(),
        })
    }

    /// One tick: measures, corrects, applies the law; then moves the plant.
    fn tick(&mut self, law: &TickLaw<'_>) {
        let sensors = &self.setting.noise.sensors;
        let innovation: Vec<f64> = (0..sensors.len())
            .map(|i| measured(self.setting, self.trial, &self.state, i) - self.predicted[sensors[i].0])
            .collect();
        for (i, estimate) in self.estimate.iter_mut().enumerate() {
            let correction: f64 = innovation.iter().enumerate().map(|(j, e)| law.l[(i, j)] * e).sum();
            *estimate = self.predicted[i] + correction;
        }
        let force = law.k.map_or(0.0, |k| {
            let deviations = self.estimate.iter().zip(law.x).map(|(estimate, x)| estimate - x);
            let feedback: f64 = deviations.enumerate().map(|(i, deviation)| k[(0, i)] * deviation).sum();
            applied(self.setting, law.u - feedback, self.estimate[1])
        });
        let mut push = 0.0;
        if let Some(random) = &mut self.random {
            let mut draw = || -> f64 { StandardNormal.sample(random) };
            push = self.setting.disturbance.force_n * draw();
            self.torques.fill_with(|| self.setting.disturbance.torque_n_m * draw());
        }
        self.plant.advance(force + push, &self.torques, self.setting.tick_s, 2);
        self.plant.write_state(&mut self.state);
        self.predicted.copy_from_slice(&self.estimate);
        self.setting.dynamics.step(&mut self.predicted, [force; 2], self.setting.tick_s);
    }

    /// Whether the cart has reached an end of the rail.
    fn is_at_the_end(&self) -> bool {
        let [low, high] = self.setting.chain.cart.travel_m;
        !(low < self.state[0] && self.state[0] < high)
    }
}

/// The law in tick k of a motion and after it.
fn law_at<'a>(
    setting: &'a Setting<'_>,
    motion: &'a PlannedMotion,
    transition: Transition,
    k: usize,
) -> TickLaw<'a> {
    let steps = motion.steps();
    match transition {
        _ if k < steps => TickLaw { x: &motion.x[k], u: motion.u[k], k: Some(&motion.k[k]), l: &motion.l[k] },
        transition if transition.ends_hanging() => {
            TickLaw { x: &motion.x[steps], u: 0.0, k: None, l: &motion.l[steps - 1] }
        }
        transition => {
            let at_end = setting.at_end(transition);
            TickLaw { x: &motion.x[steps], u: 0.0, k: Some(&at_end.k), l: &at_end.l }
        }
    }
}

/// Runs `motion` on the trial's chain.
///
/// # Errors
/// [`SwingUpError`] if the chain cannot be simulated.
pub(crate) fn run(
    setting: &Setting<'_>,
    motion: &PlannedMotion,
    transition: Transition,
    trial: &TrackingTrial,
) -> Result<TrackingResult, SwingUpError> {
    let mut rig = ClosedLoop::new(setting, trial, &motion.x[0])?;
    let steps = motion.steps();
    let mut outcome = TrackingResult { arrived: false, deviation_rad: 0.0, deviation_m: 0.0 };
    for k in 0..steps + (trial.after_s / motion.tick_s) as usize {
        rig.tick(&law_at(setting, motion, transition, k));
        let reference = motion.x.get(k + 1).unwrap_or(&motion.x[steps]);
        let deviation = deviation(&rig.state, reference);
        outcome.deviation_m = outcome.deviation_m.max((rig.state[0] - reference[0]).abs());
        if k < steps {
            outcome.deviation_rad = outcome.deviation_rad.max(deviation);
        }
        let watched = k < steps || !transition.ends_hanging();
        if (watched && deviation > LOST_RAD) || rig.is_at_the_end() {
            outcome.deviation_rad = outcome.deviation_rad.max(LOST_RAD);
            return Ok(outcome);
        }
    }
    // After lowering, the motor is off, and links without friction swing on.
    let near = if transition.ends_hanging() { LOST_RAD } else { ARRIVED_RAD };
    outcome.arrived = deviation(&rig.state, &motion.x[steps]) < near;
    Ok(outcome)
}

fn measured(setting: &Setting<'_>, trial: &TrackingTrial, state: &[f64], sensor: usize) -> f64 {
    let value = state[setting.noise.sensors[sensor].0] + trial.zero_error[sensor];
    let step = setting.steps[sensor];
    if trial.counts { libm::round(value / step) * step } else { value }
}

/// What the actuator can deliver of a commanded force (N) or acceleration (m/s²), at a speed of the cart.
fn applied(setting: &Setting<'_>, wanted: f64, speed: f64) -> f64 {
    let Bounds { input: limit, motor, speed_m_per_s, lead_s, .. } = setting.actuator;
    let within = |input: f64| input.max(-limit).min(limit);
    let input = within(wanted);
    match (motor, speed_m_per_s) {
        (Some([stall, loss]), _) => input.max(-stall - loss * speed).min(stall - loss * speed),
        (None, Some(fastest)) => {
            let lead_s = lead_s.max(setting.tick_s);
            let next = (speed + input * lead_s).max(-fastest).min(fastest);
            within((next - speed) / lead_s)
        }
        (None, None) => input,
    }
}

impl TrackingTrial {
    /// The model itself, exactly at the start of `motion`, without counts or disturbances.
    pub(crate) fn ideal(setting: &Setting<'_>, motion: &PlannedMotion) -> Self {
        Self {
            chain: setting.chain.clone(),
            start: motion.x[0].clone(),
            zero_error: vec![0.0; setting.steps.len()],
            counts: false,
            seed: None,
            after_s: 1.0,
        }
    }
}

/// Largest difference of a link's angle from the vertical to that of the reference (rad).
pub(crate) fn deviation(state: &[f64], reference: &[f64]) -> f64 {
    absolute_angles(state).zip(absolute_angles(reference)).fold(0.0, |largest, (a, b)| {
        let difference = (a - b).abs();
        if difference.is_nan() { f64::INFINITY } else { f64::max(largest, difference) }
    })
}
