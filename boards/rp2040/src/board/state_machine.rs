//! State machines of a PIO block (chapter 3).

use hal::pac::pio0::RegisterBlock;

/// Where a program begins, where it repeats from, its last instruction, and the divider of its clock.
pub(super) struct Course {
    pub(super) begin: u32,
    pub(super) repeat: u32,
    pub(super) last: u32,
    pub(super) divider: u32,
}

/// Writes a program into the instruction memory from `origin` on.
pub(super) fn load(pio: &RegisterBlock, origin: usize, program: &[u16]) {
    for (place, &word) in program.iter().enumerate() {
        // SAFETY: an instruction of 16 bits.
        pio.instr_mem(origin + place).write(|w| unsafe { w.bits(word.into()) });
    }
}

/// Starts a state machine with these pins (SM_PINCTRL), the pin that it may test, and instructions to
/// execute first.
pub(super) fn start(
    pio: &RegisterBlock,
    number: usize,
    course: Course,
    pins: u32,
    tested_pin: usize,
    first: &[u16],
) {
    let machine = pio.sm(number);
    // SAFETY: values of the fields of table 368 and its neighbours.
    unsafe {
        machine.sm_clkdiv().write(|w| w.bits(course.divider << 16));
        let execution = (tested_pin as u32) << 24 | course.last << 12 | course.repeat << 7;
        machine.sm_execctrl().write(|w| w.bits(execution));
        // IN shifts left, OUT shifts right; nothing moves by itself.
        machine.sm_shiftctrl().write(|w| w.bits(1 << 19));
        machine.sm_pinctrl().write(|w| w.bits(pins));
        for &word in first {
            machine.sm_instr().write(|w| w.bits(word.into()));
        }
        // A jump to where it begins.
        machine.sm_instr().write(|w| w.bits(course.begin));
        pio.ctrl().modify(|r, w| w.bits(r.bits() | 1 << number));
    }
}

/// Continues elsewhere, at once, whatever it waits for.
pub(super) fn restart(pio: &RegisterBlock, number: usize, at: u32) {
    // SAFETY: bits of CTRL, and a jump.
    unsafe {
        pio.ctrl().modify(|r, w| w.bits(r.bits() | 1 << (4 + number)));
        pio.sm(number).sm_instr().write(|w| w.bits(at));
    }
}

/// Whether these state machines run.
pub(super) fn run(pio: &RegisterBlock, numbers: u32) -> bool {
    pio.ctrl().read().bits() & numbers == numbers
}
