//! The person at the rig: homes, checks the signs, raises the links and holds them upright until the motor is on.

use upright::protocol::message::Request;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;

use crate::rig::{PlantDescription, Rig};

/// Where the hand leads the rig, and what it asks the firmware for, in a tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Act {
    /// The state in which the rig is held (m, m/s, rad, rad/s …).
    pub held: Vec<f64>,
    /// The request sent at the end of the tick.
    pub request: Option<Request>,
}

/// What the hand sees of the firmware: its telemetry tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seen {
    /// State of the supervisor.
    pub state: State,
    /// How far the check of the signs is.
    pub signs: Signs,
}

/// The hand, tick by tick. It goes the way that the firmware asks for, as a person would; there is no other.
#[derive(Debug, Clone)]
pub struct Hand {
    doing: Doing,
    hanging: Vec<f64>,
    start: Vec<f64>,
    held: Vec<f64>,
    /// Way of a tick for a link (rad) and the cart (m).
    pace: [f64; 2],
    /// Ticks to wait before a refused request is tried again.
    patience: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Doing {
    Home,
    CheckSigns,
    Follow,
    Raise,
    Arm,
    Hold,
}

/// Pace of the hand: joints (rad/s), cart (m/s).
const RATE: [f64; 2] = [2.0, 0.5];
/// Between two tries of the same request (s).
const RETRY_S: f64 = 0.05;

impl Hand {
    /// A hand that leads `rig` from hanging to the state `start`, and lets go there.
    pub fn new(rig: &Rig, start: &[f64]) -> Self {
        let mut hanging = vec![0.0; rig.states()];
        if let (PlantDescription::Chain(_), Some(first)) = (&rig.plant, hanging.get_mut(2)) {
            *first = core::f64::consts::PI;
        }
        Self {
            doing: Doing::Home,
            held: hanging.clone(),
            hanging,
            start: start.to_vec(),
            pace: RATE.map(|rate| rate * rig.tick.period_s),
            patience: (RETRY_S / rig.tick.period_s).ceil() as u32,
        }
    }

    /// The state in which the rig is held now.
    pub fn held(&self) -> &[f64] {
        &self.held
    }

    /// The next tick; none once the firmware balances and the hand has let go.
    pub fn act(&mut self, tick: u32, seen: &Seen) -> Option<Act> {
        if seen.state == State::Balancing {
            return None;
        }
        let request = match self.doing {
            Doing::Home => {
                self.until(seen.state == State::Calibrated, Doing::CheckSigns, tick, Request::Home)
            }
            Doing::CheckSigns => {
                let begun = seen.signs != Signs::Unchecked;
                self.until(begun, Doing::Follow, tick, Request::CheckSigns)
            }
            Doing::Follow => {
                self.follow(seen.signs);
                None
            }
            Doing::Raise => {
                let start = self.start.clone();
                if self.lead_to(&start) {
                    self.doing = Doing::Arm;
                }
                None
            }
            Doing::Arm => self.until(seen.state == State::Armed, Doing::Hold, tick, Request::Arm),
            Doing::Hold => None,
        };
        Some(Act { held: self.held.clone(), request })
    }

    /// Asks again and again, until it is `done`.
    fn until(&mut self, done: bool, then: Doing, tick: u32, request: Request) -> Option<Request> {
        if done {
            self.doing = then;
            return None;
        }
        tick.is_multiple_of(self.patience).then_some(request)
    }

    /// Moves what the check of the signs asks for.
    fn follow(&mut self, signs: Signs) {
        match signs {
            Signs::Rest(_) => {
                // The cart stays where it is.
                let mut rest = self.hanging.clone();
                rest[0] = self.held[0];
                self.lead_to(&rest);
            }
            Signs::Move(0) => self.held[0] += self.pace[1],
            Signs::Move(sensor) => {
                let joint = 2 * usize::from(sensor);
                self.held[joint] += self.pace[0];
                // The next link hangs on.
                if let Some(outer) = self.held.get_mut(joint + 2) {
                    *outer -= self.pace[0];
                }
            }
            Signs::Checked => self.doing = Doing::Raise,
            Signs::Unchecked | Signs::Reversed(_) | Signs::Swapped { .. } => {}
        }
    }

    /// Leads every position towards `to`; whether it is there.
    fn lead_to(&mut self, to: &[f64]) -> bool {
        let mut there = true;
        for (index, (held, &to)) in self.held.iter_mut().zip(to).enumerate().step_by(2) {
            let pace = self.pace[usize::from(index == 0)];
            *held += (to - *held).clamp(-pace, pace);
            there &= *held == to;
        }
        there
    }
}
