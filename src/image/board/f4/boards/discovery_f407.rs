//! ST STM32F407G-DISC1 and its predecessor STM32F4DISCOVERY.

use super::super::wiring::{STANDARD, Signal, output};
use super::data::{BoardData, ChipFamily, HseSource};

pub(crate) const BOARD: BoardData = BoardData {
    name: "discovery-f407",
    title: "STM32F407G-DISC1 (Discovery)",
    chip: ChipFamily::F405OrF407,
    crystal_hz: 8_000_000,
    sources: &[HseSource::Crystal],
    wiring: &STANDARD,
    status_led: output(Signal::StatusLed, b'D', 12),
    status_led_is_low: false,
    supply_divider: 23.0,
    reference_v: 3.0,
    special: "the chip runs from 3.0 V; PA0 is also the blue button: do not press it; PC0 also switches USB power, PB6 and PC7 also go to the \
              codec, which is in reset; the serial line needs a USB adapter at PA2 and PA3",
};
