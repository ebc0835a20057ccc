//! One trial with a firmware: what is done, and what is observed.

use upright::board::Output;
use upright::protocol::message::{Answer, Request};
use upright::supervision::sign_check::Signs;

use super::defect::{Expected, Kind};
use super::injection::Injection;
use super::observed::Observed;
use super::trial::Trial;
use crate::in_the_loop::{Place, RunError};
use upright_design::harness::{HEARTBEAT_S, Harness, HarnessError};
use upright_design::plant::absolute_angles;
use upright_design::rig::{PlantDescription, Rig};
use upright_design::table::TableValues;

/// What a campaign is run with.
#[derive(Debug, Clone, Copy)]
pub struct Setup<'a> {
    /// The rig.
    pub rig: &'a Rig,
    /// Its gain table.
    pub table: &'a TableValues,
    /// Where the firmware runs; a new one for each trial.
    pub place: Place<'a>,
    /// Whether the firmware has its thresholds and limits. Without them it cannot find most defects.
    pub detection: bool,
}

/// Longest time from a defect to its verdict (s).
const LONGEST_S: f64 = 6.0;
/// Ticks watched after the motor went off: the fault is known a tick later, and the motor has to stay off.
const TICKS_AFTER: usize = 12;
/// A true angle or position beyond its limit by more than this share is too late, whatever follows.
const BEYOND: f64 = 0.25;

/// Runs the trial, with its defect or, for comparison, without.
pub(super) fn attempt(setup: &Setup<'_>, trial: &Trial, with_defect: bool) -> Result<Observed, RunError> {
    let attempt = Attempt { rig: setup.rig, table: setup.table, trial, with_defect };
    let without_detection;
    let table = if setup.detection {
        setup.table
    } else {
        without_detection = setup.table.clone().without_detection();
        &without_detection
    };
    setup.place.with_target(table, |target| {
        let mut harness = Harness::new(setup.rig, setup.table, &trial.scenario, target)?;
        Ok(match trial.kind {
            Kind::ArmUnhomed | Kind::ArmHanging | Kind::ArmStopped | Kind::ArmHeld => {
                attempt.arm(&mut harness)
            }
            _ => attempt.balance(&mut harness),
        }?)
    })
}

struct Attempt<'a> {
    rig: &'a Rig,
    table: &'a TableValues,
    trial: &'a Trial,
    with_defect: bool,
}

impl Attempt<'_> {
    fn balance(&self, harness: &mut Harness<'_>) -> Result<Observed, HarnessError> {
        let trial = self.trial;
        let mut observed = Observed::default();
        let mut injection = Injection::new(self.rig, self.table, trial.clone());
        let mut output = harness.raise(Some(0.0))?;
        let heartbeat = self.ticks(HEARTBEAT_S);
        for tick in 0.. {
            if self.is_over(tick, &observed) {
                break;
            }
            let since = tick.checked_sub(trial.onset).filter(|_| self.with_defect);
            let mut is_visible = false;
            if tick > 0 {
                output = match self.control(harness, &mut injection, since, &mut is_visible) {
                    Err(HarnessError::Stopped { .. }) if observed.off.is_some() => {
                        observed.dead = true;
                        return Ok(observed);
                    }
                    output => output?,
                };
            }
            if tick == 1 {
                harness.session.send(Request::Setpoint(trial.scenario.step_m as f32));
            } else if tick.is_multiple_of(heartbeat) && injection.host_is_alive(since) {
                harness.session.send(Request::Beat);
            }
            if since == Some(0) {
                injection.serial(&mut harness.session);
            }
            observed.output(tick, output);
            let mut acting = output;
            if since.is_some() {
                is_visible |= injection.output(&mut acting);
            }
            if is_visible {
                observed.visible.get_or_insert(tick);
            }
            observed.outside |= observed.off.is_none() && self.is_outside(harness.bench.state());
            let drive = if acting.enable { acting.drive } else { output.drive };
            harness.bench.push(since.map_or(0.0, |since| injection.push_n(since)));
            harness.bench.tick(drive);
        }
        observed.fault = harness.session.fault();
        if trial.kind != Kind::HostDeaf && observed.off.is_none() {
            let inputs = harness.inputs();
            if let Ok(Answer::Statistics(statistics)) = harness.session.ask(Request::Statistics, &inputs) {
                observed.rejected = statistics.rejected_samples;
            }
        }
        Ok(observed)
    }

    /// One tick of the firmware, `since` ticks after the onset; sets `is_visible` if its inputs differ visibly.
    fn control(
        &self,
        harness: &mut Harness<'_>,
        injection: &mut Injection<'_>,
        since: Option<usize>,
        is_visible: &mut bool,
    ) -> Result<Output, HarnessError> {
        let mut inputs = harness.inputs();
        if let Some(since) = since {
            *is_visible |= injection.inputs(since, &mut inputs);
        }
        if since == Some(0) {
            if let Some(fault) = self.trial.kind.inside_the_microcontroller() {
                harness.session.sabotage(fault);
            }
            if self.trial.kind == Kind::HostDeaf {
                harness.session.stop_reading()?;
            }
        }
        harness.session.tick(&inputs)
    }

    /// Whether nothing is left to be observed before `tick`.
    fn is_over(&self, tick: usize, observed: &Observed) -> bool {
        let trial = self.trial;
        let is_undecided = matches!(trial.kind.expected(), Expected::Off(_)) && observed.is_undecided();
        let last =
            trial.onset + if is_undecided { self.ticks(LONGEST_S).max(trial.watched) } else { trial.watched };
        tick >= last || observed.off.is_some_and(|off| tick > off + TICKS_AFTER)
    }

    fn ticks(&self, seconds: f64) -> usize {
        (seconds / self.rig.tick.period_s).max(1.0) as usize
    }

    fn is_outside(&self, state: &[f64]) -> bool {
        let PlantDescription::Chain(chain) = &self.rig.plant else { return false };
        let angle =
            f64::from(self.rig.limits.angle_rad.unwrap_or(f64::from(self.table.limits.angle_rad)) as f32);
        let leans = absolute_angles(state).any(|lean| lean.abs() > angle * (1.0 + BEYOND));
        let [low, high] = chain.cart.travel_m;
        leans || !(low..=high).contains(&state[0])
    }

    /// The kinds in which arming has to be refused.
    fn arm(&self, harness: &mut Harness<'_>) -> Result<Observed, HarnessError> {
        let mut observed = Observed::default();
        let mut stopped = false;
        if self.trial.kind != Kind::ArmUnhomed {
            // Until the links hang, homed and checked.
            for tick in 0.. {
                harness.by_hand(tick)?;
                if harness.session.status().signs == Signs::Checked {
                    break;
                }
            }
        }
        if matches!(self.trial.kind, Kind::ArmStopped | Kind::ArmHeld) {
            let mut inputs = harness.inputs();
            inputs.contacts.emergency_stop = true;
            observed.on_again |= harness.session.tick(&inputs)?.enable;
            stopped = self.trial.kind == Kind::ArmStopped;
        }
        let mut inputs = harness.inputs();
        inputs.contacts.emergency_stop = stopped;
        let mut refusal = harness.session.ask(Request::Arm, &inputs);
        if self.trial.kind == Kind::ArmHeld {
            harness.session.ask(Request::Clear, &inputs)?;
            refusal = harness.session.ask(Request::Arm, &inputs);
        }
        match refusal {
            Err(HarnessError::Refused { answer: Answer::NotNow(reasons), .. }) => {
                observed.refused = Some(reasons)
            }
            Err(error) => return Err(error),
            Ok(_) => (),
        }
        for _ in 0..TICKS_AFTER {
            observed.on_again |= harness.session.tick(&inputs)?.enable;
        }
        Ok(observed)
    }
}
