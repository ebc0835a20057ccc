//! The simulated person at the rig: homes, checks the signs and the motor, then raises the links and holds them upright
//! until the motor is on, or lets them hang for the swing-up.

use upright::board::Output;
use upright::control::actuator::Drive;
use upright::protocol::KEEP_ALIVE;
use upright::protocol::message::Request;
use upright::supervision::jog::MotorSign;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;
use upright::table::Equilibrium;

use super::held_rig::HeldRig;
use upright_design::rig::Rig;
use upright_design::simulate::{Begin, Bench, Scenario, SimulationError};

/// What the operator does in one tick.
#[derive(Debug, Clone, PartialEq)]
pub struct OperatorTick {
    /// The state in which the rig is held (m, m/s, rad, rad/s …).
    pub held: Vec<f64>,
    /// The request sent at the end of the tick.
    pub request: Option<Request>,
}

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
pub struct Operator {
    doing: Doing,
    /// The request that turns the motor on.
    turn_on: Request,
    rig: HeldRig,
    /// Travel per pulse (m) of a drive that takes them.
    pulse_m: Option<f64>,
    start: Vec<f64>,
    /// A second rig, simulated while the motor pushes the cart: the random numbers and the state of the run's own rig
    /// must not depend on how it was started.
    pushed: Bench,
    /// Ticks between two tries of the same request.
    retry_ticks: u32,
    /// Ticks between two commands of a key that is held.
    key_ticks: u32,
    /// Ticks for which the rig stands still before the motor pushes.
    settle_ticks: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Doing {
    Home,
    CheckSigns,
    Follow,
    /// Lets the rig stand still for some ticks.
    Settle(u32),
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
    ///
    /// # Errors
    /// [`SimulationError`] if the plant cannot be built.
    pub fn new(rig: &Rig, scenario: &Scenario) -> Result<Self, SimulationError> {
        let undisturbed =
            Scenario { force_noise_n: 0.0, torque_noise_n_m: 0.0, force_offset_n: 0.0, ..scenario.clone() };
        let ticks = |seconds: f64| (seconds / rig.tick.period_s).ceil() as u32;
        Ok(Self {
            doing: Doing::Home,
            turn_on: match scenario.begin {
                Begin::ByHand => Request::Arm,
                Begin::Hanging => Request::Goto(Equilibrium::UPRIGHT),
            },
            rig: HeldRig::hanging(rig),
            pulse_m: rig.actuator.pulses().map(|drive| drive.step_m),
            start: scenario.start.clone(),
            pushed: Bench::new(rig, &undisturbed)?,
            retry_ticks: ticks(RETRY_S),
            key_ticks: ticks(KEEP_ALIVE.as_secs_f64()),
            // The firmware asks for a quarter of arm_time_s.
            settle_ticks: ticks(0.5 * rig.limits.arm_time_s),
        })
    }

    /// The state in which the rig is held now.
    pub fn held(&self) -> &[f64] {
        self.rig.held()
    }

    /// Whether the firmware balances or raises the links, with this output and as far as its telemetry says. A drive
    /// with pulses is on before, to hold the cart, so that the hand lets go when telemetry says so, a tick later.
    pub fn has_let_go(&self, status: &Status, output: &Output) -> bool {
        match self.pulse_m {
            Some(_) => status.state.controls(),
            None => output.enable && self.doing != Doing::Push,
        }
    }

    /// What the operator does in tick number `tick`, when `output` was the firmware's last output; `None` once the
    /// controller commands the motor and the hand has let go.
    pub fn act(&mut self, tick: u32, status: &Status, output: &Output) -> Option<OperatorTick> {
        if status.state.controls() {
            return None;
        }
        if self.doing != Doing::Push {
            self.rig.carry(f64::from(output.pulses()) * self.pulse_m.unwrap_or_default());
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
                self.follow(status);
                None
            }
            Doing::Settle(0) => {
                self.doing = Doing::Push;
                self.pushed.hold(self.rig.held());
                None
            }
            Doing::Settle(ticks) => {
                self.doing = Doing::Settle(ticks - 1);
                None
            }
            Doing::Push => self.push(tick, status, output),
            Doing::Raise => {
                if self.rig.put(&self.start) {
                    self.doing = Doing::TurnOn;
                }
                None
            }
            Doing::TurnOn => self.until(status.state == State::Armed, Doing::Hold, tick, self.turn_on),
            Doing::Hold => None,
        };
        Some(OperatorTick { held: self.rig.held().to_vec(), request })
    }

    /// Repeats a request until it is `done`, then continues with `then`.
    fn until(&mut self, done: bool, then: Doing, tick: u32, request: Request) -> Option<Request> {
        if done {
            self.doing = then;
            return None;
        }
        tick.is_multiple_of(self.retry_ticks).then_some(request)
    }

    /// Moves what the sign check asks for.
    fn follow(&mut self, status: &Status) {
        match status.signs {
            Signs::Rest(_) => {
                self.rig.rest();
            }
            Signs::Move(sensor) => self.rig.turn(sensor),
            Signs::Checked if status.motor == MotorSign::Checked => self.doing = Doing::Raise,
            // The last sensor to be checked was a link's.
            Signs::Checked if self.pulse_m.is_some() && !self.rig.rest() => {}
            Signs::Checked => self.doing = Doing::Settle(self.settle_ticks),
            Signs::Unchecked | Signs::Reversed(_) | Signs::Swapped { .. } => {}
        }
    }

    /// Lets the motor push the cart with all links free, and holds the key until the motor's sign is known.
    fn push(&mut self, tick: u32, status: &Status, output: &Output) -> Option<Request> {
        // A motor that is off turns freely.
        let drive = if output.enable { output.drive } else { Drive::Force(0.0) };
        self.pushed.tick(drive);
        self.rig.take(self.pushed.state());
        match status.motor {
            MotorSign::Unchecked if tick.is_multiple_of(self.key_ticks) => {
                Some(Request::Jog { along: false })
            }
            MotorSign::Checked if status.state == State::Calibrated => {
                self.rig.stop();
                self.doing = Doing::Raise;
                None
            }
            _ => None,
        }
    }
}
