//! Shakes a machine at the other end of a serial line through its firmware, and records the log.
//!
//! Nothing here reads or writes the line: the caller passes in received bytes and the time, and takes bytes to send.

use std::collections::VecDeque;
use std::time::Duration;

use upright::protocol::frame::{self, Receiver};
use upright::protocol::message::{Answer, Command, Message, PROTOCOL, Reply, Request};
use upright::protocol::serial_link::{MAX_COMMAND, MAX_MESSAGE};
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::supervisor::State;

use super::error::IdentifyError;
use super::feed::Feed;
use super::log::Log;
use super::recorder::Recorder;
use crate::harness::HarnessError;
use crate::rig::Rig;
use crate::table::{MAX_SENSORS, MAX_STATES, TableValues};

/// Interval at which a request is repeated until it is answered.
const REPEAT: Duration = Duration::from_millis(50);
/// Time without an answer, or without a message, after which the host gives up.
const PATIENCE: Duration = Duration::from_secs(2);
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
    /// The firmware does not answer the request to log: its image is built without logging.
    #[error(
        "the firmware does not log its ticks: flash the image for identification, upright firmware flash RIG --identify"
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

/// A request that has not been answered yet.
struct Waiting {
    command: Command,
    since: Duration,
    next: Duration,
}

/// The host's part while a firmware at the other end of a line shakes its machine: requests, forces, and the log.
pub struct OverLine {
    rig_hash: u64,
    requests: VecDeque<Request>,
    waiting: Option<Waiting>,
    receiver: Receiver<MAX_MESSAGE>,
    outgoing: Vec<u8>,
    last_id: u64,
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
            rig_hash: rig.hash(),
            requests,
            waiting: None,
            receiver: Receiver::new(),
            outgoing: Vec::new(),
            last_id: 0,
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
        if now.saturating_sub(self.heard) > PATIENCE {
            return Err(LineError::Silent);
        }
        match &mut self.waiting {
            Some(waiting) if now.saturating_sub(waiting.since) > PATIENCE => {
                return Err(match waiting.command.request {
                    Request::Log(_) => LineError::NoLog,
                    request => HarnessError::NoAnswer(request).into(),
                });
            }
            Some(waiting) if now >= waiting.next => {
                waiting.next = now + REPEAT;
                let command = waiting.command;
                self.write(&command);
            }
            Some(_) => {}
            None => {
                if let Some(request) = self.requests.pop_front() {
                    let command = self.send(request, now);
                    self.waiting = Some(Waiting { command, since: now, next: now + REPEAT });
                }
            }
        }
        for request in self.feed.due(self.recorder.log())? {
            self.send(request, now);
        }
        Ok(())
    }

    /// Processes bytes received over the line.
    ///
    /// # Errors
    /// [`LineError`] if the firmware does not match, refuses, or has turned the motor off.
    pub fn receive(&mut self, bytes: &[u8], now: Duration) -> Result<(), LineError> {
        for &byte in bytes {
            let Some(Ok(message)) = self.receiver.push::<Message<MAX_STATES, MAX_SENSORS>>(byte) else {
                continue;
            };
            self.heard = now;
            match message {
                Message::Telemetry(telemetry) => self.follow(telemetry.state, telemetry.fault)?,
                Message::Reply(Reply { id, answer }) => self.answered(id, answer)?,
                Message::Log(log) => {
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

    fn answered(&mut self, id: u64, answer: Answer) -> Result<(), LineError> {
        let Some(waiting) = self.waiting.take_if(|waiting| waiting.command.id == id) else { return Ok(()) };
        let request = waiting.command.request;
        match answer {
            Answer::NotNow(inhibits) => return Err(LineError::NotNow(inhibits)),
            Answer::Rejected(_) => return Err(HarnessError::Refused { request, answer }.into()),
            Answer::Info(info) if info.protocol != PROTOCOL => {
                return Err(HarnessError::Protocol(info.protocol).into());
            }
            Answer::Info(info) if info.rig_hash != self.rig_hash => {
                return Err(HarnessError::Rig { found: info.rig_hash, wanted: self.rig_hash }.into());
            }
            _ => self.is_shaken |= matches!(request, Request::Shake(_)),
        }
        Ok(())
    }

    /// Turns motor and log off, whatever is going on.
    pub fn stop(&mut self, now: Duration) {
        self.requests.clear();
        self.waiting = None;
        self.send(Request::Disarm, now);
        self.send(Request::Log(false), now);
    }

    fn send(&mut self, request: Request, now: Duration) -> Command {
        self.last_id = (now.as_micros() as u64).max(self.last_id + 1);
        let command = Command { id: self.last_id, request };
        self.write(&command);
        command
    }

    fn write(&mut self, command: &Command) {
        let (mut scratch, mut out) = ([0; MAX_COMMAND], [0; MAX_COMMAND]);
        // Every command fits, as a test of the messages checks.
        if let Ok(frame) = frame::encode(command, &mut scratch, &mut out) {
            self.outgoing.extend(frame);
        }
    }

    /// Takes the bytes that are to be sent over the line.
    pub fn take_outgoing(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outgoing)
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
