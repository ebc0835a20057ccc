//! The steps.

use serde::Serialize;

/// A step from a wired rig to a balancing one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)] // the table below says what each is
pub enum CommissionStep {
    Connect,
    Contacts,
    Homing,
    Signs,
    Turns,
    Motor,
    Excitation,
    Identification,
    Design,
    Verification,
    Image,
    Balance,
}

impl CommissionStep {
    /// Every step with its name and what it finds out.
    pub const ALL: [(CommissionStep, &str, &str); 12] = [
        (Self::Connect, "connect", "the firmware answers, and is that of the rig file"),
        (
            CommissionStep::Contacts,
            "contacts",
            "emergency stop and limit switches open when they are pressed, each at its own end; then supply and power stage",
        ),
        (
            CommissionStep::Homing,
            "homing",
            "the limit switches are as far apart as the file says; zeros of cart and links",
        ),
        (
            CommissionStep::Signs,
            "signs",
            "every encoder counts in the right direction, and is plugged in at its own place",
        ),
        (Self::Turns, "turns", "the counts per turn of every link's encoder are those of the file"),
        (Self::Motor, "motor", "the motor moves the cart, and in the right direction"),
        (Self::Excitation, "excitation", "the log of the machine, shaken while its links hang"),
        (
            CommissionStep::Identification,
            "identification",
            "wiring, masses, lengths, frictions, delay and zeros, each with its deviation; whether they explain the log",
        ),
        (
            CommissionStep::Design,
            "design",
            "gains for the machine as it was found, if possible robust against what is not known of it",
        ),
        (
            CommissionStep::Verification,
            "verification",
            "margins as [verify] requires them, and whether runs with the friction that was found pass",
        ),
        (Self::Image, "image", "the firmware with these gains"),
        (Self::Balance, "balance", "raised by hand, the machine balances for 10 s"),
    ];

    /// The steps with the firmware of the rig file: up to that of the motor, they find every error in the wiring; then
    /// the machine is measured.
    pub const FIRST: [CommissionStep; 10] = [
        Self::Connect,
        Self::Contacts,
        Self::Homing,
        Self::Signs,
        Self::Turns,
        Self::Motor,
        Self::Excitation,
        Self::Identification,
        Self::Design,
        Self::Verification,
    ];

    /// The steps with the firmware for the machine as it was found. It has just started: nothing is homed or checked.
    pub const SECOND: [CommissionStep; 5] =
        [Self::Connect, Self::Homing, Self::Signs, Self::Motor, Self::Balance];

    /// The step to go back to if this one is not passed; `loses_cart`: the drive lets go of the cart after each step
    /// that moves it, and then nobody knows where that is.
    pub fn back(self, loses_cart: bool) -> Self {
        match self {
            Self::Identification | Self::Design | Self::Verification | Self::Motor if loses_cart => {
                Self::Homing
            }
            // A fault may have lost the positions.
            Self::Excitation | Self::Balance => Self::Homing,
            // Another log may be better.
            Self::Identification | Self::Design | Self::Verification => Self::Excitation,
            step => step,
        }
    }

    fn row(self) -> &'static (CommissionStep, &'static str, &'static str) {
        // A test checks that every step is in the table, in its order.
        &Self::ALL[self as usize]
    }

    /// Its name, as shown to the person.
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// What it finds out.
    pub fn finds_out(self) -> &'static str {
        self.row().2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_every_step_in_order() {
        for (index, (step, name, finds_out)) in CommissionStep::ALL.iter().enumerate() {
            assert_eq!(*step as usize, index);
            assert!(!name.is_empty() && !finds_out.is_empty());
        }
    }
}
