//! Who decides whether the motor may move.

use serde::{Deserialize, Serialize};

use crate::fault::Fault;
use crate::io::Contacts;

/// State of the supervisor. The motor is off in all of them but [`State::Balancing`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum State {
    /// Positions are not known.
    #[default]
    Disarmed,
    /// Positions are known.
    Calibrated,
    /// Waiting until all links are upright and slow.
    Armed,
    /// The controller drives the motor.
    Balancing,
    /// A fault is latched.
    Fault,
}

/// Why a command is not followed now: a set of reasons.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Reasons(u16);

impl Reasons {
    /// Positions are not known: home first.
    pub const NOT_HOMED: Self = Self(1);
    /// A fault is latched: clear it first.
    pub const FAULT: Self = Self(1 << 1);
    /// The motor is not off.
    pub const RUNNING: Self = Self(1 << 2);

    /// Both sets of reasons.
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether there is none.
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// The state machine.
#[derive(Debug, Clone, Default)]
pub struct Supervisor {
    state: State,
    fault: Option<Fault>,
}

impl Supervisor {
    /// The state.
    pub fn state(&self) -> State {
        self.state
    }

    /// The latched fault.
    pub fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Latches `fault` unless there is an earlier one.
    pub fn trip(&mut self, fault: Fault) {
        self.fault.get_or_insert(fault);
        self.state = State::Fault;
    }

    /// Turns the motor off.
    pub fn disarm(&mut self) {
        if matches!(self.state, State::Armed | State::Balancing) {
            self.state = State::Calibrated;
        }
    }

    /// Positions are known from now on.
    ///
    /// # Errors
    /// The reasons against it.
    pub fn home(&mut self) -> Result<(), Reasons> {
        match self.state {
            State::Disarmed | State::Calibrated => {
                self.state = State::Calibrated;
                Ok(())
            }
            State::Armed | State::Balancing => Err(Reasons::RUNNING),
            State::Fault => Err(Reasons::FAULT),
        }
    }

    /// Balance when upright.
    ///
    /// # Errors
    /// The reasons against it.
    pub fn arm(&mut self) -> Result<(), Reasons> {
        match self.state {
            State::Calibrated => {
                self.state = State::Armed;
                Ok(())
            }
            State::Disarmed => Err(Reasons::NOT_HOMED),
            State::Fault => Err(Reasons::FAULT),
            State::Armed | State::Balancing => Err(Reasons::RUNNING),
        }
    }

    /// The links are upright: whether balancing begins.
    pub fn upright(&mut self) -> bool {
        let begins = self.state == State::Armed;
        if begins {
            self.state = State::Balancing;
        }
        begins
    }

    /// Forgets the latched fault.
    pub fn clear(&mut self) {
        if self.state == State::Fault {
            self.fault = None;
            self.state = State::Disarmed;
        }
    }

    /// Looks at the contacts of a tick.
    pub fn watch(&mut self, contacts: &Contacts) {
        if contacts.clock_fault {
            self.trip(Fault::Clock);
        } else if contacts.emergency_stop {
            self.trip(Fault::EmergencyStop);
        } else if contacts.driver_fault {
            self.trip(Fault::Driver);
        } else if self.state == State::Balancing && (contacts.limit_low || contacts.limit_high) {
            self.trip(Fault::LimitSwitch);
        }
    }
}
