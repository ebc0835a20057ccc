//! Who decides whether the motor may move: states, and what leads from one to another.

use serde::{Deserialize, Serialize};

use crate::supervision::fault::{Cause, Fault};
use crate::supervision::inhibits::Reasons;

/// State of the supervisor. The motor is off in all of them but [`State::Balancing`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum State {
    /// Positions are not known.
    #[default]
    Disarmed,
    /// Positions are being found: the cart is pushed to the limit switches by hand.
    Homing,
    /// Positions are known.
    Calibrated,
    /// Waiting until all links have been upright and slow for a set time.
    Armed,
    /// The controller drives the motor.
    Balancing,
    /// A fault is latched.
    Fault,
}

/// The state machine, with the first cause of a fault.
///
/// ```text
/// Disarmed ─ begin_homing ─► Homing ─ homed ─► Calibrated ─ arm ─► Armed ─ upright ─► Balancing
///     └───────────────────── homed ───────────────►│◄── disarm, lost ─┘◄───── disarm ─────┘
/// any state ─ trip ─► Fault ─ clear ─► Calibrated, or Disarmed if positions are not known
/// ```
#[derive(Debug, Clone, Default)]
pub struct Supervisor {
    state: State,
    positions_known: bool,
    cause: Option<Cause>,
}

impl Supervisor {
    /// The state after a reset: disarmed, with what the reset was caused by.
    pub fn new(cause: Option<Cause>) -> Self {
        Self { cause, ..Self::default() }
    }

    /// The state.
    pub fn state(&self) -> State {
        self.state
    }

    /// The latched fault.
    pub fn fault(&self) -> Option<Fault> {
        self.cause.filter(|_| self.state == State::Fault).map(|cause| cause.fault)
    }

    /// The first cause of the latched fault, or of the reset before the start; none once it is cleared.
    pub fn cause(&self) -> Option<Cause> {
        self.cause
    }

    /// Latches `cause` unless there is an earlier fault.
    pub fn trip(&mut self, cause: Cause) {
        if self.state == State::Fault {
            return;
        }
        self.positions_known &= !cause.fault.loses_positions() && self.state != State::Homing;
        self.cause = Some(cause);
        self.state = State::Fault;
    }

    /// Turns the motor off, and ends homing.
    pub fn disarm(&mut self) {
        match self.state {
            State::Armed | State::Balancing => self.state = State::Calibrated,
            State::Homing => self.state = State::Disarmed,
            State::Disarmed | State::Calibrated | State::Fault => {}
        }
    }

    /// Begins to look for positions; those known before are forgotten.
    ///
    /// # Errors
    /// The reasons against it.
    pub fn begin_homing(&mut self) -> Result<(), Reasons> {
        self.may_home()?;
        self.positions_known = false;
        self.state = State::Homing;
        Ok(())
    }

    /// Positions are known from now on.
    ///
    /// # Errors
    /// The reasons against it.
    pub fn homed(&mut self) -> Result<(), Reasons> {
        self.may_home()?;
        self.positions_known = true;
        self.state = State::Calibrated;
        Ok(())
    }

    fn may_home(&self) -> Result<(), Reasons> {
        match self.state {
            State::Disarmed | State::Homing | State::Calibrated => Ok(()),
            State::Armed | State::Balancing => Err(Reasons::RUNNING),
            State::Fault => Err(Reasons::FAULT),
        }
    }

    /// Balance when upright, if nothing of `further` is against it.
    ///
    /// # Errors
    /// All reasons against it.
    pub fn arm(&mut self, further: Reasons) -> Result<(), Reasons> {
        self.against_arming().and(further).none()?;
        self.state = State::Armed;
        Ok(())
    }

    /// The reasons against arming that the state gives.
    pub fn against_arming(&self) -> Reasons {
        let unknown = Reasons::NOT_HOMED.when(!self.positions_known);
        unknown.and(match self.state {
            State::Disarmed | State::Homing | State::Calibrated => Reasons::NONE,
            State::Armed | State::Balancing => Reasons::RUNNING,
            State::Fault => Reasons::FAULT,
        })
    }

    /// The links have been upright and slow for long enough: balancing begins if armed.
    pub fn upright(&mut self) {
        if self.state == State::Armed {
            self.state = State::Balancing;
        }
    }

    /// What arming waits for has become impossible: no longer armed.
    pub fn lost(&mut self) {
        if self.state == State::Armed {
            self.state = State::Calibrated;
        }
    }

    /// Forgets the cause, unless one of `still` holds on.
    ///
    /// # Errors
    /// `still`.
    pub fn clear(&mut self, still: Reasons) -> Result<(), Reasons> {
        if self.state == State::Fault {
            still.none()?;
            self.state = if self.positions_known { State::Calibrated } else { State::Disarmed };
        }
        self.cause = None;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use State::*;
    use std::vec::Vec;

    const STATES: [State; 6] = [Disarmed, Homing, Calibrated, Armed, Balancing, Fault];

    #[derive(Debug, Clone, Copy)]
    enum Event {
        Trip,
        TripEncoder,
        Disarm,
        BeginHoming,
        Homed,
        Arm,
        ArmAgainst,
        Upright,
        Lost,
        Clear,
        ClearAgainst,
    }

    fn cause(fault: super::Fault) -> Cause {
        Cause { fault, tick: 7, sensor: None }
    }

    fn supervisor(state: State, positions_known: bool) -> Supervisor {
        let cause = (state == Fault).then(|| cause(super::Fault::Angle));
        Supervisor { state, positions_known, cause }
    }

    /// Does it, and whether it was accepted.
    fn apply(supervisor: &mut Supervisor, event: Event) -> Result<(), Reasons> {
        match event {
            Event::Trip => supervisor.trip(cause(super::Fault::Rail)),
            Event::TripEncoder => supervisor.trip(cause(super::Fault::Encoder)),
            Event::Disarm => supervisor.disarm(),
            Event::BeginHoming => return supervisor.begin_homing(),
            Event::Homed => return supervisor.homed(),
            Event::Arm => return supervisor.arm(Reasons::NONE),
            Event::ArmAgainst => return supervisor.arm(Reasons::TILTED),
            Event::Upright => supervisor.upright(),
            Event::Lost => supervisor.lost(),
            Event::Clear => return supervisor.clear(Reasons::NONE),
            Event::ClearAgainst => return supervisor.clear(Reasons::EMERGENCY_STOP),
        }
        Ok(())
    }

    #[test]
    fn every_event_in_every_state_leads_where_the_table_says() {
        use Event::*;
        let known = [Calibrated, Armed, Balancing];
        // One row per event: the state it leads to from each of STATES, and where it is refused.
        let table: [(Event, [State; 6], &[State]); 11] = [
            (Trip, [Fault; 6], &[]),
            (TripEncoder, [Fault; 6], &[]),
            (Disarm, [Disarmed, Disarmed, Calibrated, Calibrated, Calibrated, Fault], &[]),
            (BeginHoming, [Homing, Homing, Homing, Armed, Balancing, Fault], &[Armed, Balancing, Fault]),
            (
                Homed,
                [Calibrated, Calibrated, Calibrated, Armed, Balancing, Fault],
                &[Armed, Balancing, Fault],
            ),
            (
                Arm,
                [Disarmed, Homing, Armed, Armed, Balancing, Fault],
                &[Disarmed, Homing, Armed, Balancing, Fault],
            ),
            (ArmAgainst, STATES, &STATES),
            (Upright, [Disarmed, Homing, Calibrated, Balancing, Balancing, Fault], &[]),
            (Lost, [Disarmed, Homing, Calibrated, Calibrated, Balancing, Fault], &[]),
            (Clear, [Disarmed, Homing, Calibrated, Armed, Balancing, Disarmed], &[]),
            (ClearAgainst, STATES, &[Fault]),
        ];
        for (event, leads_to, refused_in) in table {
            for (from, to) in STATES.into_iter().zip(leads_to) {
                let mut supervisor = supervisor(from, known.contains(&from));
                let outcome = apply(&mut supervisor, event);
                assert_eq!(supervisor.state(), to, "{event:?} in {from:?}");
                assert_eq!(
                    outcome.is_err(),
                    refused_in.contains(&from),
                    "{event:?} in {from:?}: {outcome:?}"
                );
            }
        }
    }

    #[test]
    fn the_first_cause_stays_until_it_is_cleared() {
        let mut supervisor = supervisor(Balancing, true);
        supervisor.trip(Cause { fault: super::Fault::Angle, tick: 3, sensor: None });
        supervisor.trip(Cause { fault: super::Fault::Rail, tick: 4, sensor: None });
        assert_eq!(supervisor.cause().map(|cause| (cause.fault, cause.tick)), Some((super::Fault::Angle, 3)));
        assert_eq!(supervisor.clear(Reasons::EMERGENCY_STOP), Err(Reasons::EMERGENCY_STOP));
        assert_eq!(supervisor.fault(), Some(super::Fault::Angle));
        supervisor.clear(Reasons::NONE).unwrap();
        assert_eq!((supervisor.state(), supervisor.cause()), (Calibrated, None));
    }

    #[test]
    fn a_fault_of_an_encoder_or_while_homing_loses_the_positions() {
        for (state, fault, left) in [
            (Balancing, super::Fault::Encoder, Disarmed),
            (Balancing, super::Fault::Frozen, Disarmed),
            (Balancing, super::Fault::Angle, Calibrated),
            (Homing, super::Fault::EmergencyStop, Disarmed),
        ] {
            let mut supervisor = supervisor(state, true);
            supervisor.trip(cause(fault));
            supervisor.clear(Reasons::NONE).unwrap();
            assert_eq!(supervisor.state(), left, "{fault:?} in {state:?}");
        }
    }

    #[test]
    fn all_reasons_against_arming_are_given_at_once() {
        let mut supervisor = supervisor(Fault, false);
        let reasons = supervisor.arm(Reasons::TILTED.and(Reasons::SIGNS)).unwrap_err();
        let wanted = [Reasons::FAULT, Reasons::NOT_HOMED, Reasons::TILTED, Reasons::SIGNS];
        assert_eq!(reasons, wanted.into_iter().fold(Reasons::NONE, Reasons::and));
    }

    #[test]
    fn a_reset_by_the_watchdog_starts_disarmed_and_keeps_the_reason() {
        let mut supervisor = Supervisor::new(Some(cause(super::Fault::Watchdog)));
        assert_eq!(supervisor.state(), Disarmed);
        assert_eq!(supervisor.cause().map(|cause| cause.fault), Some(super::Fault::Watchdog));
        supervisor.homed().unwrap();
        assert!(supervisor.cause().is_some(), "homing does not forget it");
        let events: Vec<_> = [Event::Upright, Event::Lost, Event::Disarm].to_vec();
        for event in events {
            apply(&mut supervisor, event).unwrap();
            assert_eq!(supervisor.state(), Calibrated);
        }
    }
}
