//! Between viewers and firmware: the conversation with the firmware, who is in command, and the recording.
//!
//! It is the same for a simulated rig and for a real one.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use upright::protocol::message::Request;
use upright::supervision::supervisor::State;
use upright_design::client::AnyTelemetry;

use super::connections::{Connections, EventQueue, ViewerEvent, ViewerId};
use super::pace::PICTURE;
use super::request::{MachineRequest, PageRequest};
use crate::monitor::record::{TelemetryCsv, json as telemetry_json};
use crate::monitor::{Monitor, MonitorAction, request as command, words};

/// Longest silence of the viewer in command while the motor may move. A page answers every few pictures, in a
/// background tab as well; a sleeping computer does not.
const SILENCE: Duration = Duration::from_secs(2);
/// Longest recording (bytes).
const MAX_RECORDING: usize = 256 << 20;
/// Most telemetry messages kept for a picture; further ones are dropped.
const MAX_FRESH: usize = 2000;

/// The last finished recording as CSV, shared with the server.
pub(super) type SharedCsv = Arc<Mutex<Vec<u8>>>;

/// What stands between the viewers and the firmware.
pub(super) struct Dispatcher {
    /// The conversation with the firmware.
    pub(super) monitor: Monitor,
    viewers: Connections,
    events: EventQueue,
    commander: Option<ViewerId>,
    last_heard: Instant,
    /// Whether a viewer has ever connected.
    pub(super) was_seen: bool,
    fresh: Vec<Value>,
    recorder: Option<TelemetryCsv<Vec<u8>>>,
    recording: SharedCsv,
}

impl Dispatcher {
    /// A dispatcher with a new conversation.
    pub(super) fn new(
        monitor: Monitor,
        (viewers, events): (Connections, EventQueue),
        recording: SharedCsv,
    ) -> Self {
        Self {
            monitor,
            viewers,
            events,
            commander: None,
            last_heard: Instant::now(),
            was_seen: false,
            fresh: Vec::new(),
            recorder: None,
            recording,
        }
    }

    /// Takes telemetry that the firmware has sent: for the next picture, and for the recording.
    pub(super) fn take(&mut self, all: Vec<AnyTelemetry>) {
        for telemetry in all {
            if let Some(recorder) = &mut self.recorder {
                // Writing to memory does not fail.
                let _ = recorder.push(&telemetry);
                if recorder.get_ref().len() > MAX_RECORDING {
                    self.stop_recording();
                    self.monitor.note("the recording is full".to_owned());
                }
            }
            if self.fresh.len() < MAX_FRESH {
                let mut object = telemetry_json(&telemetry);
                object["now"] = json!(words::instruction(&telemetry));
                object["inputs"] = json!(words::inputs(&telemetry));
                self.fresh.push(object);
            }
        }
    }

    /// Carries out what the viewers ask for; returns what the one in command asks of the simulated machine.
    pub(super) fn requests(&mut self, now: Duration) -> Vec<MachineRequest> {
        let mut machine = Vec::new();
        while let Some((viewer, event)) = self.events.next() {
            let commands = self.commander == Some(viewer);
            if commands {
                self.last_heard = Instant::now();
            }
            match event {
                ViewerEvent::Came => {
                    self.was_seen = true;
                    self.take_command(viewer);
                }
                ViewerEvent::Went if commands => self.commander = None,
                ViewerEvent::Went | ViewerEvent::Asks(PageRequest::Alive) => {}
                ViewerEvent::Asks(PageRequest::Command) => self.take_command(viewer),
                ViewerEvent::Asks(PageRequest::Release) if commands => self.commander = None,
                // Anyone who sees danger may turn the motor off.
                ViewerEvent::Asks(PageRequest::Say { line }) if commands || line == "disarm" => {
                    self.say(&line, now)
                }
                ViewerEvent::Asks(PageRequest::Record { on }) if commands => {
                    if on {
                        self.start_recording()
                    } else {
                        self.stop_recording()
                    }
                }
                ViewerEvent::Asks(PageRequest::Machine { what }) if commands => machine.push(what),
                ViewerEvent::Asks(_) => self.viewers.tell(
                    viewer,
                    &json!({ "notice": "another viewer is in command; only the stop button works here" })
                        .to_string(),
                ),
            }
        }
        self.watch(now);
        machine
    }

    fn take_command(&mut self, viewer: ViewerId) {
        if self.commander.is_none() {
            (self.commander, self.last_heard) = (Some(viewer), Instant::now());
        }
    }

    fn say(&mut self, line: &str, now: Duration) {
        match command(line) {
            Ok(request) => self.monitor.act(MonitorAction::Send(request), now),
            Err(bad) => self.monitor.note(bad.to_string()),
        }
    }

    /// Turns the motor off when the viewer in command is silent. Otherwise, while the rig balances, starts the
    /// keep-alive of the firmware's own dead-man timer.
    fn watch(&mut self, now: Duration) {
        let state = self.monitor.telemetry.as_ref().map(|telemetry| telemetry.state);
        let is_on = state.is_some_and(|state| state == State::Armed || state.motor_is_on());
        if !self.was_seen || !is_on {
            return;
        }
        if self.last_heard.elapsed() > SILENCE {
            self.turn_off(now);
            self.monitor.wanted = None;
            self.commander = None;
        } else if state == Some(State::Balancing) && self.monitor.wanted.is_none() {
            // From the first set-point on, the firmware turns the motor off by itself when this program is silent.
            self.monitor.act(MonitorAction::Shift(0.0), now);
        }
    }

    fn start_recording(&mut self) {
        self.recorder = Some(TelemetryCsv::new(Vec::new()));
        self.monitor.recording = Some("recording.csv".to_owned());
    }

    fn stop_recording(&mut self) {
        if let Some(recorder) = self.recorder.take() {
            *self.recording.lock().unwrap_or_else(PoisonError::into_inner) = recorder.into_bytes();
        }
        self.monitor.recording = None;
    }

    /// Turns the motor off.
    pub(super) fn turn_off(&mut self, now: Duration) {
        self.monitor.act(MonitorAction::Send(Request::Disarm), now);
    }

    /// Shows why the firmware has stopped, until the viewer in command asks for a restart. Returns whether to restart
    /// upright; `None` if `goes_on` no longer holds.
    pub(super) fn wait_for_restart(&mut self, why: &str, goes_on: &dyn Fn() -> bool) -> Option<bool> {
        self.monitor.note(format!("{why}; switch the power off and on"));
        while goes_on() {
            // Nothing else can be done while the firmware is stopped.
            for request in self.requests(Duration::ZERO) {
                if let MachineRequest::Restart { upright } = request {
                    return Some(upright);
                }
            }
            self.show(&json!({ "stopped": why }));
            std::thread::sleep(PICTURE);
        }
        None
    }

    /// Begins the conversation with a firmware that has just started.
    pub(super) fn begin_again(&mut self, monitor: Monitor) {
        let log = std::mem::take(&mut self.monitor.log);
        self.monitor = monitor;
        self.monitor.log = log;
        self.monitor.note("the firmware has started".to_owned());
        (self.last_heard, self.fresh) = (Instant::now(), Vec::new());
    }

    /// Whether a viewer is connected.
    pub(super) fn has_viewers(&self) -> bool {
        !self.viewers.is_empty()
    }

    /// Sends a picture to all viewers: the telemetry since the picture before, and `machine`.
    pub(super) fn show(&mut self, machine: &Value) {
        let fresh = std::mem::take(&mut self.fresh);
        if !self.has_viewers() {
            return;
        }
        let monitor = &mut self.monitor;
        let fault = monitor.telemetry.as_ref().and_then(|telemetry| telemetry.fault);
        let entry = fault.map(|fault| fault.entry());
        let picture = json!({
            "picture": {
                "telemetry": fresh,
                "machine": machine,
                "commander": self.commander,
                "recording": monitor.recording.is_some(),
                "wanted_m": monitor.wanted,
                "statistics": monitor.statistics,
                "fault": entry.map(|entry| json!({
                    "code": fault.map(|fault| fault.code()),
                    "name": entry.name,
                    "condition": entry.condition,
                    "remedy": entry.remedy,
                    "at": monitor.cause.filter(|cause| Some(cause.fault) == fault)
                        .and_then(|cause| cause.sensor).map(words::joint),
                })),
                "ended": monitor.ended.as_ref().map(ToString::to_string),
                "log": monitor.log.drain(..).collect::<Vec<_>>(),
            }
        });
        self.viewers.tell_all(picture.to_string());
    }
}
