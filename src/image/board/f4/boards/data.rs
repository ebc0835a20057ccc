//! What is to be said about a board.

use super::super::wiring::Wire;

/// What the image has to know about a board, and what the documentation says about it.
pub(crate) struct BoardData {
    /// Name of the board and of the cargo feature.
    #[cfg_attr(target_os = "none", allow(dead_code, reason = "for the table of the documentation"))]
    pub(crate) name: &'static str,
    /// Product name.
    #[cfg_attr(target_os = "none", allow(dead_code, reason = "for the table of the documentation"))]
    pub(crate) title: &'static str,
    /// Type of the microcontroller, which the image checks at start-up.
    pub(crate) chip: ChipFamily,
    /// Frequency at HSE (Hz), a multiple of 1 MHz; the image measures it at start-up.
    pub(crate) crystal_hz: u32,
    /// Sources of the clock at HSE, in the order in which they are tried.
    pub(crate) sources: &'static [HseSource],
    /// The pins, except that of the status LED.
    pub(crate) wiring: &'static [Wire],
    /// The status LED.
    pub(crate) status_led: Wire,
    /// Whether the status LED is on while its pin is low.
    pub(crate) status_led_is_low: bool,
    /// Ratio of the power stage's supply voltage to the voltage at the pin that measures it.
    pub(crate) supply_divider: f32,
    /// Supply voltage of the microcontroller (V), for a chip without a valid factory calibration of its reference.
    pub(crate) reference_v: f32,
    /// Anything else that a user has to know.
    #[cfg_attr(target_os = "none", allow(dead_code, reason = "for the table of the documentation"))]
    pub(crate) special: &'static str,
}

/// A type of microcontroller, with its device identifier (DBGMCU_IDCODE).
#[derive(Clone, Copy)]
pub(crate) enum ChipFamily {
    /// STM32F405 and STM32F407, which share an identifier.
    F405OrF407 = 0x413,
    /// STM32F446.
    F446 = 0x421,
}

/// Source of the clock at HSE.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum HseSource {
    /// A crystal.
    Crystal,
    /// An external clock signal: the oscillator is bypassed.
    Clock,
}
