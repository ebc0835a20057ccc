//! A real board behind a serial line that the page has opened: bytes in, bytes out.

use std::io;
use std::time::Duration;

use serde::Deserialize;
use serde_json::{Value, json};
use upright::supervision::supervisor::State;
use upright_closed_loop::client::ExpectedRig;
use upright_closed_loop::conversation::Monitor;
use upright_design::rig::Rig;

use super::console::Console;
use super::greeting::greeting;
use super::request::PageRequest;
use crate::designed::DeskDesign;
use crate::refusal::{FILE, PageRefusal};

/// Number of the only viewer: a browser opens a port for one page.
const VIEWER: u64 = 1;
const LINE: &str = "serial port";

/// What has happened since the exchange before.
#[derive(Debug, Deserialize)]
pub(super) struct Exchange {
    /// What the person asks for.
    asked: Vec<PageRequest>,
    /// The bytes of the board.
    received: Vec<u8>,
    /// Why the line is closed, if it is.
    closed: Option<String>,
    /// The time (s).
    since_1970_s: f64,
    /// Whether the page has been silent for too long to be in command.
    is_silent: bool,
}

/// A conversation with a board.
pub(super) struct ConnectedBoard {
    console: Console,
    expected: ExpectedRig,
}

impl ConnectedBoard {
    /// A conversation with the board of this rig, and the greeting for the page.
    pub(super) fn connect(toml: &str, motions: Option<&str>) -> Result<(Self, Value), PageRefusal> {
        let rig = Rig::from_toml(toml, FILE.as_ref())?;
        let table = DeskDesign::design(&rig)?.table_with(&rig, motions)?;
        let board = Self { console: Console::new(Monitor::new(LINE), rig.base()), expected: (&rig).into() };
        Ok((board, json!({ "hello": greeting(&rig, &table, LINE, None), "you": VIEWER })))
    }

    /// The picture, and the bytes to send. Commands to another rig's firmware are not sent.
    pub(super) fn exchange(&mut self, exchange: Exchange) -> Value {
        let Exchange { asked, received, closed, since_1970_s, is_silent } = exchange;
        let now = Duration::try_from_secs_f64(since_1970_s).unwrap_or_default();
        let console = &mut self.console;
        for request in asked {
            match request {
                PageRequest::Say { line } => console.say(&line, now),
                PageRequest::Record { on } => console.record(on),
                // The only viewer is in command, and a board does nothing that only a simulation can do.
                _ => {}
            }
        }
        console.watch(is_silent, now);
        let telemetry = console.monitor.receive(&received, now);
        console.take(telemetry);
        console.monitor.expect_rig(self.expected);
        if let Some(why) = closed {
            console.monitor.close(&io::Error::other(why));
        }
        console.monitor.poll(now);
        let send = console.monitor.take_outgoing();
        let picture = console.picture(&Value::Null, Some(VIEWER));
        let csv = console.recorded().map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        let state = console.monitor.telemetry.as_ref().map(|telemetry| telemetry.state);
        let is_off = !state.is_some_and(|state| state == State::Armed || state.motor_is_on());
        json!({ "picture": picture, "csv": csv, "send": send, "is_off": is_off })
    }
}
