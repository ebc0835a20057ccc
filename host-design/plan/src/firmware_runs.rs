//! Random runs of the whole firmware: the rig is raised from hanging, balances, is lowered, and hangs.

use core::ops::Range;
use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use upright::board::Output;
use upright::protocol::message::{Answer, Request};
use upright::supervision::supervisor::State;
use upright::table::Equilibrium;

use super::SwingUpError;
use super::closed_loop::deviation;
use super::demonstration::{hang, up_and_down};
use super::robustness::{MotionSpread, RandomRuns, TELEMETRY_TICKS, drawn};
use upright_closed_loop::harness::{BeforeMotion, Goals, HarnessError, Target, World, until, with_firmware};
use upright_design::motion::{RaiseAndLower, Transition};
use upright_design::rig::{LinkEncoder, PlantDescription, Rig};
use upright_design::simulate::Scenario;
use upright_design::study::{Study, infinite_if_null};
use upright_design::table::TableValues;
use upright_trust::verify::wilson;

/// How long a raised rig balances before it is lowered (s).
const UPRIGHT_S: f64 = 1.0;

/// The errors in a set of runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Condition {
    /// Description, which is also the name of the runs in a study.
    pub name: &'static str,
    /// Ranges of the errors of masses, friction, start and encoder zeros.
    pub spread: MotionSpread,
    /// Counts per turn of the joints' encoders, instead of the rig's; the table is designed with them.
    pub joint_counts: Option<f64>,
    /// Whether the motor acts a tick later than the firmware assumes.
    pub is_late: bool,
}

impl Condition {
    /// The rows of the table in the documentation.
    pub fn all() -> [Self; 8] {
        let degree = core::f64::consts::PI / 180.0;
        let usual = MotionSpread::new(0.0, 0.0);
        let named = |name, spread| Self { name, spread, joint_counts: None, is_late: false };
        [
            named("masses and friction as in the file", usual),
            named("masses ±2 %, friction ±30 %", MotionSpread::new(0.02, 0.3)),
            named("masses ±5 %, friction ±30 %", MotionSpread::new(0.05, 0.3)),
            named("start off by 10°", MotionSpread { tilt_rad: 10.0 * degree, ..usual }),
            named("start off by 20 mm", MotionSpread { position_m: 0.02, ..usual }),
            named("zeros off by 0.3°", MotionSpread { zero_rad: 0.3 * degree, ..usual }),
            Self { joint_counts: Some(1024.0), ..named("1024 counts per turn", usual) },
            Self { is_late: true, ..named("a tick late", usual) },
        ]
    }

    /// The errors that a motion has to survive according to `[swing_up]`.
    pub fn asked(rig: &Rig) -> Self {
        let (spread, name) = (MotionSpread::asked(rig), "errors of [swing_up]");
        Self { name, spread, joint_counts: None, is_late: false }
    }

    /// The rig that the table for this condition is designed for.
    pub fn designed(&self, rig: &Rig) -> Rig {
        let mut rig = rig.clone();
        if let (PlantDescription::Chain(chain), Some(counts)) = (&mut rig.plant, self.joint_counts) {
            for link in &mut chain.links {
                link.encoder = Some(LinkEncoder::CountsPerRev(counts));
            }
        }
        rig
    }
}

/// Results of a set of runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FirmwareRuns {
    /// Runs in which the firmware did not begin to raise the rig, by the reason.
    pub refused: BTreeMap<String, usize>,
    /// Of the runs that were not refused: those that are upright until they are lowered.
    pub raise: RandomRuns,
    /// Of those that are upright: those that hang in the end, the motor off, without a fault.
    pub lower: RandomRuns,
    /// Faults that ended a run, and how often.
    pub faults: BTreeMap<String, usize>,
}

impl FirmwareRuns {
    /// The raising, counted over all runs: a run that was refused has not arrived.
    pub fn raise_in_all(&self) -> RandomRuns {
        let runs = self.refused.values().sum::<usize>() + self.raise.runs;
        RandomRuns { runs, interval: wilson(self.raise.arrived, runs), ..self.raise.clone() }
    }

    /// The raising, counted over all runs, or the lowering of those that were raised.
    pub fn runs_of(&self, transition: Transition) -> RandomRuns {
        if transition == Transition::Up { self.raise_in_all() } else { self.lower.clone() }
    }

    /// What ended the runs that did not arrive, the most frequent first, as text.
    pub(crate) fn ended_text(&self) -> String {
        let mut faults: Vec<_> = self.faults.iter().collect();
        faults.sort_by_key(|(_, count)| core::cmp::Reverse(**count));
        let faults = faults.into_iter().map(|(fault, count)| format!("fault {fault} ended {count}"));
        let refused = self.refused.iter().map(|(reason, count)| format!("{count} did not begin ({reason})"));
        faults.chain(refused).collect::<Vec<_>>().join(", ")
    }
}

/// Result of one run.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Reached {
    refused: Option<String>,
    arrived: bool,
    hung: bool,
    fault: Option<String>,
    /// Largest distance of a link from its planned angle during the raising and the lowering (rad).
    deviation_rad: [Deviation; 2],
}

#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
struct Deviation(#[serde(deserialize_with = "infinite_if_null")] f64);

/// Runs of the firmware of `table`, which is designed for `rig`, one with each of the `seeds`, on all threads; the
/// outcome does not depend on their number. `motions` are those of the table. The condition is a part of `study`.
///
/// # Errors
/// [`SwingUpError`] if the table has no motions, or the firmware does not run.
pub fn firmware_runs(
    rig: &Rig,
    table: &TableValues,
    motions: &RaiseAndLower,
    condition: &Condition,
    seeds: Range<u64>,
    study: &Study,
) -> Result<FirmwareRuns, SwingUpError> {
    let scenario = Scenario { substeps: 2, ..up_and_down(rig, table, UPRIGHT_S)? };
    let one = |number: u64| {
        let seed = seeds.start + number;
        let (mut real, start) = drawn(rig, Transition::Up, &condition.spread, seed);
        real.tick.delay_ticks = u8::from(condition.is_late);
        let scenario = Scenario { start, seed, ..scenario.clone() };
        with_firmware(table, |target| raised_and_lowered(&real, table, motions, &scenario, target))
            .flatten()
            .map_err(|error| SwingUpError::Firmware(error.to_string()))
    };
    let all: Vec<Reached> = study.outcomes(condition.name, seeds.end - seeds.start, one)?;
    let counts = |what: &dyn Fn(&Reached) -> Option<String>| {
        let mut counts = BTreeMap::new();
        for name in all.iter().filter_map(what) {
            *counts.entry(name).or_default() += 1;
        }
        counts
    };
    let counted = |begun: &dyn Fn(&Reached) -> bool, arrived: &dyn Fn(&Reached) -> bool, motion: usize| {
        let tried = all.iter().filter(|run| begun(run)).count();
        let arrived = || all.iter().filter(|run| arrived(run));
        let deviation_rad =
            arrived().fold(0.0, |largest, run| f64::max(largest, run.deviation_rad[motion].0));
        let arrived = arrived().count();
        RandomRuns {
            base_seed: seeds.start,
            runs: tried,
            arrived,
            interval: wilson(arrived, tried),
            deviation_rad,
        }
    };
    Ok(FirmwareRuns {
        refused: counts(&|run| run.refused.clone()),
        raise: counted(&|run| run.refused.is_none(), &|run| run.arrived, 0),
        lower: counted(&|run| run.arrived, &|run| run.hung, 1),
        faults: counts(&|run| run.fault.clone()),
    })
}

/// The first reason that the firmware gives against raising the links, without its remedy.
fn why_not_begun(world: &mut World<'_>) -> Result<String, HarnessError> {
    let inputs = world.inputs();
    let reason = match world.session.ask(Request::Goto(Equilibrium::UPRIGHT), &inputs) {
        Err(HarnessError::Refused { answer: Answer::NotNow(inhibits), .. }) => inhibits.texts().next(),
        answer => answer.map(|_| None)?,
    };
    let text = reason.unwrap_or("it took longer than a minute");
    Ok(text.split_once(':').map_or(text, |(reason, _)| reason).to_owned())
}

fn raised_and_lowered(
    rig: &Rig,
    table: &TableValues,
    motions: &RaiseAndLower,
    scenario: &Scenario,
    target: &mut dyn Target,
) -> Result<Reached, HarnessError> {
    let goals = Goals::of(rig, scenario);
    let Some(lower_at) = goals.tick_of(0) else { return Ok(Reached::default()) };
    let mut world = World::new(rig, table, scenario, target)?;
    match world.raise(None) {
        Err(HarnessError::NotBalancing(_)) => {
            // A fault in the first ticks of the motion is none of the reasons against a command.
            let fault = world.session.fault().map(|fault| fault.to_string());
            let refused = if fault.is_some() { None } else { Some(why_not_begun(&mut world)?) };
            return Ok(Reached { fault, refused, ..Reached::default() });
        }
        raised => raised?,
    };
    world.goals = goals;
    world.session.send(Request::Telemetry(TELEMETRY_TICKS));
    let last = (scenario.duration_s / rig.tick.period_s).round() as usize;
    let mut reached = Reached::default();
    let mut watch = BeforeMotion(|world: &mut World<'_>, _: &mut Output| {
        let (tick, lowered) = (world.ticks(), world.goals.begun().first().copied());
        if tick > last + lowered.map_or(0, |from| from - lower_at) {
            return until(true);
        }
        let state = world.session.status().state;
        if tick == lower_at {
            reached.arrived = state == State::Balancing;
        }
        let moves = [(&motions.raise, Some(0)), (&motions.lower, lowered)];
        for ((motion, begin), largest) in moves.into_iter().zip(&mut reached.deviation_rad) {
            let planned = begin.and_then(|begin| motion.x.get(tick.checked_sub(begin)?));
            if let Some(planned) = planned {
                largest.0 = largest.0.max(deviation(world.bench.state(), planned));
            }
        }
        until(false)
    });
    world.run(usize::MAX, &mut [&mut watch])?;
    reached.fault = world.session.fault().map(|fault| fault.to_string());
    reached.hung = reached.arrived
        && reached.fault.is_none()
        && world.session.status().state == State::Calibrated
        && hang(world.bench.state());
    Ok(reached)
}
