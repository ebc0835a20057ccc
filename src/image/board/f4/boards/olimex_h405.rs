//! Olimex STM32-H405.

use super::super::wiring::{STANDARD, Signal, output};
use super::data::{BoardData, ChipFamily, HseSource};

pub(crate) const BOARD: BoardData = BoardData {
    name: "olimex-h405",
    title: "Olimex STM32-H405",
    chip: ChipFamily::F405OrF407,
    crystal_hz: 8_000_000,
    sources: &[HseSource::Crystal],
    wiring: &STANDARD,
    status_led: output(Signal::StatusLed, b'C', 12),
    status_led_is_low: true,
    supply_divider: 23.0,
    reference_v: 3.3,
    special: "PA0 is also the button BUT: do not press it; a debugger has to use SWD, because PA15, PB3 and PB4 are JTAG pins",
};
