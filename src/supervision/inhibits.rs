//! Why a command is not followed now.

use serde::{Deserialize, Serialize};

/// A set of reasons; every one that holds is in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Reasons(u32);

macro_rules! reasons {
    ($($bit:literal $name:ident $text:literal;)*) => {
        impl Reasons {
            $(#[doc = concat!("Because ", $text, ".")] pub const $name: Self = Self(1 << $bit);)*

            /// Every reason and its text.
            pub const ALL: &[(Self, &str)] = &[$((Self::$name, $text)),*];
        }
    };
}

reasons! {
    0 NOT_HOMED "positions are not known: home first";
    1 FAULT "a fault is latched: clear it first";
    2 RUNNING "the motor is not off: disarm first";
    3 SIGNS "the encoders' signs are not checked since power-up: check them first";
    4 TILTED "a link is not upright: hold all of them upright";
    5 MOVING "something moves: hold cart and links still";
    6 OFF_CENTRE "the cart is too close to an end of the rail: push it away";
    7 LIMIT_SWITCH "a limit switch is pressed, or its wire is open";
    8 EMERGENCY_STOP "the emergency stop is pressed, or its wire is open";
    9 DRIVER "the power stage reports a fault";
    10 SUPPLY "the supply is too low";
    11 HELD "the arm command was held since the fault: let go, then arm again";
    12 NO_OBSERVER "the gain table holds no observer: give the rig its encoders and `[kalman]`";
    13 TABLE "the gain table does not fit its checksum or this build";
    14 NOT_HANGING "the links do not hang at rest";
    15 NO_SWITCHES "this rig has no rail with switches at its ends";
}

impl Reasons {
    /// No reason.
    pub const NONE: Self = Self(0);

    /// Both sets of reasons.
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// These reasons if `holds`, else none.
    pub const fn when(self, holds: bool) -> Self {
        if holds { self } else { Self::NONE }
    }

    /// Whether there is none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether all of `other` are among these.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// `Ok` if there is none.
    ///
    /// # Errors
    /// All of them.
    pub const fn none(self) -> Result<(), Self> {
        if self.is_empty() { Ok(()) } else { Err(self) }
    }

    /// The text of each.
    pub fn texts(self) -> impl Iterator<Item = &'static str> {
        Self::ALL.iter().filter(move |(reason, _)| self.contains(*reason)).map(|(_, text)| *text)
    }
}

impl core::fmt::Display for Reasons {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        for (index, text) in self.texts().enumerate() {
            f.write_str(if index == 0 { "" } else { "; " })?;
            f.write_str(text)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn all_reasons_are_listed() {
        let both = Reasons::TILTED.and(Reasons::NOT_HOMED);
        assert_eq!(both.texts().count(), 2);
        assert!(both.to_string().contains("home first") && both.to_string().contains("upright"));
        assert_eq!(
            Reasons::ALL.iter().fold(Reasons::NONE, |all, (reason, _)| all.and(*reason)).texts().count(),
            16
        );
        assert_eq!(Reasons::NONE.none(), Ok(()));
        assert_eq!(both.none(), Err(both));
    }
}
