//! The state of a conversation with a firmware of any size.

use std::collections::VecDeque;
use std::time::Duration;

use crate::client::{AnyTelemetry, Client, ExpectedRig, Mismatch, Received, Unanswered};
use upright::protocol::message::{Answer, CrashRecord, Info, Request, Statistics};
use upright::supervision::fault::Cause;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::supervisor::State;
use upright::table::{Equilibrium, Law};
use upright_design::motion::posture_name;
use upright_design::plant::absolute_angles;

use super::command::MonitorAction;
use super::words;

/// Time span of the plots (s).
const HISTORY_S: f32 = 10.0;
/// Time between two telemetry messages (s).
const TELEMETRY_S: f32 = 0.02;
const STATISTICS: Duration = Duration::from_secs(1);
const LOG_LINES: usize = 100;

/// Why a conversation has ended.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Ended {
    /// The firmware is another one; only the request for its identity was sent.
    #[error(transparent)]
    Mismatch(#[from] Mismatch),
    /// The line is closed.
    #[error("the connection is closed: {0}; start `upright firmware monitor` again")]
    Closed(String),
}

/// A conversation: bytes and actions in, bytes out. Times are seconds since 1970.
pub struct Monitor {
    /// The port, as given on the command line.
    pub connection: String,
    /// Identity of the firmware, once received.
    pub info: Option<Info>,
    /// The latest telemetry.
    pub telemetry: Option<AnyTelemetry>,
    /// Counters of ticks, overruns, rejected measurements and lost messages, as last received.
    pub statistics: Option<Statistics>,
    /// The first cause of the fault or of the last reset.
    pub cause: Option<Cause>,
    /// Record of the firmware's last crash, if there is one.
    pub crash: Option<CrashRecord>,
    /// Requests and replies, oldest first.
    pub log: VecDeque<String>,
    /// Telemetry of the last 10 s.
    pub history: VecDeque<AnyTelemetry>,
    /// The set-point commanded here (m), if any.
    pub wanted: Option<f32>,
    /// The file of the recording, if one is written.
    pub recording: Option<String>,
    /// Why the last command that was answered was refused, if it was.
    pub refusal: Option<Answer>,
    /// Why the conversation has ended; `None` while it goes on.
    pub ended: Option<Ended>,
    client: Client,
    telemetry_s: f32,
    next_ask: Duration,
}

impl Monitor {
    /// A new conversation over `connection`.
    pub fn new(connection: &str) -> Self {
        Self {
            connection: connection.to_owned(),
            info: None,
            telemetry: None,
            statistics: None,
            cause: None,
            crash: None,
            log: VecDeque::new(),
            history: VecDeque::new(),
            wanted: None,
            recording: None,
            refusal: None,
            ended: None,
            client: Client::default(),
            telemetry_s: TELEMETRY_S,
            next_ask: Duration::ZERO,
        }
    }

    /// As [`Monitor::new`], with telemetry every `seconds` (s), rounded to whole ticks.
    pub fn with_telemetry_every(seconds: f32, connection: &str) -> Self {
        Self { telemetry_s: seconds, ..Self::new(connection) }
    }

    /// Ends the conversation if the firmware is not that of this rig.
    pub fn expect_rig(&mut self, wanted: ExpectedRig) {
        if let Some(Err(mismatch)) = self.info.map(|info| Mismatch::check(&info, wanted)) {
            self.end(mismatch);
        }
    }

    fn end(&mut self, mismatch: Mismatch) {
        self.client.clear();
        self.ended.get_or_insert(mismatch.into());
    }

    /// Takes received bytes; returns the telemetry in them.
    pub fn receive(&mut self, bytes: &[u8], now: Duration) -> Vec<AnyTelemetry> {
        let mut all = Vec::new();
        for &byte in bytes {
            match self.client.receive(byte, now) {
                Some(Received::Telemetry(telemetry)) if self.info.is_some() => {
                    self.take(telemetry.clone(), now);
                    all.push(telemetry);
                }
                Some(Received::Answer { request: Some(request), answer, .. }) => {
                    self.answered(request, answer, now);
                }
                // Until the firmware has named its version of the messages, telemetry may mean anything.
                _ => (),
            }
        }
        all
    }

    fn take(&mut self, telemetry: AnyTelemetry, now: Duration) {
        let fault = self.telemetry.as_ref().and_then(|before| before.fault);
        if telemetry.fault != fault {
            if let Some(fault) = telemetry.fault {
                self.note(format!("fault: {fault}"));
            }
            self.send(Request::Cause, now);
        }
        // The firmware has restarted: what was shown belongs to the run before.
        if self.history.back().is_some_and(|last| last.tick > telemetry.tick) {
            self.history.clear();
            self.note("the firmware has started again".to_owned());
            self.send(Request::Crash, now);
        }
        let tick_s = self.info.map_or(0.0, |info| info.tick_s);
        while let Some(first) = self.history.front()
            && telemetry.tick.wrapping_sub(first.tick) as f32 * tick_s > HISTORY_S
        {
            self.history.pop_front();
        }
        self.history.push_back(telemetry.clone());
        self.telemetry = Some(telemetry);
    }

    fn answered(&mut self, request: Request, answer: Answer, now: Duration) {
        match answer {
            Answer::Info(info) => {
                if let Err(mismatch) = Mismatch::check_protocol(&info) {
                    return self.end(mismatch);
                }
                self.info = Some(info);
                let ticks = (self.telemetry_s / info.tick_s).round().clamp(1.0, f32::from(u16::MAX));
                self.send(Request::Telemetry(ticks as u16), now);
                self.send(Request::Cause, now);
                self.send(Request::Crash, now);
            }
            Answer::Crash(crash) => {
                self.crash = crash;
                crash.iter().for_each(|record| self.note(words::crash(record)));
            }
            Answer::Cause(cause) => self.cause = cause,
            Answer::Statistics(statistics) => self.statistics = Some(statistics),
            Answer::Done => match request {
                Request::KeepAlive | Request::Jog { .. } | Request::Telemetry(_) => (),
                _ => {
                    self.refusal = None;
                    self.note(format!("{}: done", name(request, self.links())));
                }
            },
            // The reasons were logged with the first answer to the held key.
            Answer::NotNow(reasons)
                if matches!(request, Request::Jog { .. }) && reasons.contains(Inhibits::HELD) => {}
            Answer::NotNow(reasons) => {
                self.note(format!("{}: refused", name(request, self.links())));
                reasons.texts().for_each(|text| self.note(format!("  because {text}")));
                self.refuse(request, answer);
            }
            Answer::Rejected(rejected) => {
                self.note(format!("{}: {rejected}", name(request, self.links())));
                self.refuse(request, answer);
            }
        }
    }

    fn refuse(&mut self, request: Request, answer: Answer) {
        self.refusal = Some(answer);
        self.forget(request);
    }

    /// Forgets a set-point that was refused: it is not shown as the target.
    fn forget(&mut self, request: Request) {
        if matches!(request, Request::Setpoint(_)) {
            self.wanted = None;
        }
    }

    /// Sends the request of an action. Recording and quitting are up to the caller.
    pub fn act(&mut self, action: MonitorAction, now: Duration) {
        if self.info.is_none() {
            return self.note("the firmware has not answered yet".to_owned());
        }
        let request = match action {
            MonitorAction::Send(request) => request,
            MonitorAction::Shift(by) => {
                let governed = self.telemetry.as_ref().map_or(0.0, |telemetry| telemetry.setpoint_m);
                Request::Setpoint(self.wanted.unwrap_or(governed) + by)
            }
            MonitorAction::Turn(link) if link >= self.links() => {
                return self.note(format!("there is no link {}", link + 1));
            }
            MonitorAction::Turn(link) => match self.equilibrium() {
                Some(at) => Request::Goto(Equilibrium::of_bits(at.bits() ^ 1 << link)),
                None => return self.note("the links are at no equilibrium".to_owned()),
            },
            MonitorAction::OtherLaw => {
                Request::Select(match self.telemetry.as_ref().map(|telemetry| telemetry.law) {
                    None | Some(Law::Lqr) => Law::PolePlacement,
                    Some(Law::PolePlacement) => Law::Lqr,
                })
            }
            MonitorAction::Record | MonitorAction::Quit => return,
        };
        if matches!(request, Request::Jog { .. }) {
            return self.client.hold(request, now);
        }
        if let Request::Setpoint(wanted) = request {
            self.wanted = Some(wanted);
            self.client.keep_alive();
        }
        self.send(request, now);
    }

    /// The equilibrium at which the links are balanced, or hang; none while they move or their positions are not known.
    pub fn equilibrium(&self) -> Option<Equilibrium> {
        let telemetry = self.telemetry.as_ref()?;
        match telemetry.state {
            State::Balancing => Some(Equilibrium::UPRIGHT),
            State::Calibrated => Some(Equilibrium::hanging(self.links())),
            State::Holding => {
                let state: Vec<f64> = telemetry.estimate.iter().map(|&value| f64::from(value)).collect();
                let downward = absolute_angles(&state).enumerate().filter(|(_, angle)| angle.cos() < 0.0);
                Some(Equilibrium::of_bits(downward.map(|(link, _)| 1 << link).sum()))
            }
            _ => None,
        }
    }

    fn links(&self) -> usize {
        self.info.as_ref().map_or(0, |info| usize::from(info.sensors).saturating_sub(1))
    }

    /// Sends what is due: the request for the identity, the keep-alive of the dead-man timer, the request for the
    /// counters.
    pub fn poll(&mut self, now: Duration) {
        if self.ended.is_some() {
            return;
        }
        for unanswered in self.client.poll(now) {
            self.tell(unanswered);
        }
        if now >= self.next_ask && !self.client.is_waiting() {
            self.send(if self.info.is_none() { Request::Info } else { Request::Statistics }, now);
            self.next_ask = now + STATISTICS;
        }
    }

    /// Ends the conversation because the line has failed.
    pub fn close(&mut self, error: &std::io::Error) {
        self.ended.get_or_insert(Ended::Closed(error.to_string()));
    }

    /// Takes the bytes to be sent over the line.
    pub fn take_outgoing(&mut self) -> Vec<u8> {
        self.client.take_outgoing()
    }

    /// Frames that could not be read.
    pub fn unreadable(&self) -> u32 {
        self.client.damaged
    }

    /// Whether a request has no answer yet.
    pub fn is_waiting(&self) -> bool {
        self.client.is_waiting()
    }

    /// Adds a line to the log.
    pub fn note(&mut self, line: String) {
        self.log.push_back(line);
        if self.log.len() > LOG_LINES {
            self.log.pop_front();
        }
    }

    fn send(&mut self, request: Request, now: Duration) {
        if self.ended.is_some() {
            return;
        }
        for unanswered in self.client.send(request, now) {
            self.tell(unanswered);
        }
    }

    fn tell(&mut self, Unanswered { request, is_given_up }: Unanswered) {
        let then = if is_given_up { "given up; it may have been carried out" } else { "it is repeated" };
        self.note(format!("{}: not answered, {then}", name(request, self.links())));
        if is_given_up {
            self.refusal = None;
            self.forget(request);
        }
    }
}

/// A request, for the log.
fn name(request: Request, links: usize) -> String {
    match request {
        Request::Home => "home".to_owned(),
        Request::HomeRail => "home on the rail's switches".to_owned(),
        Request::CheckSigns => "check signs".to_owned(),
        Request::Jog { along: true } => "jog along +x".to_owned(),
        Request::Jog { along: false } => "jog against +x".to_owned(),
        Request::Arm => "arm".to_owned(),
        Request::Goto(Equilibrium::UPRIGHT) => "up".to_owned(),
        Request::Goto(Equilibrium::HANGING) => "down".to_owned(),
        Request::Goto(to) => format!("go to {}", posture_name(to, links)),
        Request::Still => "still".to_owned(),
        Request::Disarm => "disarm".to_owned(),
        Request::Clear => "clear".to_owned(),
        Request::Setpoint(metres) => format!("set-point {metres:.3} m"),
        Request::Select(law) => format!("law {law}"),
        other => format!("{other:?}"),
    }
}
