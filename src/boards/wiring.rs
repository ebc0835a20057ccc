//! The wiring: what is connected to which pin. The pins are set up from it, and a test checks the tables in
//! docs/board.md against it.
//!
//! Alternate functions: datasheets DS8626 (F405, F407) and DS10693 (F446), table "Alternate function mapping".

/// A pin of port `A`, `B`, `C` or `D`, and what is connected to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wire {
    /// What is connected.
    pub signal: Signal,
    /// The port's letter.
    pub port: u8,
    /// Number within the port.
    pub pin: u8,
    /// Electrical mode of the pin.
    pub mode: PinMode,
    /// Whether the pin is pulled to 3.3 V inside the microcontroller (about 40 kΩ).
    pub pull_up: bool,
    /// The peripheral behind the pin, which says which timer and which USART are used.
    pub function: &'static str,
}

impl Wire {
    /// Base address of the registers of its port (RM0090, 2.3).
    pub const fn port_base(self) -> usize {
        0x4002_0000 + 0x400 * (self.port - b'A') as usize
    }

    /// The digit after `name` in its function: 3 for `TIM` in `TIM3_CH1`.
    pub const fn number(self, name: &str) -> u8 {
        self.function.as_bytes()[name.len()] - b'0'
    }
}

/// What is connected to a pin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Signal {
    /// An encoder: sensor (0 is the cart's) and channel, 'A' or 'B'.
    Encoder(u8, u8),
    /// PWM input of the power stage: high drives.
    Pwm,
    /// Direction input of the power stage: high pushes along +x.
    Direction,
    /// Enable input of the power stage: high enables it.
    Enable,
    /// Fault output of the power stage: low during a fault.
    DriverFault,
    /// The emergency stop: its contact opens when pressed.
    EmergencyStop,
    /// The limit switch at the low end of the rail: opens when pressed.
    LimitLow,
    /// The limit switch at the high end of the rail: opens when pressed.
    LimitHigh,
    /// Select of the absolute sensors: low during a frame.
    AngleSelect,
    /// Clock of the absolute sensors.
    AngleClock,
    /// Commands to the absolute sensors.
    AngleCommand,
    /// The supply voltage of the power stage, through a divider.
    Supply,
    /// Serial line to the host.
    Transmit,
    /// Serial line from the host.
    Receive,
    /// High while a tick runs, for an oscilloscope.
    Tick,
    /// The status LED: on after a normal start, off after a crash.
    StatusLed,
}

impl Signal {
    /// A distinct number for each signal, for comparisons in constants.
    const fn code(self) -> u8 {
        match self {
            Signal::Pwm => 0,
            Signal::Direction => 1,
            Signal::Enable => 2,
            Signal::DriverFault => 3,
            Signal::EmergencyStop => 4,
            Signal::LimitLow => 5,
            Signal::LimitHigh => 6,
            Signal::Supply => 7,
            Signal::Transmit => 8,
            Signal::Receive => 9,
            Signal::Tick => 10,
            Signal::StatusLed => 11,
            Signal::AngleSelect => 12,
            Signal::AngleClock => 13,
            Signal::AngleCommand => 14,
            Signal::Encoder(sensor, channel) => 16 + 2 * sensor + (channel - b'A'),
        }
    }
}

/// Mode of a pin; the numbers are those of the register GPIOx_MODER (RM0090, 8.4.1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PinMode {
    /// Digital input.
    Input,
    /// Push-pull output, initially low.
    Output,
    /// Output that pulls low or leaves the pin alone, initially alone.
    OpenDrain,
    /// Alternate function of this number.
    Alternate(u8),
    /// Analog input.
    Analog,
}

/// The wiring of all boards that leave these pins free: the pins exist on the 64-pin packages of STM32F405, STM32F407
/// and STM32F446, with the same functions. The status LED differs from board to board.
pub const STANDARD: [Wire; 24] = [
    encoder(0, b'A', b'A', 15, 1, "TIM2_CH1"),
    encoder(0, b'B', b'B', 3, 1, "TIM2_CH2"),
    encoder(1, b'A', b'A', 0, 2, "TIM5_CH1"),
    encoder(1, b'B', b'A', 1, 2, "TIM5_CH2"),
    encoder(2, b'A', b'B', 4, 2, "TIM3_CH1"),
    encoder(2, b'B', b'B', 5, 2, "TIM3_CH2"),
    encoder(3, b'A', b'B', 6, 2, "TIM4_CH1"),
    encoder(3, b'B', b'B', 7, 2, "TIM4_CH2"),
    encoder(4, b'A', b'C', 6, 3, "TIM8_CH1"),
    encoder(4, b'B', b'C', 7, 3, "TIM8_CH2"),
    wire(Signal::Pwm, b'A', 8, PinMode::Alternate(1), false, "TIM1_CH1"),
    output(Signal::Direction, b'B', 14),
    output(Signal::Enable, b'B', 15),
    wire(Signal::DriverFault, b'B', 13, PinMode::Input, true, "input"),
    wire(Signal::EmergencyStop, b'B', 12, PinMode::Alternate(1), true, "TIM1_BKIN"),
    wire(Signal::LimitLow, b'C', 0, PinMode::Input, true, "input"),
    wire(Signal::LimitHigh, b'C', 1, PinMode::Input, true, "input"),
    wire(Signal::Supply, b'C', 2, PinMode::Analog, false, "ADC1_IN12"),
    wire(Signal::Transmit, b'A', 2, PinMode::Alternate(7), false, "USART2_TX"),
    wire(Signal::Receive, b'A', 3, PinMode::Alternate(7), true, "USART2_RX"),
    output(Signal::Tick, b'B', 1),
    output(Signal::AngleSelect, b'B', 0),
    output(Signal::AngleClock, b'C', 5),
    output(Signal::AngleCommand, b'B', 8),
];

/// Number of encoders that a board can count.
pub const fn encoders(wiring: &[Wire]) -> usize {
    let (mut count, mut i) = (0, 0);
    while i < wiring.len() {
        if let Signal::Encoder(_, b'A') = wiring[i].signal {
            count += 1;
        }
        i += 1;
    }
    count
}

/// The wire of a signal; a board without it does not compile.
pub const fn wire_of(wiring: &[Wire], signal: Signal) -> Wire {
    let mut i = 0;
    while i < wiring.len() {
        if wiring[i].signal.code() == signal.code() {
            return wiring[i];
        }
        i += 1;
    }
    panic!("a signal has no pin")
}

/// A pin and what is connected to it; the arguments are the fields of [`Wire`].
pub const fn wire(
    signal: Signal,
    port: u8,
    pin: u8,
    mode: PinMode,
    pull_up: bool,
    function: &'static str,
) -> Wire {
    Wire { signal, port, pin, mode, pull_up, function }
}

/// An output, such as a status LED.
pub const fn output(signal: Signal, port: u8, pin: u8) -> Wire {
    wire(signal, port, pin, PinMode::Output, false, "output")
}

/// An encoder input, with the internal pull-up: the least that an open-collector encoder needs.
pub const fn encoder(sensor: u8, channel: u8, port: u8, pin: u8, number: u8, function: &'static str) -> Wire {
    wire(Signal::Encoder(sensor, channel), port, pin, PinMode::Alternate(number), true, function)
}
