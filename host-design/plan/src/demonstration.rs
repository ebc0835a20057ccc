//! A demonstration by the whole firmware in one run: up, balance, a step of the set-point, back, and down.

use upright::supervision::fault::Fault;
use upright::supervision::supervisor::State;

use super::SwingUpError;
use super::robustness::{MotionSpread, drawn};
use super::route::{Route, states};
use upright_closed_loop::harness::{HarnessError, Recording, record, with_firmware};
use upright_design::motion::Transition;
use upright_design::plant::absolute_angles;
use upright_design::rig::Rig;
use upright_design::simulate::{Disturbance, Scenario, Trace};
use upright_design::table::TableValues;

/// Duration of balancing after the links are raised, and of hanging at the end (s).
const PAUSE_S: f64 = 1.5;
/// Time to settle after the governor has moved the set-point (s).
const SETTLE_S: f64 = 4.0;
/// Duration of hanging at the end of [`up_and_down`] (s).
const HANG_S: f64 = 0.5;
/// Step of the set-point (m), and the largest share of the rail that it may take.
const MOVE_M: f64 = 0.5;
const RAIL_SHARE: f64 = 0.5;
/// Largest angle from the vertical at which a link counts as hanging (rad): without friction it swings on.
const HANGS_RAD: f64 = upright_design::rig::defaults::ANGLE_RAD;

/// Script of a demonstration: what it does, before it has run.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    /// The rig that is simulated. It differs from that of the table by the errors that are drawn.
    pub rig: Rig,
    /// Start, set-point and commands.
    pub scenario: Scenario,
    /// Start (s) and name of each part.
    pub parts: Vec<(f64, String)>,
    /// The supervisor's states, one after the other, if all goes well.
    states: Vec<State>,
}

impl Script {
    /// Both motions of `table`, from encoders and with the rig's noise, from a start that is off by 1° and 1 mm, with
    /// encoders off by 0.1°, drawn with `seed`. Masses and friction are the rig's, or wrong by up to the spreads of
    /// `[swing_up]`.
    ///
    /// # Errors
    /// [`SwingUpError::NoMotions`] if the table has none.
    pub fn draw(rig: &Rig, table: &TableValues, seed: u64, is_wrong: bool) -> Result<Self, SwingUpError> {
        let motions = table.swing_up.as_ref().ok_or(SwingUpError::NoMotions)?;
        let Some(chain) = rig.chain() else { return Err(SwingUpError::NotAChain) };
        let rules = rig.swing_up.clone().unwrap_or_default();
        let share = |percent: f64| if is_wrong { percent / 100.0 } else { 0.0 };
        let spread =
            MotionSpread::new(share(rules.mass_spread_percent), share(rules.friction_spread_percent));
        let (real, start) = drawn(rig, Transition::Up, &spread, seed);
        let duration_s = |ticks: u32| f64::from(ticks) * rig.tick.period_s;
        let [low, high] = chain.cart.travel_m;
        let far = MOVE_M.min(RAIL_SHARE * high.min(-low));
        let step = table.laws.lqr.as_ref().map_or(f32::MAX, |law| law.setpoint_step);
        let move_s = (far / f64::from(step)).ceil() * rig.tick.period_s + SETTLE_S;
        let lengths = [
            ("raise", duration_s(motions.raise.ticks)),
            ("balance", PAUSE_S),
            ("step", move_s),
            ("back", move_s),
            ("lower", duration_s(motions.lower.ticks)),
            ("hang", PAUSE_S),
        ];
        let mut end_s = 0.0;
        let parts = lengths.map(|(name, length_s)| {
            let begin_s = end_s;
            end_s += length_s;
            (begin_s, name)
        });
        let [_, _, (step_at_s, _), (step_until_s, _), (lower_at_s, _), _] = parts;
        let disturbance = Disturbance::of(rig);
        let scenario = Scenario {
            start,
            step_m: far,
            step_at_s,
            step_until_s,
            force_noise_n: disturbance.force_n,
            torque_noise_n_m: disturbance.torque_n_m,
            seed,
            ..Scenario::swing_up(rig, end_s, Some(lower_at_s))
        };
        let parts = parts.map(|(at_s, name)| (at_s, name.to_owned())).to_vec();
        Ok(Self { rig: real, scenario, parts, states: UP_AND_DOWN.to_vec() })
    }

    /// A run through all motions of `table`, under the same conditions; the parts have the names of the motions.
    ///
    /// # Errors
    /// [`SwingUpError::NoRoute`] if no route leads through all of them.
    pub fn route(rig: &Rig, table: &TableValues, seed: u64) -> Result<Self, SwingUpError> {
        let route = Route::of(rig, table).ok_or(SwingUpError::NoRoute)?;
        let links = rig.links();
        let (real, start) = drawn(rig, Transition::Up, &MotionSpread::new(0.0, 0.0), seed);
        let names = route.transitions.iter().map(|transition| transition.name(links));
        let states = route.transitions.iter().flat_map(|transition| states(*transition, links));
        Ok(Self {
            parts: route.begin_s.iter().copied().zip(names).collect(),
            states: states.collect(),
            scenario: Scenario { start, ..route.scenario(rig, seed) },
            rig: real,
        })
    }

    /// Runs it on the host.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware does not run, or does not begin to raise the links.
    pub fn run(&self, table: &TableValues) -> Result<Demonstration, HarnessError> {
        let recording = with_firmware(table, |target| record(&self.rig, table, &self.scenario, target))??;
        Ok(self.demonstration(recording))
    }

    /// Evaluates a recording of this script.
    pub fn demonstration(&self, recording: Recording) -> Demonstration {
        Demonstration {
            parts: self.parts.clone(),
            arrived: hangs_after(&recording, &self.states),
            fault: recording.fault,
            trace: recording.trace,
        }
    }
}

/// A run in which the links are raised, balance for `upright_s`, are lowered, and hang for half a second, with the
/// rig's noise.
///
/// # Errors
/// [`SwingUpError::NoMotions`] if the table has none.
pub fn up_and_down(rig: &Rig, table: &TableValues, upright_s: f64) -> Result<Scenario, SwingUpError> {
    let motions = table.swing_up.as_ref().ok_or(SwingUpError::NoMotions)?;
    let [up_s, down_s] =
        [&motions.raise, &motions.lower].map(|motion| f64::from(motion.ticks) * rig.tick.period_s);
    let disturbance = Disturbance::of(rig);
    Ok(Scenario {
        force_noise_n: disturbance.force_n,
        torque_noise_n_m: disturbance.torque_n_m,
        ..Scenario::swing_up(rig, up_s + upright_s + down_s + HANG_S, Some(up_s + upright_s))
    })
}

/// A demonstration that has run.
#[derive(Debug, Clone, PartialEq)]
pub struct Demonstration {
    /// The recorded samples, tick by tick.
    pub trace: Trace,
    /// Start (s) and name of each part.
    pub parts: Vec<(f64, String)>,
    /// Whether all of it was done without a fault, and the links hang in the end.
    pub arrived: bool,
    /// The fault that turned the motor off, if there was one.
    pub fault: Option<Fault>,
}

/// Whether the firmware has raised and lowered the links without a fault, and they hang in the end.
pub fn hangs(recording: &Recording) -> bool {
    hangs_after(recording, &UP_AND_DOWN)
}

/// The supervisor's states while the links are raised, balanced and lowered.
const UP_AND_DOWN: [State; 4] = [State::Raising, State::Balancing, State::Lowering, State::Calibrated];

/// Whether the firmware has gone through these states without a fault, and the links hang in the end.
fn hangs_after(recording: &Recording, wanted: &[State]) -> bool {
    let mut states: Vec<State> = recording.ticks.iter().map(|tick| tick.state).collect();
    states.dedup();
    recording.fault.is_none()
        && states == wanted
        && recording.trace.samples().last().is_some_and(|sample| hang(sample.state))
}

/// Whether all links hang: within [`HANGS_RAD`] of the vertical.
pub(crate) fn hang(state: &[f64]) -> bool {
    // The cosine ignores whole turns.
    absolute_angles(state).all(|angle| libm::acos(-libm::cos(angle)) < HANGS_RAD)
}
