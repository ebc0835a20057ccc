//! The person at the rig: homes, checks the signs, then raises the links and holds them upright until the motor is on,
//! or lets them hang for the swing-up.

use upright::protocol::message::Request;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;

use crate::reality::hanging_by_hand;
use crate::rig::{PlantDescription, Rig};
use crate::simulate::Begin;

/// What the hand does in one tick.
#[derive(Debug, Clone, PartialEq)]
pub struct HandTick {
    /// The state in which the rig is held (m, m/s, rad, rad/s …).
    pub held: Vec<f64>,
    /// The request sent at the end of the tick.
    pub request: Option<Request>,
}

/// What the hand knows of the firmware, from its telemetry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Status {
    /// State of the supervisor.
    pub state: State,
    /// Progress of the sign check.
    pub signs: Signs,
}

/// The hand, tick by tick. It follows the firmware's instructions, as a person would.
#[derive(Debug, Clone)]
pub struct Hand {
    doing: Doing,
    /// The request that turns the motor on.
    turn_on: Request,
    hanging: Vec<f64>,
    start: Vec<f64>,
    held: Vec<f64>,
    /// Largest movement per tick of a joint (rad) and of the cart (m).
    step: [f64; 2],
    /// Ticks between two tries of the same request.
    retry_ticks: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Doing {
    Home,
    CheckSigns,
    Follow,
    Raise,
    TurnOn,
    Hold,
}

/// Speed of the hand: joints (rad/s), cart (m/s).
const RATE: [f64; 2] = [2.0, 0.5];
/// Time between two tries of the same request (s).
const RETRY_S: f64 = 0.05;

impl Hand {
    /// A hand that moves `rig` from hanging to the state `start`, and lets go there: when the firmware balances, or
    /// for a swing-up (`begin`) when it begins to raise the links.
    pub fn new(rig: &Rig, start: &[f64], begin: Begin) -> Self {
        let hanging = match &rig.plant {
            PlantDescription::Chain(_) => hanging_by_hand(rig),
            PlantDescription::Model(_) => vec![0.0; rig.states()],
        };
        Self {
            doing: Doing::Home,
            turn_on: match begin {
                Begin::ByHand => Request::Arm,
                Begin::Hanging { .. } => Request::Up,
            },
            held: hanging.clone(),
            hanging,
            start: start.to_vec(),
            step: RATE.map(|rate| rate * rig.tick.period_s),
            retry_ticks: (RETRY_S / rig.tick.period_s).ceil() as u32,
        }
    }

    /// The state in which the rig is held now.
    pub fn held(&self) -> &[f64] {
        &self.held
    }

    /// What the hand does in tick number `tick`; `None` once the motor is on and the hand has let go.
    pub fn act(&mut self, tick: u32, status: &Status) -> Option<HandTick> {
        if status.state.drives() {
            return None;
        }
        let request = match self.doing {
            Doing::Home => {
                self.until(status.state == State::Calibrated, Doing::CheckSigns, tick, Request::Home)
            }
            Doing::CheckSigns => {
                let begun = status.signs != Signs::Unchecked;
                self.until(begun, Doing::Follow, tick, Request::CheckSigns)
            }
            Doing::Follow => {
                self.follow(status.signs);
                None
            }
            Doing::Raise => {
                let start = self.start.clone();
                if self.move_to(&start) {
                    self.doing = Doing::TurnOn;
                }
                None
            }
            Doing::TurnOn => self.until(status.state == State::Armed, Doing::Hold, tick, self.turn_on),
            Doing::Hold => None,
        };
        Some(HandTick { held: self.held.clone(), request })
    }

    /// Repeats a request until it is `done`, then goes on with `then`.
    fn until(&mut self, done: bool, then: Doing, tick: u32, request: Request) -> Option<Request> {
        if done {
            self.doing = then;
            return None;
        }
        tick.is_multiple_of(self.retry_ticks).then_some(request)
    }

    /// Moves what the sign check asks for.
    fn follow(&mut self, signs: Signs) {
        match signs {
            Signs::Rest(_) => {
                // The cart stays where it is.
                let mut rest = self.hanging.clone();
                rest[0] = self.held[0];
                self.move_to(&rest);
            }
            Signs::Move(0) => self.held[0] += self.step[1],
            Signs::Move(sensor) => {
                let joint = 2 * usize::from(sensor);
                self.held[joint] += self.step[0];
                // The next link keeps hanging.
                if let Some(outer) = self.held.get_mut(joint + 2) {
                    *outer -= self.step[0];
                }
            }
            Signs::Checked => self.doing = Doing::Raise,
            Signs::Unchecked | Signs::Reversed(_) | Signs::Swapped { .. } => {}
        }
    }

    /// Moves every position towards `to`; gives whether all are there.
    fn move_to(&mut self, to: &[f64]) -> bool {
        let mut there = true;
        for (index, (held, &to)) in self.held.iter_mut().zip(to).enumerate().step_by(2) {
            let step = self.step[usize::from(index == 0)];
            *held += (to - *held).clamp(-step, step);
            there &= *held == to;
        }
        there
    }
}
