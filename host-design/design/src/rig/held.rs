//! What a drive holds from one tick to the next.

/// What the drive holds during a tick: the one answer to how the cart moves between two commands, for design, margins,
/// simulation and identification.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Held {
    /// The force on the cart.
    Force,
    /// The voltage of a DC motor: a force at standstill, less its braking by back-EMF (N·s/m) times the cart's speed.
    Voltage {
        /// Loss of force per speed (N·s/m).
        braking_n_s_per_m: f64,
    },
    /// The speed of the cart: even pulses. The acceleration a of a tick of length T changes the speed by `a T`, half of
    /// it at the beginning of the tick and half at its end, and the links' rates with it.
    MeanSpeed,
    /// The speed that a servo is commanded. The cart approaches it with a lag of first order, so that it is faster by
    /// `a T` after the tick.
    LaggingSpeed {
        /// Time constant (s).
        lag_s: f64,
    },
}

impl Held {
    /// Whether the drive moves the cart, whatever force that takes.
    pub fn is_motion(&self) -> bool {
        matches!(self, Self::MeanSpeed | Self::LaggingSpeed { .. })
    }
}

/// Time constant (s) of a lag of first order with this bandwidth (Hz).
pub(crate) fn lag_at(bandwidth_hz: f64) -> f64 {
    1.0 / (core::f64::consts::TAU * bandwidth_hz)
}
