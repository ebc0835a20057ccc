//! What is connected to the microcontroller.

/// A pin of the chip, by port and number; made by [`pin`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pin {
    /// Number of the port; A is 0.
    pub(crate) port: usize,
    pub(crate) number: u8,
}

/// The pin `number` of the port with this letter.
///
/// # Panics
/// For a pin that no chip has.
pub const fn pin(letter: char, number: u8) -> Pin {
    assert!(letter >= 'A' && letter <= 'I' && number < 16, "ports A to I have pins 0 to 15");
    Pin { port: letter as usize - 'A' as usize, number }
}

/// The power stage, the encoders, the contacts and the serial line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardWiring {
    /// Channels A and B of each encoder.
    pub encoders: &'static [(Pin, Pin)],
    /// Select, clock and command of absolute sensors, each of which has its data at channel A of an encoder; none in a
    /// wiring without this bus.
    pub angle_bus: Option<[Pin; 3]>,
    /// PWM of the power stage; channel 1 of TIM1, or its complementary output.
    pub pwm: Pin,
    /// Direction; high drives along +x.
    pub direction: Pin,
    /// Enable; high lets the power stage switch.
    pub enable: Pin,
    /// Fault output of the power stage.
    pub driver_fault: Pin,
    /// Contact of the emergency stop.
    pub emergency_stop: Pin,
    /// Contacts of the limit switches, at the low end and at the high end.
    pub limits: [Pin; 2],
    /// Output that is high while a tick runs.
    pub tick: Pin,
    /// Receive pin (RX) of the serial line; the same USART transmits.
    pub receive: Pin,
    /// Number of the serial line's USART: 2 or 3.
    pub usart: u8,
    /// Channel of the converter that measures the supply.
    pub supply_channel: usize,
    /// Channel of the converter that measures the wiper of a potentiometer; none in a wiring without it.
    pub wiper_channel: Option<usize>,
    /// Ratio of the divider: supply voltage over the voltage at that channel.
    pub supply_divider: f32,
    /// Reference voltage of the converter (V).
    pub reference_v: f32,
}

const STANDARD_ENCODERS: [(Pin, Pin); 5] = [
    (pin('A', 15), pin('B', 3)),
    (pin('A', 0), pin('A', 1)),
    (pin('B', 4), pin('B', 5)),
    (pin('B', 6), pin('B', 7)),
    (pin('C', 6), pin('C', 7)),
];

impl BoardWiring {
    /// The standard wiring, tabulated in docs/board.md.
    pub const fn upright() -> &'static Self {
        const WIRING: BoardWiring = BoardWiring {
            encoders: &STANDARD_ENCODERS,
            angle_bus: Some([pin('B', 0), pin('C', 5), pin('B', 8)]),
            pwm: pin('A', 8),
            direction: pin('B', 14),
            enable: pin('B', 15),
            driver_fault: pin('B', 13),
            emergency_stop: pin('B', 12),
            limits: [pin('C', 0), pin('C', 1)],
            tick: pin('B', 1),
            receive: pin('A', 3),
            usart: 2,
            supply_channel: 12,
            wiper_channel: Some(1),
            supply_divider: 23.0,
            reference_v: 3.3,
        };
        &WIRING
    }

    /// Whether PWM is at the complementary output.
    pub(crate) fn is_complementary(&self) -> bool {
        COMPLEMENTARY_PINS.contains(&self.pwm)
    }
}

/// Inputs of the timers in encoder mode: timer, channel (0 or 1), pin, alternate function (datasheet, alternate
/// function mapping).
pub(crate) const ENCODER_INPUTS: [(usize, usize, Pin, u32); 17] = [
    (0, 0, pin('A', 15), 1),
    (0, 0, pin('A', 0), 1),
    (0, 0, pin('A', 5), 1),
    (0, 1, pin('B', 3), 1),
    (0, 1, pin('A', 1), 1),
    (1, 0, pin('B', 4), 2),
    (1, 0, pin('A', 6), 2),
    (1, 0, pin('C', 6), 2),
    (1, 1, pin('B', 5), 2),
    (1, 1, pin('A', 7), 2),
    (1, 1, pin('C', 7), 2),
    (2, 0, pin('B', 6), 2),
    (2, 1, pin('B', 7), 2),
    (3, 0, pin('A', 0), 2),
    (3, 1, pin('A', 1), 2),
    (4, 0, pin('C', 6), 3),
    (4, 1, pin('C', 7), 3),
];

/// Break inputs of TIM1, all with alternate function 1.
pub(crate) const BREAK_PINS: [Pin; 3] = [pin('B', 12), pin('A', 6), pin('E', 15)];
/// Outputs of channel 1 of TIM1, with alternate function 1.
pub(crate) const PWM_PINS: [Pin; 2] = [pin('A', 8), pin('E', 9)];
/// Complementary outputs of channel 1 of TIM1, with alternate function 1.
pub(crate) const COMPLEMENTARY_PINS: [Pin; 3] = [pin('A', 7), pin('B', 13), pin('E', 8)];
/// Number of a USART, its TX pin and its RX pin, with alternate function 7.
pub(crate) const SERIAL_PINS: [(u8, Pin, Pin); 5] = [
    (2, pin('A', 2), pin('A', 3)),
    (2, pin('D', 5), pin('D', 6)),
    (3, pin('B', 10), pin('B', 11)),
    (3, pin('C', 10), pin('C', 11)),
    (3, pin('D', 8), pin('D', 9)),
];

/// The pin of a channel of ADC1 (datasheet, pin definitions); `None` for internal channels.
pub(crate) fn analog_pin(channel: usize) -> Option<Pin> {
    Some(match channel {
        0..=7 => pin('A', channel as u8),
        8 | 9 => pin('B', channel as u8 - 8),
        10..=15 => pin('C', channel as u8 - 10),
        _ => return None,
    })
}
