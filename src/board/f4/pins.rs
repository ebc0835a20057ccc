//! The pins: set up from the wiring, read and written by name.

use stm32f4xx_hal::pac::{EXTI, GPIOA, GPIOB, GPIOC, GPIOD, SYSCFG};

use super::wiring::{
    DIRECTION, DRIVER_FAULT, EMERGENCY_STOP, ENABLE, LIMIT_HIGH, LIMIT_LOW, Mode, STATUS_LEDS, WIRING, Wire,
};

const STATUS_LED: Wire = STATUS_LEDS[if cfg!(feature = "stm32f405") {
    0
} else if cfg!(feature = "stm32f407") {
    1
} else {
    2
}];

const PORTS: usize = 4;

/// Values for the registers of a port, and the bits that they cover (RM0090, 8.4).
#[derive(Clone, Copy)]
struct Port {
    mode: u32,
    pull: u32,
    two_bits: u32,
    alternate: [u32; 2],
    four_bits: [u32; 2],
}

const SET_UP: [Port; PORTS] = {
    let mut ports = [Port { mode: 0, pull: 0, two_bits: 0, alternate: [0; 2], four_bits: [0; 2] }; PORTS];
    let mut i = 0;
    while i <= WIRING.len() {
        let wire = if i < WIRING.len() { WIRING[i] } else { STATUS_LED };
        let port = &mut ports[(wire.port - b'A') as usize];
        let (at, half) = (2 * wire.pin, (wire.pin / 8) as usize);
        assert!(port.two_bits & (3 << at) == 0, "a pin is used twice");
        port.two_bits |= 3 << at;
        port.mode |= match wire.mode {
            Mode::Input => 0,
            Mode::Output => 1,
            Mode::Alternate(_) => 2,
            Mode::Analog => 3,
        } << at;
        port.pull |= (wire.pull_up as u32) << at;
        if let Mode::Alternate(number) = wire.mode {
            port.alternate[half] |= (number as u32) << (4 * (wire.pin % 8));
            port.four_bits[half] |= 15 << (4 * (wire.pin % 8));
        }
        i += 1;
    }
    ports
};

/// Sets up all pins. The outputs are low from the start, because the output registers hold 0 after a reset.
pub(super) fn set_up(syscfg: &SYSCFG, exti: &EXTI) {
    let bases = [GPIOA::PTR as usize, GPIOB::PTR as usize, GPIOC::PTR as usize, GPIOD::PTR as usize];
    for (base, port) in bases.into_iter().zip(&SET_UP) {
        let change = |offset: usize, covered: u32, value: u32| {
            let register = (base + offset) as *mut u32;
            // SAFETY: a register of this port; nothing else runs before the set-up is complete.
            unsafe { register.write_volatile(register.read_volatile() & !covered | value) };
        };
        // Alternate functions first, so that no pin has the wrong one even for a moment.
        change(0x20, port.four_bits[0], port.alternate[0]);
        change(0x24, port.four_bits[1], port.alternate[1]);
        change(0x0c, port.two_bits, port.pull);
        change(0x00, port.two_bits, port.mode);
    }
    // A falling edge of the power stage's fault signal, however short, stays in the pending register until the next
    // tick reads it (RM0090, 12.2.4). Its interrupt is not enabled in the NVIC.
    // SAFETY: 1 is port B (RM0090, 9.2.6).
    syscfg.exticr4().modify(|_, w| unsafe { w.exti13().bits(1) });
    exti.ftsr().modify(|_, w| w.tr13().set_bit());
    exti.imr().modify(|_, w| w.mr13().set_bit());
}

/// Levels of ports B and C at one moment; true is high.
#[derive(Clone, Copy)]
pub(super) struct Levels {
    b: u32,
    c: u32,
}

impl Levels {
    /// Reads the levels of both ports.
    pub(super) fn read() -> Self {
        // SAFETY: reading levels has no side effect.
        unsafe { Self { b: (*GPIOB::PTR).idr().read().bits(), c: (*GPIOC::PTR).idr().read().bits() } }
    }

    /// An open contact reads high, because of the pull-up.
    pub(super) fn emergency_stop(self) -> bool {
        self.b & (1 << EMERGENCY_STOP) != 0
    }

    pub(super) fn driver_fault(self) -> bool {
        self.b & (1 << DRIVER_FAULT) == 0
    }

    pub(super) fn limit_low(self) -> bool {
        self.c & (1 << LIMIT_LOW) != 0
    }

    pub(super) fn limit_high(self) -> bool {
        self.c & (1 << LIMIT_HIGH) != 0
    }
}

/// Whether the power stage has reported a fault since the last call, even if the fault is over.
pub(super) fn driver_fault_was_reported(exti: &EXTI) -> bool {
    let reported = exti.pr().read().pr13().bit_is_set();
    if reported {
        // Writing a one clears this bit and no other.
        // SAFETY: any combination of bits is allowed.
        exti.pr().write(|w| unsafe { w.bits(1 << DRIVER_FAULT) });
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

fn set(pin: u8, high: bool) {
    let pin = u32::from(pin) + if high { 0 } else { 16 };
    // SAFETY: the bit set and reset register changes one output of the power stage at once (RM0090, 8.4.7).
    unsafe { (*GPIOB::PTR).bsrr().write(|w| w.bits(1 << pin)) };
}

/// Switches the status LED.
pub(super) fn set_status_led(on: bool) {
    let port = [GPIOA::PTR as usize, GPIOB::PTR as usize, GPIOC::PTR as usize, GPIOD::PTR as usize]
        [(STATUS_LED.port - b'A') as usize];
    let pin = STATUS_LED.pin + if on { 0 } else { 16 };
    // SAFETY: the bit set and reset register of the LED's port changes nothing but the LED.
    unsafe { ((port + 0x18) as *mut u32).write_volatile(1 << pin) };
}
