//! The state machine that decides whether the motor may run.

use crate::supervision::fault::{Cause, Fault};
use crate::supervision::inhibits::Inhibits;
pub use crate::supervision::state::State;

/// The state machine, with the first cause of a fault. Each method is an event.
///
/// ```text
/// Disarmed ─ start_homing ─► Homing ─ complete_homing ─► Calibrated ─ arm ─► Armed ─ start_balancing ─► Balancing
///     └───────────────────── complete_homing ────────────────►│  │◄──────────────┘                        ▲  │  │
///                                                             │  │  disarm, cancel_arming                 │  │  │
///                                                             │  └─ raise ─► Raising ── finish_motion ────┘  │  │
///                                                             │◄─ finish_motion ── Lowering ◄────── lower ───┘  │
///                                                             │  Raising ── finish_motion ─► Holding ─ lower ─► Lowering
///                                                             │  Balancing, Holding ─ move_on ─► Raising        │
///                                                             │◄──────── disarm while the motor is on ──────────┘
///                                                             ├◄─ disarm ── Jogging ◄─ start_jogging ── Calibrated
///                                                             └◄─ disarm ── Identifying ◄─ start_identifying ── Calibrated
///  Calibrated ─ start_stilling ─► Stilling ─ disarm ─► Calibrated
/// Raising, Balancing, Holding, Lowering ─ fall ─► Stilling
/// any state ─ trip ─► Fault ─ clear ─► Calibrated, or Disarmed if positions are not known
/// ```
#[derive(Debug, Clone, Default)]
pub struct Supervisor {
    state: State,
    positions_known: bool,
    cause: Option<Cause>,
}

impl Supervisor {
    /// The state after a reset: disarmed, with the cause of the reset, if it was a fault.
    pub fn new(cause: Option<Cause>) -> Self {
        Self { cause, ..Self::default() }
    }

    /// The current state.
    pub fn state(&self) -> State {
        self.state
    }

    /// The latched fault, or the one from which the rig has fallen while its links are stilled; none in other states.
    pub fn fault(&self) -> Option<Fault> {
        let is_shown = |cause: &Cause| match self.state {
            State::Fault => true,
            State::Stilling => cause.fault.is_fall(),
            _ => false,
        };
        self.cause.filter(is_shown).map(|cause| cause.fault)
    }

    /// The first cause of the latched fault, of the last fall, or of the reset before the start; none once it is
    /// cleared.
    pub fn cause(&self) -> Option<Cause> {
        self.cause
    }

    /// Latches `cause` unless a fault is latched already: the first cause stays. Faults of the same tick are tripped
    /// in the order of [`Fault::PRECEDENCE`].
    #[inline(never)]
    pub fn trip(&mut self, cause: Cause) {
        if self.state == State::Fault {
            return;
        }
        self.positions_known &= !cause.fault.loses_positions() && self.state != State::Homing;
        // A fall of this tick came first; one before is no longer why the motor is off.
        let falls_now = |fall: &Cause| self.state == State::Stilling && fall.tick == cause.tick;
        self.cause = self.cause.filter(falls_now).or(Some(cause));
        self.state = State::Fault;
    }

    /// The rig has fallen: its links are stilled instead of the motor going off. `cause` stays known afterwards.
    #[inline(never)]
    pub fn fall(&mut self, cause: Cause) {
        if self.state.controls() {
            self.cause = Some(cause);
            self.state = State::Stilling;
        }
    }

    /// Positions are not known any more.
    pub fn lose_positions(&mut self) {
        self.positions_known = false;
        if self.state == State::Calibrated {
            self.state = State::Disarmed;
        }
    }

    /// Turns the motor off; ends homing.
    pub fn disarm(&mut self) {
        match self.state {
            State::Jogging
            | State::Armed
            | State::Raising
            | State::Balancing
            | State::Holding
            | State::Lowering => self.state = State::Calibrated,
            State::Identifying | State::Stilling => self.state = State::Calibrated,
            State::Homing => self.state = State::Disarmed,
            State::Disarmed | State::Calibrated | State::Fault => {}
        }
    }

    /// Starts homing by the limit switches; positions known before are forgotten.
    ///
    /// # Errors
    /// The inhibits that hold.
    pub fn start_homing(&mut self) -> Result<(), Inhibits> {
        self.check_homing_allowed()?;
        self.positions_known = false;
        self.state = State::Homing;
        Ok(())
    }

    /// Ends homing: positions are known from now on.
    ///
    /// # Errors
    /// The inhibits that hold.
    pub fn complete_homing(&mut self) -> Result<(), Inhibits> {
        self.check_homing_allowed()?;
        self.positions_known = true;
        self.state = State::Calibrated;
        Ok(())
    }

    /// Whether homing is allowed.
    ///
    /// # Errors
    /// The inhibits that hold.
    pub fn check_homing_allowed(&self) -> Result<(), Inhibits> {
        match self.state {
            State::Disarmed | State::Homing | State::Calibrated => Ok(()),
            State::Jogging
            | State::Armed
            | State::Raising
            | State::Balancing
            | State::Holding
            | State::Lowering => Err(Inhibits::RUNNING),
            State::Identifying | State::Stilling => Err(Inhibits::RUNNING),
            State::Fault => Err(Inhibits::FAULT),
        }
    }

    /// Arms, unless the state or one of `other` inhibits it.
    ///
    /// # Errors
    /// All inhibits that hold.
    pub fn arm(&mut self, other: Inhibits) -> Result<(), Inhibits> {
        self.arming_inhibits().union(other).err_if_any()?;
        self.state = State::Armed;
        Ok(())
    }

    /// Inhibits of arming that follow from the state.
    pub fn arming_inhibits(&self) -> Inhibits {
        let unknown = Inhibits::NOT_HOMED.when(!self.positions_known);
        unknown.union(match self.state {
            State::Disarmed | State::Homing | State::Calibrated => Inhibits::NONE,
            State::Jogging | State::Identifying | State::Armed | State::Raising => Inhibits::RUNNING,
            State::Balancing | State::Holding | State::Lowering | State::Stilling => Inhibits::RUNNING,
            State::Fault => Inhibits::FAULT,
        })
    }

    /// Turns the motor on to push the cart a little, unless the state or one of `other` inhibits it.
    ///
    /// # Errors
    /// All inhibits that hold.
    pub fn start_jogging(&mut self, other: Inhibits) -> Result<(), Inhibits> {
        self.arming_inhibits().union(other).err_if_any()?;
        self.state = State::Jogging;
        Ok(())
    }

    /// Turns the motor on to shake the rig, unless the state or one of `other` inhibits it.
    ///
    /// # Errors
    /// All inhibits that hold.
    pub fn start_identifying(&mut self, other: Inhibits) -> Result<(), Inhibits> {
        self.arming_inhibits().union(other).err_if_any()?;
        self.state = State::Identifying;
        Ok(())
    }

    /// Turns the motor on to still the links, unless the state or one of `other` inhibits it. An earlier fall is no
    /// longer their cause.
    ///
    /// # Errors
    /// All inhibits that hold.
    pub fn start_stilling(&mut self, other: Inhibits) -> Result<(), Inhibits> {
        self.arming_inhibits().union(other).err_if_any()?;
        self.cause = self.cause.filter(|cause| !cause.fault.is_fall());
        self.state = State::Stilling;
        Ok(())
    }

    /// Turns the motor on if armed: the links have been upright and slow for long enough.
    pub fn start_balancing(&mut self) {
        if self.state == State::Armed {
            self.state = State::Balancing;
        }
    }

    /// Turns the motor on to raise the links, unless the state or one of `other` inhibits it.
    ///
    /// # Errors
    /// All inhibits that hold.
    pub fn raise(&mut self, other: Inhibits) -> Result<(), Inhibits> {
        self.arming_inhibits().union(other).err_if_any()?;
        self.state = State::Raising;
        Ok(())
    }

    /// Begins to lower the balanced links, unless one of `other` inhibits it.
    ///
    /// # Errors
    /// All inhibits that hold.
    pub fn lower(&mut self, other: Inhibits) -> Result<(), Inhibits> {
        self.leave(State::Lowering, other)
    }

    /// Begins to bring the balanced links to another equilibrium, unless one of `other` inhibits it.
    ///
    /// # Errors
    /// All inhibits that hold.
    pub fn move_on(&mut self, other: Inhibits) -> Result<(), Inhibits> {
        self.leave(State::Raising, other)
    }

    fn leave(&mut self, to: State, other: Inhibits) -> Result<(), Inhibits> {
        let balances = matches!(self.state, State::Balancing | State::Holding);
        Inhibits::NOT_BALANCING.when(!balances).union(other).err_if_any()?;
        self.state = to;
        Ok(())
    }

    /// A planned motion has reached its end: raised links are balanced, hanging ones need no motor.
    pub fn finish_motion(&mut self, is_upright: bool) {
        match self.state {
            State::Raising if is_upright => self.state = State::Balancing,
            State::Raising => self.state = State::Holding,
            State::Lowering => self.state = State::Calibrated,
            _ => {}
        }
    }

    /// Cancels arming, because the rig is no longer ready to balance: a link has fallen, a limit switch is pressed …
    pub fn cancel_arming(&mut self) {
        if self.state == State::Armed {
            self.state = State::Calibrated;
        }
    }

    /// Clears a latched fault and its cause, unless one of `inhibits` holds.
    ///
    /// # Errors
    /// `inhibits`, if a fault is latched and the set is not empty.
    pub fn clear(&mut self, inhibits: Inhibits) -> Result<(), Inhibits> {
        if self.state == State::Fault {
            inhibits.err_if_any()?;
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

    const STATES: [State; 12] = [
        Disarmed,
        Homing,
        Calibrated,
        Jogging,
        Identifying,
        Armed,
        Raising,
        Balancing,
        Holding,
        Lowering,
        Stilling,
        Fault,
    ];

    #[derive(Debug, Clone, Copy)]
    enum Event {
        Trip,
        TripEncoder,
        Fall,
        Disarm,
        StartHoming,
        CompleteHoming,
        StartJogging,
        StartJoggingInhibited,
        StartIdentifying,
        StartIdentifyingInhibited,
        StartStilling,
        StartStillingInhibited,
        Arm,
        ArmInhibited,
        StartBalancing,
        CancelArming,
        Raise,
        RaiseInhibited,
        Lower,
        LowerInhibited,
        MoveOn,
        MoveOnInhibited,
        FinishMotion,
        FinishMotionElsewhere,
        Clear,
        ClearInhibited,
    }

    fn cause(fault: super::Fault) -> Cause {
        Cause { fault, tick: 7, sensor: None }
    }

    fn supervisor(state: State, positions_known: bool) -> Supervisor {
        let cause = (state == Fault).then(|| cause(super::Fault::Angle));
        Supervisor { state, positions_known, cause }
    }

    /// Applies the event; an error if it is refused.
    fn apply(supervisor: &mut Supervisor, event: Event) -> Result<(), Inhibits> {
        match event {
            Event::Trip => supervisor.trip(cause(super::Fault::Rail)),
            Event::TripEncoder => supervisor.trip(cause(super::Fault::Encoder)),
            Event::Fall => supervisor.fall(cause(super::Fault::Angle)),
            Event::Disarm => supervisor.disarm(),
            Event::StartHoming => return supervisor.start_homing(),
            Event::CompleteHoming => return supervisor.complete_homing(),
            Event::StartJogging => return supervisor.start_jogging(Inhibits::NONE),
            Event::StartJoggingInhibited => return supervisor.start_jogging(Inhibits::MOVING),
            Event::StartIdentifying => return supervisor.start_identifying(Inhibits::NONE),
            Event::StartIdentifyingInhibited => return supervisor.start_identifying(Inhibits::MOTOR),
            Event::StartStilling => return supervisor.start_stilling(Inhibits::NONE),
            Event::StartStillingInhibited => return supervisor.start_stilling(Inhibits::NO_STILLING),
            Event::Arm => return supervisor.arm(Inhibits::NONE),
            Event::ArmInhibited => return supervisor.arm(Inhibits::TILTED),
            Event::StartBalancing => supervisor.start_balancing(),
            Event::CancelArming => supervisor.cancel_arming(),
            Event::Raise => return supervisor.raise(Inhibits::NONE),
            Event::RaiseInhibited => return supervisor.raise(Inhibits::NOT_HANGING),
            Event::Lower => return supervisor.lower(Inhibits::NONE),
            Event::LowerInhibited => return supervisor.lower(Inhibits::UNSETTLED),
            Event::MoveOn => return supervisor.move_on(Inhibits::NONE),
            Event::MoveOnInhibited => return supervisor.move_on(Inhibits::NO_ROOM),
            Event::FinishMotion => supervisor.finish_motion(true),
            Event::FinishMotionElsewhere => supervisor.finish_motion(false),
            Event::Clear => return supervisor.clear(Inhibits::NONE),
            Event::ClearInhibited => return supervisor.clear(Inhibits::EMERGENCY_STOP),
        }
        Ok(())
    }

    const RUNNING: [State; 9] =
        [Jogging, Identifying, Armed, Raising, Balancing, Holding, Lowering, Stilling, Fault];
    const NOT_CALIBRATED: [State; 11] = [
        Disarmed,
        Homing,
        Jogging,
        Identifying,
        Armed,
        Raising,
        Balancing,
        Holding,
        Lowering,
        Stilling,
        Fault,
    ];
    const NOT_BALANCING: [State; 10] =
        [Disarmed, Homing, Calibrated, Jogging, Identifying, Armed, Raising, Lowering, Stilling, Fault];

    /// One row per event: the state it leads to from each of STATES, and where it is refused.
    fn transitions() -> [(Event, [State; 12], &'static [State]); 26] {
        use Event::*;
        // Where an event leads to from each of STATES, if not to the same state.
        let but = |changes: &[(State, State)]| {
            STATES.map(|from| changes.iter().find(|(state, _)| *state == from).map_or(from, |(_, to)| *to))
        };
        [
            (Trip, [Fault; 12], &[]),
            (TripEncoder, [Fault; 12], &[]),
            (
                Fall,
                but(&[(Raising, Stilling), (Balancing, Stilling), (Holding, Stilling), (Lowering, Stilling)]),
                &[],
            ),
            (
                Disarm,
                but(&[
                    (Homing, Disarmed),
                    (Jogging, Calibrated),
                    (Identifying, Calibrated),
                    (Armed, Calibrated),
                    (Raising, Calibrated),
                    (Balancing, Calibrated),
                    (Holding, Calibrated),
                    (Lowering, Calibrated),
                    (Stilling, Calibrated),
                ]),
                &[],
            ),
            (StartHoming, but(&[(Disarmed, Homing), (Calibrated, Homing)]), &RUNNING),
            (CompleteHoming, but(&[(Disarmed, Calibrated), (Homing, Calibrated)]), &RUNNING),
            (StartJogging, but(&[(Calibrated, Jogging)]), &NOT_CALIBRATED),
            (StartJoggingInhibited, STATES, &STATES),
            (StartIdentifying, but(&[(Calibrated, Identifying)]), &NOT_CALIBRATED),
            (StartIdentifyingInhibited, STATES, &STATES),
            (StartStilling, but(&[(Calibrated, Stilling)]), &NOT_CALIBRATED),
            (StartStillingInhibited, STATES, &STATES),
            (Arm, but(&[(Calibrated, Armed)]), &NOT_CALIBRATED),
            (ArmInhibited, STATES, &STATES),
            (StartBalancing, but(&[(Armed, Balancing)]), &[]),
            (CancelArming, but(&[(Armed, Calibrated)]), &[]),
            (Raise, but(&[(Calibrated, Raising)]), &NOT_CALIBRATED),
            (RaiseInhibited, STATES, &STATES),
            (Lower, but(&[(Balancing, Lowering), (Holding, Lowering)]), &NOT_BALANCING),
            (LowerInhibited, STATES, &STATES),
            (MoveOn, but(&[(Balancing, Raising), (Holding, Raising)]), &NOT_BALANCING),
            (MoveOnInhibited, STATES, &STATES),
            (FinishMotion, but(&[(Raising, Balancing), (Lowering, Calibrated)]), &[]),
            (FinishMotionElsewhere, but(&[(Raising, Holding), (Lowering, Calibrated)]), &[]),
            (Clear, but(&[(Fault, Disarmed)]), &[]),
            (ClearInhibited, STATES, &[Fault]),
        ]
    }

    #[test]
    fn every_event_in_every_state_leads_where_the_table_says() {
        let known =
            [Calibrated, Jogging, Identifying, Armed, Raising, Balancing, Holding, Lowering, Stilling];
        for (event, leads_to, refused_in) in transitions() {
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
        assert_eq!(supervisor.clear(Inhibits::EMERGENCY_STOP), Err(Inhibits::EMERGENCY_STOP));
        assert_eq!(supervisor.fault(), Some(super::Fault::Angle));
        supervisor.clear(Inhibits::NONE).unwrap();
        assert_eq!((supervisor.state(), supervisor.cause()), (Calibrated, None));
    }

    #[test]
    fn a_fall_is_told_while_the_links_are_stilled_and_known_until_they_are_stilled_again() {
        let mut supervisor = supervisor(Balancing, true);
        supervisor.fall(cause(super::Fault::Angle));
        assert_eq!((supervisor.state(), supervisor.fault()), (Stilling, Some(super::Fault::Angle)));
        supervisor.disarm();
        assert_eq!((supervisor.state(), supervisor.fault()), (Calibrated, None));
        assert!(supervisor.cause().is_some());
        supervisor.start_stilling(Inhibits::NONE).unwrap();
        assert_eq!((supervisor.fault(), supervisor.cause()), (None, None));
        // What turns the motor off counts, not the fall before.
        supervisor.fall(cause(super::Fault::Rail));
        assert_eq!(supervisor.fault(), None, "it does not fall while it is stilled");
        supervisor.trip(Cause { fault: super::Fault::Driver, tick: 8, sensor: None });
        assert_eq!((supervisor.state(), supervisor.fault()), (Fault, Some(super::Fault::Driver)));
        let mut falling = Supervisor { state: Balancing, ..supervisor };
        falling.fall(cause(super::Fault::Angle));
        falling.trip(cause(super::Fault::Table));
        assert_eq!(
            (falling.state(), falling.fault()),
            (Fault, Some(super::Fault::Angle)),
            "in the same tick"
        );
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
            supervisor.clear(Inhibits::NONE).unwrap();
            assert_eq!(supervisor.state(), left, "{fault:?} in {state:?}");
        }
    }

    #[test]
    fn all_inhibits_of_arming_are_given_at_once() {
        let mut supervisor = supervisor(Fault, false);
        let inhibits = supervisor.arm(Inhibits::TILTED.union(Inhibits::SIGNS)).unwrap_err();
        let wanted = [Inhibits::FAULT, Inhibits::NOT_HOMED, Inhibits::TILTED, Inhibits::SIGNS];
        assert_eq!(inhibits, wanted.into_iter().fold(Inhibits::NONE, Inhibits::union));
    }

    #[test]
    fn a_reset_by_the_watchdog_starts_disarmed_and_keeps_the_cause() {
        let mut supervisor = Supervisor::new(Some(cause(super::Fault::Watchdog)));
        assert_eq!(supervisor.state(), Disarmed);
        assert_eq!(supervisor.cause().map(|cause| cause.fault), Some(super::Fault::Watchdog));
        supervisor.complete_homing().unwrap();
        assert!(supervisor.cause().is_some(), "homing does not forget it");
        let events: Vec<_> = [Event::StartBalancing, Event::CancelArming, Event::Disarm].to_vec();
        for event in events {
            apply(&mut supervisor, event).unwrap();
            assert_eq!(supervisor.state(), Calibrated);
        }
    }
}
