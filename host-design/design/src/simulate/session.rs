//! The whole firmware, supervisor included, against the simulated rig: from power-up to whatever happens.

use upright::board::{Inputs, Output};
use upright::firmware::Firmware;
use upright::protocol::message::{Answer, Command, Reply, Request, Reset, Telemetry};
use upright::supervision::detection::Thresholds;
use upright::supervision::fault::Cause;
use upright::supervision::supervisor::State;
use upright::table::GainTable;

use super::bench::Bench;
use super::closed_loop::SimulationError;
use super::hand::{Hand, Seen};
use super::scenario::Scenario;
use crate::rig::Rig;
use crate::table::TableValues;

/// What comes between the firmware and the rig; the default is nothing.
pub trait Interference<const NY: usize> {
    /// Changes what the firmware reads in `tick`.
    fn inputs(&mut self, _tick: u32, _inputs: &mut Inputs<NY>) {}

    /// Changes what the motor gets in `tick`.
    fn output(&mut self, _tick: u32, _output: &mut Output) {}
}

/// Nothing comes between.
impl<const NY: usize> Interference<NY> for () {}

/// Firmware and bench, tick by tick.
pub struct Session<'t, const NX: usize, const NY: usize> {
    firmware: Firmware<'t, NX, NY>,
    thresholds: &'t Thresholds<NY>,
    bench: Bench,
    hand: Hand,
    holding: bool,
    supply_v: f32,
    tick: u32,
    commands: u64,
}

/// What a tick came to.
#[derive(Debug, Clone)]
pub struct Tick<const NX: usize, const NY: usize> {
    /// What the firmware told, if telemetry was due.
    pub telemetry: Option<Telemetry<NX, NY>>,
    /// What it answered, if it was asked.
    pub reply: Option<Reply>,
    /// What went to the motor.
    pub output: Output,
}

impl<'t, const NX: usize, const NY: usize> Session<'t, NX, NY> {
    /// The rig hanging at rest and the firmware just powered up; `scenario` tells where the hand lets go, what disturbs
    /// the run then, and its law.
    ///
    /// # Errors
    /// [`SimulationError`] if the firmware refuses the table or the law, or the plant cannot be built.
    pub fn new(
        rig: &Rig,
        values: &TableValues,
        table: &'t GainTable<NX, NY>,
        scenario: &Scenario,
    ) -> Result<Self, SimulationError> {
        let firmware = Firmware::new(table, &values.build(), Bench::widths(), Reset::Power)?;
        let hand = Hand::new(rig, &scenario.start);
        let mut bench = Bench::new(rig, scenario)?;
        bench.hold(hand.held());
        let supply_v = rig.actuator.motor.as_ref().map_or(0.0, |motor| motor.supply_v as f32);
        let mut session = Self {
            firmware,
            thresholds: &table.thresholds,
            bench,
            hand,
            holding: true,
            supply_v,
            tick: 0,
            commands: 0,
        };
        if let Some(Reply { answer: Answer::Rejected(rejected), .. }) =
            session.step(Some(Request::Select(scenario.law)), &mut ()).reply
        {
            return Err(rejected.into());
        }
        Ok(session)
    }

    /// The firmware.
    pub fn firmware(&self) -> &Firmware<'t, NX, NY> {
        &self.firmware
    }

    /// The thresholds of its tests for encoders and motor.
    pub fn thresholds(&self) -> &'t Thresholds<NY> {
        self.thresholds
    }

    /// The rig.
    pub fn bench(&self) -> &Bench {
        &self.bench
    }

    /// Number of the next tick.
    pub fn number(&self) -> u32 {
        self.tick
    }

    /// Lets the hand do everything until the firmware balances, and lets go.
    ///
    /// # Errors
    /// [`SimulationError::NotBalancing`] with the cause, if that takes longer than a minute.
    pub fn start(&mut self, interference: &mut impl Interference<NY>) -> Result<(), SimulationError> {
        let most = (60.0 / self.bench.period_s()) as u32;
        while self.firmware.state() != State::Balancing {
            if self.tick > most {
                return Err(SimulationError::NotBalancing(self.firmware.cause()));
            }
            self.by_hand(interference);
        }
        Ok(())
    }

    /// A tick in which the hand holds the rig and asks for what comes next.
    pub fn by_hand(&mut self, interference: &mut impl Interference<NY>) -> Tick<NX, NY> {
        let seen = Seen { state: self.firmware.state(), signs: self.firmware.calibration().signs() };
        let request = match self.hand.act(self.tick, &seen) {
            Some(act) => {
                self.bench.hold(&act.held);
                act.request
            }
            None => None,
        };
        self.step(request, interference)
    }

    /// A tick, with a request at its end.
    pub fn step(
        &mut self,
        request: Option<Request>,
        interference: &mut impl Interference<NY>,
    ) -> Tick<NX, NY> {
        let mut inputs = Inputs {
            raw_counts: self.bench.counters(),
            supply_v: self.supply_v,
            contacts: Default::default(),
        };
        interference.inputs(self.tick, &mut inputs);
        let mut output = self.firmware.control(&inputs);
        interference.output(self.tick, &mut output);
        if self.firmware.state() == State::Balancing {
            self.holding = false;
        }
        if !self.holding {
            self.bench.tick(output.drive);
        }
        let command = request.map(|request| {
            self.commands += 1;
            Command { id: self.commands, request }
        });
        let (telemetry, reply) = self.firmware.finish(command.as_ref(), 0);
        self.tick += 1;
        Tick { telemetry, reply, output }
    }

    /// The latched fault.
    pub fn fault(&self) -> Option<Cause> {
        self.firmware.cause().filter(|_| self.firmware.state() == State::Fault)
    }
}
