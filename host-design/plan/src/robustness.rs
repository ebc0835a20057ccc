//! Robustness of a motion against wrong masses and friction: a deterministic score, and random runs.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::Serialize;

use super::SwingUpError;
use super::closed_loop::{LOST_RAD, TrackingTrial, run};
use super::setting::Setting;
use upright_design::motion::{PlannedMotion, Transition};
use upright_design::parallel;
use upright_design::rig::{Chain, PerJoint, PlantDescription, Rig};
use upright_trust::verify::wilson;

/// Relative error of one mass in a run for the score.
const MASS_STEP: f64 = 0.005;

/// The ranges from which each random run is drawn, uniformly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MotionSpread {
    /// Range of the cart's and each link's mass: 0.05 is -5 % to +5 %.
    pub mass: f64,
    /// Range of the friction of cart and joints, which are all wrong by the same factor.
    pub friction: f64,
    /// Range of each link's angle at the start (rad).
    pub tilt_rad: f64,
    /// Range of the cart's position at the start (m).
    pub position_m: f64,
    /// Range of each encoder's zero (rad).
    pub zero_rad: f64,
}

impl MotionSpread {
    /// The given ranges of masses and friction, a start off by up to 1° and 1 mm, encoder zeros off by up to 0.1°.
    pub fn new(mass: f64, friction: f64) -> Self {
        let degree = core::f64::consts::PI / 180.0;
        Self { mass, friction, tilt_rad: degree, position_m: 1e-3, zero_rad: 0.1 * degree }
    }

    /// Masses and friction wrong by up to the spreads of `[swing_up]`, the rest as in [`new`](Self::new).
    pub(crate) fn asked(rig: &Rig) -> Self {
        let rules = rig.swing_up.clone().unwrap_or_default();
        Self::new(rules.mass_spread_percent / 100.0, rules.friction_spread_percent / 100.0)
    }
}

/// Ticks between two telemetry messages of a random run, once the hand has let go. It does so at the first message.
pub(crate) const TELEMETRY_TICKS: u16 = 20;

/// Outcome of random runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RandomRuns {
    /// Seed of the first run; each following run has the next one.
    pub base_seed: u64,
    /// Runs made.
    pub runs: usize,
    /// Runs that arrived and stayed.
    pub arrived: usize,
    /// 95 % confidence interval of their share (Wilson).
    pub interval: [f64; 2],
    /// Largest deviation of a link from its reference in the runs that arrived (rad).
    pub deviation_rad: f64,
}

/// A deterministic measure of fragility from runs without noise: one for each mass, which is slightly wrong, and two
/// with all friction wrong. It sums the deviations to expect at the spreads of mass and friction, as shares of what is
/// available: the angle at which a link counts as lost, and the rail that the plan leaves. Smaller is better.
pub(crate) fn score(
    setting: &Setting<'_>,
    motion: &PlannedMotion,
    transition: Transition,
    spread: &MotionSpread,
) -> Result<f64, SwingUpError> {
    let ideal = TrackingTrial::ideal(setting, motion);
    let [low, high] = setting.chain.cart.travel_m;
    let room = motion.x.iter().fold(f64::INFINITY, |room, x| room.min(high - x[0]).min(x[0] - low));
    let share = |change: &dyn Fn(&mut Chain)| -> Result<f64, SwingUpError> {
        let mut trial = ideal.clone();
        change(&mut trial.chain);
        let outcome = run(setting, motion, transition, &trial)?;
        Ok(outcome.deviation_rad / LOST_RAD + outcome.deviation_m / room)
    };
    let mut sum = 0.0;
    for body in 0..=setting.chain.links.len() {
        sum += share(&|chain| scale_mass(chain, body, 1.0 + MASS_STEP))? / MASS_STEP * spread.mass;
    }
    for friction in [spread.friction, -spread.friction] {
        sum += share(&|chain| scale_friction(chain, 1.0 + friction))?;
    }
    Ok(sum)
}

/// Scales the mass of a body; body 0 is the cart. An inertia given in the file is scaled with the mass.
pub(crate) fn scale_mass(chain: &mut Chain, body: usize, factor: f64) {
    match body.checked_sub(1) {
        None => chain.cart.mass_kg = chain.cart.mass_kg.map(|mass| factor * mass),
        Some(link) => {
            chain.links[link].mass_kg *= factor;
            chain.links[link].inertia_kg_m2 = chain.links[link].inertia_kg_m2.map(|inertia| inertia * factor);
        }
    }
}

pub(crate) fn scale_friction(chain: &mut Chain, factor: f64) {
    chain.cart.friction_n_s_per_m *= factor;
    for link in &mut chain.links {
        link.friction_n_m_s_per_rad *= factor;
    }
}

/// A real rig within the spread, and the state in which it starts (m, m/s, rad, rad/s …), drawn with `seed`.
pub(crate) fn drawn(rig: &Rig, transition: Transition, spread: &MotionSpread, seed: u64) -> (Rig, Vec<f64>) {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut between = |share: f64| share * random.random_range(-1.0..=1.0);
    let mut rig = rig.clone();
    let [mut start, _] = transition.ends(rig.states(), |_| false);
    let Some(chain) = rig.chain_mut() else { return (rig, start) };
    let links = chain.links.len();
    for body in 0..=links {
        scale_mass(chain, body, 1.0 + between(spread.mass));
    }
    let factor = 1.0 + between(spread.friction);
    scale_friction(chain, factor);
    start[0] += between(spread.position_m);
    // Any other motion begins while the loop balances, when the links are as near to rest as the encoder zeros.
    let tilt_rad = if transition.begins_hanging() { spread.tilt_rad } else { spread.zero_rad };
    let mut below = 0.0;
    let zeros = &mut rig.reality.sensors.homing_error_rad;
    let mut wrong = Vec::new();
    for joint in 0..links {
        // What is drawn is the error of each link's angle from the vertical; a joint is off by the difference.
        let tilt = between(tilt_rad);
        start[2 + 2 * joint] += tilt - below;
        below = tilt;
        wrong.push(zeros.of_joint(joint) + between(spread.zero_rad));
    }
    *zeros = PerJoint::each(wrong);
    (rig, start)
}

/// Conditions of the random run with this seed.
pub(crate) fn sample(
    setting: &Setting<'_>,
    motion: &PlannedMotion,
    transition: Transition,
    spread: &MotionSpread,
    seed: u64,
) -> TrackingTrial {
    let (rig, start) = drawn(setting.rig, transition, spread, seed);
    let mut trial =
        TrackingTrial { counts: true, seed: Some(seed), start, ..TrackingTrial::ideal(setting, motion) };
    for (joint, error) in trial.zero_error.iter_mut().skip(1).enumerate() {
        *error = rig.reality.sensors.homing_error_rad.of_joint(joint);
    }
    if let PlantDescription::Chain(chain) = rig.plant {
        trial.chain = chain;
    }
    trial
}

/// `runs` random runs with the seeds from `base_seed` on, on all threads; the outcome does not depend on their number.
pub(crate) fn random_runs(
    setting: &Setting<'_>,
    motion: &PlannedMotion,
    transition: Transition,
    spread: &MotionSpread,
    base_seed: u64,
    runs: usize,
) -> Result<RandomRuns, SwingUpError> {
    let one = |index: usize| {
        let trial = sample(setting, motion, transition, spread, base_seed + index as u64);
        run(setting, motion, transition, &trial)
    };
    let all: Vec<_> = parallel::try_map(0..runs, one)?;
    let arrived = || all.iter().filter(|outcome| outcome.arrived);
    Ok(RandomRuns {
        base_seed,
        runs,
        arrived: arrived().count(),
        interval: wilson(arrived().count(), runs),
        deviation_rad: arrived().fold(0.0, |largest, outcome| f64::max(largest, outcome.deviation_rad)),
    })
}
