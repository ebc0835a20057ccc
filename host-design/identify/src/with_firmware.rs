//! The log of a simulated machine that is shaken by the whole firmware.

use upright::protocol::message::Request;
use upright::supervision::jog::MotorSign;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_closed_loop::harness::{Flow, HarnessError, Participant, Session, Target, World, until};
use upright_design::reality::hanging_by_hand;
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;

use crate::error::IdentifyError;
use crate::feed::Feed;
use crate::log::Log;
use crate::recorder::Recorder;

/// Time for which the links hang still before they are shaken (s).
const STILL_S: f64 = 1.0;
/// Time between two telemetry messages (s).
const TELEMETRY_S: f64 = 0.05;
/// Longest time for the cart to return to the middle (s).
const RETURN_S: f64 = 6.0;

/// Why a run was not recorded.
#[derive(Debug, thiserror::Error)]
pub enum ShakeError {
    /// The firmware does not run, or refuses.
    #[error(transparent)]
    Harness(#[from] HarnessError),
    /// The rig cannot be identified, the motor was turned off by a fault, or the cart does not follow.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
}

/// The log of the simulated machine of `rig`, with its `[reality]`, which the firmware on `target` shakes for
/// `duration_s`. The run starts at power-up: homing, checks of signs and motor, a pulse each way, the excitation, and
/// back to the middle.
///
/// # Errors
/// [`ShakeError`] if the firmware does not run or turns the motor off, or the cart does not follow.
pub fn shake_with(
    rig: &Rig,
    table: &TableValues,
    target: &mut dyn Target,
    duration_s: f64,
    seed: u64,
) -> Result<Log, ShakeError> {
    let feed = Feed::new(rig, table, duration_s, seed)?;
    let mut world = checked_and_hanging(rig, table, target, seed)?;
    let mut host = ShakingHost::begin(feed, rig, table, &mut world)?;
    world.run(ticks(rig, duration_s + 2.0 + RETURN_S), &mut [&mut host])?;
    if let Some(fault) = world.session.fault() {
        let words = format!("{}: the firmware has turned the motor off: {fault}", rig.name);
        return Err(IdentifyError::Excitation(words).into());
    }
    Ok(host.finish()?)
}

/// Runs the machine of `rig` from power-up until signs and motor are checked and it hangs still in the hand.
///
/// # Errors
/// [`HarnessError`] if the firmware does not run, or does not get there.
pub fn checked_and_hanging<'t>(
    rig: &Rig,
    table: &TableValues,
    target: &'t mut dyn Target,
    seed: u64,
) -> Result<World<'t>, HarnessError> {
    let mut state = hanging_by_hand(rig);
    let scenario = Scenario { start: state.clone(), seed, ..Scenario::at_rest(rig, Law::Lqr) };
    let mut world = World::new(rig, table, &scenario, target)?;
    world.by_hand_until(|status| status.state == State::Calibrated && status.motor == MotorSign::Checked)?;
    state[0] = world.bench.state()[0];
    world.hand.hold_in(&state);
    world.run(ticks(rig, STILL_S), &mut [])?;
    Ok(world)
}

/// A host that has the firmware shake its machine: sends the forces and takes the log.
pub struct ShakingHost {
    feed: Feed,
    recorder: Recorder,
    /// Why it has given up.
    failed: Option<IdentifyError>,
}

impl ShakingHost {
    /// Asks the firmware of a machine that is [checked and hangs](checked_and_hanging) to shake it, and has the hand
    /// let go in the first tick.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware refuses.
    pub fn begin(
        feed: Feed,
        rig: &Rig,
        table: &TableValues,
        world: &mut World<'_>,
    ) -> Result<Self, HarnessError> {
        let inputs = world.inputs();
        // The line of a board has room for the log and a little telemetry. Of a drive with pulses, only telemetry says
        // whether it shakes the cart or holds it.
        let telemetry_ticks = if table.drive.pulses().is_some() { 1 } else { ticks(rig, TELEMETRY_S) as u16 };
        world.session.ask(Request::Telemetry(telemetry_ticks), &inputs)?;
        world.session.ask(Request::Log(true), &inputs)?;
        world.session.ask(feed.begin(), &inputs)?;
        let mut host = Self { feed, recorder: Recorder::new(rig, table), failed: None };
        world.run(1, &mut [&mut host])?;
        world.let_go();
        Ok(host)
    }

    /// Takes the log, and sends the forces that are due.
    ///
    /// # Errors
    /// [`IdentifyError`] if the cart does not follow the pulses.
    pub fn feed(&mut self, session: &mut Session<'_>) -> Result<(), IdentifyError> {
        while let Some(message) = session.next_log() {
            self.recorder.push(&message);
            if let Some(last) = self.recorder.log().ticks().last().filter(|_| !self.feed.has_begun()) {
                self.feed.begun(last.number);
            }
        }
        for request in self.feed.due(self.recorder.log())? {
            session.send(request);
        }
        Ok(())
    }

    /// Whether all forces have been applied and logged, and the motor is off.
    pub fn is_over(&self, session: &Session<'_>) -> bool {
        self.feed.is_over(self.recorder.log()) && session.status().state == State::Calibrated
    }

    /// The log so far.
    pub fn log(&self) -> &Log {
        self.recorder.log()
    }

    /// The whole log.
    ///
    /// # Errors
    /// [`IdentifyError`] if the cart did not follow the pulses, or the firmware has sent no log.
    pub fn finish(self) -> Result<Log, IdentifyError> {
        self.failed.map_or_else(|| self.recorder.finish(), Err)
    }
}

impl Participant for ShakingHost {
    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        self.failed = self.feed(&mut world.session).err();
        until(self.failed.is_some() || world.session.fault().is_some() || self.is_over(&world.session))
    }
}

fn ticks(rig: &Rig, seconds: f64) -> usize {
    (seconds / rig.tick.period_s).ceil() as usize
}
