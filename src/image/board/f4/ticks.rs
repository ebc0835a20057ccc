//! The ticks that these boards can make.

/// Shortest and longest tick (µs): a shorter one leaves no time for a controller, and over a longer one the motor's
/// timer cannot keep up the PWM.
pub(crate) const TICK_US: [u32; 2] = [120, 33_000];
