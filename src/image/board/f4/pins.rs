//! The pins: set up from the wiring, read and written by name.

use crate::pac::{EXTI, SYSCFG};
use upright::boards::wiring::{PinMode, Signal, Wire, wire_of};

use super::chosen::BOARD;
use super::sensors;

const DIRECTION: Wire = wire_of(BOARD.wiring, Signal::Direction);
const ENABLE: Wire = wire_of(BOARD.wiring, Signal::Enable);
const DRIVER_FAULT: Wire = wire_of(BOARD.wiring, Signal::DriverFault);
const EMERGENCY_STOP: Wire = wire_of(BOARD.wiring, Signal::EmergencyStop);
const LIMIT_LOW: Wire = wire_of(BOARD.wiring, Signal::LimitLow);
const LIMIT_HIGH: Wire = wire_of(BOARD.wiring, Signal::LimitHigh);
const TICK: Wire = wire_of(BOARD.wiring, Signal::Tick);

const PORTS: usize = 4;

/// Values for the registers of a port, and the bits that they cover (RM0090, 8.4).
#[derive(Clone, Copy)]
struct PortSettings {
    mode: u32,
    /// Outputs that only pull low: high at first.
    open_drain: u32,
    pull: u32,
    two_bits: u32,
    alternate: [u32; 2],
    four_bits: [u32; 2],
}

const SET_UP: [PortSettings; PORTS] = {
    let mut ports =
        [PortSettings { mode: 0, open_drain: 0, pull: 0, two_bits: 0, alternate: [0; 2], four_bits: [0; 2] };
            PORTS];
    let mut i = 0;
    while i <= BOARD.wiring.len() {
        let wire = if i < BOARD.wiring.len() { BOARD.wiring[i] } else { BOARD.status_led };
        let Some(mode) = sensors::mode(wire) else {
            i += 1;
            continue;
        };
        let port = &mut ports[(wire.port - b'A') as usize];
        let (at, half) = (2 * wire.pin, (wire.pin / 8) as usize);
        assert!(port.two_bits & (3 << at) == 0, "a pin is used twice");
        port.two_bits |= 3 << at;
        port.mode |= match mode {
            PinMode::Input => 0,
            PinMode::Output | PinMode::OpenDrain => 1,
            PinMode::Alternate(_) => 2,
            PinMode::Analog => 3,
        } << at;
        port.open_drain |= (matches!(mode, PinMode::OpenDrain) as u32) << wire.pin;
        port.pull |= (wire.pull_up && !matches!(mode, PinMode::Analog)) as u32 * (1 << at);
        if let PinMode::Alternate(number) = mode {
            port.alternate[half] |= (number as u32) << (4 * (wire.pin % 8));
            port.four_bits[half] |= 15 << (4 * (wire.pin % 8));
        }
        i += 1;
    }
    ports
};

/// Sets up all pins. Outputs that drive are low from the start, because the output registers hold 0 after a reset.
pub(super) fn set_up(syscfg: &SYSCFG, exti: &EXTI) {
    for (number, port) in SET_UP.iter().enumerate() {
        let base = 0x4002_0000 + 0x400 * number;
        let change = |offset: usize, covered: u32, value: u32| {
            let register = (base + offset) as *mut u32;
            // SAFETY: a register of this port; nothing else runs before the set-up is complete.
            unsafe { register.write_volatile(register.read_volatile() & !covered | value) };
        };
        // Alternate functions first, so that no pin has the wrong one even for a moment.
        change(0x20, port.four_bits[0], port.alternate[0]);
        change(0x24, port.four_bits[1], port.alternate[1]);
        change(0x14, port.open_drain, port.open_drain);
        change(0x04, port.open_drain, port.open_drain);
        change(0x0c, port.two_bits, port.pull);
        change(0x00, port.two_bits, port.mode);
    }
    // A falling edge of the power stage's fault signal, however short, stays in the pending register until the next
    // tick reads it (RM0090, 12.2.4). Its interrupt is not enabled in the NVIC.
    // SAFETY: the port of this line (RM0090, 9.2.6).
    const { assert!(DRIVER_FAULT.pin / 4 == 3, "line 12 to 15") };
    const SHIFT: u32 = 4 * (DRIVER_FAULT.pin as u32 % 4);
    const PORT: u32 = (DRIVER_FAULT.port - b'A') as u32;
    syscfg.exticr4().modify(|r, w| unsafe { w.bits(r.bits() & !(15 << SHIFT) | PORT << SHIFT) });
    exti.ftsr().modify(|r, w| unsafe { w.bits(r.bits() | 1 << DRIVER_FAULT.pin) });
    exti.imr().modify(|r, w| unsafe { w.bits(r.bits() | 1 << DRIVER_FAULT.pin) });
}

/// Level of an input; true is high.
pub(super) fn is_high(wire: Wire) -> bool {
    // SAFETY: reading the input register (8.4.5) has no side effect.
    unsafe { ((wire.port_base() + 0x10) as *const u32).read_volatile() & 1 << wire.pin != 0 }
}

/// Whether the contact of the emergency stop is open: the pull-up then pulls it high.
pub(super) fn emergency_stop() -> bool {
    is_high(EMERGENCY_STOP)
}

/// Whether the power stage reports a fault now.
pub(super) fn driver_fault() -> bool {
    !is_high(DRIVER_FAULT)
}

/// Whether the contacts of the limit switches are open, at the low end and at the high end.
pub(super) fn limits() -> [bool; 2] {
    [is_high(LIMIT_LOW), is_high(LIMIT_HIGH)]
}

/// Whether the power stage has reported a fault since the last call, even if the fault is over.
pub(super) fn driver_fault_was_reported(exti: &EXTI) -> bool {
    let reported = exti.pr().read().bits() & 1 << DRIVER_FAULT.pin != 0;
    if reported {
        // Writing a one clears this bit and no other.
        // SAFETY: any combination of bits is allowed.
        exti.pr().write(|w| unsafe { w.bits(1 << DRIVER_FAULT.pin) });
    }
    reported
}

/// Enables or disables the power stage.
pub(super) fn enable(enable: bool) {
    set(ENABLE, enable);
}

/// Sets the direction of the motor.
pub(super) fn push_along_x(along: bool) {
    set(DIRECTION, along);
}

/// Sets the pin that shows on an oscilloscope whether a tick is running.
pub(super) fn show_tick(running: bool) {
    set(TICK, running);
}

/// Switches the status LED.
pub(super) fn set_status_led(on: bool) {
    set(BOARD.status_led, on != BOARD.status_led_is_low);
}

/// Sets an output.
pub(super) fn set(wire: Wire, high: bool) {
    let bit = u32::from(wire.pin) + if high { 0 } else { 16 };
    // SAFETY: the bit set and reset register changes this output at once, and nothing else (8.4.7).
    unsafe { ((wire.port_base() + 0x18) as *mut u32).write_volatile(1 << bit) };
}
