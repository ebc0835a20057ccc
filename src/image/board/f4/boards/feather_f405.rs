//! Adafruit Feather STM32F405 Express.

use super::super::wiring::{PinMode, Signal, Wire, encoder, output, wire};
use super::data::{BoardData, ChipFamily, HseSource};

/// All pins are at the edge of the board, under the names printed there. Besides the break input, only two timers have
/// both encoder inputs there, so this board counts the cart and one link.
const WIRING: [Wire; 15] = [
    encoder(0, b'A', b'C', 6, 2, "TIM3_CH1"),
    encoder(0, b'B', b'C', 7, 2, "TIM3_CH2"),
    encoder(1, b'A', b'B', 6, 2, "TIM4_CH1"),
    encoder(1, b'B', b'B', 7, 2, "TIM4_CH2"),
    wire(Signal::Pwm, b'B', 13, PinMode::Alternate(1), false, "TIM1_CH1N"),
    output(Signal::Direction, b'B', 9),
    output(Signal::Enable, b'B', 14),
    wire(Signal::DriverFault, b'B', 15, PinMode::Input, true, "input"),
    wire(Signal::EmergencyStop, b'A', 6, PinMode::Alternate(1), true, "TIM1_BKIN"),
    wire(Signal::LimitLow, b'C', 4, PinMode::Input, true, "input"),
    wire(Signal::LimitHigh, b'C', 5, PinMode::Input, true, "input"),
    wire(Signal::Supply, b'C', 2, PinMode::Analog, false, "ADC1_IN12"),
    wire(Signal::Transmit, b'B', 10, PinMode::Alternate(7), false, "USART3_TX"),
    wire(Signal::Receive, b'B', 11, PinMode::Alternate(7), true, "USART3_RX"),
    output(Signal::Tick, b'B', 8),
];

pub(crate) const BOARD: BoardData = BoardData {
    name: "feather-f405",
    title: "Adafruit Feather STM32F405 Express",
    chip: ChipFamily::F405OrF407,
    crystal_hz: 12_000_000,
    sources: &[HseSource::Crystal],
    wiring: &WIRING,
    status_led: output(Signal::StatusLed, b'C', 1),
    status_led_is_low: false,
    supply_divider: 23.0,
    reference_v: 3.3,
    special: "its own [wiring](#wiring-of-the-feather); its memory chip has PA15, PB3, PB4 and PB5; leave the STEMMA QT socket \
              empty: its two signals count link 1",
};
