//! A machine behind a serial line: telemetry comes in, commands go out.

use std::time::{Duration, Instant};

use serde_json::Value;
use upright_closed_loop::client::ExpectedRig;

use super::dispatcher::{Dispatcher, PICTURE};
use crate::monitor::{SerialLine, now};

/// Longest wait at the end, when the motor is turned off, for the answer.
const LAST_WAIT: Duration = Duration::from_millis(500);

/// Passes bytes between the line and the viewers while `goes_on` holds. The firmware has to be that of `rig`;
/// commands to another one are not sent.
pub(super) fn run(
    mut line: SerialLine,
    dispatcher: &mut Dispatcher,
    rig: ExpectedRig,
    goes_on: &dyn Fn() -> bool,
) {
    let mut next = Instant::now();
    while goes_on() {
        // What only a simulation can do is ignored.
        let _ = dispatcher.requests(now());
        if dispatcher.console.monitor.ended.is_none() {
            exchange(&mut line, dispatcher);
            dispatcher.console.monitor.expect_rig(rig);
        } else {
            std::thread::sleep(PICTURE);
        }
        if Instant::now() >= next {
            dispatcher.show(&Value::Null);
            next = Instant::now() + PICTURE;
        }
    }
    // From here on, requests of the viewer in command are no longer read.
    dispatcher.console.turn_off(now());
    let end = Instant::now() + LAST_WAIT;
    while dispatcher.console.monitor.ended.is_none()
        && dispatcher.console.monitor.is_waiting()
        && Instant::now() < end
    {
        exchange(&mut line, dispatcher);
    }
}

/// Sends pending bytes, and receives.
fn exchange(line: &mut SerialLine, dispatcher: &mut Dispatcher) {
    let telemetry = line.carry(&mut dispatcher.console.monitor);
    dispatcher.console.take(telemetry);
}
