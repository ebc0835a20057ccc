//! The encoders: state machines count edges, 12.5 million per second each. Four are in PIO 0, the fifth is in PIO 1.

use crate::gains::SENSORS;
use hal::pac::pio0::RegisterBlock;
use hal::pac::{PIO0, PIO1};

use super::pins::{ENCODERS, GIVES_PULSES};
use super::sensors::ON_BUS;
use super::state_machine::{Course, load, run, start};

const _: () = assert!(SENSORS <= ENCODERS.len(), "the board counts fewer encoders than the rig has");

/// The sensors that count edges: pulses tell where the cart is that they move, and absolute sensors read an angle.
const COUNT_EDGES: u32 = ((1 << SENSORS) - 1) & !(GIVES_PULSES as u32) & !ON_BUS;

/// The length of the program: what follows it is free.
pub(super) const LENGTH: usize = COUNT.len();

/// Counts in Y. The first 16 words are a table of jumps by the last and the present level of both phases, so the
/// program has to begin at 0. Entries 14 and 15 are part of the program as well.
const COUNT: [u16; 24] = [
    UPDATE,
    DECREMENT,
    INCREMENT,
    UPDATE, // from 00 to 00, 01, 10, 11
    INCREMENT,
    UPDATE,
    UPDATE,
    DECREMENT, // from 01
    DECREMENT,
    UPDATE,
    UPDATE,
    INCREMENT, // from 10
    UPDATE,
    INCREMENT,       // from 11 to 00, 01
    0x0080 | UPDATE, // DECREMENT: jmp y--, UPDATE
    0xa0c2,          // UPDATE: mov isr, y
    0x8000,          // push noblock
    0x60c2,          // out isr, 2: the last levels
    0x4002,          // in pins, 2: the present ones
    0xa0e6,          // mov osr, isr
    0xa0a6,          // mov pc, isr
    0xa04a,          // INCREMENT: mov y, ~y
    0x0080 | 23,     // jmp y--, 23
    0xa04a,          // mov y, ~y, and on to UPDATE
];
const DECREMENT: u16 = 14;
const UPDATE: u16 = 15;
const INCREMENT: u16 = 21;
/// set y, 0
const ZERO: u16 = 0xe040;

/// Reads of the queue of a state machine until the count is no older than the first read: four counts wait in it.
const OLD_COUNTS: usize = 4;
/// Tries to get a fresh count. One comes every ten cycles.
const PATIENCE: usize = 32;

/// The counting state machines.
pub(super) struct Encoders {
    have_stopped: bool,
}

/// Block and state machine of an encoder.
fn machine(encoder: usize) -> (&'static RegisterBlock, usize) {
    // SAFETY: reading a queue takes from it; only the control task does. Both blocks have the same registers.
    unsafe { if encoder < 4 { (&*PIO0::PTR, encoder) } else { (&*PIO1::PTR, encoder - 4) } }
}

impl Encoders {
    /// Starts to count from 0.
    pub(super) fn set_up(first: &PIO0, second: &PIO1) -> Self {
        load(first, 0, &COUNT);
        load(second, 0, &COUNT);
        for (encoder, &phase_b) in ENCODERS.iter().enumerate().take(SENSORS) {
            if COUNT_EDGES & 1 << encoder == 0 {
                continue;
            }
            let (pio, number) = machine(encoder);
            let course = Course { begin: UPDATE.into(), repeat: UPDATE.into(), last: 23, divider: 1 };
            start(pio, number, course, (phase_b as u32) << 15, 0, &[ZERO]);
        }
        Self { have_stopped: false }
    }

    /// The counts, as of now; 0 for a sensor that is no encoder.
    pub(super) fn raw_counts(&mut self) -> [u32; SENSORS] {
        core::array::from_fn(|encoder| {
            if COUNT_EDGES & 1 << encoder == 0 {
                return 0;
            }
            let (pio, number) = machine(encoder);
            for _ in 0..OLD_COUNTS {
                let _ = pio.rxf(number).read().bits();
            }
            let has_come = |_: &usize| pio.fstat().read().bits() & 1 << (8 + number) == 0;
            self.have_stopped |= !(0..PATIENCE).any(|tried| has_come(&tried));
            pio.rxf(number).read().bits()
        })
    }

    /// Whether a state machine has not counted in time, or is off.
    pub(super) fn have_stopped(&self) -> bool {
        let [in_first, in_second] = [COUNT_EDGES & 0xf, COUNT_EDGES >> 4];
        self.have_stopped | !run(machine(0).0, in_first) | !run(machine(4).0, in_second)
    }
}
