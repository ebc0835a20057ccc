//! Shakes a machine at the other end of a serial line through its firmware, and records the log.
//!
//! Nothing here reads or writes the line: the caller passes in received bytes and the time, and takes bytes to send.

use std::collections::VecDeque;
use std::time::Duration;

use upright::protocol::message::{Answer, Request};
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::supervisor::State;
use upright_closed_loop::client::{Client, ExpectedRig, Mismatch, PATIENCE, Received};
use upright_closed_loop::harness::HarnessError;
use upright_design::rig::Rig;
use upright_design::table::TableValues;

use crate::error::IdentifyError;
use crate::feed::Feed;
use crate::log::Log;
use crate::recorder::Recorder;

/// Time without a message after which the host gives up.
const SILENCE: Duration = Duration::from_secs(2);
/// Time between two telemetry messages (s): the line has room for the log and a little telemetry.
const TELEMETRY_S: f64 = 0.05;

/// Why shaking a machine over a line failed.
#[derive(Debug, thiserror::Error)]
pub enum LineError {
    /// The firmware does not match the rig file or the protocol, or does not answer or rejects a request.
    #[error(transparent)]
    Harness(#[from] HarnessError),
    /// The cart does not follow, or the rig cannot be identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// No message arrives.
    #[error("nothing is heard from the firmware: check port, cable, and that no other program has the port")]
    Silent,
    /// The firmware does not answer the request to log: its image is of an older version.
    #[error(
        "the firmware does not log its ticks: flash the image of this version, upright firmware flash RIG"
    )]
    NoLog,
    /// Something prevents shaking at present.
    #[error(
        "the firmware does not shake the rig: {0}; home it and check signs and motor with upright firmware monitor first"
    )]
    NotNow(Inhibits),
    /// The motor was turned off by a fault.
    #[error("the firmware has turned the motor off: {0}")]
    Fault(Fault),
    /// The shaking ended before all forces were applied.
    #[error("the shaking has ended too early: the forces came too late, or someone has turned the motor off")]
    Interrupted,
}

/// The host's part while a firmware at the other end of a line shakes its machine: requests, forces, and the log.
pub struct OverLine {
    expected: ExpectedRig,
    requests: VecDeque<Request>,
    client: Client,
    /// Time of the last message.
    heard: Duration,
    state: Option<State>,
    /// Whether the firmware has accepted the request to shake.
    is_shaken: bool,
    feed: Feed,
    recorder: Recorder,
}

impl OverLine {
    /// Prepares to shake the machine of `rig`, whose gain table is `table`, for `duration_s`; `now` is the time since
    /// 1970.
    ///
    /// # Errors
    /// [`IdentifyError`] if the rig has no chain with encoders.
    pub fn new(
        rig: &Rig,
        table: &TableValues,
        duration_s: f64,
        seed: u64,
        now: Duration,
    ) -> Result<Self, IdentifyError> {
        let feed = Feed::new(rig, table, duration_s, seed)?;
        let telemetry_ticks = (TELEMETRY_S / rig.tick.period_s).ceil() as u16;
        let requests =
            [Request::Info, Request::Telemetry(telemetry_ticks), Request::Log(true), feed.begin()].into();
        Ok(Self {
            expected: rig.into(),
            requests,
            client: Client::default(),
            heard: now,
            state: None,
            is_shaken: false,
            feed,
            recorder: Recorder::new(rig, table),
        })
    }

    /// Queues the requests and forces that are due, for [`take_outgoing`](Self::take_outgoing).
    ///
    /// # Errors
    /// [`LineError`] if the firmware is silent, does not answer, or the cart does not follow.
    pub fn poll(&mut self, now: Duration) -> Result<(), LineError> {
        let silence = now.saturating_sub(self.heard);
        if silence > SILENCE {
            return Err(LineError::Silent);
        }
        if let Some(unanswered) = self.client.poll(now).first() {
            return Err(match unanswered.request {
                _ if silence >= PATIENCE => LineError::Silent,
                Request::Log(_) => LineError::NoLog,
                request => HarnessError::NoAnswer(request).into(),
            });
        }
        if !self.client.is_waiting()
            && let Some(request) = self.requests.pop_front()
        {
            self.client.send(request, now);
        }
        for request in self.feed.due(self.recorder.log())? {
            self.client.send_once(request, now);
        }
        Ok(())
    }

    /// Processes bytes received over the line.
    ///
    /// # Errors
    /// [`LineError`] if the firmware does not match, refuses, or has turned the motor off.
    pub fn receive(&mut self, bytes: &[u8], now: Duration) -> Result<(), LineError> {
        for &byte in bytes {
            let Some(message) = self.client.receive(byte, now) else { continue };
            self.heard = now;
            match message {
                Received::Telemetry(telemetry) => self.follow(telemetry.state, telemetry.fault)?,
                Received::Answer { request: Some(request), answer, .. } => self.answered(request, answer)?,
                Received::Answer { .. } => {}
                Received::Log(log) => {
                    self.recorder.push(&log);
                    if let Some(last) = self.recorder.log().ticks().last()
                        && self.is_shaken
                        && !self.feed.has_begun()
                    {
                        self.feed.begun(last.number);
                    }
                }
            }
        }
        Ok(())
    }

    fn follow(&mut self, state: State, fault: Option<Fault>) -> Result<(), LineError> {
        let before = self.state.replace(state);
        if let Some(fault) = fault.filter(|_| self.is_shaken) {
            return Err(LineError::Fault(fault));
        }
        let has_ended = before == Some(State::Identifying) && state != State::Identifying;
        if has_ended && !self.feed.is_over(self.recorder.log()) {
            Err(LineError::Interrupted)
        } else {
            Ok(())
        }
    }

    fn answered(&mut self, request: Request, answer: Answer) -> Result<(), LineError> {
        match answer {
            // Forces that come after the shaking has ended: telemetry says what has ended it.
            Answer::NotNow(_) if self.is_shaken => {}
            Answer::NotNow(inhibits) => return Err(LineError::NotNow(inhibits)),
            Answer::Rejected(_) => return Err(HarnessError::Refused { request, answer }.into()),
            Answer::Info(info) => Mismatch::check(&info, self.expected).map_err(HarnessError::from)?,
            _ => self.is_shaken |= matches!(request, Request::Shake(_)),
        }
        Ok(())
    }

    /// Turns motor and log off, whatever is going on.
    pub fn stop(&mut self, now: Duration) {
        self.requests.clear();
        self.client.clear();
        self.client.send_once(Request::Disarm, now);
        self.client.send_once(Request::Log(false), now);
    }

    /// Takes the bytes that are to be sent over the line.
    pub fn take_outgoing(&mut self) -> Vec<u8> {
        self.client.take_outgoing()
    }

    /// Whether the motor is off according to the last telemetry; false before the first.
    pub fn is_off(&self) -> bool {
        self.state.is_some_and(|state| !state.motor_is_on())
    }

    /// Whether all forces have been applied and logged, and the motor is off.
    pub fn is_over(&self) -> bool {
        self.feed.is_over(self.recorder.log()) && self.is_off()
    }

    /// Ends the recording and returns the log.
    ///
    /// # Errors
    /// [`IdentifyError::NothingRecorded`] if the firmware has sent none.
    pub fn finish(self) -> Result<Log, IdentifyError> {
        self.recorder.finish()
    }
}
