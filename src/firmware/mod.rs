//! One tick of the firmware: inputs → supervisor → controller → output, then commands and telemetry.

mod commands;
pub mod control_task;
mod posture;

use heapless::Vec;

use crate::board::{Contacts, Inputs, Output};
use crate::control::actuator::Drive;
use crate::control::controller::Controller;
use crate::control::encoder::CounterWidth;
use crate::protocol::message::{Command, Message, Reset, Statistics, Telemetry};
use crate::supervision::calibration::Calibration;
use crate::supervision::detection::Detection;
use crate::supervision::envelope;
use crate::supervision::fault::{Cause, Fault};
use crate::supervision::supervisor::{State, Supervisor};
use crate::supervision::watch::Watch;
use crate::table::{Build, GainTable, Reading, TableError};

/// Controller and supervisor, tick by tick. It knows neither registers nor frames.
///
/// A tick is [`control`](Self::control), after which the motor is driven with its result, then
/// [`finish`](Self::finish), which may take its time until the next tick is due.
#[derive(Debug, Clone)]
pub struct Firmware<'t, const NX: usize, const NY: usize> {
    controller: Controller<'t, NX, NY>,
    supervisor: Supervisor,
    calibration: Calibration<NY>,
    detection: Detection<NY>,
    watch: Watch,
    reading: Reading,
    table: &'t GainTable<NX, NY>,
    build: Build,
    raw: [u32; NY],
    contacts: Contacts,
    supply_v: f32,
    /// Whether the host has given a set-point since the motor was last turned off.
    commanded: bool,
    /// Ticks for which another arm command is the one that was refused because of a fault.
    held: u32,
    /// Number of the last command that cleared a fault.
    cleared_by: u64,
    tick: u32,
    output: Output,
    requested: f32,
    applied: f32,
    cycles: u32,
    statistics: Statistics,
    reset: Reset,
    /// Telemetry of every so many ticks.
    every: u16,
    until_telemetry: u16,
}

/// Telemetry of every so many ticks, until the host asks for something else.
const EVERY: u16 = 10;

impl<'t, const NX: usize, const NY: usize> Firmware<'t, NX, NY> {
    /// The firmware after a `reset`, motor off.
    ///
    /// # Errors
    /// [`TableError`] if the table is damaged or was made for another build.
    pub fn new(
        table: &'t GainTable<NX, NY>,
        build: &Build,
        widths: [CounterWidth; NY],
        reset: Reset,
    ) -> Result<Self, TableError> {
        let cause = reset.fault().map(|fault| Cause { fault, tick: 0, sensor: None });
        Ok(Self {
            controller: Controller::new(table, build, widths)?,
            supervisor: Supervisor::new(cause),
            calibration: Calibration::new(&table.limits),
            detection: Detection::default(),
            watch: Watch::default(),
            reading: Reading::default(),
            table,
            build: *build,
            raw: [0; NY],
            contacts: Contacts::default(),
            supply_v: 0.0,
            commanded: false,
            held: 0,
            cleared_by: 0,
            tick: 0,
            output: Output::OFF,
            requested: 0.0,
            applied: 0.0,
            cycles: 0,
            statistics: Statistics::default(),
            reset,
            every: EVERY,
            until_telemetry: 0,
        })
    }

    /// The controller.
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

    /// Homing and the check of the signs.
    pub fn calibration(&self) -> &Calibration<NY> {
        &self.calibration
    }

    /// What has happened since the start.
    pub fn statistics(&self) -> Statistics {
        Statistics { rejected_samples: self.detection.rejected(), ..self.statistics }
    }

    /// First half of a tick, from inputs to output.
    pub fn control(&mut self, inputs: &Inputs<NY>) -> Output {
        (self.raw, self.contacts, self.supply_v) = (inputs.counts, inputs.contacts, inputs.supply_v);
        self.statistics.overruns =
            self.statistics.overruns.saturating_add(u32::from(inputs.contacts.overrun));
        if inputs.contacts.clock_fault {
            self.trip(Fault::Clock, None);
        } else if inputs.contacts.emergency_stop {
            self.trip(Fault::EmergencyStop, None);
        } else if inputs.contacts.driver_fault {
            self.trip(Fault::Driver, None);
        }
        if self.supervisor.state() != State::Balancing {
            self.prepare();
        }
        self.output = match self.supervisor.state() {
            State::Balancing => self.balance(inputs),
            _ => Output::OFF,
        };
        if !self.output.enable {
            (self.requested, self.applied) = (0.0, 0.0);
            self.controller.stop();
        }
        self.output
    }

    /// A tick with the motor on.
    fn balance(&mut self, inputs: &Inputs<NY>) -> Output {
        let table = self.table;
        let (detection, thresholds) = (&mut self.detection, &table.thresholds);
        let mut finding = None;
        let command = self.controller.control_with(&inputs.counts, |counts, y, e| {
            finding = detection.test(thresholds, counts, y, e);
        });
        (self.requested, self.applied) = (command.requested, command.applied);
        if let Some(fault) = self.watch.inputs(&table.limits, inputs) {
            self.trip(fault, None);
        }
        if let Some(fault) =
            envelope::left(&table.limits, self.controller.estimate().as_slice(), command.requested)
        {
            self.trip(fault, None);
        }
        if let Some(finding) = finding {
            self.trip(finding.fault, Some(finding.sensor));
        }
        if let Some(fault) = self.watch.force(&table.limits, command.requested != command.applied) {
            self.trip(fault, None);
        }
        if self.supervisor.state() == State::Balancing {
            Output { enable: true, drive: command.drive }
        } else {
            Output::OFF
        }
    }

    /// A tick with the motor off: what is done by hand.
    fn prepare(&mut self) {
        self.controller.follow(&self.raw);
        let limits = &self.table.limits;
        let counts = *self.controller.encoders_mut().counts();
        self.calibration.update(&counts, limits);
        self.held = self.held.saturating_sub(1);
        match self.supervisor.state() {
            State::Homing => match self.calibration.find_rail(&counts, &self.contacts, limits) {
                Ok(Some(position)) => self.home(&position),
                Ok(None) => {}
                Err(_) => self.supervisor.disarm(),
            },
            State::Calibrated => self.calibration.check_signs(&counts, limits),
            State::Armed => self.wait(&counts),
            State::Disarmed | State::Balancing | State::Fault => {}
        }
    }

    /// Armed: begins when everything has been upright and slow for long enough.
    fn wait(&mut self, counts: &[i32; NY]) {
        let limits = &self.table.limits;
        let upright = limits.within_half_a_turn(counts);
        let lean = self.largest_lean(&upright);
        if lean > limits.angle_rad || !self.against_by_inputs().and(self.off_centre(counts)).is_empty() {
            self.supervisor.lost();
        } else if lean > limits.arm_angle_rad {
            self.calibration.restart_slow(counts);
        } else if self.calibration.slow_ticks() >= limits.arm_ticks {
            self.begin(&upright);
        }
    }

    /// Balancing begins at these counts, which are within half a turn.
    fn begin(&mut self, counts: &[i32; NY]) {
        self.controller.encoders_mut().home(&self.raw, counts);
        if self.controller.start(&self.raw).is_err() {
            return;
        }
        if !self.commanded {
            let here = self.controller.law_state().setpoint;
            // A position from the encoders is finite.
            let _ = self.controller.set_setpoint(here);
        }
        self.detection.start(counts, &self.controller.positions().data.0[0]);
        self.watch.start();
        self.supervisor.upright();
    }

    /// Second half of a tick: telemetry, then the prediction for the next tick and the command that has arrived, if any.
    /// `cycles` is what the tick before has cost.
    pub fn finish(
        &mut self,
        command: Option<&Command>,
        cycles: u32,
    ) -> (Option<Telemetry<NX, NY>>, Option<Message<NX, NY>>) {
        self.cycles = cycles;
        self.statistics.ticks = self.statistics.ticks.wrapping_add(1);
        self.statistics.worst_cycles = self.statistics.worst_cycles.max(cycles);
        let telemetry = self.telemetry_is_due().then(|| self.telemetry());
        if self.supervisor.state() == State::Balancing {
            self.end();
            if let Some(fault) = self.watch.link(&self.table.limits, command.is_some(), self.commanded) {
                self.trip(fault, None);
            }
        }
        if self.reading.next(self.table).is_some_and(|crc| crc != self.table.crc) {
            self.trip(Fault::Table, None);
        }
        let reply = command.map(|command| Message::Reply { id: command.id, answer: self.answer(command) });
        self.tick = self.tick.wrapping_add(1);
        (telemetry, reply)
    }

    /// A message found its queue full.
    pub fn message_dropped(&mut self) {
        self.statistics.dropped = self.statistics.dropped.saturating_add(1);
    }

    fn telemetry_is_due(&mut self) -> bool {
        if self.until_telemetry > 0 {
            self.until_telemetry -= 1;
            return false;
        }
        self.until_telemetry = self.every.saturating_sub(1);
        self.every > 0
    }

    /// Prepares the next tick of balancing.
    fn end(&mut self) {
        let corrected = self.measured_estimate();
        self.detection.end(&self.table.thresholds.motor, corrected, self.controller.acting());
        self.controller.predict();
    }

    /// The estimate of what each sensor measures.
    fn measured_estimate(&self) -> [f32; NY] {
        let mut positions = [0.0; NY];
        if let Some(observer) = &self.table.observer {
            let estimate = self.controller.estimate();
            for (position, &state) in positions.iter_mut().zip(&observer.measured) {
                *position = estimate.get(state as usize).copied().unwrap_or_default();
            }
        }
        positions
    }

    fn trip(&mut self, fault: Fault, sensor: Option<u8>) {
        if self.supervisor.state() != State::Fault && fault.loses_positions() {
            self.calibration.lose(&self.table.limits);
        }
        self.calibration.give_up();
        self.commanded = false;
        self.supervisor.trip(Cause { fault, tick: self.tick, sensor });
    }

    fn home(&mut self, position: &[i32; NY]) {
        if self.supervisor.homed().is_ok() {
            self.controller.encoders_mut().home(&self.raw, position);
            self.calibration.homed();
        }
    }

    fn telemetry(&mut self) -> Telemetry<NX, NY> {
        let (Drive::Force(drive) | Drive::Duty(drive)) = self.output.drive;
        Telemetry {
            tick: self.tick,
            state: self.supervisor.state(),
            fault: self.supervisor.fault(),
            cause_tick: self.supervisor.cause().map_or(0, |cause| cause.tick),
            homing: self.calibration.homing(),
            signs: self.calibration.signs(),
            against: self.against_arming(),
            counts: Vec::from_slice(self.controller.encoders_mut().counts()).unwrap_or_default(),
            estimate: Vec::from_slice(self.controller.estimate().as_slice()).unwrap_or_default(),
            innovation: Vec::from_slice(self.controller.innovation().as_slice()).unwrap_or_default(),
            setpoint: self.controller.law_state().setpoint,
            requested: self.requested,
            applied: self.applied,
            drive,
            cycles: self.cycles,
        }
    }
}

#[cfg(test)]
mod tests;
