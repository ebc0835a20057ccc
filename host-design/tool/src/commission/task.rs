//! What a person at the rig is asked to do.

use core::fmt;

/// An end of the rail.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// At the smallest position.
    Low,
    /// At the largest position.
    High,
}

/// Something to do by hand. Its text is what the person is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PersonTask {
    /// Press the emergency stop.
    PressStop,
    /// Release it.
    ReleaseStop,
    /// Push the cart until it presses the switch at an end.
    PushTo(End),
    /// Push the cart to the middle of the rail, and let the links hang still.
    Centre,
    /// Switch the motor's supply on.
    SwitchOn,
    /// Let the links hang still where the cart is.
    Rest,
    /// Turn a link counter-clockwise, or push the cart (0) along +x.
    Move(u8),
    /// Turn a link once around, counter-clockwise.
    TurnAround(u8),
    /// Let go of everything: the motor is going to move the cart.
    HandsOff,
    /// Hold the links upright and still, until the motor comes on.
    Raise,
    /// Take hold of the links before the motor goes off.
    Catch,
}

impl PersonTask {
    /// Whether the hand lets cart and links go in this task; `is_on`: the motor is on.
    pub fn lets_go(self, is_on: bool) -> bool {
        match self {
            PersonTask::HandsOff => true,
            PersonTask::Raise | PersonTask::Catch => is_on,
            _ => false,
        }
    }

    /// Whether the person has to confirm first, because the motor comes on or goes off.
    pub fn needs_consent(self) -> bool {
        matches!(self, PersonTask::SwitchOn | PersonTask::HandsOff | PersonTask::Raise | PersonTask::Catch)
    }
}

impl fmt::Display for PersonTask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PersonTask::PressStop => f.write_str("press the emergency stop, and keep it pressed"),
            PersonTask::ReleaseStop => f.write_str("release the emergency stop"),
            PersonTask::PushTo(End::Low) => {
                f.write_str("push the cart to the low end of the rail until it presses the switch")
            }
            PersonTask::PushTo(End::High) => {
                f.write_str("push the cart to the high end of the rail, along +x, until it presses the switch")
            }
            PersonTask::Centre => {
                f.write_str("push the cart to the middle of the rail, and let the links hang still")
            }
            PersonTask::SwitchOn => f.write_str("switch the motor's supply on, with the emergency stop in your hand"),
            PersonTask::Rest => f.write_str("let the links hang still"),
            PersonTask::Move(0) => f.write_str("push the cart along +x"),
            PersonTask::Move(link) => write!(f, "turn link {link} counter-clockwise; let the links beyond it hang"),
            PersonTask::TurnAround(link) => write!(
                f,
                "turn link {link} once around, counter-clockwise, until it hangs again; do not stop on the way, then keep it \
                 still"
            ),
            PersonTask::HandsOff => f.write_str(
                "take your hands off the rig and hold the emergency stop: the motor is going to move the cart",
            ),
            PersonTask::Raise => f.write_str(
                "raise the links and hold them upright and still; when the motor comes on, let go, with the emergency stop in \
                 your hand",
            ),
            PersonTask::Catch => f.write_str("take hold of the links: the motor is going to be turned off"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hands_are_either_off_the_rig_or_at_the_emergency_stop() {
        let text = PersonTask::HandsOff.to_string();
        assert!(text.contains("hands off the rig and hold the emergency stop"), "{text}");
        assert!(!text.contains("them"), "{text}");
    }
}
