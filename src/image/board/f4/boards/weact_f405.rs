//! WeAct Studio STM32F405 core board.

use super::super::wiring::{STANDARD, Signal, output};
use super::data::{BoardData, ChipFamily, HseSource};

pub(crate) const BOARD: BoardData = BoardData {
    name: "weact-f405",
    title: "WeAct STM32F405",
    chip: ChipFamily::F405OrF407,
    crystal_hz: 8_000_000,
    sources: &[HseSource::Crystal],
    wiring: &STANDARD,
    status_led: output(Signal::StatusLed, b'B', 2),
    status_led_is_low: false,
    supply_divider: 23.0,
    reference_v: 3.3,
    special: "PB2 is the LED and BOOT1; the key is at PC13",
};
