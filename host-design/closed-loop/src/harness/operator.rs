//! The simulated person at the rig: homes, checks the signs and the motor, then raises the links and holds them upright
//! until the motor is on, or lets them hang for the swing-up.

use upright::board::Output;
use upright::protocol::KEEP_ALIVE;
use upright::protocol::message::Request;
use upright::supervision::jog::MotorSign;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;
use upright::table::Equilibrium;

use super::hand::Hand;
use upright_design::rig::Rig;
use upright_design::simulate::{Begin, Bench, Scenario};

/// What the operator knows of the firmware, from its telemetry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Status {
    /// State of the supervisor.
    pub state: State,
    /// Progress of the sign check.
    pub signs: Signs,
    /// Progress of the check of the motor's sign.
    pub motor: MotorSign,
}

/// The operator, tick by tick, who follows the firmware's instructions.
pub(super) struct Operator {
    doing: Doing,
    /// The request that turns the motor on.
    turn_on: Request,
    takes_pulses: bool,
    start: Vec<f64>,
    /// Ticks between two tries of the same request.
    retry_ticks: usize,
    /// Ticks between two commands of a key that is held.
    key_ticks: usize,
    /// Ticks for which the rig stands still before the motor pushes.
    settle_ticks: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Doing {
    Home,
    CheckSigns,
    Follow,
    /// Lets the rig stand still for some ticks.
    Settle(usize),
    /// Holds the key with which the motor pushes the cart.
    Push,
    Raise,
    TurnOn,
    Hold,
}

/// Time between two tries of the same request (s).
pub(super) const RETRY_S: f64 = 0.05;

impl Operator {
    /// An operator who moves `rig` from hanging to the start of `scenario`, and lets go there: when the firmware
    /// balances, or for a swing-up when it begins to raise the links.
    pub(super) fn new(rig: &Rig, scenario: &Scenario) -> Self {
        let ticks = |seconds: f64| (seconds / rig.tick.period_s).ceil() as usize;
        Self {
            doing: Doing::Home,
            turn_on: match scenario.begin {
                Begin::ByHand => Request::Arm,
                Begin::Hanging => Request::Goto(Equilibrium::UPRIGHT),
            },
            takes_pulses: rig.actuator.pulses().is_some(),
            start: scenario.start.clone(),
            retry_ticks: ticks(RETRY_S),
            key_ticks: ticks(KEEP_ALIVE.as_secs_f64()),
            // The firmware asks for a quarter of arm_time_s.
            settle_ticks: ticks(0.5 * rig.limits.arm_time_s),
        }
    }

    /// Whether the firmware balances or raises the links, with this output and as far as its telemetry says. A drive
    /// with pulses is on before, to hold the cart, so that the hand lets go when telemetry says so, a tick later.
    pub(super) fn has_let_go(&self, status: &Status, output: &Output) -> bool {
        if self.takes_pulses { status.state.controls() } else { output.enable && self.doing != Doing::Push }
    }

    /// What the operator does in tick number `tick`, when `output` was the firmware's last output: moves the rig on
    /// `bench` with `hand`, and returns the request. Nothing once the controller commands the motor and the hand has
    /// let go.
    pub(super) fn act(
        &mut self,
        tick: usize,
        status: &Status,
        output: &Output,
        (hand, bench): (&mut Hand, &mut Bench),
    ) -> Option<Request> {
        if status.state.controls() {
            return None;
        }
        if self.doing != Doing::Push {
            hand.carry(output);
        }
        match self.doing {
            Doing::Home => {
                self.until(status.state == State::Calibrated, Doing::CheckSigns, tick, Request::Home)
            }
            Doing::CheckSigns => {
                let begun = status.signs != Signs::Unchecked;
                self.until(begun, Doing::Follow, tick, Request::CheckSigns)
            }
            Doing::Follow => {
                self.follow(status, hand);
                None
            }
            Doing::Settle(0) => {
                self.doing = Doing::Push;
                None
            }
            Doing::Settle(ticks) => {
                self.doing = Doing::Settle(ticks - 1);
                None
            }
            Doing::Push => self.push(tick, status, output, (hand, bench)),
            Doing::Raise => {
                if hand.put(&self.start) {
                    self.doing = Doing::TurnOn;
                }
                None
            }
            Doing::TurnOn => self.until(status.state == State::Armed, Doing::Hold, tick, self.turn_on),
            Doing::Hold => None,
        }
    }

    /// Repeats a request until it is `done`, then continues with `then`.
    fn until(&mut self, done: bool, then: Doing, tick: usize, request: Request) -> Option<Request> {
        if done {
            self.doing = then;
            return None;
        }
        tick.is_multiple_of(self.retry_ticks).then_some(request)
    }

    /// Moves what the sign check asks for.
    fn follow(&mut self, status: &Status, hand: &mut Hand) {
        match status.signs {
            Signs::Rest(_) => {
                hand.rest();
            }
            Signs::Move(sensor) => hand.turn(sensor),
            Signs::Checked if status.motor == MotorSign::Checked => self.doing = Doing::Raise,
            // The last sensor to be checked was a link's.
            Signs::Checked if self.takes_pulses && !hand.rest() => {}
            Signs::Checked => self.doing = Doing::Settle(self.settle_ticks),
            Signs::Unchecked | Signs::Reversed(_) | Signs::Swapped { .. } => {}
        }
    }

    /// Lets the motor push the cart with all links free, and holds the key until the motor's sign is known. The
    /// disturbances of the run begin later, so that they do not depend on how it was started.
    fn push(
        &mut self,
        tick: usize,
        status: &Status,
        output: &Output,
        (hand, bench): (&mut Hand, &mut Bench),
    ) -> Option<Request> {
        hand.let_go();
        bench.disturb(false);
        if status.motor == MotorSign::Checked && status.state == State::Calibrated {
            bench.tick(output.drive);
            bench.disturb(true);
            hand.take_hold(bench.state());
            self.doing = Doing::Raise;
        }
        let presses = status.motor == MotorSign::Unchecked && tick.is_multiple_of(self.key_ticks);
        presses.then_some(Request::Jog { along: false })
    }
}
