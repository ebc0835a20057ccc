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
use super::stilled::StilledRun;
use crate::in_the_loop::{Events, RunError, RunPlace, VirtualBoard};
use upright_closed_loop::defects::{Defect, Defective, Expected, Phase, Trial};
use upright_closed_loop::harness::{
    Flow, Goals, HarnessError, Participant, Pins, RailEnds, Session, Target, World, healthy, until,
};
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
                blind.sensors[sensor].sign_counts = 0;
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

/// The limits of angles and rates while the rig is shaken are not in the table, so the angles per count are made
/// smaller.
fn blind_while_shaken(table: &mut TableValues) {
    table.limits.jog_force_n *= BLIND;
    table.sensors.iter_mut().skip(1).for_each(|sensor| sensor.step /= BLIND);
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
        let mut world = World::new(self.rig, self.table, &self.trial.scenario, target)?;
        match self.trial.kind {
            _ if self.trial.phase == Phase::Jogging => self.jog(&mut world),
            Defect::ArmUnhomed | Defect::ArmHanging | Defect::ArmStopped | Defect::ArmHeld => {
                self.arm(&mut world)
            }
            _ => self.balance(&mut world),
        }
    }

    fn balance(&self, world: &mut World<'_>) -> Result<Observed, HarnessError> {
        let trial = self.trial;
        world.raise(Some(0.0))?;
        world.goals = Goals::of(self.rig, &trial.scenario);
        let mut balanced = BalancedRun {
            run: self,
            defect: self.defective(Some(trial.onset)),
            observed: Observed::default(),
            fault: None,
            stilled: StilledRun::of(self.rig, self.table),
        };
        world.run(usize::MAX, &mut [&mut balanced])?;
        let mut observed = balanced.observed;
        observed.fault = balanced.fault;
        self.find_reason(world, &mut observed);
        if trial.kind != Defect::HostDeaf && observed.off.is_none() {
            let inputs = world.inputs();
            if let Ok(Answer::Statistics(statistics)) = world.session.ask(Request::Statistics, &inputs) {
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

    /// The defect of the trial, if the run has one, which begins in the firmware's tick `onset`.
    pub(super) fn defective(&self, onset: Option<usize>) -> Defective<'_> {
        Defective::new(self.rig, self.table, self.trial.clone(), onset.filter(|_| self.with_defect))
    }

    /// Pushes the rig in the next tick: by hand, or at the cart alone.
    fn push(&self, world: &mut World<'_>, defect: &Defective<'_>) {
        let (Some(since), Some(chain)) = (defect.since(world.ticks()), self.rig.chain()) else { return };
        let Some(push) = &self.trial.push else { return world.bench.push(defect.push_n(world.ticks())) };
        let t = since as f64 * self.rig.tick.period_s;
        if let Some((force_n, torques_n_m)) = push.in_tick(t, chain, world.bench.state()) {
            world.bench.pull(force_n, &torques_n_m);
        }
    }

    /// Asks a board whose motor went off without a fault why it has restarted.
    pub(super) fn find_reason(&self, world: &mut World<'_>, observed: &mut Observed) {
        if self.board.is_some() && observed.off.is_some() && observed.fault.is_none() {
            observed.fault = self.reason(world);
        }
        observed.dead |= observed.fault == Some(Fault::Crash);
    }

    /// The fault that stands for the reason of a board's last reset, if any.
    fn reason(&self, world: &mut World<'_>) -> Option<Fault> {
        let inputs = world.inputs();
        match world.session.ask(Request::Info, &inputs) {
            Ok(Answer::Info(info)) => info.reset.fault(),
            _ => None,
        }
    }

    /// Changes what the firmware reads, and starts what begins in its next tick.
    pub(super) fn disturb(
        &self,
        world: &mut World<'_>,
        defect: &mut Defective<'_>,
        pins: &mut Pins,
    ) -> Result<(), HarnessError> {
        let has_switches = match self.trial.phase {
            Phase::Jogging => true,
            Phase::Shaken => self.setup.detection,
            Phase::Balancing | Phase::Raising | Phase::Lowering => false,
        };
        if has_switches {
            // They alone keep the cart on its rail if its encoder is wrong.
            RailEnds::of(self.rig).pins(world, pins)?;
        }
        defect.pins(world, pins)?;
        if let Some(board) = self.board.as_ref().filter(|_| defect.since(world.ticks() + 1) == Some(0)) {
            let events = self.trial.kind.events(self.trial, self.table, board.image, board.receive);
            board.events.borrow_mut().extend(events);
        }
        Ok(())
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
    pub(super) fn until_checked(&self, world: &mut World<'_>) -> Result<(), HarnessError> {
        // Without anything to check, the signs are known before the rig is homed.
        world.by_hand_until(|status| status.signs == Signs::Checked && status.state == State::Calibrated)
    }

    /// Runs a trial in which arming has to be refused.
    fn arm(&self, world: &mut World<'_>) -> Result<Observed, HarnessError> {
        let mut observed = Observed::default();
        let mut stopped = false;
        if self.trial.kind != Defect::ArmUnhomed {
            self.until_checked(world)?;
        }
        if matches!(self.trial.kind, Defect::ArmStopped | Defect::ArmHeld) {
            let mut inputs = world.inputs();
            inputs.contacts.emergency_stop = true;
            let output = world.session.tick(&inputs)?;
            observed.on_again |= self.is_on(&world.session, &output);
            stopped = self.trial.kind == Defect::ArmStopped;
        }
        let mut inputs = world.inputs();
        inputs.contacts.emergency_stop = stopped;
        let mut refusal = world.session.ask(Request::Arm, &inputs);
        if self.trial.kind == Defect::ArmHeld {
            world.session.ask(Request::Clear, &inputs)?;
            refusal = world.session.ask(Request::Arm, &inputs);
        }
        match refusal {
            Err(HarnessError::Refused { answer: Answer::NotNow(reasons), .. }) => {
                observed.refused = Some(reasons)
            }
            Err(error) => return Err(error),
            Ok(_) => (),
        }
        for _ in 0..TICKS_AFTER {
            let output = world.session.tick(&inputs)?;
            observed.on_again |= self.is_on(&world.session, &output);
        }
        Ok(observed)
    }
}

/// A rig that balances, or is raised or lowered, with a defect from the onset on.
struct BalancedRun<'r> {
    run: &'r DefectRun<'r>,
    defect: Defective<'r>,
    observed: Observed,
    fault: Option<Fault>,
    stilled: StilledRun,
}

impl Participant for BalancedRun<'_> {
    fn say(&mut self, world: &World<'_>) -> Option<Request> {
        let tick = world.ticks();
        if tick == 1 {
            return Some(Request::Setpoint(self.run.trial.scenario.step_m as f32));
        }
        let is_due = tick.is_multiple_of(self.run.ticks(KEEP_ALIVE.as_secs_f64()));
        (is_due && self.defect.host_is_alive(tick)).then_some(Request::KeepAlive)
    }

    fn act(&mut self, world: &mut World<'_>, output: &mut Output) -> Flow {
        let (run, tick) = (self.run, world.ticks());
        let is_on = run.is_on(&world.session, output);
        self.observed.output(tick, *output, is_on, run.ticks_since_stop(&world.session));
        // What ends the stilling after a fall is not the fault that was found.
        if !self.observed.stills {
            self.fault = world.session.fault();
        }
        if world.session.status().state == State::Stilling {
            self.observed.stills = true;
            let state = world.bench.state();
            self.observed.astray |= run.is_off_rail(state) || self.stilled.adds_energy(state, tick);
        }
        if self.observed.off.is_some_and(|off| tick > off + TICKS_AFTER) {
            self.observed.fault = self.fault;
        }
        let _ = self.defect.act(world, output)?;
        if self.defect.is_visible() {
            self.observed.visible.get_or_insert(tick);
        }
        let lowered_from = world.goals.begun().first().copied();
        self.observed.outside |=
            self.observed.off.is_none() && run.is_outside(tick, lowered_from, world.bench.state());
        run.push(world, &self.defect);
        until(false)
    }

    fn pins(&mut self, world: &mut World<'_>, pins: &mut Pins) -> Result<(), HarnessError> {
        self.run.disturb(world, &mut self.defect, pins)
    }

    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        // A board is not watched for so long.
        let is_stilled = self.run.board.is_none() && world.session.status().state == State::Stilling;
        until((!is_stilled || self.observed.astray) && self.run.is_over(world.ticks(), &self.observed))
    }
}
