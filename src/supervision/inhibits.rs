//! The inhibits: conditions that keep the firmware from carrying out a command now.
//!
//! A new one is a line in the list below. The functions that check for it are in `firmware/posture.rs` and
//! `firmware/commands.rs`.

use serde::{Deserialize, Serialize};

/// A set of inhibits: all that hold at the same time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Inhibits(u32);

macro_rules! inhibits {
    ($($bit:literal $name:ident $text:literal;)*) => {
        impl Inhibits {
            $(#[doc = concat!("Refused: ", $text, ".")] pub const $name: Self = Self(1 << $bit);)*

            /// Every inhibit with its text.
            pub const ALL: &[(Self, &str)] = &[$((Self::$name, $text)),*];
        }
    };
}

inhibits! {
    0 NOT_HOMED "positions are not known: home first";
    1 FAULT "a fault is latched: clear it first";
    2 RUNNING "the motor is not off: disarm first";
    3 SIGNS "the encoders' signs are not checked since power-up: check them first";
    4 TILTED "a link is not upright: hold all of them upright";
    5 MOVING "something moves: hold cart and links still";
    6 OFF_CENTRE "the cart is too close to an end of the rail: push it away";
    7 LIMIT_SWITCH "a limit switch is pressed, or its wire is open: push the cart off it";
    8 EMERGENCY_STOP "the emergency stop is pressed, or its wire is open: release it";
    9 DRIVER "the power stage reports a fault: see whether its supply is on";
    10 SUPPLY "the supply is too low or too high: measure it";
    11 HELD "the key was held since the motor went off: let go, then try again";
    12 NO_OBSERVER "the gain table holds no observer: give the rig its encoders and `[kalman]`";
    13 TABLE "the gain table or the image does not fit its checksum, or the table does not fit this build: flash the firmware again";
    14 NOT_HANGING "the links do not hang at rest: wait until they do";
    15 NO_SWITCHES "this rig has no rail with switches at its ends: home with the cart at position 0";
    16 NO_SWING_UP "the gain table holds no swing-up: give the rig file `[swing_up]`";
    17 NOT_BALANCING "the rig does not balance: there is nothing to lower";
    18 UNSETTLED "the cart is on its way to the set-point, or a link leans: wait until it stands";
    19 NO_ROOM "the motion does not fit on the rail from here: move the cart";
    20 OTHER_LAW "the swing-up ends in another control law: select LQR";
    21 MOTOR "the motor's sign is not checked since power-up: jog the cart";
    22 NOT_SHAKEN "the rig is not being shaken: begin again";
    23 ZEROS "the links swing about different zeros every 5 s: let go of them, hold the cart";
    24 NO_TRANSITION "the gain table holds no motion from this equilibrium to that one: plan it with `upright transitions`";
    25 OTHER_ZERO "a link hangs elsewhere than at its absolute sensor's zero: let it hang, or correct `sensor_zero_counts`";
    26 NO_STILLING "the gain table holds no stilling: hold the links still by hand";
}

impl Inhibits {
    /// The empty set.
    pub const NONE: Self = Self(0);

    /// All inhibits of both sets.
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// These inhibits if `holds`, else the empty set.
    pub const fn when(self, holds: bool) -> Self {
        if holds { self } else { Self::NONE }
    }

    /// Whether no inhibit holds.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Whether this set includes all of `other`.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// `Ok` if no inhibit holds, for use with `?`.
    ///
    /// # Errors
    /// The set itself, if it is not empty.
    pub const fn err_if_any(self) -> Result<(), Self> {
        if self.is_empty() { Ok(()) } else { Err(self) }
    }

    /// Texts of all inhibits in the set.
    pub fn texts(self) -> impl Iterator<Item = &'static str> {
        Self::ALL.iter().filter(move |(inhibit, _)| self.contains(*inhibit)).map(|(_, text)| *text)
    }
}

impl core::fmt::Display for Inhibits {
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
    fn all_inhibits_are_listed() {
        let both = Inhibits::TILTED.union(Inhibits::NOT_HOMED);
        assert_eq!(both.texts().count(), 2);
        assert!(both.to_string().contains("home first") && both.to_string().contains("upright"));
        assert_eq!(
            Inhibits::ALL
                .iter()
                .fold(Inhibits::NONE, |all, (inhibit, _)| all.union(*inhibit))
                .texts()
                .count(),
            27
        );
        assert_eq!(Inhibits::NONE.err_if_any(), Ok(()));
        assert_eq!(both.err_if_any(), Err(both));
    }
}
