//! What is connected to the microcontroller.

/// A pin.
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

/// The power stage, the encoders and the supply divider.
#[derive(Debug, Clone, PartialEq)]
pub struct Wiring {
    /// Channels A and B of each encoder.
    pub encoders: Vec<(Pin, Pin)>,
    /// PWM of the power stage; channel 1 of TIM1.
    pub pwm: Pin,
    /// Direction; high drives along +x.
    pub direction: Pin,
    /// Enable; high lets the power stage switch.
    pub enable: Pin,
    /// Input of the converter that sees the supply.
    pub supply_channel: usize,
    /// Supply voltage over the voltage at that input.
    pub supply_divider: f32,
    /// Reference of the converter (V).
    pub reference_v: f32,
}

impl Wiring {
    /// The table of the README.
    pub fn upright() -> Self {
        Self {
            encoders: vec![
                (pin('A', 15), pin('B', 3)),
                (pin('A', 0), pin('A', 1)),
                (pin('B', 4), pin('B', 5)),
                (pin('B', 6), pin('B', 7)),
                (pin('C', 6), pin('C', 7)),
            ],
            pwm: pin('A', 8),
            direction: pin('B', 14),
            enable: pin('B', 15),
            supply_channel: 12,
            supply_divider: 11.0,
            reference_v: 3.3,
        }
    }
}

/// Inputs of the timers in encoder mode: timer, channel (0 or 1), pin, alternate function (datasheet, alternate function
/// mapping).
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
/// TX and RX of USART2, with alternate function 7.
pub(crate) const SERIAL_PINS: [(Pin, Pin); 2] = [(pin('A', 2), pin('A', 3)), (pin('D', 5), pin('D', 6))];

/// The pin of an input of converter 1 (datasheet, pin definitions).
pub(crate) fn analog_pin(channel: usize) -> Option<Pin> {
    Some(match channel {
        0..=7 => pin('A', channel as u8),
        8 | 9 => pin('B', channel as u8 - 8),
        10..=15 => pin('C', channel as u8 - 10),
        _ => return None,
    })
}
