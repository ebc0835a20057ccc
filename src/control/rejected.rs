//! Why a request is rejected.

#[cfg(feature = "firmware")]
use serde::{Deserialize, Serialize};

/// Reason for rejecting a request; the previous setting is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "firmware", derive(Serialize, Deserialize))]
pub enum Rejected {
    /// The table holds no gains for this law.
    NoSuchLaw,
    /// The law can only be changed while the controller is stopped.
    Running,
    /// The set-point is not finite, or not within the soft limits of the rail.
    Setpoint,
    /// The table holds no observer, so the controller cannot run from encoders.
    NoObserver,
}

impl core::fmt::Display for Rejected {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Rejected::NoSuchLaw => "the gain table does not hold this control law",
            Rejected::Running => "the control law can only be changed while disarmed",
            Rejected::Setpoint => "the set-point is not a finite number, or within a tenth of the usable rail of one of its soft limits",
            Rejected::NoObserver => {
                "the gain table holds no observer: give the rig its encoders and [kalman]"
            }
        })
    }
}

impl core::error::Error for Rejected {}
