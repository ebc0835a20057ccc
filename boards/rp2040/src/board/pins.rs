//! Pins: numbers, pulls and functions. docs/pico.md shows the wiring.

use hal::pac::{IO_BANK0, PADS_BANK0, RESETS, SIO};
use upright::boards::rp;

use super::chip::BLOCKS;
use super::sensors::ARE_THERE;
use crate::gains::TABLE;

/// Whether the drive of the gain table takes pulses.
pub(super) const GIVES_PULSES: bool = TABLE.drive.pulses().is_some();

/// Phase B of each encoder, from the cart's on; phase A is the next pin.
pub(super) const ENCODERS: [usize; rp::ENCODERS] = [0, 2, 4, 6, 8];
/// PWM: output A of slice 5. Step pulses for a drive that takes them.
pub(super) const PWM: usize = 10;
pub(super) const STEP: usize = PWM;
pub(super) const DIRECTION: usize = 11;
pub(super) const ENABLE: usize = 12;
const LIMIT_LOW: usize = 13;
const LIMIT_HIGH: usize = 14;
pub(super) const EMERGENCY_STOP: usize = 15;
/// Low while the power stage reports a fault.
const DRIVER_FAULT: usize = 16;
/// Clock of absolute sensors.
pub(super) const ANGLE_CLOCK: usize = 17;
const STATUS_LED: usize = 25;
const SUPPLY: usize = 26;

// Pads (2.19.6.3): input enabled, Schmitt trigger, 4 mA.
const FLOATING: u32 = 1 << 6 | 1 << 4 | 1 << 1;
/// For outputs. With the input enabled, an RP2350 would not pull a pin down that nothing drives (its erratum E9).
const PULLED_DOWN: u32 = 1 << 4 | 1 << 2 | 1 << 1;
const PULLED_UP: u32 = FLOATING | 1 << 3;
/// Digital input and output off.
const ANALOG: u32 = 1 << 7;

// Functions (2.19.2).
const FUNCTION_PWM: u32 = 4;
const FUNCTION_SIO: u32 = 5;
const FUNCTION_PIO0: u32 = 6;
const FUNCTION_PIO1: u32 = 7;
const NO_FUNCTION: u32 = 31;

/// Resets all blocks that this image uses, and gives each pin its function. Outputs are low.
pub(super) fn set_up(resets: &RESETS, pads: &PADS_BANK0, functions: &IO_BANK0) {
    // SAFETY, here and below: values of the fields described there.
    resets.reset().modify(|r, w| unsafe { w.bits(r.bits() | BLOCKS) });
    resets.reset().modify(|r, w| unsafe { w.bits(r.bits() & !BLOCKS) });
    while resets.reset_done().read().bits() & BLOCKS != BLOCKS {}
    let set = |pin: usize, pad: u32, function: u32| {
        pads.gpio(pin).write(|w| unsafe { w.bits(pad) });
        functions.gpio(pin).gpio_ctrl().write(|w| unsafe { w.bits(function) });
    };
    for b in ENCODERS {
        set(b, PULLED_UP, FUNCTION_SIO);
        set(b + 1, PULLED_UP, FUNCTION_SIO);
    }
    for contact in [LIMIT_LOW, LIMIT_HIGH, EMERGENCY_STOP, DRIVER_FAULT] {
        set(contact, PULLED_UP, FUNCTION_SIO);
    }
    sio().gpio_out_clr().write(|w| unsafe { w.bits(1 << DIRECTION | 1 << STATUS_LED) });
    sio().gpio_oe_set().write(|w| unsafe { w.bits(1 << DIRECTION | 1 << STATUS_LED) });
    set(DIRECTION, PULLED_DOWN, if GIVES_PULSES { FUNCTION_PIO0 } else { FUNCTION_SIO });
    if ARE_THERE {
        // Data wires are pulled low by their output, which is low and off at first.
        sio().gpio_out_set().write(|w| unsafe { w.bits(1 << ANGLE_CLOCK) });
        sio().gpio_oe_set().write(|w| unsafe { w.bits(1 << ANGLE_CLOCK) });
        set(ANGLE_CLOCK, FLOATING, FUNCTION_SIO);
    }
    set(STATUS_LED, FLOATING, FUNCTION_SIO);
    set(PWM, PULLED_DOWN, if GIVES_PULSES { FUNCTION_PIO0 } else { FUNCTION_PWM });
    set(ENABLE, PULLED_DOWN, FUNCTION_PIO1);
    set(SUPPLY, ANALOG, NO_FUNCTION);
}

fn sio() -> &'static hal::pac::sio::RegisterBlock {
    // SAFETY: each of these registers is written by one task only, or has bits that are set and cleared one by one.
    unsafe { &*SIO::PTR }
}

fn is_high(pin: usize) -> bool {
    sio().gpio_in().read().bits() & 1 << pin != 0
}

/// Whether each limit switch is open.
pub(super) fn limits() -> [bool; 2] {
    [is_high(LIMIT_LOW), is_high(LIMIT_HIGH)]
}

/// Whether the emergency stop is or was open, and whether the power stage reports or has reported a fault, since the
/// last call: the chip notes edges (2.19.3).
pub(super) fn was_reported() -> [bool; 2] {
    /// Register and bit of an edge: four bits per pin, of which the last two are the falling and the rising edge.
    const fn edge(pin: usize, rising: bool) -> (usize, u32) {
        (pin / 8, 1 << (4 * (pin % 8) + 2 + rising as usize))
    }
    // SAFETY: writing a one clears the note of this edge and no other.
    let noted = |(register, bit): (usize, u32)| unsafe {
        let notes = (*IO_BANK0::PTR).intr(register);
        let is_noted = notes.read().bits() & bit != 0;
        notes.write(|w| w.bits(bit));
        is_noted
    };
    let was_stopped = noted(edge(EMERGENCY_STOP, true));
    let was_faulty = noted(edge(DRIVER_FAULT, false));
    [was_stopped | is_high(EMERGENCY_STOP), was_faulty | !is_high(DRIVER_FAULT)]
}

/// Sets the clock of the absolute sensors.
pub(super) fn set_clock(is_high: bool) {
    set_output(ANGLE_CLOCK, is_high);
}

/// Pulls these pins low, and leaves those alone.
pub(super) fn pull(low: u32, alone: u32) {
    // SAFETY: any bits of pins whose output is low.
    unsafe {
        sio().gpio_oe_set().write(|w| w.bits(low));
        sio().gpio_oe_clr().write(|w| w.bits(alone));
    }
}

/// Levels of all pins.
pub(super) fn levels() -> u32 {
    sio().gpio_in().read().bits()
}

/// Sets the direction; high is along +x.
pub(super) fn set_direction(is_positive: bool) {
    set_output(DIRECTION, is_positive);
}

/// Switches the status LED.
pub(super) fn set_status_led(is_on: bool) {
    set_output(STATUS_LED, is_on);
}

fn set_output(pin: usize, is_high: bool) {
    // SAFETY: any bits.
    unsafe {
        if is_high {
            sio().gpio_out_set().write(|w| w.bits(1 << pin));
        } else {
            sio().gpio_out_clr().write(|w| w.bits(1 << pin));
        }
    }
}
