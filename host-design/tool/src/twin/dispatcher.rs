//! Between viewers and firmware: who is in command.
//!
//! It is the same for a simulated rig and for a real one.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use upright_closed_loop::conversation::Monitor;
use upright_page::twin::{Console, MachineRequest, PageRequest};

use super::connections::{Connections, EventQueue, ViewerEvent, ViewerId};

/// Time between two pictures.
pub(super) const PICTURE: Duration = Duration::from_nanos(16_666_667);
/// Longest silence of the viewer in command while the motor may move. A page answers every few pictures, in a
/// background tab as well; a sleeping computer does not.
const SILENCE: Duration = Duration::from_secs(2);

/// The last finished recording as CSV, shared with the server.
pub(super) type SharedCsv = Arc<Mutex<Vec<u8>>>;

/// What stands between the viewers and the firmware.
pub(super) struct Dispatcher {
    /// The conversation with the firmware.
    pub(super) console: Console,
    viewers: Connections,
    events: EventQueue,
    commander: Option<ViewerId>,
    last_heard: Instant,
    /// Whether a viewer has ever connected.
    pub(super) was_seen: bool,
    recording: SharedCsv,
}

impl Dispatcher {
    /// A dispatcher of this conversation.
    pub(super) fn new(
        console: Console,
        (viewers, events): (Connections, EventQueue),
        recording: SharedCsv,
    ) -> Self {
        Self {
            console,
            viewers,
            events,
            commander: None,
            last_heard: Instant::now(),
            was_seen: false,
            recording,
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
                ViewerEvent::Went | ViewerEvent::Asks(PageRequest::Alive {}) => {}
                ViewerEvent::Asks(PageRequest::Command {}) => self.take_command(viewer),
                ViewerEvent::Asks(PageRequest::Release {}) if commands => self.commander = None,
                // Anyone who sees danger may turn the motor off.
                ViewerEvent::Asks(PageRequest::Say { line }) if commands || line == "disarm" => {
                    self.console.say(&line, now)
                }
                ViewerEvent::Asks(PageRequest::Record { on }) if commands => {
                    self.console.record(on);
                }
                ViewerEvent::Asks(PageRequest::Machine { what }) if commands => machine.push(what),
                ViewerEvent::Asks(_) => self.viewers.tell(
                    viewer,
                    &json!({ "notice": "another viewer is in command; only the stop button works here" })
                        .to_string(),
                ),
            }
        }
        let is_silent = self.last_heard.elapsed() > SILENCE;
        if self.was_seen && self.console.watch(is_silent, now) {
            self.commander = None;
        }
        machine
    }

    fn take_command(&mut self, viewer: ViewerId) {
        if self.commander.is_none() {
            (self.commander, self.last_heard) = (Some(viewer), Instant::now());
        }
    }

    /// Shows why the firmware has stopped, until the viewer in command asks for a restart. Returns whether to restart
    /// upright; `None` if `goes_on` no longer holds.
    pub(super) fn wait_for_restart(&mut self, why: &str, goes_on: &dyn Fn() -> bool) -> Option<bool> {
        self.console.monitor.note(format!("{why}; switch the power off and on"));
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
        self.console.begin_again(monitor);
        self.last_heard = Instant::now();
    }

    /// Whether a viewer is connected.
    pub(super) fn has_viewers(&self) -> bool {
        !self.viewers.is_empty()
    }

    /// Sends a picture to all viewers: the telemetry since the picture before, and `machine`.
    pub(super) fn show(&mut self, machine: &Value) {
        if let Some(recorded) = self.console.recorded() {
            *self.recording.lock().unwrap_or_else(PoisonError::into_inner) = recorded;
        }
        let picture = self.console.picture(machine, self.commander);
        if self.has_viewers() {
            self.viewers.tell_all(json!({ "picture": picture }).to_string());
        }
    }
}
