//! The faults: one list for code, documentation and tests.

use serde::{Deserialize, Serialize};

/// Why the motor was turned off. Latched: the first cause stays until it is cleared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Fault {
    /// A measurement, the estimate or the force is not a finite number.
    NotFinite = 1,
    /// A link leans further than the limit.
    Angle = 2,
    /// The cart is beyond its soft limits.
    Rail = 3,
    /// A limit switch is pressed.
    LimitSwitch = 4,
    /// The emergency stop is pressed.
    EmergencyStop = 5,
    /// The power stage reports a fault.
    Driver = 6,
    /// The clock has failed to start: crystal or PLL.
    Clock = 18,
}
