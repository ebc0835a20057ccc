//! The hand that holds the simulated rig: hanging, upright, or as the sign check asks.

use std::f64::consts::{PI, TAU};

use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;
use upright_design::harness::Status;

use super::request::Holding;

/// Speed of the hand: cart (m/s), joints (rad/s).
const RATE: [f64; 2] = [0.5, 2.0];
/// Lead of the target over the held position while the sign check asks for a move: cart (m), joints (rad).
const NUDGE: [f64; 2] = [0.3, 1.0];

/// The hand, and the state in which it holds the rig.
#[derive(Debug, Clone)]
pub(super) struct Hand {
    how: Holding,
    held: Vec<f64>,
    period_s: f64,
}

impl Hand {
    /// A hand that holds nothing.
    pub(super) fn new(states: usize, period_s: f64) -> Self {
        Self { how: Holding::Free, held: vec![0.0; states], period_s }
    }

    /// What the hand does.
    pub(super) fn how(&self) -> Holding {
        self.how
    }

    /// Takes hold of the rig in `state`, or lets go.
    pub(super) fn take(&mut self, how: Holding, state: &[f64]) {
        if self.how == Holding::Free {
            self.held.copy_from_slice(state);
            self.held.iter_mut().skip(1).step_by(2).for_each(|rate| *rate = 0.0);
        }
        self.how = how;
    }

    /// The state in which the hand holds the rig in the next tick; `None` if it does not hold it. `state` is that of
    /// the rig now. While the motor pushes the cart, the hand lets go, and takes hold again afterwards.
    pub(super) fn tick(&mut self, status: &Status, state: &[f64]) -> Option<&[f64]> {
        if status.state == State::Jogging {
            let how = std::mem::replace(&mut self.how, Holding::Free);
            self.take(how, state);
            return None;
        }
        match self.how {
            Holding::Free => return None,
            Holding::Hanging => self.move_to(&hanging(self.held.len(), 0.0)),
            Holding::Upright => {
                let mut upright = vec![0.0; self.held.len()];
                upright[0] = self.held[0];
                self.move_to(&upright);
            }
            Holding::Guided => self.follow(status.signs),
        }
        Some(&self.held)
    }

    /// Moves what the sign check asks for; otherwise lets the links hang.
    fn follow(&mut self, signs: Signs) {
        let rest = hanging(self.held.len(), self.held[0]);
        let Signs::Move(sensor) = signs else { return self.move_to(&rest) };
        let joint = 2 * usize::from(sensor);
        let mut moved = rest;
        if let Some(position) = moved.get_mut(joint) {
            *position = self.held[joint] + NUDGE[usize::from(sensor > 0)];
        }
        // The next link keeps hanging.
        if sensor > 0 && joint + 2 < moved.len() {
            moved[joint + 2] = self.held[joint + 2] - NUDGE[1];
        }
        self.move_to(&moved);
    }

    /// Moves every position towards `to`, the joints on the shorter way round.
    fn move_to(&mut self, to: &[f64]) {
        for (index, (held, &to)) in self.held.iter_mut().zip(to).enumerate().step_by(2) {
            let joint = usize::from(index > 0);
            let turns = if joint == 1 { ((*held - to) / TAU).round() * TAU } else { 0.0 };
            let step = RATE[joint] * self.period_s;
            *held += (to + turns - *held).clamp(-step, step);
        }
    }
}

/// All links hanging, the cart at `x_m`.
fn hanging(states: usize, x_m: f64) -> Vec<f64> {
    let mut state = vec![0.0; states];
    state[0] = x_m;
    if let Some(first) = state.get_mut(2) {
        *first = PI;
    }
    state
}

#[cfg(test)]
mod tests {
    use super::*;
    use upright::supervision::jog::MotorSign;

    const CALIBRATED: Status =
        Status { state: State::Calibrated, signs: Signs::Checked, motor: MotorSign::Unchecked };

    #[test]
    fn a_cart_that_the_motor_pushes_is_held_again_where_it_is() {
        let mut hand = Hand::new(4, 0.01);
        hand.take(Holding::Upright, &[0.2, 0.0, 0.0, 0.0]);
        let jogging = Status { state: State::Jogging, ..CALIBRATED };
        assert_eq!(hand.tick(&jogging, &[0.25, 0.3, 0.0, 0.1]), None);
        assert_eq!(hand.tick(&CALIBRATED, &[0.3; 4]), Some([0.25, 0.0, 0.0, 0.0].as_slice()));
    }

    #[test]
    fn a_rig_that_has_turned_over_is_raised_on_the_shorter_way() {
        let mut hand = Hand::new(4, 0.01);
        hand.take(Holding::Upright, &[0.2, 1.0, 4.0 * TAU + 0.5, 30.0]);
        let mut held = Vec::new();
        for _ in 0..100 {
            held = hand.tick(&CALIBRATED, &held).unwrap_or_default().to_vec();
        }
        assert_eq!(held[1..2], [0.0]);
        assert!((held[2] - 4.0 * TAU).abs() < 1e-9 && held[0] == 0.2, "{held:?}");
        hand.take(Holding::Free, &held);
        assert_eq!(hand.tick(&CALIBRATED, &held), None);
    }
}
