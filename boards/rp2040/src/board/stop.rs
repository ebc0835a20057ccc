//! The end of the program.

use super::{motor, pins};

/// Turns the motor off for good. If the watchdog is running, it resets the microcontroller.
pub(super) fn stop() -> ! {
    cortex_m::interrupt::disable();
    motor::off();
    pins::set_status_led(false);
    loop {
        cortex_m::asm::nop();
    }
}
