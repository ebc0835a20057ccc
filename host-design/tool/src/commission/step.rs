//! The steps.

use serde::Serialize;

/// A step from a wired rig to a balancing one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)] // the table below says what each is
pub enum Step {
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

impl Step {
    /// Every step with its name and what is found out.
    pub const ALL: [(Step, &str, &str); 12] = [
        (Step::Connect, "connect", "the firmware answers, and is that of the rig file"),
        (
            Step::Contacts,
            "contacts",
            "emergency stop and limit switches open when they are pressed, each at its own end; then supply and power stage",
        ),
        (
            Step::Homing,
            "homing",
            "the limit switches are as far apart as the file says; zeros of cart and links",
        ),
        (
            Step::Signs,
            "signs",
            "every encoder counts in the right direction, and is plugged in at its own place",
        ),
        (Step::Turns, "turns", "every link's encoder gives the counts of the file for a whole turn"),
        (Step::Motor, "motor", "the motor moves the cart, and the right way"),
        (Step::Excitation, "excitation", "the log of the machine, which hangs and is shaken"),
        (
            Step::Identification,
            "identification",
            "wiring, masses, lengths, frictions, delay and zeros, each with its deviation; whether they explain the log",
        ),
        (
            Step::Design,
            "design",
            "gains for the machine as it was found, that stand what is not known of it, if there are any",
        ),
        (
            Step::Verification,
            "verification",
            "margins as [verify] requires them, and whether runs with the friction that was found stand",
        ),
        (Step::Image, "image", "the firmware with these gains"),
        (Step::Balance, "balance", "raised by hand, the machine balances for 10 s"),
    ];

    /// The steps until everything that a wire can do wrong is known: nothing is measured yet.
    pub const EARLY: [Step; 6] =
        [Step::Connect, Step::Contacts, Step::Homing, Step::Signs, Step::Turns, Step::Motor];

    /// The steps with the firmware of the rig file.
    pub const FIRST: [Step; 10] = [
        Step::Connect,
        Step::Contacts,
        Step::Homing,
        Step::Signs,
        Step::Turns,
        Step::Motor,
        Step::Excitation,
        Step::Identification,
        Step::Design,
        Step::Verification,
    ];

    /// The steps with the firmware for the machine as it was found, which knows nothing yet.
    pub const SECOND: [Step; 5] = [Step::Connect, Step::Homing, Step::Signs, Step::Motor, Step::Balance];

    /// Where to begin again if it is not passed.
    pub fn back(self) -> Step {
        match self {
            // A fault may have lost the positions.
            Step::Excitation | Step::Balance => Step::Homing,
            // Another log may be better.
            Step::Identification | Step::Design | Step::Verification => Step::Excitation,
            step => step,
        }
    }

    fn row(self) -> &'static (Step, &'static str, &'static str) {
        // A test holds that every step is in the table, in its order.
        &Self::ALL[self as usize]
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        self.row().1
    }

    /// What is found out.
    pub fn finds_out(self) -> &'static str {
        self.row().2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_every_step_in_order() {
        for (index, (step, name, finds_out)) in Step::ALL.iter().enumerate() {
            assert_eq!(*step as usize, index);
            assert!(!name.is_empty() && !finds_out.is_empty());
        }
    }
}
