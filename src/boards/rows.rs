//! The rows.

use super::f4::{F4Board, F4Chip, HseSource};
use super::row::{BoardRow, Family};
use super::rp::{RpBoard, RpChip};
use super::wiring::{PinMode, Signal, Wire, encoder, output, wire};

/// All boards.
pub static BOARDS: [BoardRow; 7] = [
    BoardRow {
        name: "weact-f405",
        product: "WeAct STM32F405",
        family: Family::F4(F4Board {
            status_led: output(Signal::StatusLed, b'B', 2),
            special: "PB2 is the LED and BOOT1; the key is at PC13",
            ..F4Board::F405
        }),
    },
    BoardRow {
        name: "olimex-h405",
        product: "Olimex STM32-H405",
        family: Family::F4(F4Board {
            status_led: output(Signal::StatusLed, b'C', 12),
            status_led_is_low: true,
            special: "PA0 is also the button BUT: do not press it; a debugger has to use SWD, because PA15, PB3 and PB4 are JTAG pins",
            ..F4Board::F405
        }),
    },
    BoardRow {
        name: "feather-f405",
        product: "Adafruit Feather STM32F405 Express",
        family: Family::F4(F4Board {
            crystal_hz: 12_000_000,
            wiring: &FEATHER,
            status_led: output(Signal::StatusLed, b'C', 1),
            special: "its own [wiring](#wiring-of-the-feather); its memory chip has PA15, PB3, PB4 and PB5; leave the STEMMA QT socket \
                      empty: its two signals count link 1",
            ..F4Board::F405
        }),
    },
    BoardRow {
        name: "discovery-f407",
        product: "STM32F407G-DISC1 (Discovery)", // and its predecessor, the STM32F4DISCOVERY
        family: Family::F4(F4Board {
            chip: F4Chip::F407,
            package: "VGTx",
            status_led: output(Signal::StatusLed, b'D', 12),
            reference_v: 3.0,
            special: "the chip runs from 3.0 V; PA0 is also the blue button: do not press it; PC0 also switches USB power, PB6 and PC7 also go to the \
                      codec, which is in reset; the serial line needs a USB adapter at PA2 and PA3",
            ..F4Board::F405
        }),
    },
    BoardRow {
        name: "nucleo-f446",
        product: "NUCLEO-F446RE", // all revisions
        family: Family::F4(F4Board {
            chip: F4Chip::F446,
            package: "RETx",
            sources: &[HseSource::Clock, HseSource::Crystal],
            status_led: output(Signal::StatusLed, b'A', 5),
            special: "the debugger supplies the clock and the serial line (USB); MB1136 C-02 and later come like this; C-01 comes without a \
                      clock, which is fault *clock*: open SB55, close SB16 and SB50, or fit the crystal X3; PB3 is also the \
                      debugger's SWO input",
            ..F4Board::F405
        }),
    },
    BoardRow {
        name: "pico",
        product: "Raspberry Pi Pico",
        family: Family::Rp(RpBoard {
            chip: RpChip::Rp2040,
            executed: "rp2040js 1.4.1, with a motor and with a stepper",
        }),
    },
    BoardRow {
        name: "pico2",
        product: "Raspberry Pi Pico 2",
        family: Family::Rp(RpBoard {
            chip: RpChip::Rp2350,
            executed: "compiled; its bits by the replay image in QEMU; peripherals untried",
        }),
    },
];

/// All pins are at the edge of the Feather, under the names printed there. Besides the break input, only two timers
/// have both encoder inputs there, so this board counts the cart and one link.
static FEATHER: [Wire; 15] = [
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
