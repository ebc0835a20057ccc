//! The dead man's switch: a state machine holds the enable output high only as long as ticks restart it, and while the
//! emergency stop is closed. It needs no code on the processor.

use hal::pac::PIO1;

use super::encoders::LENGTH;
use super::pins::{EMERGENCY_STOP, ENABLE};
use super::state_machine::{Course, load, run, start};

/// Where the program begins; it fills the rest of the instruction memory.
const ORIGIN: u16 = LENGTH as u16;
const BEGIN: u16 = ORIGIN + 1;
const OFF: u16 = ORIGIN + 6;

/// X is the time left, in rounds of [`ROUND`] cycles.
const PROGRAM: [u16; 8] = [
    0x8080,          // pull noblock: a new time; X if there is none
    0xa027,          // BEGIN: mov x, osr
    0x0020 | OFF,    // jmp !x, OFF
    0x00c0 | OFF,    // jmp pin, OFF: the emergency stop is open
    0xe001,          // set pins, 1
    0x0040 | ORIGIN, // jmp x--, ORIGIN
    0xe000,          // OFF: set pins, 0
    0x80a0,          // pull block, and on to BEGIN
];
const ROUND: u32 = 6;
const NUMBER: usize = 3;

/// set pins, 0 and set pindirs, 1
const OUTPUT: [u16; 2] = [0xe000, 0xe081];

/// The state machine.
pub(super) struct Guard {
    pio: PIO1,
    /// Rounds in three ticks.
    hold: u32,
}

impl Guard {
    /// Starts it, with the enable output low, for ticks of so many processor cycles.
    pub(super) fn set_up(pio: PIO1, tick_cycles: u32) -> Self {
        load(&pio, ORIGIN.into(), &PROGRAM);
        let pins = 1 << 26 | (ENABLE as u32) << 5;
        let off = u32::from(OFF);
        let course = Course { begin: off, repeat: BEGIN.into(), last: off + 1, divider: 1 };
        start(&pio, NUMBER, course, pins, EMERGENCY_STOP, &OUTPUT);
        Self { pio, hold: 3 * tick_cycles / ROUND }
    }

    /// Enables the power stage for three ticks.
    pub(super) fn hold(&self) {
        self.set(self.hold);
    }

    /// Disables the power stage.
    pub(super) fn release(&self) {
        self.set(0);
    }

    fn set(&self, rounds: u32) {
        // SAFETY: any number. The queue is empty within a few cycles, long before the next tick.
        self.pio.txf(NUMBER).write(|w| unsafe { w.bits(rounds) });
    }

    /// Whether the state machine is off.
    pub(super) fn has_stopped(&self) -> bool {
        !run(&self.pio, 1 << NUMBER)
    }
}

/// Disables the power stage, when nothing else runs any more.
pub(super) fn release() {
    // SAFETY: as in [`Guard::set`].
    unsafe { (*PIO1::PTR).txf(NUMBER).write(|w| w.bits(0)) };
}
