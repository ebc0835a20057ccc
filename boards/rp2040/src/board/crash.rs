//! What ends the program: panics and faults of the processor. They turn the motor off, and are recorded in the scratch
//! registers of the watchdog, which survive its reset (4.7).

use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};
use hal::pac::WATCHDOG;
use upright::flash_image::WordSums;
use upright::protocol::message::{CrashRecord, Reset, Start};

use super::memory::words;
use super::stop::stop;

/// Mark of a crash that caused the last reset, and of an older one.
const NEW: u32 = 0x5afe_2040;
const OLD: u32 = 0x5afe_2041;

/// Why the program started, and the record of the last crash since power-on; and whether the image is damaged.
pub(super) fn start(watchdog: &WATCHDOG) -> (Start, bool) {
    let mark = watchdog.scratch0().read().bits();
    let record = [watchdog.scratch1().read().bits(), watchdog.scratch2().read().bits(), 0, 0, 0];
    if mark == NEW {
        // SAFETY: any value.
        watchdog.scratch0().write(|w| unsafe { w.bits(OLD) });
    }
    let was_watchdog = watchdog.reason().read().bits() & 1 != 0;
    let reset = match (was_watchdog, mark) {
        (true, NEW) => Reset::Software,
        (true, _) => Reset::Watchdog,
        _ => Reset::Power,
    };
    let crash = matches!(mark, NEW | OLD).then_some(CrashRecord(record));
    let image = WordSums::of_image(words());
    (Start { reset, crash, image: image.weighted }, image != WordSums::carried_by(words()))
}

fn record(pc: u32, lr: u32) {
    // SAFETY: nothing else runs any more.
    unsafe {
        let watchdog = &*WATCHDOG::PTR;
        watchdog.scratch1().write(|w| w.bits(pc));
        watchdog.scratch2().write(|w| w.bits(lr));
        watchdog.scratch0().write(|w| w.bits(NEW));
    }
}

#[panic_handler]
fn panicked(_: &PanicInfo) -> ! {
    record(0, 0);
    stop()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    record(frame.pc(), frame.lr());
    stop()
}
