//! The outcome that a defect must have, and what the rig does when it begins.

use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::jog::MotorSign;

/// The outcome that a defect must have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Expected {
    /// Motor off with this fault, at most this number of ticks after the onset. Where the list of faults has no
    /// number, it follows from the rig's limits.
    Fault(Fault, Ticks),
    /// Motor off, with any fault, before a link is far beyond its limit. At best this takes the given number of ticks
    /// from the first visible difference to a healthy rig.
    Off(u32),
    /// Balancing continues, and the rejected measurement is counted.
    Counted,
    /// Balancing continues, with every output bit for bit as without the defect.
    Ignored,
    /// Motor off, with any fault, before a link is far beyond its limit.
    Changed,
    /// Links and cart stay within their limits until the motor is off, if it is turned off at all.
    Bounded,
    /// Balancing continues, if it does so without the tests of the innovation.
    Survived,
    /// The firmware refuses to arm, for these reasons at least.
    Refused(Inhibits),
    /// The motor is off in the same tick, and the firmware stops running.
    Dead,
    /// A jog ends without a fault, as soon after the last command as when the key is released; a rig that was
    /// shaken brings its cart back first.
    LetGo,
    /// A jog ends with this finding about the motor, which keeps it from arming.
    Found(MotorSign),
}

/// Number of ticks within which a fault must turn the motor off.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ticks {
    /// This number.
    Exactly(u32),
    /// The ticks of `supply_time_s`, plus one.
    Supply,
    /// The ticks of `link_timeout_s` from the last command on, plus those that its bytes take.
    Link,
}

/// What the rig does when a defect begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// It balances, raised by hand.
    Balancing,
    /// It is raised by the motor.
    Raising,
    /// It is lowered by the motor.
    Lowering,
    /// Its links hang, and the motor pushes the cart while a key is held.
    Jogging,
    /// Its links hang, and the motor shakes them.
    Shaken,
}
