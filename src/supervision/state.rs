//! The states of the supervisor.

use serde::{Deserialize, Serialize};

/// State of the supervisor. The motor is on where [`motor_is_on`](State::motor_is_on) says so.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum State {
    /// Positions are not known.
    #[default]
    Disarmed,
    /// Positions are being found: the cart is pushed to the limit switches by hand.
    Homing,
    /// Positions are known.
    Calibrated,
    /// The motor pushes the cart a little, while a person holds a key.
    Jogging,
    /// Waiting until all links have been upright and slow for `arm_time_s`.
    Armed,
    /// The motor brings the links to an equilibrium by a planned motion: to upright, or to one at which some hang.
    Raising,
    /// The controller balances the links upright.
    Balancing,
    /// The controller balances the links at an equilibrium at which some hang.
    Holding,
    /// The motor lowers the links by a planned motion.
    Lowering,
    /// A fault is latched.
    Fault,
    /// The motor shakes the hanging links, for an identification.
    Identifying,
    /// The motor stills links that swing or tumble: after a command, or after a fall.
    Stilling,
}

impl State {
    /// Whether the motor is on.
    pub const fn motor_is_on(self) -> bool {
        self.controls() || matches!(self, State::Jogging | State::Identifying | State::Stilling)
    }

    /// Whether the controller commands the motor.
    pub const fn controls(self) -> bool {
        matches!(self, State::Raising | State::Balancing | State::Holding | State::Lowering)
    }
}
