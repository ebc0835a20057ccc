//! Bytes and commands to a firmware whose rig hangs still: it never arms, and the motor stays off.

use heapless::spsc::Queue;
use upright::board::{Board, Contacts, Inputs, Output};
use upright::control::actuator::Drive;
use upright::control::encoder::CounterWidth;
use upright::firmware::Firmware;
use upright::firmware::control_task::{COMMANDS, ControlTask, MESSAGES};
use upright::gains::{RIG_HASH, SENSORS, STATES, TABLE, TICK_S};
use upright::protocol::frame::encode;
use upright::protocol::message::{Command, Message, Request, Reset};
use upright::protocol::serial_link::{MAX_COMMAND, SerialLink};
use upright::supervision::supervisor::State;
use upright::table::Build;

/// The bytes of one tick, at most; what a line carries in it.
const BYTES_PER_TICK: usize = 16;

/// Sends `bytes` as they are; then the requests that they spell, in good frames, which gets past the checksum: before
/// each request, one byte says how many times 16 ticks pass.
///
/// # Panics
/// If the firmware arms or balances, or the motor is turned on.
pub(crate) fn check(bytes: &[u8]) {
    on_a_hanging_rig(|link, tick| {
        for piece in bytes.chunks(BYTES_PER_TICK) {
            piece.iter().for_each(|&byte| link(byte));
            tick(1);
        }
        tick(2);
    });
    on_a_hanging_rig(|link, tick| {
        let (mut rest, mut id) = (bytes, 0);
        while let Some((&ticks, after)) = rest.split_first() {
            let Ok((request, after)) = postcard::take_from_bytes::<Request>(after) else {
                rest = after;
                continue;
            };
            rest = after;
            id += 1;
            let (mut scratch, mut out) = ([0; MAX_COMMAND], [0; MAX_COMMAND]);
            let frame = encode(&Command { id, request }, &mut scratch, &mut out).expect("a command fits");
            tick(16 * u32::from(ticks % 64));
            frame.iter().for_each(|&byte| link(byte));
            tick(1);
        }
        tick(2);
    });
}

/// Runs `what` with a way to send a byte and a way to let ticks pass.
fn on_a_hanging_rig(what: impl FnOnce(&mut dyn FnMut(u8), &mut dyn FnMut(u32))) {
    let (mut commands, mut messages) =
        (Queue::<Command, COMMANDS>::new(), Queue::<Message<STATES, SENSORS>, MESSAGES>::new());
    let ((to_control, from_link), (from_control, to_link)) = (commands.split(), messages.split());
    let build = Build { rig_hash: RIG_HASH, tick_s: TICK_S };
    let firmware = Firmware::new(&TABLE, &build, Hanging::WIDTHS, Reset::Power).expect("the table is sound");
    let mut control = ControlTask::new(firmware, Hanging, from_link, from_control);
    let link = core::cell::RefCell::new(SerialLink::new(to_control, to_link));
    what(&mut |byte| link.borrow_mut().receive(byte), &mut |ticks| {
        for _ in 0..ticks {
            control.tick();
            let state = control.firmware().state();
            assert!(!matches!(state, State::Armed | State::Balancing), "{state:?}");
            while link.borrow_mut().transmit().is_some() {}
        }
    });
}

/// A healthy board whose rig hangs still; it refuses to drive the motor.
struct Hanging;

impl Board<SENSORS> for Hanging {
    const WIDTHS: [CounterWidth; SENSORS] = [CounterWidth::Bits32; SENSORS];

    fn inputs(&mut self) -> Inputs<SENSORS> {
        Inputs { raw_counts: [0; SENSORS], supply_v: 24.0, contacts: Contacts::default() }
    }

    fn drive(&mut self, output: &Output) {
        assert!(!output.enable && output.drive == Drive::OFF, "{output:?}");
    }

    fn feed_watchdog(&mut self) {}

    fn cycles(&self) -> u32 {
        0
    }
}
