//! One trial with a firmware: what was done, and what was seen.

use std::path::Path;

use upright::board::Output;
use upright::protocol::message::{Answer, Request};
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::sign_check::Signs;

use super::defect::{Expected, Kind};
use super::injection::Injection;
use super::trial::Trial;
use crate::in_the_loop::{
    Emulator, InProcess, Link, Queues, RunError, Session, SessionError, Stage, Target, TargetError,
};
use upright_design::rig::{PlantDescription, Rig};
use upright_design::table::{TableValues, WithSize, with_firmware_size};

/// Where the firmware of a campaign runs.
#[derive(Debug, Clone, Copy)]
pub enum Place<'a> {
    /// In this process.
    Host,
    /// In this process, with nothing that it could find a defect by.
    Blind,
    /// As this image in QEMU, a new one for each trial.
    Qemu(&'a Path),
}

/// What was seen of a trial. Ticks count from the release of the rig.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Seen {
    /// Outputs from the release on.
    pub(super) outputs: Vec<Output>,
    /// First tick in which the motor was off.
    pub(super) off: Option<usize>,
    /// Whether it came on again.
    pub(super) on_again: bool,
    /// First tick in which the defect could be told from a healthy rig.
    pub(super) visible: Option<usize>,
    /// Whether a link or the cart was far beyond its limit while the motor was on.
    pub(super) outside: bool,
    /// The latched fault.
    pub(super) fault: Option<Fault>,
    /// Measurements that were rejected.
    pub(super) rejected: u32,
    /// Inhibits against arming.
    pub(super) refused: Option<Inhibits>,
    /// Whether the firmware has stopped running.
    pub(super) dead: bool,
}

/// Between two signs of life of the host (s).
const BEAT_S: f64 = 0.025;
/// Longest time from a defect to its verdict (s).
const LONGEST_S: f64 = 6.0;
/// A true angle or position beyond its limit by more than this share is too late, whatever follows.
const BEYOND: f64 = 0.25;

/// Runs the trial, with its defect or, for comparison, without.
pub(super) fn attempt(
    rig: &Rig,
    table: &TableValues,
    trial: &Trial,
    with_defect: bool,
    place: Place<'_>,
) -> Result<Seen, RunError> {
    let (states, sensors) = (table.states, table.sensors);
    let attempt = Attempt { rig, table, trial, with_defect, place };
    with_firmware_size(states, sensors, attempt)
        .ok_or(upright_design::simulate::SimulationError::Size { states, sensors })?
}

struct Attempt<'a> {
    rig: &'a Rig,
    table: &'a TableValues,
    trial: &'a Trial,
    with_defect: bool,
    place: Place<'a>,
}

impl WithSize for Attempt<'_> {
    type Output = Result<Seen, RunError>;

    fn run<const NX: usize, const NY: usize>(self) -> Self::Output {
        match self.place {
            Place::Host | Place::Blind => {
                let mut values = self.table.clone();
                if let Place::Blind = self.place {
                    values = values.without_detection();
                }
                let (table, mut queues) = (values.table::<NX, NY>(), Queues::default());
                let mut target = InProcess::<NX, NY>::new(&mut queues, &table, &values.build())?;
                if self.with_defect && self.trial.kind == Kind::HostDeaf {
                    // From the first tick of the run on: see below.
                    target.stuck_from = Some(self.trial.onset);
                }
                self.with::<NX, NY>(&mut target)
            }
            Place::Qemu(image) => self.with::<NX, NY>(&mut Emulator::start(image, Link::Files)?),
        }
    }
}

impl Attempt<'_> {
    fn with<const NX: usize, const NY: usize>(self, target: &mut dyn Target<NY>) -> Result<Seen, RunError> {
        let mut stage =
            Stage::<NX, NY>::new(self.rig, self.table, &self.trial.scenario, Session::new(target))?;
        match self.trial.kind {
            Kind::ArmUnhomed | Kind::ArmHanging | Kind::ArmStopped | Kind::ArmHeld => self.arm(&mut stage),
            _ => self.balance(&mut stage),
        }
    }

    fn balance<const NX: usize, const NY: usize>(
        &self,
        stage: &mut Stage<'_, NX, NY>,
    ) -> Result<Seen, RunError> {
        let trial = self.trial;
        let mut seen = Seen::default();
        let mut injection = Injection::<NY>::new(self.rig, self.table, trial);
        let mut output = stage.raise(0.0)?;
        let ticks = |seconds: f64| (seconds / self.rig.tick.period_s).max(1.0) as usize;
        let beat = ticks(BEAT_S);
        let (last, longest) = (trial.onset + trial.watched, trial.onset + ticks(LONGEST_S));
        for tick in 0.. {
            // What can be seen has to be decided, one way or the other: a slow rig takes its time to fall.
            let undecided = matches!(trial.kind.expected(), Expected::Off(_))
                && seen.visible.is_some()
                && seen.off.is_none()
                && !seen.outside;
            if tick >= last && !(undecided && tick < longest) {
                break;
            }
            let since = tick.checked_sub(trial.onset).filter(|_| self.with_defect);
            let mut told = false;
            if tick > 0 {
                let mut inputs = stage.inputs();
                if let Some(since) = since {
                    told |= injection.inputs(since, &mut inputs);
                    if since == 0
                        && let Some(sabotage) = trial.kind.sabotage()
                    {
                        stage.session.sabotage(sabotage);
                    }
                }
                output = match stage.session.tick(&inputs) {
                    Err(TargetError::Stopped { .. }) if seen.off.is_some() => {
                        seen.dead = true;
                        return Ok(seen);
                    }
                    output => output?,
                };
            }
            if tick == 1 {
                stage.session.send(Request::Setpoint(trial.scenario.step_m as f32));
            } else if tick.is_multiple_of(beat) && injection.host_speaks(since) {
                stage.session.send(Request::Beat);
            }
            if since == Some(0) {
                injection.serial(&mut stage.session);
            }
            seen.outputs.push(output);
            seen.on_again |= output.enable && seen.off.is_some();
            if !output.enable {
                seen.off.get_or_insert(tick);
            }
            let mut acting = output;
            if since.is_some() {
                told |= injection.output(&mut acting);
            }
            if told {
                seen.visible.get_or_insert(tick);
            }
            seen.outside |= seen.off.is_none() && self.is_outside(stage.bench.state());
            let drive = if acting.enable { acting.drive } else { output.drive };
            stage.bench.push(since.map_or(0.0, |since| injection.push_n(since)));
            stage.bench.tick(drive);
            // A few ticks more: the fault is heard of later, and off has to stay off.
            if seen.off.is_some_and(|off| tick >= off + TICKS_AFTER) {
                break;
            }
        }
        seen.fault = stage.session.fault();
        if trial.kind != Kind::HostDeaf && seen.off.is_none() {
            let inputs = stage.inputs();
            if let Ok(Answer::Statistics(statistics)) = stage.session.ask(Request::Statistics, &inputs) {
                seen.rejected = statistics.rejected_samples;
            }
        }
        Ok(seen)
    }

    fn is_outside(&self, state: &[f64]) -> bool {
        let PlantDescription::Chain(chain) = &self.rig.plant else { return false };
        let angle =
            f64::from(self.rig.limits.angle_rad.unwrap_or(f64::from(self.table.limits.angle_rad)) as f32);
        let mut lean = 0.0;
        let leans = state[2..].chunks_exact(2).any(|joint| {
            lean += joint[0];
            f64::abs(lean) > angle * (1.0 + BEYOND)
        });
        let [low, high] = chain.cart.travel_m;
        leans || !(low..=high).contains(&state[0])
    }

    /// The kinds in which arming has to be refused.
    fn arm<const NX: usize, const NY: usize>(&self, stage: &mut Stage<'_, NX, NY>) -> Result<Seen, RunError> {
        let mut seen = Seen::default();
        let mut stopped = false;
        if self.trial.kind != Kind::ArmUnhomed {
            // To the links hanging, homed and checked.
            for tick in 0.. {
                stage.by_hand(tick)?;
                if stage.session.seen().signs == Signs::Checked {
                    break;
                }
            }
        }
        if matches!(self.trial.kind, Kind::ArmStopped | Kind::ArmHeld) {
            let mut inputs = stage.inputs();
            inputs.contacts.emergency_stop = true;
            seen.on_again |= stage.session.tick(&inputs)?.enable;
            stopped = self.trial.kind == Kind::ArmStopped;
        }
        let mut inputs = stage.inputs();
        inputs.contacts.emergency_stop = stopped;
        let mut refusal = stage.session.ask(Request::Arm, &inputs);
        if self.trial.kind == Kind::ArmHeld {
            stage.session.ask(Request::Clear, &inputs)?;
            refusal = stage.session.ask(Request::Arm, &inputs);
        }
        match refusal {
            Err(SessionError::Refused { answer: Answer::NotNow(reasons), .. }) => {
                seen.refused = Some(reasons)
            }
            Err(error) => return Err(error.into()),
            Ok(_) => (),
        }
        for _ in 0..TICKS_AFTER {
            seen.on_again |= stage.session.tick(&inputs)?.enable;
        }
        Ok(seen)
    }
}

/// Ticks watched after the motor went off.
const TICKS_AFTER: usize = 12;
