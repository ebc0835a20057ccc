//! The conversation with the firmware as a page shows it: commands in words, telemetry, fault, recording.

use std::time::Duration;

use serde_json::{Value, json};
use upright::protocol::message::Request;
use upright::supervision::supervisor::State;
use upright_closed_loop::client::AnyTelemetry;
use upright_closed_loop::conversation::record::{TelemetryCsv, json as telemetry_json};
use upright_closed_loop::conversation::{Monitor, MonitorAction, request as command, words};
use upright_design::rig::Base;

/// Longest recording (bytes).
const MAX_RECORDING: usize = 256 << 20;
/// Most telemetry messages kept for a picture; further ones are dropped.
const MAX_FRESH: usize = 2000;

/// What a page is shown of the conversation, and what a person says in it.
pub struct Console {
    /// The conversation.
    pub monitor: Monitor,
    base: Base,
    fresh: Vec<Value>,
    recorder: Option<TelemetryCsv<Vec<u8>>>,
    recorded: Option<Vec<u8>>,
}

impl Console {
    /// A console with a new conversation with a rig that has this base.
    pub fn new(monitor: Monitor, base: Base) -> Self {
        Self { monitor, base, fresh: Vec::new(), recorder: None, recorded: None }
    }

    /// Takes telemetry that the firmware has sent: for the next picture, and for the recording.
    pub fn take(&mut self, all: Vec<AnyTelemetry>) {
        for telemetry in all {
            if let Some(recorder) = &mut self.recorder {
                // Writing to memory does not fail.
                let _ = recorder.push(&telemetry);
                if recorder.get_ref().len() > MAX_RECORDING {
                    self.record(false);
                    self.monitor.note("the recording is full".to_owned());
                }
            }
            if self.fresh.len() < MAX_FRESH {
                let mut object = telemetry_json(&telemetry);
                for name in ["against_arming", "against_swing_up"] {
                    let texts = object[name].as_array_mut().into_iter().flatten();
                    texts.for_each(|text| *text = self.base.words(text.as_str().unwrap_or_default()).into());
                }
                object["now"] = json!(words::instruction(&telemetry).map(|text| self.base.words(&text)));
                object["inputs"] = json!(words::inputs(&telemetry));
                self.fresh.push(object);
            }
        }
    }

    /// Sends a command in words, or notes why it is none.
    pub fn say(&mut self, line: &str, now: Duration) {
        match command(line) {
            Ok(request) => self.monitor.act(MonitorAction::Send(request), now),
            Err(bad) => self.monitor.note(bad.to_string()),
        }
    }

    /// Turns the motor off when the person in command is silent, and returns whether it has. Otherwise, while the rig
    /// balances, starts the keep-alive of the firmware's own dead-man timer.
    pub fn watch(&mut self, is_silent: bool, now: Duration) -> bool {
        let state = self.monitor.telemetry.as_ref().map(|telemetry| telemetry.state);
        if !state.is_some_and(|state| state == State::Armed || state.motor_is_on()) {
            return false;
        }
        if is_silent {
            self.turn_off(now);
            self.monitor.wanted = None;
            return true;
        }
        if state == Some(State::Balancing) && self.monitor.wanted.is_none() {
            // From the first set-point on, the firmware turns the motor off by itself when this program is silent.
            self.monitor.act(MonitorAction::Shift(0.0), now);
        }
        false
    }

    /// Turns the motor off.
    pub fn turn_off(&mut self, now: Duration) {
        self.monitor.act(MonitorAction::Send(Request::Disarm), now);
    }

    /// Starts a recording, or ends it.
    pub fn record(&mut self, on: bool) {
        if on {
            self.recorder = Some(TelemetryCsv::new(Vec::new()));
            self.monitor.recording = Some("recording.csv".to_owned());
            return;
        }
        if let Some(recorder) = self.recorder.take() {
            self.recorded = Some(recorder.into_bytes());
        }
        self.monitor.recording = None;
    }

    /// Takes the recording that has ended since the last call, as CSV.
    pub fn recorded(&mut self) -> Option<Vec<u8>> {
        self.recorded.take()
    }

    /// Begins the conversation with a firmware that has just started.
    pub fn begin_again(&mut self, monitor: Monitor) {
        let log = std::mem::take(&mut self.monitor.log);
        self.monitor = monitor;
        self.monitor.log = log;
        self.monitor.note("the firmware has started".to_owned());
        self.fresh = Vec::new();
    }

    /// The next picture: the telemetry since the picture before, `machine`, and who is in command.
    pub fn picture(&mut self, machine: &Value, commander: Option<u64>) -> Value {
        let (monitor, base) = (&mut self.monitor, self.base);
        let fault = monitor.telemetry.as_ref().and_then(|telemetry| telemetry.fault);
        let entry = fault.map(|fault| fault.entry());
        json!({
            "telemetry": std::mem::take(&mut self.fresh),
            "machine": machine,
            "commander": commander,
            "recording": monitor.recording.is_some(),
            "wanted_m": monitor.wanted,
            "statistics": monitor.statistics,
            "fault": entry.map(|entry| json!({
                "code": fault.map(|fault| fault.code()),
                "name": entry.name,
                "condition": base.words(entry.condition),
                "remedy": base.words(entry.remedy),
                "at": monitor.cause.filter(|cause| Some(cause.fault) == fault)
                    .and_then(|cause| cause.sensor).map(|sensor| base.words(&words::joint(sensor))),
            })),
            "ended": monitor.ended.as_ref().map(ToString::to_string),
            "log": monitor.log.drain(..).map(|line| base.words(&line)).collect::<Vec<_>>(),
        })
    }
}
