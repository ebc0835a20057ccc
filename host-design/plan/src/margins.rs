//! How far each link may be pushed at each moment of a motion.

use serde::Serialize;
use upright::board::Output;
use upright::protocol::message::Request;
use upright::supervision::supervisor::State;
use upright::table::Equilibrium;

use super::SwingUpError;
use super::demonstration::{hang, up_and_down};
use super::robustness::TELEMETRY_TICKS;
use upright_closed_loop::harness::{BeforeMotion, Goals, HarnessError, Target, World, until, with_firmware};
use upright_design::motion::Transition;
use upright_design::parallel;
use upright_design::plant::absolute_angles;
use upright_design::rig::Rig;
use upright_design::simulate::{Begin, Goal, Scenario};
use upright_design::table::TableValues;

/// Duration of a push (s): a tap of a finger.
const PUSH_S: f64 = 0.05;
/// The first push that is tried, and the largest and the smallest (N).
const FIRST_N: f64 = 0.125;
const LARGEST_N: f64 = 32.0;
const SMALLEST_N: f64 = 1.0 / 4096.0;
/// Halvings of the interval from a push that is survived to its double, which is not: the edge is found to 1/16 of
/// the push.
const HALVINGS: u32 = 4;
/// Time to balance before a lowering, and to watch the rig after a motion (s).
const UPRIGHT_S: f64 = 0.5;
const AFTER_S: f64 = 1.0;
/// Longest time from the request until a lowering begins (s).
const LONGEST_WAIT_S: f64 = 5.0;

/// Margins at one moment of a motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Margin {
    /// Time since the beginning of the motion (s).
    pub at_s: f64,
    /// For each link: the largest push against its angle and along it after which the motion still arrives (N, both
    /// positive). A push of 32 N is the largest that is tried; 0: not even one of 1/4096 N is survived.
    pub links_n: Vec<[f64; 2]>,
}

/// A force at the end of one link, perpendicular to it.
#[derive(Debug, Clone, Copy)]
struct Push {
    /// First tick of the push; it lasts [`PUSH_S`].
    tick: usize,
    link: usize,
    /// Positive: it makes the link's angle larger (N).
    force_n: f64,
}

/// Margins of the raising or the lowering of `table`, which is designed for `rig`, at `moments` equally spaced moments
/// from its beginning on; `done` is called after each.
///
/// A push is a force at the end of one link, perpendicular to it, that begins at this moment and lasts 50 ms. The
/// firmware notices it through its encoders only, and its supervision is on. The machine is the rig of the file,
/// without noise. A second after the motion, a raised rig has to balance and a lowered one to hang, without a fault.
///
/// Pushes are doubled until one is not survived; then bisection finds the edge. Larger ones may be survived again.
/// All margins are 0 if the motion does not even arrive without a push.
///
/// # Errors
/// [`SwingUpError`] if the table has no motions, or the firmware does not run.
pub fn margins(
    rig: &Rig,
    table: &TableValues,
    transition: Transition,
    moments: usize,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Margin>, SwingUpError> {
    let scenario =
        Scenario { force_noise_n: 0.0, torque_noise_n_m: 0.0, ..up_and_down(rig, table, UPRIGHT_S)? };
    let scenario = match transition {
        Transition::Up => scenario,
        Transition::Down => Scenario {
            begin: Begin::ByHand,
            start: vec![0.0; rig.states()],
            goals: vec![Goal { at_s: UPRIGHT_S, to: Equilibrium::HANGING }],
            ..scenario
        },
        Transition::Between { .. } => return Err(SwingUpError::NoMotions),
    };
    let pushed = |push: Option<Push>| -> Result<Option<usize>, SwingUpError> {
        with_firmware(table, |target| arrival(rig, table, &scenario, push, target))
            .flatten()
            .map_err(|error| SwingUpError::Firmware(error.to_string()))
    };
    let (ticks, begin) = (motion_ticks(table, transition), pushed(None)?);
    let edge = |tick: usize, link: usize, side: f64| -> Result<f64, SwingUpError> {
        let Some(begin) = begin else { return Ok(0.0) };
        let survives =
            |size: f64| Ok(pushed(Some(Push { tick: begin + tick, link, force_n: side * size }))?.is_some());
        largest(survives)
    };
    let links = rig.links();
    let at = |moment: usize| -> Result<Margin, SwingUpError> {
        let tick = moment * ticks / moments;
        let both = |link| Ok([edge(tick, link, -1.0)?, edge(tick, link, 1.0)?]);
        let links_n = (0..links).map(both).collect::<Result<_, SwingUpError>>()?;
        done();
        Ok(Margin { at_s: tick as f64 * rig.tick.period_s, links_n })
    };
    parallel::try_map(0..moments, at)
}

fn motion_ticks(table: &TableValues, transition: Transition) -> usize {
    let motions = table.swing_up.as_ref();
    motions.map_or(
        0,
        |motions| if transition == Transition::Up { motions.raise.ticks } else { motions.lower.ticks },
    ) as usize
}

/// The largest size that is survived, below the first one that is not.
fn largest(survives: impl Fn(f64) -> Result<bool, SwingUpError>) -> Result<f64, SwingUpError> {
    let mut good = FIRST_N;
    if survives(good)? {
        while good < LARGEST_N && survives(2.0 * good)? {
            good *= 2.0;
        }
        if good >= LARGEST_N {
            return Ok(good);
        }
    } else {
        good *= 0.5;
        while !survives(good)? {
            good *= 0.5;
            if good < SMALLEST_N {
                return Ok(0.0);
            }
        }
    }
    let mut bad = 2.0 * good;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (good + bad);
        if survives(middle)? { good = middle } else { bad = middle }
    }
    Ok(good)
}

/// The tick in which the motion of `scenario` began, if it arrives in spite of `push`: the raising of a rig that hangs,
/// the lowering of one that was raised by hand.
fn arrival(
    rig: &Rig,
    table: &TableValues,
    scenario: &Scenario,
    push: Option<Push>,
    target: &mut dyn Target,
) -> Result<Option<usize>, HarnessError> {
    let in_ticks = |seconds: f64| (seconds / rig.tick.period_s).round() as usize;
    let mut world = World::new(rig, table, scenario, target)?;
    world.raise(None)?;
    world.session.send(Request::Telemetry(TELEMETRY_TICKS));
    let transition = match scenario.begin {
        Begin::Hanging => Transition::Up,
        Begin::ByHand => {
            world.goals = Goals::of(rig, scenario);
            Transition::Down
        }
    };
    let (is_up, in_motion) = (transition == Transition::Up, motion_ticks(table, transition));
    let mut arrived = None;
    let mut pushing = BeforeMotion(|world: &mut World<'_>, output: &mut Output| {
        let tick = world.ticks();
        let begin = if is_up { Some(0) } else { world.goals.begun().first().copied() };
        let latest = world.goals.tick_of(0).map(|at| at + in_ticks(LONGEST_WAIT_S));
        let Some(end) = begin.map(|begin| begin + in_motion).or(latest) else { return until(true) };
        if !output.enable && (is_up || tick < end) {
            return until(true);
        }
        if tick == end + in_ticks(AFTER_S) {
            let state = world.session.status().state;
            let hangs = state == State::Calibrated && hang(world.bench.state());
            let is_well = if is_up { state == State::Balancing } else { hangs };
            arrived = begin.filter(|_| is_well && world.session.fault().is_none());
            return until(true);
        }
        let is_now = |push: &Push| (push.tick..push.tick + in_ticks(PUSH_S)).contains(&tick);
        if let Some(push) = push.filter(is_now) {
            let (force_n, torques_n_m) = push.on(rig, world.bench.state());
            world.bench.pull(force_n, &torques_n_m);
        }
        until(false)
    });
    world.run(usize::MAX, &mut [&mut pushing])?;
    Ok(arrived)
}

impl Push {
    /// The generalised forces in `state`: on the cart (N), and at the joints (N·m).
    ///
    /// With `p` the end of the pushed link, the force on a coordinate q is `F · ∂p/∂q`. A change of the angle φ_l of a
    /// link below moves `p` perpendicular to that link, and the torque at a joint is the sum over the links from this
    /// joint to the pushed one.
    fn on(&self, rig: &Rig, state: &[f64]) -> (f64, Vec<f64>) {
        let Some(chain) = rig.chain() else { return (0.0, Vec::new()) };
        let angles: Vec<f64> = absolute_angles(state).collect();
        let across = angles[self.link];
        let mut torques_n_m = vec![0.0; angles.len()];
        let mut beyond = 0.0;
        for joint in (0..=self.link).rev() {
            beyond += self.force_n * chain.links[joint].length_m * libm::cos(angles[joint] - across);
            torques_n_m[joint] = beyond;
        }
        (-self.force_n * libm::cos(across), torques_n_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For a small change of any coordinate, the work of the force is that of the generalised forces.
    #[test]
    fn a_push_is_across_the_end_of_its_link() {
        let rig = Rig::from_path("../../rigs/quadruple-paper.toml".as_ref()).unwrap();
        let chain = rig.chain().unwrap();
        let state = [0.1, 0.2, 0.7, 0.3, -1.9, 0.4, 2.2, 0.5, 0.6, 0.7];
        for link in 0..4 {
            let end = |state: &[f64]| {
                absolute_angles(state).zip(&chain.links).take(link + 1).fold(
                    [state[0], 0.0],
                    |[x, y], (angle, link)| {
                        [x - link.length_m * libm::sin(angle), y + link.length_m * libm::cos(angle)]
                    },
                )
            };
            let phi = absolute_angles(&state).nth(link).unwrap();
            let push = Push { tick: 0, link, force_n: 0.3 };
            let force = [-libm::cos(phi), -libm::sin(phi)].map(|part| push.force_n * part);
            let (cart_n, torques_n_m) = push.on(&rig, &state);
            for (coordinate, generalised) in [cart_n].into_iter().chain(torques_n_m).enumerate() {
                let small = 1e-6;
                let mut moved = state;
                moved[2 * coordinate] += small;
                let (from, to) = (end(&state), end(&moved));
                let work: f64 = (0..2).map(|axis| force[axis] * (to[axis] - from[axis])).sum();
                assert!((work / small - generalised).abs() < 1e-6, "{link}, {coordinate}: {generalised}");
            }
        }
    }
}
