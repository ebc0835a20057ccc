//! One trial with a firmware: what is done, and what is observed.

use upright::board::Output;
use upright::protocol::KEEP_ALIVE;
use upright::protocol::message::{Answer, Request};
use upright::supervision::fault::Fault;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;
use upright_board::UNITS_PER_MICROSECOND;

use super::observed::Observed;
use super::on_board::OnChip;
use crate::in_the_loop::{Events, RunError, RunPlace, VirtualBoard};
use upright_closed_loop::defects::{Defect, Expected, Injection, Phase, Trial};
use upright_closed_loop::harness::{Harness, HarnessError, Pins, RailEnds, Session, Target, goals, healthy};
use upright_design::plant::absolute_angles;
use upright_design::rig::Rig;
use upright_design::simulate::Begin;
use upright_design::table::TableValues;
use upright_identify::Feed;

/// Settings of a campaign.
#[derive(Debug, Clone, Copy)]
pub struct Setup<'a> {
    /// The rig.
    pub rig: &'a Rig,
    /// Its gain table.
    pub table: &'a TableValues,
    /// Where the firmware runs; it is started again for each trial.
    pub place: RunPlace<'a>,
    /// Whether the firmware has its thresholds and limits. Without them it cannot detect most defects.
    pub detection: bool,
    /// Whether a board has its guards: watchdog, break input, MPU, registers that are read back.
    pub guards: bool,
    /// What the rig does when the defects begin.
    pub during: During<'a>,
}

/// What the rig does when the defects of a campaign begin.
#[derive(Debug, Clone, Copy)]
pub enum During<'a> {
    /// It balances; if the table has motions, it is raised or lowered.
    Balancing,
    /// A jog.
    Jog,
    /// It is shaken by these forces.
    Shaking(&'a Feed),
}

/// Longest time from a defect to its verdict (s).
const LONGEST_S: f64 = 6.0;
/// Ticks watched after the motor went off: the fault is known a tick later, and the motor has to stay off.
const TICKS_AFTER: usize = 12;
/// Longest such time on a board, which may have to restart first (s): without a crystal it waits for one.
const LONGEST_START_S: f64 = 0.8;
/// Factor for a firmware without limits while the rig is shaken: it takes angles for this many times smaller ones, and
/// needs this many times the impulse before it reports that something stands still.
const BLIND: f32 = 100.0;
/// A true angle that exceeds its limit by more than this share means that any detection comes too late.
pub(super) const BEYOND: f64 = 0.25;

/// Runs the trial, with its defect or, for comparison, without.
pub(super) fn attempt(setup: &Setup<'_>, trial: &Trial, with_defect: bool) -> Result<Observed, RunError> {
    let without_detection;
    let table = if setup.detection {
        setup.table
    } else {
        let mut blind = setup.table.clone().without_detection();
        match setup.during {
            During::Balancing => {}
            // Movement of the cart, or of the first link, that is needed to determine the motor's sign.
            During::Jog => {
                let sensor = blind.drive.witness();
                blind.limits.sign_counts[sensor] = 0;
            }
            During::Shaking(_) => blind_while_shaken(&mut blind),
        }
        without_detection = blind;
        &without_detection
    };
    let mut attempt =
        DefectRun { setup, rig: setup.rig, table: setup.table, trial, with_defect, board: None };
    let RunPlace::Board { image, conditions } = setup.place else {
        return setup.place.with_target(table, |target| Ok(attempt.run(target)?));
    };
    let conditions = trial.kind.conditions(trial, conditions);
    let broken = trial.kind.at_power_up(trial, setup.guards);
    let mut target = VirtualBoard::start_with(image, &conditions, table, &broken)?;
    attempt.board = Some(OnBoard { image, receive: conditions.wiring.receive, events: target.events() });
    let mut observed = attempt.run(&mut target)?;
    observed.stop_to_off_us = target.stop_to_off().map(|time| time as f64 / UNITS_PER_MICROSECOND as f64);
    Ok(observed)
}

/// Changes what the motor does, `since` ticks after the onset; returns whether the rig shows it by now.
pub(super) fn spoil(
    harness: &mut Harness<'_>,
    injection: &mut Injection<'_>,
    since: usize,
    acting: &mut Output,
) -> bool {
    if let Some(defect) = injection.step_defect(since) {
        harness.bench.spoil(defect);
    }
    injection.output(since, acting)
}

/// The limits of angles and rates while the rig is shaken are not in the table, so the angles per count are made
/// smaller.
fn blind_while_shaken(table: &mut TableValues) {
    table.limits.jog_force_n *= BLIND;
    if let Some(observer) = &mut table.observer {
        observer.step.iter_mut().skip(1).for_each(|step| *step /= BLIND);
    }
}

/// What is needed to inject defects that only a board has.
pub(super) struct OnBoard<'a> {
    image: &'a upright_board::Image,
    receive: upright_board::Pin,
    events: Events,
}

pub(super) struct DefectRun<'a> {
    pub(super) setup: &'a Setup<'a>,
    pub(super) rig: &'a Rig,
    pub(super) table: &'a TableValues,
    pub(super) trial: &'a Trial,
    pub(super) with_defect: bool,
    pub(super) board: Option<OnBoard<'a>>,
}

impl DefectRun<'_> {
    fn run(&self, target: &mut dyn Target) -> Result<Observed, HarnessError> {
        if self.trial.kind.begins_at_power_up() {
            return self.power_up(target);
        }
        if let During::Shaking(feed) = self.setup.during {
            return self.shake(feed, target);
        }
        let mut harness = Harness::new(self.rig, self.table, &self.trial.scenario, target)?;
        match self.trial.kind {
            _ if self.trial.phase == Phase::Jogging => self.jog(&mut harness),
            Defect::ArmUnhomed | Defect::ArmHanging | Defect::ArmStopped | Defect::ArmHeld => {
                self.arm(&mut harness)
            }
            _ => self.balance(&mut harness),
        }
    }

    fn balance(&self, harness: &mut Harness<'_>) -> Result<Observed, HarnessError> {
        let trial = self.trial;
        let mut observed = Observed::default();
        let mut injection = Injection::new(self.rig, self.table, trial.clone());
        let mut output = harness.raise(Some(0.0))?;
        let keep_alive = self.ticks(KEEP_ALIVE.as_secs_f64());
        let goals = goals(&self.trial.scenario, self.rig.tick.period_s);
        for tick in 0.. {
            if self.is_over(tick, &observed) {
                break;
            }
            let since = tick.checked_sub(trial.onset).filter(|_| self.with_defect);
            let mut is_visible = false;
            if tick > 0 {
                output = self.control(harness, &mut injection, since, &mut is_visible)?;
            }
            if harness.ask_for(tick, &goals) {
                // One command in a tick.
            } else if tick == 1 {
                harness.session.send(Request::Setpoint(trial.scenario.step_m as f32));
            } else if tick.is_multiple_of(keep_alive) && injection.host_is_alive(since) {
                harness.session.send(Request::KeepAlive);
            }
            if since == Some(0) {
                injection.serial(&mut harness.session);
                is_visible |= trial.kind == Defect::TableBit;
            }
            let is_on = self.is_on(&harness.session, &output);
            observed.output(tick, output, is_on, self.ticks_since_stop(&harness.session));
            if observed.off.is_some_and(|off| tick > off + TICKS_AFTER) {
                observed.fault = harness.session.fault();
            }
            let mut acting = output;
            is_visible |= since.is_some_and(|since| spoil(harness, &mut injection, since, &mut acting));
            if is_visible {
                observed.visible.get_or_insert(tick);
            }
            observed.outside |= observed.off.is_none()
                && self.is_outside(tick, harness.begun().first().copied(), harness.bench.state());
            let drive = if acting.enable { acting.drive } else { output.drive };
            self.push(harness, &injection, since);
            harness.bench.tick(drive);
        }
        observed.fault = harness.session.fault();
        self.find_reason(harness, &mut observed);
        if trial.kind != Defect::HostDeaf && observed.off.is_none() {
            let inputs = harness.inputs();
            if let Ok(Answer::Statistics(statistics)) = harness.session.ask(Request::Statistics, &inputs) {
                observed.rejected = statistics.rejected_samples;
            }
        }
        Ok(observed)
    }

    /// Whether the motor is on: a drive that takes pulses is, too, while it only holds the cart and while it brings it
    /// to rest after a fault, and then counts as off.
    fn is_on(&self, session: &Session<'_>, output: &Output) -> bool {
        output.enable && !self.stops(session)
    }

    /// Whether telemetry says that a drive with pulses has stopped following the control law.
    fn stops(&self, session: &Session<'_>) -> bool {
        self.table.drive.pulses().is_some() && !session.status().state.controls()
    }

    /// Number of ticks since it has stopped: a board has telemetry of some ticks only.
    fn ticks_since_stop(&self, session: &Session<'_>) -> usize {
        if self.stops(session) { session.ticks_since_fault().unwrap_or(1) } else { 0 }
    }

    /// Pushes the rig in the next tick, `since` ticks after the onset: by hand, or at the cart alone.
    fn push(&self, harness: &mut Harness<'_>, injection: &Injection<'_>, since: Option<usize>) {
        let (Some(since), Some(chain)) = (since, self.rig.chain()) else { return };
        let Some(push) = &self.trial.push else { return harness.bench.push(injection.push_n(since)) };
        let t = since as f64 * self.rig.tick.period_s;
        if let Some((force_n, torques_n_m)) = push.in_tick(t, chain, harness.bench.state()) {
            harness.bench.pull(force_n, &torques_n_m);
        }
    }

    /// Asks a board whose motor went off without a fault why it has restarted.
    pub(super) fn find_reason(&self, harness: &mut Harness<'_>, observed: &mut Observed) {
        if self.board.is_some() && observed.off.is_some() && observed.fault.is_none() {
            observed.fault = self.reason(harness);
        }
        observed.dead |= observed.fault == Some(Fault::Crash);
    }

    /// The fault that stands for the reason of a board's last reset, if any.
    fn reason(&self, harness: &mut Harness<'_>) -> Option<Fault> {
        let inputs = harness.inputs();
        match harness.session.ask(Request::Info, &inputs) {
            Ok(Answer::Info(info)) => info.reset.fault(),
            _ => None,
        }
    }

    /// One tick of the firmware, `since` ticks after the onset; sets `is_visible` if its inputs differ visibly.
    pub(super) fn control(
        &self,
        harness: &mut Harness<'_>,
        injection: &mut Injection<'_>,
        since: Option<usize>,
        is_visible: &mut bool,
    ) -> Result<Output, HarnessError> {
        let inputs = self.pins(harness, injection, since, is_visible)?;
        harness.session.tick(&inputs)
    }

    /// The firmware's inputs in this tick; also starts what begins in it.
    pub(super) fn pins(
        &self,
        harness: &mut Harness<'_>,
        injection: &mut Injection<'_>,
        since: Option<usize>,
        is_visible: &mut bool,
    ) -> Result<Pins, HarnessError> {
        let mut inputs = harness.inputs();
        let has_switches = match self.trial.phase {
            Phase::Jogging => true,
            Phase::Shaken => self.setup.detection,
            Phase::Balancing | Phase::Raising | Phase::Lowering => false,
        };
        if has_switches {
            // They alone keep the cart on its rail if its encoder is wrong.
            RailEnds::of(self.rig).press(harness.bench.state()[0], &mut inputs.contacts);
        }
        if let Some(since) = since {
            *is_visible |= injection.inputs(since, &mut inputs);
        }
        if since == Some(0) {
            if let Some(fault) = self.trial.kind.inside_the_microcontroller() {
                harness.session.injected_fault(fault);
            }
            if let Some(board) = &self.board {
                let events = self.trial.kind.events(self.trial, self.table, board.image, board.receive);
                board.events.borrow_mut().extend(events);
            }
            if self.trial.kind == Defect::HostDeaf {
                harness.session.stop_reading()?;
            }
        }
        Ok(inputs)
    }

    /// Whether nothing is left to be observed before `tick`.
    fn is_over(&self, tick: usize, observed: &Observed) -> bool {
        let trial = self.trial;
        // A motor that goes off when the rig hangs proves nothing.
        let may_wait = trial.phase != Phase::Lowering;
        let is_undecided =
            may_wait && matches!(trial.expected(), Expected::Off(_)) && observed.is_undecided();
        let last =
            trial.onset + if is_undecided { self.ticks(LONGEST_S).max(trial.watched) } else { trial.watched };
        // A board that restarts reports the reason as soon as it runs.
        let starts = self.board.is_some() && observed.fault.is_none();
        match observed.off {
            Some(off) => tick > off + self.ticks_after(starts) || (!starts && tick >= last),
            None => tick >= last,
        }
    }

    /// Ticks watched after the motor went off; more on a board that may have to restart first (`starts`).
    pub(super) fn ticks_after(&self, starts: bool) -> usize {
        if starts { self.ticks(LONGEST_START_S) } else { TICKS_AFTER }
    }

    pub(super) fn ticks(&self, seconds: f64) -> usize {
        (seconds / self.rig.tick.period_s).max(1.0) as usize
    }

    /// Whether a link is far beyond its limit in `tick`: from the vertical, or in a motion from its planned angle; or
    /// the cart is off its rail. The rig is lowered from the tick `lowered_from` on.
    fn is_outside(&self, tick: usize, lowered_from: Option<usize>, state: &[f64]) -> bool {
        if self.rig.chain().is_none() {
            return false;
        }
        if self.is_off_rail(state) {
            return true;
        }
        if let Some(planned) = self.planned(tick, lowered_from) {
            let allowed =
                self.table.swing_up.as_ref().map_or(f32::MAX, |swing_up| swing_up.limits.deviation_rad);
            let away = absolute_angles(state).zip(planned).map(|(angle, planned)| (angle - planned).abs());
            return away.fold(0.0, f64::max) > f64::from(allowed) * (1.0 + BEYOND);
        }
        let angle =
            f64::from(self.rig.limits.angle_rad.unwrap_or(f64::from(self.table.limits.angle_rad)) as f32);
        absolute_angles(state).any(|lean| lean.abs() > angle * (1.0 + BEYOND))
    }

    /// Whether the cart is off its rail.
    pub(super) fn is_off_rail(&self, state: &[f64]) -> bool {
        !RailEnds::of(self.rig).holds(state[0])
    }

    /// Planned angles of the links from the vertical in `tick` of a run with a motion (rad).
    fn planned(&self, tick: usize, lowered_from: Option<usize>) -> Option<Vec<f64>> {
        let swing_up = self.table.swing_up.as_ref()?;
        if self.trial.scenario.begin == Begin::ByHand {
            return None;
        }
        let (motion, begin) = match lowered_from {
            Some(begin) => (&swing_up.lower, begin),
            None => (&swing_up.raise, 0),
        };
        let state = motion.planned(self.table.states(), tick.saturating_sub(begin));
        Some(absolute_angles(&state).collect())
    }

    /// Runs a defect that is present at power-up: arming has to be refused.
    fn power_up(&self, target: &mut dyn Target) -> Result<Observed, HarnessError> {
        let mut observed = Observed::default();
        let mut session = Session::new(target);
        let supply_v = self.table.drive.supply_v().unwrap_or(24.0);
        let pins = healthy(&vec![0; self.table.sensors()], supply_v);
        match session.ask(Request::Arm, &pins) {
            Err(HarnessError::Refused { answer: Answer::NotNow(reasons), .. }) => {
                observed.refused = Some(reasons)
            }
            Err(error) => return Err(error),
            Ok(_) => (),
        }
        for _ in 0..4 * TICKS_AFTER {
            observed.on_again |= session.tick(&pins)?.enable;
        }
        observed.fault = session.fault();
        Ok(observed)
    }

    /// Homes the rig and checks its signs by hand; then the links hang.
    pub(super) fn until_checked(&self, harness: &mut Harness<'_>) -> Result<(), HarnessError> {
        for tick in 0.. {
            harness.by_hand(tick)?;
            // Without anything to check, the signs are known before the rig is homed.
            let status = harness.session.status();
            if status.signs == Signs::Checked && status.state == State::Calibrated {
                break;
            }
        }
        Ok(())
    }

    /// Runs a trial in which arming has to be refused.
    fn arm(&self, harness: &mut Harness<'_>) -> Result<Observed, HarnessError> {
        let mut observed = Observed::default();
        let mut stopped = false;
        if self.trial.kind != Defect::ArmUnhomed {
            self.until_checked(harness)?;
        }
        if matches!(self.trial.kind, Defect::ArmStopped | Defect::ArmHeld) {
            let mut inputs = harness.inputs();
            inputs.contacts.emergency_stop = true;
            let output = harness.session.tick(&inputs)?;
            observed.on_again |= self.is_on(&harness.session, &output);
            stopped = self.trial.kind == Defect::ArmStopped;
        }
        let mut inputs = harness.inputs();
        inputs.contacts.emergency_stop = stopped;
        let mut refusal = harness.session.ask(Request::Arm, &inputs);
        if self.trial.kind == Defect::ArmHeld {
            harness.session.ask(Request::Clear, &inputs)?;
            refusal = harness.session.ask(Request::Arm, &inputs);
        }
        match refusal {
            Err(HarnessError::Refused { answer: Answer::NotNow(reasons), .. }) => {
                observed.refused = Some(reasons)
            }
            Err(error) => return Err(error),
            Ok(_) => (),
        }
        for _ in 0..TICKS_AFTER {
            let output = harness.session.tick(&inputs)?;
            observed.on_again |= self.is_on(&harness.session, &output);
        }
        Ok(observed)
    }
}
