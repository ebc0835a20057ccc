//! The whole firmware, tick by tick: inputs → supervisor → controller → output, then commands and telemetry.
//!
//! This module combines all the others. [`Firmware`] knows neither registers nor frames; [`control_task`] connects it
//! to a board and to the serial link.
//!
//! ```
//! # mod gains { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/gains.rs")); }
//! use gains::{SENSORS, SWING_UP, TABLE};
//! use upright::board::{Contacts, Inputs};
//! use upright::control::encoder::CounterWidth;
//! use upright::firmware::Firmware;
//! use upright::protocol::message::Reset;
//! use upright::supervision::fault::Fault;
//! use upright::supervision::supervisor::State;
//!
//! let mut firmware = Firmware::new(&TABLE, &SWING_UP, [CounterWidth::Bits32; SENSORS], Reset::Power);
//! let contacts = Contacts { emergency_stop: true, ..Contacts::default() };
//! let output = firmware.control(&Inputs { raw_counts: [0; SENSORS], supply_v: 24.0, contacts });
//! assert_eq!((output.enable, firmware.state()), (false, State::Fault));
//! assert_eq!(firmware.cause().map(|cause| cause.fault), Some(Fault::EmergencyStop));
//! ```
//!
//! The answer to a new request goes into `commands.rs`, a new condition on arming
//! into `posture.rs`, a new field of telemetry into `telemetry.rs`.

mod bad_samples;
mod balancing;
mod commands;
pub mod control_task;
#[cfg(feature = "image")]
#[cfg(feature = "image")]
pub mod hot_path;
mod idle_drive;
mod jog;
mod posture;
mod shake;
mod still;
mod swing_up;
mod telemetry;
mod tick_log;

use crate::board::{Contacts, Inputs, Output};
use crate::control::controller::Controller;
use crate::control::encoder::CounterWidth;
use crate::control::motion::Playback;
use crate::protocol::message::{Command, Reply, Start, Statistics, Telemetry};
use crate::protocol::telemetry_ticks;
use crate::protocol::tick_log::TickLog;
use crate::supervision::calibration::Calibration;
use crate::supervision::debounce::{Debounce, OVERRUNS};
use crate::supervision::detection::Detection;
use crate::supervision::fault::{Cause, Fault};
use crate::supervision::homing::WrongTravel;
use crate::supervision::inhibits::Inhibits;
use crate::supervision::jog::{Jog, MotorSign};
use crate::supervision::shaking::Shaker;
use crate::supervision::slow_drive::SlowDrive;
use crate::supervision::stilling::Stiller;
use crate::supervision::supervisor::{State, Supervisor};
use crate::table::{ChecksumScan, Equilibrium, GainTable, NoSwingUp, SwingUp};

/// Controller and supervisor of one rig, with its swing-up, if it has one.
///
/// A tick has two halves: [`control`](Self::control) computes the output, with which the motor has to be driven at
/// once; [`finish`](Self::finish) does everything else and only has to end before the next tick is due.
#[derive(Debug, Clone)]
pub struct Firmware<'t, const NX: usize, const NY: usize, S = NoSwingUp> {
    controller: Controller<'t, NX, NY>,
    supervisor: Supervisor,
    calibration: Calibration<NY>,
    jog: Jog,
    detection: Detection<NY>,
    debounce: Debounce,
    checksum_scan: ChecksumScan<'t>,
    swing_up_scan: ChecksumScan<'t>,
    /// See [`Board::CHECKS_TABLES`](crate::board::Board::CHECKS_TABLES).
    board_checks_tables: bool,
    /// Whether table and image were sound at the start.
    is_usable: bool,
    /// Whether the whole table has been found intact since arming.
    is_checked: bool,
    table: &'t GainTable<NX, NY>,
    swing_up: &'t S,
    /// The motion that is being followed; while the rig holds, the last one.
    moving: Option<Playback<'t, NX, NY>>,
    /// The equilibrium at which that motion ends, or has ended.
    goal: Equilibrium,
    raw_counts: [u32; NY],
    contacts: Contacts,
    supply_v: f32,
    /// Whether the host has commanded a set-point since the last fault or disarm command.
    setpoint_commanded: bool,
    /// Ticks for which arming stays refused after it was refused because of a fault: see [`Inhibits::HELD`].
    ///
    /// [`Inhibits::HELD`]: crate::supervision::inhibits::Inhibits::HELD
    rearm_lockout_ticks: u32,
    /// Id of the last command that cleared a fault.
    last_clear_id: u64,
    tick: u32,
    output: Output,
    requested_n: f32,
    applied_n: f32,
    cycles: u32,
    worst_cycles: u32,
    /// Ticks in a row that were late, whether the motor is on or off.
    late_ticks: u32,
    statistics: Statistics,
    start: Start,
    /// Telemetry is sent every n ticks; 0: never.
    telemetry_period_ticks: u16,
    ticks_to_telemetry: u16,
    /// The tick of the board's timer (s).
    timer_tick_s: f32,
    shaker: Shaker<NY>,
    stiller: Stiller<NY>,
    /// A drive with pulses, while no control law commands it.
    slow_drive: SlowDrive,
    /// Whether a control law has commanded it since.
    is_controlled: bool,
    /// Motor voltage of the previous tick, while the rig is shaken or stilled (V).
    last_volts: f32,
    /// Logged ticks that are not yet sent; `None` while no log is kept.
    log: Option<TickLog<NY>>,
}

/// Number of words of the table that are checked per tick while armed, when the whole table has to be read before the
/// motor comes on. In other states it is one, or none if the board checks the tables.
const WORDS_PER_ARMED_TICK: u32 = 8;

/// A timer counts whole cycles, so its tick may differ from the table's by this share.
const TICK_TOLERANCE: f32 = 1e-3;

impl<'t, const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'t, NX, NY, S> {
    /// The firmware, motor off. `start` is what the board knows about its start: a [`Start`], or just a
    /// [`Reset`](crate::protocol::message::Reset). Without swing-up, `swing_up` is [`NoSwingUp`].
    ///
    /// There is a firmware for every table: if one is damaged, [`Fault::Table`] is latched, cannot be cleared, and is
    /// reported to the host. To know before, call [`GainTable::check`] and [`SwingUp::check`].
    // Returns no `Result`, which would put a copy of the firmware on the stack.
    #[inline(never)]
    pub fn new(
        table: &'t GainTable<NX, NY>,
        swing_up: &'t S,
        widths: [CounterWidth; NY],
        start: impl Into<Start>,
    ) -> Self {
        let start = start.into();
        let are_sound = swing_up.check(table).is_ok() && table.check().is_ok();
        let (controller, is_usable) = match Controller::with_checked(table, widths) {
            Ok(controller) if are_sound => (controller, true),
            _ => (Controller::unusable(table, widths), false),
        };
        let at_start = |fault| Cause { fault, tick: 0, sensor: None };
        let mut supervisor = Supervisor::new(start.reset.fault().map(at_start));
        if !is_usable {
            supervisor.trip(at_start(Fault::Table));
        }
        // It is not changed after this expression: that would make a copy, which needs a quarter of the board's stack.
        Self {
            controller,
            supervisor,
            calibration: Calibration::new(&table.sensors),
            jog: Jog::new(table.witness_sign_counts()),
            detection: Detection::of_motor(table.drive.witness()),
            debounce: Debounce::default(),
            checksum_scan: ChecksumScan::default(),
            swing_up_scan: ChecksumScan::default(),
            board_checks_tables: false,
            is_usable,
            is_checked: false,
            table,
            swing_up,
            moving: None,
            goal: Equilibrium::UPRIGHT,
            raw_counts: [0; NY],
            contacts: Contacts::default(),
            supply_v: 0.0,
            setpoint_commanded: false,
            rearm_lockout_ticks: 0,
            last_clear_id: 0,
            tick: 0,
            output: Output::OFF,
            requested_n: 0.0,
            applied_n: 0.0,
            cycles: 0,
            worst_cycles: 0,
            late_ticks: 0,
            statistics: Statistics::default(),
            start,
            telemetry_period_ticks: telemetry_ticks(table.tick_s),
            ticks_to_telemetry: 0,
            timer_tick_s: table.tick_s,
            shaker: Shaker::default(),
            stiller: Stiller::default(),
            slow_drive: SlowDrive::default(),
            is_controlled: false,
            last_volts: 0.0,
            log: None,
        }
    }

    /// Takes the tick of the board's timer (s), and whether the board gives pulses. If the tick is not the table's, or
    /// pulses are missing, [`Fault::Table`] is latched, cannot be cleared, and
    /// [`Info::tick_s`](crate::protocol::message::Info::tick_s) is that of the timer.
    pub(crate) fn compare_board(&mut self, timer_tick_s: f32, gives_pulses: bool) {
        let difference = f32::abs(timer_tick_s - self.table.tick_s);
        let lacks_pulses = self.table.drive.pulses().is_some() && !gives_pulses;
        if lacks_pulses || difference.is_nan() || difference > TICK_TOLERANCE * self.table.tick_s {
            (self.timer_tick_s, self.is_usable) = (timer_tick_s, false);
            self.trip(Fault::Table, None);
        }
    }

    /// Takes whether the board checks the tables, and whether its image is damaged: [`Fault::Image`], never cleared.
    #[inline]
    pub(crate) fn compare_memory(&mut self, checks_tables: bool, image_is_damaged: bool) {
        self.board_checks_tables = checks_tables;
        if image_is_damaged {
            self.is_usable = false;
            self.trip(Fault::Image, None);
        }
    }

    /// Whether so many ticks in a row were late, by [`Contacts::overrun`], that the watchdog must not be fed.
    #[inline]
    pub(crate) fn is_late(&self) -> bool {
        self.late_ticks >= OVERRUNS
    }

    /// The controller, read-only.
    pub fn controller(&self) -> &Controller<'t, NX, NY> {
        &self.controller
    }

    /// State of the supervisor.
    pub fn state(&self) -> State {
        self.supervisor.state()
    }

    /// The first cause of the latched fault, or of the reset before the start.
    pub fn cause(&self) -> Option<Cause> {
        self.supervisor.cause()
    }

    /// Progress of homing and sign check.
    pub fn calibration(&self) -> &Calibration<NY> {
        &self.calibration
    }

    /// What is known about the motor's sign.
    pub fn motor_sign(&self) -> MotorSign {
        self.jog.sign()
    }

    /// The counters of events; those of the serial link are 0 here.
    pub fn statistics(&self) -> Statistics {
        Statistics { rejected_samples: self.detection.rejected(), ..self.statistics }
    }

    /// First half of a tick: from inputs to output.
    pub fn control(&mut self, inputs: &Inputs<NY>) -> Output {
        self.accept(inputs);
        *self.act(inputs)
    }

    /// The first part of [`control`](Self::control): checks the contacts that turn the motor off, and does all of a
    /// tick in states without the control law.
    pub fn accept(&mut self, inputs: &Inputs<NY>) {
        (self.raw_counts, self.contacts, self.supply_v) =
            (inputs.raw_counts, inputs.contacts, inputs.supply_v);
        self.statistics.overruns =
            self.statistics.overruns.saturating_add(u32::from(inputs.contacts.overrun));
        if inputs.contacts.clock_fault {
            self.trip(Fault::Clock, None);
        } else if inputs.contacts.board_fault {
            self.trip(Fault::Board, None);
        } else if inputs.contacts.emergency_stop {
            self.trip(Fault::EmergencyStop, None);
        } else if inputs.contacts.driver_fault {
            self.trip(Fault::Driver, None);
        }
        match self.supervisor.state() {
            State::Jogging => self.push_cart(inputs),
            State::Identifying => self.shake(inputs),
            State::Stilling => self.still(inputs),
            state if !state.motor_is_on() => self.tick_motor_off(),
            _ => {}
        }
    }

    /// The second part of [`control`](Self::control): the output, from the control law or a planned motion while one
    /// of them commands the motor.
    pub fn act(&mut self, inputs: &Inputs<NY>) -> &Output {
        self.output = match self.supervisor.state() {
            State::Balancing => self.balance(inputs),
            State::Jogging => self.output,
            State::Identifying | State::Stilling => self.output,
            State::Raising | State::Holding | State::Lowering if S::IS_POSSIBLE => self.move_links(inputs),
            _ => Output::OFF,
        };
        if !self.output.enable {
            (self.requested_n, self.applied_n) = (0.0, 0.0);
            self.controller.stop();
            if let Some(steps) = self.table.drive.pulses() {
                self.output = self.idle(steps);
            }
        }
        &self.output
    }

    /// Takes and returns the counts of a tick without the control law.
    fn follow(&mut self) -> [i32; NY] {
        self.controller.follow(&self.raw_counts);
        let counts = *self.controller.encoders().counts();
        self.calibration.update(&counts, &self.table.sensors);
        counts
    }

    /// A tick with the motor off: homing, sign check, and waiting for the links to be upright.
    fn tick_motor_off(&mut self) {
        let counts = self.follow();
        let GainTable { limits, sensors, tick_s, .. } = self.table;
        // Not while armed, when the same tick may go on with the control law.
        if self.table.observer.is_some() && self.supervisor.state() != State::Armed {
            self.calibration.update_swinging(&counts, sensors, *tick_s);
        }
        self.jog.wait();
        self.rearm_lockout_ticks = self.rearm_lockout_ticks.saturating_sub(1);
        match self.supervisor.state() {
            State::Homing => self.home_by_switches(&counts),
            State::Calibrated => self.calibration.update_sign_check(&counts, sensors, limits),
            State::Armed => self.tick_armed(&counts),
            State::Disarmed
            | State::Jogging
            | State::Raising
            | State::Balancing
            | State::Holding
            | State::Lowering
            | State::Identifying
            | State::Stilling
            | State::Fault => {}
        }
    }

    /// Second half of a tick: telemetry if it is due, the prediction for the next tick, and the reply to `command`, if
    /// one has arrived. `cycles` is the execution time of the previous tick (processor cycles).
    pub fn finish(
        &mut self,
        command: Option<&Command>,
        cycles: u32,
    ) -> (Option<Telemetry<NX, NY>>, Option<Reply>) {
        let telemetry = self.report(cycles);
        self.predict();
        (telemetry, self.complete(command))
    }

    /// The first part of [`finish`](Self::finish): telemetry, if it is due.
    pub fn report(&mut self, cycles: u32) -> Option<Telemetry<NX, NY>> {
        self.cycles = cycles;
        self.statistics.ticks = self.statistics.ticks.wrapping_add(1);
        self.worst_cycles = self.worst_cycles.max(cycles);
        self.late_ticks = if self.contacts.overrun { self.late_ticks.saturating_add(1) } else { 0 };
        let telemetry = self.telemetry_is_due().then(|| self.telemetry());
        self.count_to_telemetry();
        telemetry
    }

    /// The second part of [`finish`](Self::finish): the prediction, while the controller commands the motor.
    pub fn predict(&mut self) {
        match self.supervisor.state() {
            State::Raising | State::Holding | State::Lowering if S::IS_POSSIBLE => self.predict_motion(),
            state if state.controls() => self.predict_balancing(),
            _ => {}
        }
    }

    /// The last part of [`finish`](Self::finish): checks of link and table, and the reply.
    pub fn complete(&mut self, command: Option<&Command>) -> Option<Reply> {
        if self.supervisor.state().controls()
            && let Some(fault) =
                self.debounce.check_link(&self.table.limits, command.is_some(), self.setpoint_commanded)
        {
            self.trip(fault, None);
        }
        let words = match self.supervisor.state() {
            State::Armed => WORDS_PER_ARMED_TICK,
            _ => u32::from(!self.board_checks_tables),
        };
        match self.checksum_scan.next_words(self.table, words) {
            Some(crc) if crc != self.table.crc => self.trip(Fault::Table, None),
            Some(_) => self.is_checked = true,
            None => {}
        }
        if S::IS_POSSIBLE
            && !self.board_checks_tables
            && self.swing_up.scan(&mut self.swing_up_scan) == Some(false)
        {
            self.trip(Fault::Table, None);
        }
        let reply = command.map(|command| Reply { id: command.id, answer: self.answer(command) });
        self.tick = self.tick.wrapping_add(1);
        reply
    }

    /// Latches a fault; after a fall, the motor goes on to still the links where the table allows it.
    #[cold]
    fn trip(&mut self, fault: Fault, sensor: Option<u8>) {
        if self.supervisor.state() != State::Fault {
            if fault.loses_positions() {
                self.calibration.invalidate(&self.table.sensors);
            }
            if fault.doubts_motor() {
                self.jog.forget(self.table.witness_sign_counts());
            }
        }
        self.calibration.cancel();
        self.setpoint_commanded = false;
        let cause = Cause { fault, tick: self.tick, sensor };
        if !self.stills_after(cause) {
            self.supervisor.trip(cause);
            self.let_go();
        }
    }

    /// A tick of homing by the limit switches.
    #[inline(never)]
    fn home_by_switches(&mut self, counts: &[i32; NY]) {
        let GainTable { limits, sensors, .. } = self.table;
        let found = self.calibration.update_rail_homing(counts, &self.contacts, sensors, limits);
        match found.and_then(|position| Ok((position, self.drive_to_switches(counts)?))) {
            // Tried again in the next tick, until the links hang where their sensors' zeros say.
            Ok((Some(position), true)) => {
                if self.home(&position).is_err() {
                    self.calibration.set_other_zero();
                }
            }
            Ok(_) => {}
            Err(WrongTravel) => {
                self.supervisor.disarm();
                self.let_go();
            }
        }
    }

    /// Homes with the sensors at `position`, or, if they are absolute, where their own zeros say.
    fn home(&mut self, position: &[i32; NY]) -> Result<(), Inhibits> {
        self.supervisor.check_homing_allowed()?;
        let mut position = *position;
        for ((position, &raw), sensor) in position.iter_mut().zip(&self.raw_counts).zip(&self.table.sensors) {
            *position = sensor.home_position(*position, raw).ok_or(Inhibits::OTHER_ZERO)?;
        }
        self.supervisor.complete_homing()?;
        self.controller.encoders_mut().home(&self.raw_counts, &position);
        self.calibration.set_homed();
        self.slow_drive.want(0.0);
        Ok(())
    }
}

#[cfg(test)]
mod tests;
