//! The wiring: what is connected to which pin. This is the only definition. The pins are set up from it, and a test
//! checks the table in docs/board.md against it.
//!
//! All pins exist on the 64-pin packages of STM32F405, STM32F407 and STM32F446, with the same functions. Alternate
//! functions: datasheets DS8626 (F405, F407) and DS10693 (F446), table "Alternate function mapping".

/// A pin of port `A`, `B`, `C` or `D`, and what is connected to it.
#[derive(Clone, Copy)]
pub(crate) struct Wire {
    /// The port's letter.
    pub(crate) port: u8,
    /// Number within the port.
    pub(crate) pin: u8,
    /// Electrical mode of the pin.
    pub(crate) mode: Mode,
    /// Whether the pin is pulled to 3.3 V inside the microcontroller (about 40 kΩ).
    pub(crate) pull_up: bool,
    /// The peripheral behind the pin.
    #[cfg_attr(target_os = "none", allow(dead_code, reason = "for the table of the documentation"))]
    pub(crate) function: &'static str,
    /// Signal that is connected to the pin.
    #[cfg_attr(target_os = "none", allow(dead_code, reason = "for the table of the documentation"))]
    pub(crate) signal: &'static str,
}

/// Mode of a pin; the numbers are those of the register GPIOx_MODER (RM0090, 8.4.1).
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Mode {
    /// Digital input.
    Input,
    /// Push-pull output, initially low.
    Output,
    /// Alternate function of this number.
    Alternate(u8),
    /// Analog input.
    Analog,
}

/// All pins except that of the status LED.
pub(crate) const WIRING: [Wire; 20] = [
    encoder(b'A', 15, 1, "TIM2_CH1", "cart encoder, A"),
    encoder(b'B', 3, 1, "TIM2_CH2", "cart encoder, B"),
    encoder(b'A', 0, 2, "TIM5_CH1", "link 1 encoder, A"),
    encoder(b'A', 1, 2, "TIM5_CH2", "link 1 encoder, B"),
    encoder(b'B', 4, 2, "TIM3_CH1", "link 2 encoder, A"),
    encoder(b'B', 5, 2, "TIM3_CH2", "link 2 encoder, B"),
    encoder(b'B', 6, 2, "TIM4_CH1", "link 3 encoder, A"),
    encoder(b'B', 7, 2, "TIM4_CH2", "link 3 encoder, B"),
    encoder(b'C', 6, 3, "TIM8_CH1", "link 4 encoder, A"),
    encoder(b'C', 7, 3, "TIM8_CH2", "link 4 encoder, B"),
    wire(b'A', 8, Mode::Alternate(1), false, "TIM1_CH1", "power stage, PWM: high drives"),
    wire(b'B', DIRECTION, Mode::Output, false, "output", "power stage, direction: high pushes along +x"),
    wire(b'B', ENABLE, Mode::Output, false, "output", "power stage, enable: high; 10 kΩ to ground"),
    wire(b'B', DRIVER_FAULT, Mode::Input, true, "input", "power stage, fault: low; open drain"),
    wire(b'B', EMERGENCY_STOP, Mode::Alternate(1), true, "TIM1_BKIN", "emergency stop: opens when pressed"),
    wire(b'C', LIMIT_LOW, Mode::Input, true, "input", "limit switch, low end: opens when pressed"),
    wire(b'C', LIMIT_HIGH, Mode::Input, true, "input", "limit switch, high end: opens when pressed"),
    wire(b'C', 2, Mode::Analog, false, "ADC1_IN12", "supply voltage through 10 kΩ; 1 kΩ to ground"),
    wire(b'A', 2, Mode::Alternate(7), false, "USART2_TX", "serial line to the host"),
    wire(b'A', 3, Mode::Alternate(7), true, "USART2_RX", "serial line from the host"),
];

/// The status LED of each board: on after a normal start, off after a crash.
pub(crate) const STATUS_LEDS: [Wire; 3] = [
    wire(b'C', 13, Mode::Output, false, "output", "status LED (STM32F405)"),
    wire(b'D', 12, Mode::Output, false, "output", "status LED (STM32F407 Discovery: green)"),
    wire(b'A', 5, Mode::Output, false, "output", "status LED (STM32F446 Nucleo: LD2)"),
];

/// Pin of port B: motor direction.
pub(crate) const DIRECTION: u8 = 14;
/// Pin of port B: enable of the power stage.
pub(crate) const ENABLE: u8 = 15;
/// Pin of port B: fault of the power stage.
pub(crate) const DRIVER_FAULT: u8 = 13;
/// Pin of port B: emergency stop.
pub(crate) const EMERGENCY_STOP: u8 = 12;
/// Pin of port C: limit switch at the low end.
pub(crate) const LIMIT_LOW: u8 = 0;
/// Pin of port C: limit switch at the high end.
pub(crate) const LIMIT_HIGH: u8 = 1;

const fn wire(
    port: u8,
    pin: u8,
    mode: Mode,
    pull_up: bool,
    function: &'static str,
    signal: &'static str,
) -> Wire {
    Wire { port, pin, mode, pull_up, function, signal }
}

/// An input with the pull-up that open-collector encoders need.
const fn encoder(port: u8, pin: u8, alternate: u8, function: &'static str, signal: &'static str) -> Wire {
    wire(port, pin, Mode::Alternate(alternate), true, function, signal)
}
