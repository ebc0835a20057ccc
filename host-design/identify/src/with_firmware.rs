//! The log of a simulated machine that is shaken by the whole firmware.

use upright::board::Output;
use upright::control::actuator::Drive;
use upright::protocol::message::Request;
use upright::supervision::jog::MotorSign;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_closed_loop::harness::{Harness, HarnessError, Pins, Target};
use upright_design::reality::hanging_by_hand;
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;

use crate::error::IdentifyError;
use crate::feed::Feed;
use crate::log::Log;
use crate::recorder::Recorder;

/// Longest time from power-up until the rig is ready (s).
const READY_S: f64 = 60.0;
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

/// A simulated machine while the firmware shakes it.
pub struct Shaken<'t> {
    /// Firmware and machine.
    pub harness: Harness<'t>,
    feed: Feed,
    recorder: Recorder,
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
    let mut shaken = Shaken::begin(rig, table, target, duration_s, seed)?;
    let longest = ticks(rig, duration_s + 2.0 + RETURN_S);
    for _ in 0..longest {
        shaken.tick(|_| (), |drive| drive)?;
        if let Some(fault) = shaken.harness.session.fault() {
            let words = format!("{}: the firmware has turned the motor off: {fault}", rig.name);
            return Err(IdentifyError::Excitation(words).into());
        }
        if shaken.is_over() {
            break;
        }
    }
    Ok(shaken.recorder.finish()?)
}

/// Runs the machine of `rig` from power-up until signs and motor are checked and it hangs still.
///
/// # Errors
/// [`HarnessError`] if the firmware does not run, or does not get there.
pub fn checked_and_hanging<'t>(
    rig: &Rig,
    table: &TableValues,
    target: &'t mut dyn Target,
    seed: u64,
) -> Result<Harness<'t>, HarnessError> {
    let mut state = hanging_by_hand(rig);
    let scenario = Scenario { start: state.clone(), seed, ..Scenario::at_rest(rig, Law::Lqr) };
    let mut harness = Harness::new(rig, table, &scenario, target)?;
    for tick in 0.. {
        harness.by_hand(tick)?;
        let status = harness.session.status();
        if status.state == State::Calibrated && status.motor == MotorSign::Checked {
            break;
        }
        if tick > ticks(rig, READY_S) {
            return Err(HarnessError::NotBalancing(status.state));
        }
    }
    state[0] = harness.bench.state()[0];
    harness.bench.hold(&state);
    for _ in 0..ticks(rig, STILL_S) {
        let inputs = harness.inputs();
        harness.session.tick(&inputs)?;
    }
    Ok(harness)
}

impl<'t> Shaken<'t> {
    /// Runs from power-up to the tick in which the firmware begins to shake the machine.
    ///
    /// # Errors
    /// [`ShakeError`] if the firmware does not run, or refuses.
    pub fn begin(
        rig: &Rig,
        table: &TableValues,
        target: &'t mut dyn Target,
        duration_s: f64,
        seed: u64,
    ) -> Result<Self, ShakeError> {
        let feed = Feed::new(rig, table, duration_s, seed)?;
        Ok(Self::begin_with(feed, rig, table, target, seed)?)
    }

    /// As [`begin`](Self::begin), with forces that were computed before.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware does not run, or refuses.
    pub fn begin_with(
        feed: Feed,
        rig: &Rig,
        table: &TableValues,
        target: &'t mut dyn Target,
        seed: u64,
    ) -> Result<Self, HarnessError> {
        let mut harness = checked_and_hanging(rig, table, target, seed)?;
        let inputs = harness.inputs();
        // The line of a board has room for the log and a little telemetry. Of a drive with pulses, only telemetry says
        // whether it shakes the cart or holds it.
        let telemetry_ticks = if table.drive.pulses().is_some() { 1 } else { ticks(rig, TELEMETRY_S) as u16 };
        harness.session.ask(Request::Telemetry(telemetry_ticks), &inputs)?;
        harness.session.ask(Request::Log(true), &inputs)?;
        harness.session.ask(feed.begin(), &inputs)?;
        Ok(Self { harness, feed, recorder: Recorder::new(rig, table) })
    }

    /// One tick of firmware and machine: `pins` may change what the firmware reads, `motor` what drives the cart while
    /// the motor is on.
    ///
    /// # Errors
    /// [`ShakeError`] if the firmware does not answer, or the cart does not follow the pulses.
    pub fn tick(
        &mut self,
        pins: impl FnOnce(&mut Pins),
        motor: impl FnOnce(Drive) -> Drive,
    ) -> Result<Output, ShakeError> {
        let mut inputs = self.harness.inputs();
        pins(&mut inputs);
        let output = self.act(&inputs, motor)?;
        self.feed()?;
        Ok(output)
    }

    /// One tick without the host: the log is not read, and no forces are sent.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware does not answer.
    pub fn act(&mut self, inputs: &Pins, motor: impl FnOnce(Drive) -> Drive) -> Result<Output, HarnessError> {
        let session = &mut self.harness.session;
        while session.next_reply().is_some() || session.next_telemetry().is_some() {}
        let output = session.tick(inputs)?;
        // A motor that is off turns freely.
        self.harness.bench.tick(if output.enable { motor(output.drive) } else { Drive::Force(0.0) });
        Ok(output)
    }

    /// The host's part of a tick: takes the log and sends the forces that are due.
    ///
    /// # Errors
    /// [`IdentifyError`] if the cart does not follow the pulses.
    pub fn feed(&mut self) -> Result<(), IdentifyError> {
        while let Some(message) = self.harness.session.next_log() {
            self.recorder.push(&message);
            if let Some(last) = self.recorder.log().ticks().last().filter(|_| !self.feed.has_begun()) {
                self.feed.begun(last.number);
            }
        }
        for request in self.feed.due(self.recorder.log())? {
            self.harness.session.send(request);
        }
        Ok(())
    }

    /// Whether all forces have been applied and logged, and the motor is off.
    pub fn is_over(&self) -> bool {
        self.feed.is_over(self.recorder.log()) && self.harness.session.status().state == State::Calibrated
    }

    /// The log so far.
    pub fn log(&self) -> &Log {
        self.recorder.log()
    }
}

fn ticks(rig: &Rig, seconds: f64) -> u32 {
    (seconds / rig.tick.period_s).ceil() as u32
}
