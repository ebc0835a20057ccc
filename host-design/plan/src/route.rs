//! Routes: all motions of a table, one after the other, by the whole firmware.

use serde::{Deserialize, Serialize};
use upright::board::Output;
use upright::protocol::message::Request;
use upright::supervision::supervisor::State;
use upright::table::Equilibrium;

use super::SwingUpError;
use super::robustness::{MotionSpread, TELEMETRY_TICKS, drawn};
use upright_closed_loop::harness::{BeforeMotion, Goals, HarnessError, Target, World, until, with_firmware};
use upright_design::motion::{Transition, rest};
use upright_design::plant::{absolute_angles, without_turns};
use upright_design::rig::Rig;
use upright_design::rig::defaults::ANGLE_RAD;
use upright_design::simulate::{Disturbance, Goal, Scenario};
use upright_design::study::Study;
use upright_design::table::{MotionValues, SwingUpValues, TableValues};
use upright_trust::verify::wilson;

/// Time to balance at each equilibrium (s).
const BALANCE_S: f64 = 1.0;
/// Time to hang with the motor off (s): the swinging decays, and a hand puts the rig back.
const HANG_S: f64 = 8.0;
/// Largest angle from an equilibrium at which a link counts as being there (rad).
const NEAR_RAD: f64 = ANGLE_RAD;

/// All motions of a table, in an order in which each begins where the one before it has ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// The motions from hanging to hanging, beginning with the raising. A motion is repeated if nothing else leads on.
    pub transitions: Vec<Transition>,
    /// Time at which each of them is requested (s).
    pub begin_s: Vec<f64>,
    /// Duration of the route (s): it includes the pause after the last motion.
    pub duration_s: f64,
    links: usize,
}

impl Route {
    /// A route through all motions of `table`; none if it has no motions, or if one of them cannot be reached from
    /// hanging or does not lead back there.
    pub fn of(rig: &Rig, table: &TableValues) -> Option<Self> {
        let swing_up = table.swing_up.as_ref()?;
        let links = rig.links();
        let others = swing_up.others.iter().map(|(transition, _)| *transition);
        let transitions = route_through(Transition::BOTH.into_iter().chain(others).collect(), links)?;
        let (mut begin_s, mut now_s) = (Vec::new(), 0.0);
        for transition in &transitions {
            begin_s.push(now_s);
            let pause_s = if transition.ends_hanging() { HANG_S } else { BALANCE_S };
            now_s += f64::from(motion(swing_up, *transition)?.ticks) * rig.tick.period_s + pause_s;
        }
        Some(Self { transitions, begin_s, duration_s: now_s, links })
    }

    /// The route as a run of the firmware that starts from rest, with encoders and the rig's noise.
    pub fn scenario(&self, rig: &Rig, seed: u64) -> Scenario {
        let disturbance = Disturbance::of(rig);
        let goal = |(transition, &at_s): (&Transition, &f64)| Goal { at_s, to: transition.to(self.links) };
        Scenario {
            goals: self.transitions.iter().zip(&self.begin_s).skip(1).map(goal).collect(),
            force_noise_n: disturbance.force_n,
            torque_noise_n_m: disturbance.torque_n_m,
            seed,
            ..Scenario::swing_up(rig, self.duration_s, None)
        }
    }
}

/// The supervisor's states during a motion and after it.
pub(crate) fn states(transition: Transition, links: usize) -> [State; 2] {
    match transition.to(links) {
        Equilibrium::UPRIGHT => [State::Raising, State::Balancing],
        _ if transition.ends_hanging() => [State::Lowering, State::Calibrated],
        _ => [State::Raising, State::Holding],
    }
}

/// The motion for this transition, if the table has it.
fn motion(swing_up: &SwingUpValues, transition: Transition) -> Option<&MotionValues> {
    match transition {
        Transition::Up => Some(&swing_up.raise),
        Transition::Down => Some(&swing_up.lower),
        transition => {
            swing_up.others.iter().find(|(other, _)| *other == transition).map(|(_, motion)| motion)
        }
    }
}

/// A route through all transitions, from hanging to hanging, beginning with the first of them. If unused ones begin
/// here, it takes the one at whose end most unused ones begin; otherwise the shortest path to where one is left.
fn route_through(transitions: Vec<Transition>, links: usize) -> Option<Vec<Transition>> {
    let hanging = Equilibrium::hanging(links);
    let mut left = transitions.clone();
    let mut route = vec![left.remove(0)];
    let mut here = route[0].to(links);
    while !left.is_empty() || here != hanging {
        let from =
            |at: Equilibrium| left.iter().filter(move |transition| transition.from(links) == at).count();
        let next = (0..left.len())
            .filter(|&index| left[index].from(links) == here)
            .max_by_key(|&index| from(left[index].to(links)));
        if let Some(next) = next {
            let transition = left.remove(next);
            here = transition.to(links);
            route.push(transition);
            continue;
        }
        let is_goal = |at: Equilibrium| if left.is_empty() { at == hanging } else { from(at) > 0 };
        let path = shortest(&transitions, here, &is_goal, links)?;
        here = path.last()?.to(links);
        route.extend(path);
    }
    Some(route)
}

/// Those of `transitions` that a route can contain: they can be reached from hanging, and hanging from where they end.
pub fn on_route(transitions: &[Transition], links: usize) -> Vec<Transition> {
    let all: Vec<Transition> = Transition::BOTH.into_iter().chain(transitions.iter().copied()).collect();
    let hanging = Equilibrium::hanging(links);
    let leads = |from, goal| from == goal || shortest(&all, from, &|at| at == goal, links).is_some();
    let is_held = |transition: &&Transition| {
        leads(hanging, transition.from(links)) && leads(transition.to(links), hanging)
    };
    transitions.iter().filter(is_held).copied().collect()
}

/// The path with the fewest transitions from `here` to a goal, if there is one.
fn shortest(
    transitions: &[Transition],
    here: Equilibrium,
    is_goal: &dyn Fn(Equilibrium) -> bool,
    links: usize,
) -> Option<Vec<Transition>> {
    let mut reached = vec![here];
    let mut paths = vec![Vec::new()];
    let mut next = 0;
    while next < reached.len() {
        let at = reached[next];
        for &transition in transitions.iter().filter(|transition| transition.from(links) == at) {
            let to = transition.to(links);
            if reached.contains(&to) {
                continue;
            }
            let mut path: Vec<Transition> = paths[next].clone();
            path.push(transition);
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

/// Results of one motion in runs along a route.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TransitionRuns {
    /// Which motion.
    pub transition: Transition,
    /// Number of runs that came as far as this motion.
    pub tried: usize,
    /// Number of those in which the links ended where they should.
    pub arrived: usize,
    /// 95 % confidence interval of their share (Wilson).
    pub interval: [f64; 2],
}

/// Results of such runs.
#[derive(Debug, Clone, PartialEq)]
pub struct RouteRuns {
    /// The motions in the order of the route.
    pub transitions: Vec<TransitionRuns>,
    /// For each run that ended early: the motion that did not arrive, and the fault.
    pub faults: Vec<(Transition, String)>,
}

/// Result of one run: number of motions that arrived, and the fault that ended it.
#[derive(Debug, Default, Serialize, Deserialize)]
struct RouteRun {
    arrived: usize,
    fault: Option<String>,
}

/// `runs` runs along `route` with the firmware of `table`, each with another machine: masses, friction, start and
/// encoder zeros are wrong within the spreads of `[swing_up]`, drawn with the seeds from `base_seed` on. A run ends
/// with the first motion that does not arrive.
///
/// # Errors
/// [`SwingUpError`] if the firmware does not run.
pub fn route_runs(
    rig: &Rig,
    table: &TableValues,
    route: &Route,
    base_seed: u64,
    runs: usize,
    study: &Study,
) -> Result<RouteRuns, SwingUpError> {
    let scenario = Scenario { substeps: 2, ..route.scenario(rig, base_seed) };
    let spread = MotionSpread::asked(rig);
    let one = |number: u64| {
        let seed = base_seed + number;
        let (real, start) = drawn(rig, Transition::Up, &spread, seed);
        let scenario = Scenario { start, seed, ..scenario.clone() };
        with_firmware(table, |target| along_route(&real, table, route, &scenario, target))
            .flatten()
            .map_err(|error| SwingUpError::Firmware(error.to_string()))
    };
    let all: Vec<RouteRun> = study.outcomes("routes", runs as u64, one)?;
    let of_motion = |index: usize| {
        let tried = all.iter().filter(|run| run.arrived >= index).count();
        let arrived = all.iter().filter(|run| run.arrived > index).count();
        TransitionRuns {
            transition: route.transitions[index],
            tried,
            arrived,
            interval: wilson(arrived, tried),
        }
    };
    let fault = |run: &RouteRun| {
        let transition = *route.transitions.get(run.arrived)?;
        Some((transition, run.fault.clone().unwrap_or_else(|| "no fault".to_owned())))
    };
    Ok(RouteRuns {
        transitions: (0..route.transitions.len()).map(of_motion).collect(),
        faults: all.iter().filter_map(fault).collect(),
    })
}

fn along_route(
    rig: &Rig,
    table: &TableValues,
    route: &Route,
    scenario: &Scenario,
    target: &mut dyn Target,
) -> Result<RouteRun, HarnessError> {
    let mut world = World::new(rig, table, scenario, target)?;
    world.raise(None)?;
    world.goals = Goals::of(rig, scenario);
    world.session.send(Request::Telemetry(TELEMETRY_TICKS));
    let last = (route.duration_s / rig.tick.period_s) as usize;
    let mut run = RouteRun::default();
    let mut watch = BeforeMotion(|world: &mut World<'_>, _: &mut Output| {
        run.fault = world.session.fault().map(|fault| fault.to_string());
        let ends = world.goals.tick_of(run.arrived).unwrap_or(last);
        if world.ticks() + 1 < ends || run.arrived >= route.transitions.len() {
            return until(false);
        }
        let arrives = has_arrived(world, route, run.arrived);
        run.arrived += usize::from(arrives);
        until(!arrives)
    });
    world.run(last + 1, &mut [&mut watch])?;
    Ok(run)
}

/// Whether motion `index` of the route has begun and ended where it should.
fn has_arrived(world: &World<'_>, route: &Route, index: usize) -> bool {
    let transition = route.transitions[index];
    let [_, after] = states(transition, route.links);
    world.goals.begun().len() >= index
        && world.session.status().state == after
        && is_near(world.bench.state(), transition.to(route.links))
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
    fn a_route_has_every_transition_once_if_it_can() {
        for links in 1..=3 {
            let transitions = Transition::all(links);
            let (mut sorted, others): (Vec<Transition>, Vec<Transition>) = transitions
                .iter()
                .partition(|transition| **transition == Transition::Up || **transition == Transition::Down);
            sorted.sort_by_key(|transition| *transition == Transition::Down);
            let route = route_through(sorted.into_iter().chain(others).collect(), links).unwrap();
            assert_eq!(route.len(), transitions.len());
            assert!(transitions.iter().all(|transition| route.contains(transition)));
            assert_eq!(route[0], Transition::Up);
            assert!(route.windows(2).all(|pair| pair[0].to(links) == pair[1].from(links)));
            assert!(route.last().unwrap().ends_hanging());
        }
    }

    #[test]
    fn where_no_transition_leads_back_there_is_no_route() {
        let named = |name| Transition::named(name, 2).unwrap();
        assert_eq!(route_through(vec![Transition::Up, Transition::Down, named("uu-ud")], 2), None);
        let detour =
            route_through(vec![Transition::Up, Transition::Down, named("uu-ud"), named("ud-uu")], 2).unwrap();
        let transitions = ["uu-ud", "du-uu", "uu-du"].map(named);
        assert_eq!(on_route(&transitions, 2), transitions[1..]);
        assert_eq!(detour, [Transition::Up, named("uu-ud"), named("ud-uu"), Transition::Down]);
    }
}
