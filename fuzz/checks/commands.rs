//! Commands to the whole firmware: a run starts from a clone of a firmware whose rig balances, is armed, is raised,
//! hangs, is shaken, or has a fault.
//!
//! The bytes of a run encode what happens to it: requests in valid frames, which get past the checksum, damaged and
//! repeated frames, bytes that are not a frame, contacts, the supply, a push by hand, and time.

use std::sync::OnceLock;

use crate::gains::{SENSORS, STATES, TABLE};
use heapless::spsc::Queue;
use upright::board::Contacts;
use upright::firmware::control_task::{COMMANDS, ControlTask, MESSAGES};
use upright::protocol::frame::{Receiver, encode};
use upright::protocol::message::{Command, Message, Reply, Request};
use upright::protocol::serial_link::{MAX_COMMAND, MAX_MESSAGE, SerialLink};
use upright::supervision::shaking::Shaking;
use upright::table::Law;

use crate::invariants::{self, Invariants};
use crate::simulated_rig::{SimulatedRig, Start, starts};

/// A run ends after this many ticks at the latest.
const MOST_TICKS: u32 = 32;

/// Runs what `bytes` encode.
///
/// # Panics
/// If the firmware panics or an invariant does not hold.
pub fn check(bytes: &[u8]) {
    static STARTS: OnceLock<[Start; 6]> = OnceLock::new();
    let Some((&first, bytes)) = bytes.split_first() else { return };
    let [hanging, shaken, raised, armed, balancing, stopped] = STARTS.get_or_init(starts);
    let start = match first % 8 {
        0 => hanging,
        1 => armed,
        2 | 3 => raised,
        6 => shaken,
        7 => stopped,
        _ => balancing,
    };
    let (mut commands, mut messages) =
        (Queue::<Command, COMMANDS>::new(), Queue::<Message<STATES, SENSORS>, MESSAGES>::new());
    let ((to_control, from_link), (from_control, to_link)) = (commands.split(), messages.split());
    let mut run = Run {
        control: ControlTask::new(start.firmware.clone(), start.rig.clone(), from_link, from_control),
        link: SerialLink::new(to_control, to_link),
        invariants: Invariants::new(&start.firmware),
        sent: Vec::new(),
        last_frame: Vec::new(),
        answered_id: 0,
        id: start.id,
        ticks: 0,
        hash: hash(bytes),
    };
    let mut bytes = bytes.iter().copied();
    while run.ticks < MOST_TICKS
        && let Some(what) = bytes.next()
    {
        run.step(what, &mut bytes);
    }
    run.tick();
    run.tick();
}

/// Firmware and rig in a run, and what was sent to it.
struct Run<'q> {
    control: ControlTask<'q, 'static, SimulatedRig, STATES, SENSORS>,
    link: SerialLink<'q, STATES, SENSORS>,
    invariants: Invariants,
    sent: Vec<Command>,
    last_frame: Vec<u8>,
    /// Id of the last command that was answered.
    answered_id: u64,
    id: u64,
    ticks: u32,
    hash: u16,
}

impl Run<'_> {
    /// One step: the high five bits of `what` say what happens, with the next bytes as operands; the low three bits
    /// say how many ticks follow.
    fn step(&mut self, what: u8, bytes: &mut impl Iterator<Item = u8>) {
        let mut next = || bytes.next().unwrap_or_default();
        match what >> 3 {
            16 => {
                let length = next() % 32;
                (0..length).for_each(|_| self.link.receive(next()));
            }
            17 => self.last_frame.iter().for_each(|&byte| self.link.receive(byte)),
            18 => {
                let (place, bits) = (usize::from(next()), next());
                for (index, &byte) in self.last_frame.iter().enumerate() {
                    self.link.receive(if index == place { byte ^ bits } else { byte });
                }
            }
            19 | 20 => self.control.board().contacts = contacts(next()),
            21 => self.control.board().supply_v = supply(next()),
            22 | 23 => {
                let sensor = usize::from(next()) % SENSORS;
                let moved = i16::from_le_bytes([next(), next()]);
                let offset = &mut self.control.board().offset[sensor];
                *offset = offset.wrapping_add(moved.into());
            }
            24 => (0..next() % 32).for_each(|_| self.tick()),
            25 | 31 => {
                // Coverage cannot guide the fuzzer to a single 16-bit value. So every input tries 16 values that its
                // hash chooses: mutations alone favour a few values.
                let first = self.hash & !15;
                for period_ticks in first..=first | 15 {
                    self.send(Request::Telemetry(period_ticks));
                    self.tick();
                }
            }
            30 => {
                let first = self.control.firmware().statistics().ticks as u16;
                let forces = core::array::from_fn(|_| next() as i8);
                self.send(Request::Forces { first: first.wrapping_add(u16::from(next())), forces });
            }
            which => self.send(request(which, next)),
        }
        const TICKS: [u8; 8] = [1, 0, 1, 2, 1, 3, 0, 4];
        (0..TICKS[usize::from(what % 8)]).for_each(|_| self.tick());
    }

    fn send(&mut self, request: Request) {
        self.id += 1;
        let command = Command { id: self.id, request };
        let (mut scratch, mut out) = ([0; MAX_COMMAND], [0; MAX_COMMAND]);
        let frame = encode(&command, &mut scratch, &mut out).expect("a command fits into its frame");
        frame.iter().for_each(|&byte| self.link.receive(byte));
        self.sent.push(command);
        frame.clone_into(&mut self.last_frame);
    }

    /// Runs one tick and checks everything that has to hold after it.
    fn tick(&mut self) {
        if self.ticks >= MOST_TICKS + 2 {
            return;
        }
        self.ticks += 1;
        self.control.tick();
        let mut receiver = Receiver::<MAX_MESSAGE>::new();
        let mut answered = None;
        while let Some(frame) = self.link.transmit() {
            for message in frame.iter().filter_map(|&byte| receiver.push::<Message<STATES, SENSORS>>(byte)) {
                match message.expect("a frame that the firmware sends can be read") {
                    Message::Telemetry(telemetry) => invariants::telemetry(&telemetry),
                    Message::Log(log) => assert!(!log.ticks.is_empty()),
                    // The last command was repeated, and so is its reply.
                    Message::Reply(Reply { id, .. }) if id == self.answered_id => {}
                    Message::Reply(Reply { id, answer }) => {
                        assert!(id > self.answered_id, "only the last command is answered again");
                        self.answered_id = id;
                        // A damaged frame could carry an id of its own only if its checksum collided.
                        let command = self.sent.iter().find(|command| command.id == id);
                        let command = command.expect("a reply belongs to a command that was sent");
                        assert!(answered.replace((command.request, answer)).is_none(), "one reply per tick");
                    }
                }
            }
        }
        let rig = self.control.board().clone();
        self.invariants.check(self.control.firmware(), &rig, answered.as_ref());
    }
}

/// The request of a step that sends one, with operands from `next`.
fn request(which: u8, mut next: impl FnMut() -> u8) -> Request {
    match which {
        0 => Request::KeepAlive,
        1 => Request::Home,
        2 => Request::HomeRail,
        3 => Request::CheckSigns,
        4 | 5 => Request::Arm,
        6 => Request::Disarm,
        7 => Request::Clear,
        8 => Request::Setpoint(f32::from_le_bytes([next(), next(), next(), next()])),
        9 => Request::Setpoint(setpoint(next())),
        10 => Request::Select(if next().is_multiple_of(2) { Law::Lqr } else { Law::PolePlacement }),
        11 => Request::Info,
        12 => Request::Cause,
        13 => Request::Statistics,
        14 => Request::ResetStatistics,
        15 => Request::Telemetry(u16::from_le_bytes([next(), next()])),
        28 => Request::Log(next().is_multiple_of(2)),
        29 => {
            let [largest_input, stiffness, damping] = core::array::from_fn(|_| setpoint(next()));
            Request::Shake(Shaking { largest_input, stiffness, damping })
        }
        _ => Request::Jog { along: next().is_multiple_of(2) },
    }
}

/// The upper half of FNV-1a with 32 bits.
fn hash(bytes: &[u8]) -> u16 {
    let mix = |hash: u32, &byte: &u8| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193);
    (bytes.iter().fold(0x811c_9dc5, mix) >> 16) as u16
}

/// Set-points: 0, the ends of their range and just beyond, numbers that are not finite, and some others.
fn setpoint(which: u8) -> f32 {
    let [low, high] = TABLE.limits.setpoints_m();
    let edges = [0.0, -0.0, low, high, low.next_down(), high.next_up(), f32::INFINITY, f32::NEG_INFINITY];
    let edges = edges.into_iter().chain([f32::NAN, f32::MAX, f32::MIN_POSITIVE, 0.1, -0.1, 1.0, -1.0]);
    edges.into_iter().nth(usize::from(which % 15)).unwrap_or_default()
}

/// Supply voltages (V), valid and invalid.
fn supply(which: u8) -> f32 {
    [24.0, 12.0, 0.0, -1.0, f32::NAN, f32::INFINITY][usize::from(which % 6)]
}

fn contacts(bits: u8) -> Contacts {
    let bit = |number: u8| bits & 1 << number != 0;
    Contacts {
        limit_low: bit(0),
        limit_high: bit(1),
        emergency_stop: bit(2),
        driver_fault: bit(3),
        overrun: bit(4),
        clock_fault: bit(5),
        board_fault: bit(6),
    }
}
