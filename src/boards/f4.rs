//! Boards with an STM32F405, STM32F407 or STM32F446.

use super::wiring::{STANDARD, Signal, Wire, output};

/// Shortest and longest tick (µs): a shorter one leaves no time for a controller, and over a longer one the motor's
/// timer cannot keep up the PWM.
pub const TICK_US: [u32; 2] = [120, 33_000];
/// Most step pulses in a tick: what the repetition counter of their timer holds.
pub const PULSES: u32 = 256;
/// Bits of the absolute sensors on the bus, AS5047D or AS5047P.
pub const ANGLE_BITS: u32 = 14;
/// Bits of the converter, which reads a potentiometer.
pub const WIPER_BITS: u32 = 12;

/// What the image has to know about a board of this family, and what the documents say about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct F4Board {
    /// Microcontroller, which the image checks at start-up.
    pub chip: F4Chip,
    /// Its package, flash and temperature range, as probe-rs writes them after its name.
    pub package: &'static str,
    /// Frequency at HSE (Hz), a multiple of 1 MHz from 4 to 26; the image measures it at start-up.
    pub crystal_hz: u32,
    /// Sources of the clock at HSE, in the order in which they are tried.
    pub sources: &'static [HseSource],
    /// The pins, except that of the status LED.
    pub wiring: &'static [Wire],
    /// The status LED.
    pub status_led: Wire,
    /// Whether the status LED is on while its pin is low.
    pub status_led_is_low: bool,
    /// Ratio of the power stage's supply voltage to the voltage at the pin that measures it.
    pub supply_divider: f32,
    /// Supply voltage of the microcontroller (V): the reference of its converter, where the factory's calibration is
    /// missing.
    pub reference_v: f32,
    /// Anything else that a user has to know.
    pub special: &'static str,
}

impl F4Board {
    /// What most boards have: an STM32F405RG with a crystal of 8 MHz, the standard wiring, and a LED at PB2.
    pub const F405: Self = Self {
        chip: F4Chip::F405,
        package: "RGTx",
        crystal_hz: 8_000_000,
        sources: &[HseSource::Crystal],
        wiring: &STANDARD,
        status_led: output(Signal::StatusLed, b'B', 2),
        status_led_is_low: false,
        supply_divider: 23.0,
        reference_v: 3.3,
        special: "",
    };
}

/// A microcontroller of this family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum F4Chip {
    /// STM32F405.
    F405,
    /// STM32F407: an STM32F405 with Ethernet and a camera interface, which nothing here uses.
    F407,
    /// STM32F446.
    F446,
}

impl F4Chip {
    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::F405 => "STM32F405",
            Self::F407 => "STM32F407",
            Self::F446 => "STM32F446",
        }
    }

    /// Its device identifier (DBGMCU_IDCODE; RM0090, 38.6.1; RM0390, 33.6.1).
    pub const fn identity(self) -> u32 {
        match self {
            Self::F405 | Self::F407 => 0x413,
            Self::F446 => 0x421,
        }
    }

    /// The cargo feature of the image for it.
    pub const fn feature(self) -> &'static str {
        match self {
            Self::F405 | Self::F407 => "stm32f405",
            Self::F446 => "stm32f446",
        }
    }
}

/// Source of the clock at HSE.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HseSource {
    /// A crystal.
    Crystal,
    /// An external clock signal: the oscillator is bypassed.
    Clock,
}
