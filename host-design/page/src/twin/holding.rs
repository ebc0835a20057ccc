//! The rig held by hand: hanging, upright, or as the sign check asks.

use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;
use upright_closed_loop::harness::{HeldRig, Status};
use upright_design::rig::Rig;

use super::request::Holding;

/// How the rig is held, and the state in which it is.
#[derive(Debug, Clone)]
pub(crate) struct ManualHold {
    how: Holding,
    rig: HeldRig,
}

impl ManualHold {
    /// Nothing is held.
    pub(crate) fn new(rig: &Rig) -> Self {
        Self { how: Holding::Free, rig: HeldRig::hanging(rig) }
    }

    /// How the rig is held.
    pub(crate) fn how(&self) -> Holding {
        self.how
    }

    /// Takes hold of the rig in `state`, or lets go.
    pub(crate) fn take(&mut self, how: Holding, state: &[f64]) {
        if self.how == Holding::Free {
            self.rig.take(state);
            self.rig.stop();
        }
        self.how = how;
    }

    /// The state in which the rig is held in the next tick; `None` if it is not. `state` is that of the rig now. While
    /// the motor pushes the cart, the rig is let go, and held again afterwards. A drive that takes pulses moves the
    /// cart by `carried_m` while it is on, whatever the hand does.
    pub(crate) fn tick(&mut self, status: &Status, state: &[f64], carried_m: Option<f64>) -> Option<&[f64]> {
        if status.state == State::Jogging {
            let how = std::mem::replace(&mut self.how, Holding::Free);
            self.take(how, state);
            return None;
        }
        if self.how == Holding::Free {
            return None;
        }
        self.rig.carry(carried_m.unwrap_or_default());
        match (self.how, status.signs) {
            (Holding::Guided, Signs::Move(sensor)) => self.rig.turn(sensor),
            (Holding::Hanging, _) if carried_m.is_none() => {
                self.rig.push_to(0.0);
            }
            (Holding::Free | Holding::Hanging | Holding::Guided, _) => {
                self.rig.push_to(self.rig.held()[0]);
            }
            (Holding::Upright, _) => {
                self.rig.raise();
            }
        }
        Some(self.rig.held())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use upright::supervision::jog::MotorSign;

    const CALIBRATED: Status =
        Status { state: State::Calibrated, signs: Signs::Checked, motor: MotorSign::Unchecked };

    fn hold_of(rig: &str) -> ManualHold {
        ManualHold::new(&Rig::from_path(Path::new(&format!("../../rigs/{rig}.toml"))).unwrap())
    }

    #[test]
    fn a_hand_moves_the_cart_only_while_a_drive_that_takes_pulses_is_off() {
        let mut hold = hold_of("single-stepper");
        hold.take(Holding::Hanging, &[0.1, 0.0, 0.0, 0.0]);
        let cart_m = |held: Option<&[f64]>| held.unwrap()[0];
        assert!((cart_m(hold.tick(&CALIBRATED, &[0.0; 4], Some(0.002))) - 0.102).abs() < 1e-12);
        assert!((cart_m(hold.tick(&CALIBRATED, &[0.0; 4], Some(0.0))) - 0.102).abs() < 1e-12);
        assert!(cart_m(hold.tick(&CALIBRATED, &[0.0; 4], None)) < 0.1, "the hand pushes it to the middle");
    }

    #[test]
    fn a_cart_that_the_motor_pushes_is_held_again_where_it_is() {
        let mut hold = hold_of("single-quanser-ip02");
        hold.take(Holding::Upright, &[0.2, 0.0, 0.0, 0.0]);
        let jogging = Status { state: State::Jogging, ..CALIBRATED };
        assert_eq!(hold.tick(&jogging, &[0.25, 0.3, 0.0, 0.1], None), None);
        assert_eq!(hold.tick(&CALIBRATED, &[0.3; 4], None), Some([0.25, 0.0, 0.0, 0.0].as_slice()));
        // Negative control: a rig that is let go is not held.
        hold.take(Holding::Free, &[0.25, 0.0, 0.0, 0.0]);
        assert_eq!(hold.tick(&CALIBRATED, &[0.3; 4], None), None);
    }
}
