//! One tick of the firmware: inputs → supervisor → controller → output, then commands and telemetry.

use heapless::Vec;

use crate::actuator::Drive;
use crate::controller::Controller;
use crate::encoder::CounterWidth;
use crate::io::{Inputs, Output};
use crate::message::{Answer, Command, Info, Message, PROTOCOL, Request, Reset, Statistics, Telemetry};
use crate::supervisor::{State, Supervisor};
use crate::table::{Build, GainTable, TableError};

/// Controller and supervisor, tick by tick. It knows neither registers nor frames.
///
/// A tick is [`control`](Self::control), after which the motor is driven with its result, then
/// [`finish`](Self::finish), which may take its time until the next tick is due.
#[derive(Debug, Clone)]
pub struct Firmware<'t, const NX: usize, const NY: usize> {
    controller: Controller<'t, NX, NY>,
    supervisor: Supervisor,
    table: &'t GainTable<NX, NY>,
    raw: [u32; NY],
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
        Ok(Self {
            controller: Controller::new(table, build, widths)?,
            supervisor: Supervisor::default(),
            table,
            raw: [0; NY],
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

    /// First half of a tick, from inputs to output.
    pub fn control(&mut self, inputs: &Inputs<NY>) -> Output {
        self.raw = inputs.counts;
        self.supervisor.watch(&inputs.contacts);
        if self.supervisor.upright() {
            // A controller without observer stays stopped.
            let _ = self.controller.start(&inputs.counts);
        }
        let command = self.controller.control(&inputs.counts);
        (self.requested, self.applied) = (command.requested, command.applied);
        self.output = if self.supervisor.state() == State::Balancing {
            Output { enable: true, drive: command.drive }
        } else {
            self.controller.stop();
            Output::OFF
        };
        self.output
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
        self.controller.predict();
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

    fn telemetry(&mut self) -> Telemetry<NX, NY> {
        let (Drive::Force(drive) | Drive::Duty(drive)) = self.output.drive;
        Telemetry {
            tick: self.tick,
            state: self.supervisor.state(),
            fault: self.supervisor.fault(),
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

    fn answer(&mut self, command: &Command) -> Answer {
        let done = |result: Result<(), _>| result.map_or_else(Answer::NotNow, |()| Answer::Done);
        let taken = |result: Result<(), _>| result.map_or_else(Answer::Rejected, |()| Answer::Done);
        match command.request {
            Request::Beat => Answer::Done,
            Request::Home => {
                let result = self.supervisor.home();
                if result.is_ok() {
                    self.controller.encoders_mut().home(&self.raw, &[0; NY]);
                }
                done(result)
            }
            Request::Arm => done(self.supervisor.arm()),
            Request::Disarm => {
                self.supervisor.disarm();
                self.controller.stop();
                Answer::Done
            }
            Request::Clear => {
                self.supervisor.clear();
                Answer::Done
            }
            Request::Setpoint(position) => taken(self.controller.set_setpoint(position)),
            Request::Select(law) => taken(self.controller.select(law)),
            Request::Info => Answer::Info(self.info()),
            Request::Statistics => Answer::Statistics(self.statistics),
            Request::ResetStatistics => {
                self.statistics = Statistics::default();
                Answer::Done
            }
            Request::Telemetry(every) => {
                (self.every, self.until_telemetry) = (every, 0);
                Answer::Done
            }
        }
    }

    fn info(&self) -> Info {
        Info {
            protocol: PROTOCOL,
            version: [0, 1, 0],
            rig_hash: self.table.rig_hash,
            tick_s: self.table.tick_s,
            states: NX as u8,
            sensors: NY as u8,
            reset: self.reset,
        }
    }
}
