//! A machine behind a serial line: telemetry comes in, commands go out.

use std::time::{Duration, Instant};

use serde_json::Value;

use super::desk::Desk;
use super::pace::PICTURE;
use crate::monitor::{Line, now};

/// Longest wait at the end, when the motor is turned off, for the answer.
const LAST_WAIT: Duration = Duration::from_millis(500);

/// Passes bytes between the line and the viewers while `goes_on` holds. The firmware has to be that of the rig with
/// this hash; commands to another one are not sent.
pub(super) fn run(mut line: Line, desk: &mut Desk, rig_hash: u64, goes_on: &dyn Fn() -> bool) {
    let mut buffer = [0; 4096];
    let mut next = Instant::now();
    while goes_on() {
        // What only a simulation can do is ignored.
        let _ = desk.requests(now());
        if desk.monitor.ended.is_none() {
            exchange(&mut line, desk, &mut buffer);
            desk.monitor.expect_rig(rig_hash);
        } else {
            std::thread::sleep(PICTURE);
        }
        if Instant::now() >= next {
            desk.show(&Value::Null);
            next = Instant::now() + PICTURE;
        }
    }
    // From here on, requests of the viewer in command are no longer read.
    desk.turn_off(now());
    let end = Instant::now() + LAST_WAIT;
    while desk.monitor.ended.is_none() && desk.monitor.is_waiting() && Instant::now() < end {
        exchange(&mut line, desk, &mut buffer);
    }
}

/// Sends pending bytes, and receives.
fn exchange(line: &mut Line, desk: &mut Desk, buffer: &mut [u8]) {
    desk.monitor.poll(now());
    match line.exchange(&desk.monitor.take_outgoing(), buffer) {
        Ok(bytes) => desk.receive(bytes, now()),
        Err(error) => desk.monitor.close(&error),
    }
}
