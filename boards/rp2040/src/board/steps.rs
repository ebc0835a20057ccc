//! Step pulses: a state machine gives the pulses of a tick, evenly, and then waits for the next tick. If ticks stop, so
//! do the pulses.

use hal::pac::PIO0;
use hal::pac::pio0::RegisterBlock;

use super::encoders::LENGTH;
use super::pins::{DIRECTION, STEP};
use super::state_machine::{Course, load, restart, run, start};

/// Where the program begins; it fills the rest of the instruction memory.
const ORIGIN: u16 = LENGTH as u16;
const PULL: u16 = ORIGIN + 1;
const PULSE: u16 = ORIGIN + 4;

/// X is the number of pulses after the next one, OSR half an interval, STEP the side-set pin.
const PROGRAM: [u16; 8] = [
    0x0040 | PULSE,       // jmp x--, PULSE
    0x80a0,               // PULL: pull block
    0x6001,               // out pins, 1: the direction
    0x602c,               // out x, 12
    0xa047,               // PULSE: mov y, osr
    0x0080 | (PULSE + 1), // jmp y--, here
    0xb047,               // mov y, osr, and STEP is high
    0x1080 | (PULSE + 3), // jmp y--, here; STEP is high
];
/// Cycles of an interval beside those of both loops, and of a tick beside its intervals.
const OVERHEAD: u32 = 5;
const REST: u32 = 8;

/// The first state machine: a drive that takes pulses has no encoder at the cart.
const NUMBER: usize = 0;
/// Most pulses in a tick.
const MOST: u32 = upright::boards::rp::PULSES;

/// set pins, 0 and set pindirs, 3
const OUTPUTS: [u16; 2] = [0xe000, 0xe083];

/// The state machine.
pub(super) struct Steps {
    /// Cycles of the state machine that the pulses of a tick may take.
    cycles: u32,
    given: u32,
}

fn pio() -> &'static RegisterBlock {
    // SAFETY: only the control task writes to this state machine.
    unsafe { &*PIO0::PTR }
}

impl Steps {
    /// Starts it, without pulses, for ticks of so many processor cycles.
    pub(super) fn set_up(pio: &PIO0, tick_cycles: u32) -> Self {
        // With this divider of the clock, half a tick fits into 19 bits.
        let divider = tick_cycles / (2 << 19) + 1;
        load(pio, ORIGIN.into(), &PROGRAM);
        let pins = 1 << 29 | 2 << 26 | 1 << 20 | (STEP as u32) << 10 | (STEP as u32) << 5 | DIRECTION as u32;
        let course = Course { begin: PULL.into(), repeat: ORIGIN.into(), last: 31, divider };
        start(pio, NUMBER, course, pins, 0, &OUTPUTS);
        Self { cycles: tick_cycles.checked_div(divider).unwrap_or(tick_cycles) - REST, given: 0 }
    }

    /// Gives pulses until the next tick, positive along +x. The direction changes half an interval before the first.
    pub(super) fn give(&mut self, pulses: i32) {
        let number = pulses.unsigned_abs().min(MOST);
        let Some(interval) = self.cycles.checked_div(number) else { return };
        let half = interval.saturating_sub(OVERHEAD) / 2;
        let word = half << 13 | (number - 1) << 1 | u32::from(pulses > 0);
        // SAFETY: any word. The queue is empty: the pulses of the tick before have begun.
        pio().txf(NUMBER).write(|w| unsafe { w.bits(word) });
        self.given = self.given.wrapping_add(if pulses > 0 { number } else { number.wrapping_neg() });
    }

    /// Number of all pulses so far, with those of the last tick.
    pub(super) fn given(&self) -> u32 {
        self.given
    }

    /// Leaves out what is left of the pulses.
    pub(super) fn stop(&self) {
        restart(pio(), NUMBER, PULL.into());
    }

    /// Whether the state machine is off, or takes no words.
    pub(super) fn have_stopped(&self) -> bool {
        !run(pio(), 1 << NUMBER) | (pio().fstat().read().bits() & 1 << (16 + NUMBER) != 0)
    }
}
