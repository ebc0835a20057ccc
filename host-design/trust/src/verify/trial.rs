//! One run of the firmware's controller against the plant, reduced to what a verdict needs.

use serde::{Deserialize, Serialize};
use upright::board::Output;
use upright::protocol::message::Request;
use upright::table::Law;

use upright_closed_loop::harness::{Flow, HarnessError, Host, Participant, World, until, with_firmware};
use upright_design::plant::{absolute_angles, without_turns};
use upright_design::rig::{CartInput, Rig};
use upright_design::simulate::{
    Disturbance, Fall, FallKind, Job, Sample, Scenario, SimulationError, run, run_all, ticks,
};
use upright_design::study::infinite_if_null;
use upright_design::table::TableValues;

/// Time from one telemetry message to the next while a verdict is awaited (s): a fault is known within it.
const TELEMETRY_S: f64 = 0.02;

/// Duration of a run without disturbances, and what counts as being back near rest at its end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Horizon {
    /// Duration of the run (s).
    pub duration_s: f64,
    /// Largest angle of any link from the vertical (rad).
    pub angle_rad: f64,
    /// Largest distance from the set-point (m, or the unit of a model's output).
    pub position_m: f64,
}

impl Default for Horizon {
    /// 10 s; 2° and 5 cm, far from any fall.
    fn default() -> Self {
        Self { duration_s: 10.0, angle_rad: 0.035, position_m: 0.05 }
    }
}

impl Horizon {
    /// Widened for `law`'s limit cycle. Encoder resolution keeps some loops moving by far more than one count, so the
    /// limits are at least twice the largest deviation of a run without disturbances that starts almost at rest.
    ///
    /// # Errors
    /// Those of [`run`].
    pub fn widened(self, rig: &Rig, table: &TableValues, law: Law) -> Result<Self, SimulationError> {
        // Less than an encoder count, but not the equilibrium, where nothing would ever move.
        let mut nudged = scenario(rig, law, 2.0 * self.duration_s);
        let first = if rig.chain().is_some() { 2 } else { rig.output() };
        nudged.start[first] = 1e-6;
        let rest = trial(rig, table, &nudged, &self)?;
        if rest.fall.is_some() {
            return Ok(self);
        }
        Ok(Self {
            angle_rad: self.angle_rad.max(2.0 * rest.peak_angle_rad),
            position_m: self.position_m.max(2.0 * rest.peak_error_m),
            ..self
        })
    }
}

/// Outcome of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// How it fell, if it did, or was turned off.
    pub fall: Option<Fall>,
    /// Time from which it stayed near rest (s); none if it was not near rest when the run ended.
    pub at_rest_after_s: Option<f64>,
    /// Largest angle of any link from the vertical (rad); 0 for a model.
    #[serde(deserialize_with = "infinite_if_null")]
    pub peak_angle_rad: f64,
    /// Largest distance from the set-point (m, or the unit of a model's output).
    #[serde(deserialize_with = "infinite_if_null")]
    pub peak_error_m: f64,
    /// Largest force on the cart (N).
    #[serde(deserialize_with = "infinite_if_null")]
    pub peak_force_n: f64,
}

impl Outcome {
    /// Whether there was no fall and, in a supervised run, no fault: the criterion for runs whose disturbances never
    /// let the rig come to rest.
    pub fn survives(&self) -> bool {
        self.fall.is_none()
    }

    const NOTHING_SEEN: Self =
        Self { fall: None, at_rest_after_s: None, peak_angle_rad: 0.0, peak_error_m: 0.0, peak_force_n: 0.0 };

    fn see(&mut self, rig: &Rig, horizon: &Horizon, sample: &Sample<&[f64]>) {
        let angle = largest_angle(rig, sample.state);
        let error = (sample.state[rig.output()] - sample.target).abs();
        self.peak_angle_rad = self.peak_angle_rad.max(angle);
        self.peak_error_m = self.peak_error_m.max(error);
        self.peak_force_n = self.peak_force_n.max(sample.force.abs());
        // Compared this way round so that NaN does not count as near rest.
        let quiet = angle <= horizon.angle_rad && error <= horizon.position_m;
        self.at_rest_after_s = if quiet { self.at_rest_after_s.or(Some(sample.t)) } else { None };
    }

    fn ended(self, fall: Option<Fall>) -> Self {
        Self { at_rest_after_s: self.at_rest_after_s.filter(|_| fall.is_none()), fall, ..self }
    }

    /// Whether this run fell earlier, or fell where `other` survived, or, both upright, leaned further.
    pub(super) fn is_worse_than(&self, other: &Self) -> bool {
        match (&self.fall, &other.fall) {
            (Some(own), Some(other)) => own.at_s < other.at_s,
            (Some(_), None) => true,
            (None, Some(_)) => false,
            (None, None) => self.peak_angle_rad > other.peak_angle_rad,
        }
    }

    /// Whether there was no fall, and the rig was near rest when the run ended.
    pub fn comes_to_rest(&self) -> bool {
        self.at_rest_after_s.is_some()
    }
}

/// Runs `scenario` on the plant of `rig` with the controller of `table`.
///
/// # Errors
/// Those of [`run`].
pub fn trial(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    horizon: &Horizon,
) -> Result<Outcome, SimulationError> {
    let mut outcome = Outcome::NOTHING_SEEN;
    let fall = run(rig, table, scenario, &mut |sample| outcome.see(rig, horizon, sample))?;
    Ok(outcome.ended(fall))
}

/// [`trial`] with the whole firmware, from power-up on: the rig is homed, its signs are checked, and it is armed and
/// let go as by hand.
///
/// # Errors
/// [`HarnessError`] if the firmware does not run.
pub(super) fn trial_from_power_up(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    horizon: &Horizon,
) -> Result<Outcome, HarnessError> {
    with_firmware(table, |target| {
        let mut world = World::new(rig, table, scenario, target)?;
        match world.raise(Some(scenario.target_m(0.0) as f32)) {
            Ok(_) => {}
            Err(HarnessError::NotBalancing(_)) => {
                let kind = world.session.fault().map_or(FallKind::NotArmed, FallKind::MotorOff);
                return Ok(Outcome::NOTHING_SEEN.ended(Some(Fall { at_s: 0.0, kind })));
            }
            Err(error) => return Err(error),
        }
        world.session.send(Request::Telemetry((TELEMETRY_S / rig.tick.period_s).max(1.0) as u16));
        let mut watched = UntilFall::new(rig, scenario, horizon);
        let mut host = Host::new(scenario, rig.tick.period_s, world.session.pace().command_ticks);
        world.run(ticks(rig, scenario)? + 1, &mut [&mut host, &mut watched])?;
        Ok(watched.outcome.ended(watched.fall))
    })?
}

/// Watches a firmware that balances until the rig falls, or its motor is turned off.
struct UntilFall<'a> {
    rig: &'a Rig,
    scenario: &'a Scenario,
    horizon: &'a Horizon,
    outcome: Outcome,
    t: f64,
    /// The state at the beginning of the tick.
    state: Vec<f64>,
    fall: Option<Fall>,
}

impl<'a> UntilFall<'a> {
    fn new(rig: &'a Rig, scenario: &'a Scenario, horizon: &'a Horizon) -> Self {
        let (outcome, state) = (Outcome::NOTHING_SEEN, vec![0.0; rig.states()]);
        Self { rig, scenario, horizon, outcome, t: 0.0, state, fall: None }
    }
}

impl Participant for UntilFall<'_> {
    fn act(&mut self, world: &mut World<'_>, _: &mut Output) -> Flow {
        self.t = world.ticks() as f64 * self.rig.tick.period_s;
        self.state.copy_from_slice(world.bench.state());
        let off = world.session.fault().map(|fault| Fall { at_s: self.t, kind: FallKind::MotorOff(fault) });
        self.fall = off.or_else(|| Fall::of(self.rig, self.t, &without_turns(&self.state)));
        until(false)
    }

    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        let (t, state, force) = (self.t, self.state.as_slice(), world.force_n());
        let target = self.scenario.target_m(t);
        let sample = Sample { t, target, setpoint: target, requested: force, force, state, estimate: &[] };
        self.outcome.see(self.rig, self.horizon, &sample);
        until(self.fall.is_some())
    }
}

/// [`trial`] for each of these cases, several in lockstep.
///
/// # Errors
/// As for [`trial`].
pub fn trials(
    table: &TableValues,
    cases: &[(Rig, Scenario)],
    horizon: &Horizon,
) -> Result<Vec<Outcome>, SimulationError> {
    let mut outcomes = vec![Outcome::NOTHING_SEEN; cases.len()];
    let mut observers: Vec<_> = outcomes
        .iter_mut()
        .zip(cases)
        .map(|(outcome, (rig, _))| move |sample: &Sample<&[f64]>| outcome.see(rig, horizon, sample))
        .collect();
    let mut jobs: Vec<Job<'_>> = observers
        .iter_mut()
        .zip(cases)
        .map(|(observe, (rig, scenario))| Job { table, rig, scenario, observe })
        .collect();
    let falls = run_all(&mut jobs)?;
    Ok(outcomes.into_iter().zip(falls).map(|(outcome, fall)| outcome.ended(fall)).collect())
}

fn largest_angle(rig: &Rig, state: &[f64]) -> f64 {
    if rig.chain().is_none() {
        return 0.0;
    }
    absolute_angles(state).fold(0.0, |largest, angle| f64::max(largest, angle.abs()))
}

/// The rig's run at rest for `duration_s`, with integration steps of at most 1 ms: on the fastest rig a run then
/// differs from one with steps of 0.25 ms by less than 1e-6.
pub(crate) fn scenario(rig: &Rig, law: Law, duration_s: f64) -> Scenario {
    let steps = (rig.tick.period_s / 1e-3 - 1e-9).ceil().clamp(1.0, 1e4) as usize;
    Scenario { duration_s, substeps: steps, ..Scenario::at_rest(rig, law) }
}

/// [`scenario`] with disturbances, as the firmware runs it: it ends where the motor is turned off.
pub(crate) fn disturbed(
    rig: &Rig,
    law: Law,
    duration_s: f64,
    disturbance: &Disturbance,
    seed: u64,
) -> Scenario {
    Scenario {
        force_noise_n: disturbance.force_n,
        torque_noise_n_m: disturbance.torque_n_m,
        seed,
        is_supervised: true,
        ..scenario(rig, law, duration_s)
    }
}

/// The rig at rest with the disturbances that its file expects, for runs of the whole firmware: with two integration
/// steps per tick.
pub fn at_rest_disturbed(rig: &Rig, law: Law, seed: u64) -> Scenario {
    let disturbance = Disturbance::of(rig);
    Scenario {
        force_noise_n: disturbance.force_n,
        torque_noise_n_m: disturbance.torque_n_m,
        seed,
        substeps: 2,
        ..Scenario::at_rest(rig, law)
    }
}

/// A start at rest with these angles from the vertical (rad).
pub(crate) fn leaning(rig: &Rig, angles: &[f64]) -> Vec<f64> {
    let mut start = vec![0.0; rig.states()];
    let mut below = 0.0;
    for (joint, &angle) in start[2..].chunks_exact_mut(2).zip(angles) {
        joint[0] = angle - below;
        below = angle;
    }
    start
}

/// Distance by which a set-point moves (m): 0.1 m, or half of the way to the nearer end of the rail, as far as
/// set-points may go.
pub(crate) fn moved_setpoint_m(table: &TableValues) -> f64 {
    let [low, high] = table.limits.rail_m.map(f64::from);
    (0.5 * high.min(-low)).min(0.1).min(table.limits.setpoints_m()[1].into())
}

/// The run with a set-point that moves there and back.
pub fn moving(scenario: Scenario, table: &TableValues) -> Scenario {
    let (step_at_s, step_until_s) = (0.2 * scenario.duration_s, 0.6 * scenario.duration_s);
    Scenario { step_m: moved_setpoint_m(table), step_at_s, step_until_s, ..scenario }
}

/// A lean of every link (rad) with which an imperfect machine starts. The links of a stepper whose joints stick would
/// stand below one count of their encoder, because no force on the cart wakes the loop; so they lean by one.
pub(crate) fn waking_lean(rig: &Rig) -> f64 {
    match rig.actuator.input() {
        CartInput::Force => 0.0,
        CartInput::Acceleration => rig.sensors().get(1).map_or(0.0, |sensor| sensor.step()),
    }
}

/// The largest size that survives below the first one found to fall: from `smallest` up by doubling to at most
/// `largest`, then by bisection to within `relative` of the edge.
///
/// Sizes that survive beyond the first that falls are not searched for: nobody should rely on them.
pub(super) fn edge<T, E>(
    [smallest, largest]: [f64; 2],
    relative: f64,
    mut survives: impl FnMut(f64) -> Result<Option<T>, E>,
) -> Result<Option<(f64, T)>, E> {
    let (mut held, mut size) = (None, smallest.min(largest));
    let mut lost = loop {
        match survives(size)? {
            Some(outcome) => held = Some((size, outcome)),
            None => break size,
        }
        if size >= largest {
            return Ok(held);
        }
        size = (2.0 * size).min(largest);
    };
    while let Some(&(good, _)) = held.as_ref()
        && lost - good > relative * good
    {
        let middle = 0.5 * (good + lost);
        match survives(middle)? {
            Some(outcome) => held = Some((middle, outcome)),
            None => lost = middle,
        }
    }
    Ok(held)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_edge_is_found() {
        let find = |edge_at: f64| {
            edge::<_, ()>([1e-3, 1.0], 1e-3, |size| Ok((size <= edge_at).then_some(()))).unwrap()
        };
        let (found, ()) = find(0.3).unwrap();
        assert!((0.2997..=0.3).contains(&found));
        assert_eq!(find(5.0), Some((1.0, ())));
        assert_eq!(find(1e-4), None);
    }
}
