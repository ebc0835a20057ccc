//! Tours: all motions of a table, one after the other, by the whole firmware.

use serde::{Deserialize, Serialize};
use upright::protocol::message::Request;
use upright::supervision::supervisor::State;
use upright::table::Equilibrium;

use super::SwingUpError;
use super::robustness::{Spread, drawn};
use super::way::{Way, rest};
use crate::harness::{Harness, HarnessError, Target, goals, with_firmware};
use crate::plant::{absolute_angles, without_turns};
use crate::rig::Rig;
use crate::simulate::{Goal, Scenario};
use crate::study::Study;
use crate::table::{MotionValues, SwingUpValues, TableValues};
use crate::verify::{Disturbance, wilson};

/// Time to balance at each equilibrium (s).
const BALANCE_S: f64 = 1.0;
/// Time to hang with the motor off (s): the swinging decays, and a hand puts the rig back.
const HANG_S: f64 = 8.0;
/// Largest angle from an equilibrium at which a link counts as being there (rad).
const NEAR_RAD: f64 = 0.35;
/// Ticks between two telemetry messages of a random run.
const TELEMETRY_TICKS: u16 = 20;

/// All motions of a table, in an order in which each begins where the one before it has ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Tour {
    /// The motions from hanging to hanging, beginning with the raising. A motion is repeated if there is no other way.
    pub ways: Vec<Way>,
    /// Time at which each of them is requested (s).
    pub begin_s: Vec<f64>,
    /// Duration of the tour (s): it includes the pause after the last motion.
    pub duration_s: f64,
    links: usize,
}

impl Tour {
    /// A tour of all motions of `table`; none if it has no motions, or if one of them cannot be reached from hanging
    /// or does not lead back there.
    pub fn of(rig: &Rig, table: &TableValues) -> Option<Self> {
        let swing_up = table.swing_up.as_ref()?;
        let links = rig.states() / 2 - 1;
        let others = swing_up.others.iter().map(|(way, _)| *way);
        let ways = walk(Way::BOTH.into_iter().chain(others).collect(), links)?;
        let (mut begin_s, mut now_s) = (Vec::new(), 0.0);
        for way in &ways {
            begin_s.push(now_s);
            let pause_s = if way.ends_hanging() { HANG_S } else { BALANCE_S };
            now_s += f64::from(motion(swing_up, *way)?.ticks) * rig.tick.period_s + pause_s;
        }
        Some(Self { ways, begin_s, duration_s: now_s, links })
    }

    /// The tour as a run of the firmware that starts from rest, with encoders and the rig's noise.
    pub fn scenario(&self, rig: &Rig, seed: u64) -> Scenario {
        let disturbance = Disturbance::of(rig);
        let goal = |(way, &at_s): (&Way, &f64)| Goal { at_s, to: way.to(self.links) };
        Scenario {
            goals: self.ways.iter().zip(&self.begin_s).skip(1).map(goal).collect(),
            force_noise_n: disturbance.force_n,
            torque_noise_n_m: disturbance.torque_n_m,
            seed,
            ..Scenario::swing_up(rig, self.duration_s, None)
        }
    }
}

/// The supervisor's states during a motion and after it.
pub(super) fn states(way: Way, links: usize) -> [State; 2] {
    match way.to(links) {
        Equilibrium::UPRIGHT => [State::Raising, State::Balancing],
        _ if way.ends_hanging() => [State::Lowering, State::Calibrated],
        _ => [State::Raising, State::Holding],
    }
}

/// The motion for this way, if the table has it.
fn motion(swing_up: &SwingUpValues, way: Way) -> Option<&MotionValues> {
    match way {
        Way::Up => Some(&swing_up.raise),
        Way::Down => Some(&swing_up.lower),
        way => swing_up.others.iter().find(|(other, _)| *other == way).map(|(_, motion)| motion),
    }
}

/// A walk through all ways, from hanging to hanging, beginning with the first of them. If unused ways begin here, it
/// takes the one at whose end most unused ways begin; otherwise the shortest path to where one is left.
fn walk(ways: Vec<Way>, links: usize) -> Option<Vec<Way>> {
    let hanging = Equilibrium::hanging(links);
    let mut left = ways.clone();
    let mut walk = vec![left.remove(0)];
    let mut here = walk[0].to(links);
    while !left.is_empty() || here != hanging {
        let from = |at: Equilibrium| left.iter().filter(move |way| way.from(links) == at).count();
        let next = (0..left.len())
            .filter(|&index| left[index].from(links) == here)
            .max_by_key(|&index| from(left[index].to(links)));
        if let Some(next) = next {
            let way = left.remove(next);
            here = way.to(links);
            walk.push(way);
            continue;
        }
        let is_goal = |at: Equilibrium| if left.is_empty() { at == hanging } else { from(at) > 0 };
        let path = shortest(&ways, here, &is_goal, links)?;
        here = path.last()?.to(links);
        walk.extend(path);
    }
    Some(walk)
}

/// Those of `ways` that a tour can contain: they can be reached from hanging, and hanging from where they end.
pub fn on_tour(ways: &[Way], links: usize) -> Vec<Way> {
    let all: Vec<Way> = Way::BOTH.into_iter().chain(ways.iter().copied()).collect();
    let hanging = Equilibrium::hanging(links);
    let leads = |from, goal| from == goal || shortest(&all, from, &|at| at == goal, links).is_some();
    let is_held = |way: &&Way| leads(hanging, way.from(links)) && leads(way.to(links), hanging);
    ways.iter().filter(is_held).copied().collect()
}

/// The path with the fewest ways from `here` to a goal, if there is one.
fn shortest(
    ways: &[Way],
    here: Equilibrium,
    is_goal: &dyn Fn(Equilibrium) -> bool,
    links: usize,
) -> Option<Vec<Way>> {
    let mut reached = vec![here];
    let mut paths = vec![Vec::new()];
    let mut next = 0;
    while next < reached.len() {
        let at = reached[next];
        for &way in ways.iter().filter(|way| way.from(links) == at) {
            let to = way.to(links);
            if reached.contains(&to) {
                continue;
            }
            let mut path: Vec<Way> = paths[next].clone();
            path.push(way);
            if is_goal(to) {
                return Some(path);
            }
            reached.push(to);
            paths.push(path);
        }
        next += 1;
    }
    None
}

/// Results of one motion in a set of tours.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Leg {
    /// Which motion.
    pub way: Way,
    /// Number of tours that came as far as this motion.
    pub tried: usize,
    /// Number of those in which the links ended where they should.
    pub arrived: usize,
    /// 95 % confidence interval of their share (Wilson).
    pub interval: [f64; 2],
}

/// Results of a set of tours.
#[derive(Debug, Clone, PartialEq)]
pub struct Tours {
    /// The motions in the order of the tour.
    pub legs: Vec<Leg>,
    /// For each tour that ended early: the motion that did not arrive, and the fault.
    pub faults: Vec<(Way, String)>,
}

/// Result of one tour: number of motions that arrived, and the fault that ended it.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Gone {
    arrived: usize,
    fault: Option<String>,
}

/// `runs` tours with the firmware of `table`, each with another machine: masses, friction, start and encoder zeros are
/// wrong within the spreads of `[swing_up]`, drawn with the seeds from `base_seed` on. A tour ends with the first
/// motion that does not arrive.
///
/// # Errors
/// [`SwingUpError`] if the firmware does not run.
pub fn tours(
    rig: &Rig,
    table: &TableValues,
    tour: &Tour,
    base_seed: u64,
    runs: usize,
    study: &Study,
) -> Result<Tours, SwingUpError> {
    let scenario = Scenario { substeps: 2, ..tour.scenario(rig, base_seed) };
    let spread = Spread::asked(rig);
    let one = |number: u64| {
        let seed = base_seed + number;
        let (real, start) = drawn(rig, Way::Up, &spread, seed);
        let scenario = Scenario { start, seed, ..scenario.clone() };
        with_firmware(table, |target| gone(&real, table, tour, &scenario, target))
            .flatten()
            .map_err(|error| SwingUpError::Firmware(error.to_string()))
    };
    let all: Vec<Gone> = study.outcomes("tours", runs as u64, one)?;
    let leg = |index: usize| {
        let tried = all.iter().filter(|gone| gone.arrived >= index).count();
        let arrived = all.iter().filter(|gone| gone.arrived > index).count();
        Leg { way: tour.ways[index], tried, arrived, interval: wilson(arrived, tried) }
    };
    let fault = |gone: &Gone| {
        let way = *tour.ways.get(gone.arrived)?;
        Some((way, gone.fault.clone().unwrap_or_else(|| "no fault".to_owned())))
    };
    Ok(Tours {
        legs: (0..tour.ways.len()).map(leg).collect(),
        faults: all.iter().filter_map(fault).collect(),
    })
}

fn gone(
    rig: &Rig,
    table: &TableValues,
    tour: &Tour,
    scenario: &Scenario,
    target: &mut dyn Target,
) -> Result<Gone, HarnessError> {
    let mut gone = Gone::default();
    let goals = goals(scenario, rig.tick.period_s);
    let mut harness = Harness::new(rig, table, scenario, target)?;
    let inputs = harness.inputs();
    harness.session.ask(Request::Telemetry(TELEMETRY_TICKS), &inputs)?;
    let mut output = harness.raise(None)?;
    let last = (tour.duration_s / rig.tick.period_s) as usize;
    for tick in 0..=last {
        if tick > 0 {
            let inputs = harness.inputs();
            output = harness.session.tick(&inputs)?;
        }
        harness.ask_for(tick, &goals);
        let ends = goals.get(gone.arrived).map_or(last, |(at, _)| *at);
        if tick + 1 >= ends && gone.arrived < tour.ways.len() {
            if !has_arrived(&harness, tour, gone.arrived) {
                break;
            }
            gone.arrived += 1;
        }
        harness.bench.tick(output.drive);
        while harness.session.next_telemetry().is_some() || harness.session.next_reply().is_some() {}
    }
    gone.fault = harness.session.fault().map(|fault| fault.to_string());
    Ok(gone)
}

/// Whether motion `index` of the tour has begun and ended where it should.
fn has_arrived(harness: &Harness<'_>, tour: &Tour, index: usize) -> bool {
    let way = tour.ways[index];
    let [_, after] = states(way, tour.links);
    harness.begun().len() >= index
        && harness.session.status().state == after
        && is_near(harness.bench.state(), way.to(tour.links))
}

/// Whether all links are near `at`, apart from whole turns.
fn is_near(state: &[f64], at: Equilibrium) -> bool {
    let away: Vec<f64> = state.iter().zip(rest(at, state.len())).map(|(state, rest)| state - rest).collect();
    let away = without_turns(&away);
    absolute_angles(&away).all(|angle| angle.abs() < NEAR_RAD)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tour_goes_every_way_once_if_it_can() {
        for links in 1..=3 {
            let ways = Way::all(links);
            let (mut sorted, others): (Vec<Way>, Vec<Way>) =
                ways.iter().partition(|way| **way == Way::Up || **way == Way::Down);
            sorted.sort_by_key(|way| *way == Way::Down);
            let walk = walk(sorted.into_iter().chain(others).collect(), links).unwrap();
            assert_eq!(walk.len(), ways.len());
            assert!(ways.iter().all(|way| walk.contains(way)));
            assert_eq!(walk[0], Way::Up);
            assert!(walk.windows(2).all(|pair| pair[0].to(links) == pair[1].from(links)));
            assert!(walk.last().unwrap().ends_hanging());
        }
    }

    #[test]
    fn where_no_way_leads_back_there_is_no_tour() {
        let named = |name| Way::named(name, 2).unwrap();
        assert_eq!(walk(vec![Way::Up, Way::Down, named("uu-ud")], 2), None);
        let detour = walk(vec![Way::Up, Way::Down, named("uu-ud"), named("ud-uu")], 2).unwrap();
        let ways = ["uu-ud", "du-uu", "uu-du"].map(named);
        assert_eq!(on_tour(&ways, 2), ways[1..]);
        assert_eq!(detour, [Way::Up, named("uu-ud"), named("ud-uu"), Way::Down]);
    }
}
