//! A defect that a person starts while the rig runs.

use crate::harness::{Pins, Session};
use upright::board::Output;
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, StepDefect};
use upright_design::table::TableValues;

use super::defect::{Defect, Needs};
use super::expected::Expected;
use super::expected::Phase;
use super::injection::Injection;
use super::trial::{Trial, able, first_encoder};

/// A defect in a running rig, injected tick by tick.
pub struct Defective<'a> {
    injection: Injection<'a>,
    kind: Defect,
    since: usize,
}

impl Defect {
    /// Whether a person can start it while the rig balances: it changes what the firmware reads or drives, not parts
    /// of the board.
    pub fn can_begin_while_balancing(self) -> bool {
        let is_before_balancing = matches!(self.expected(), Expected::Refused(_));
        !is_before_balancing && !matches!(self.needs(), Needs::Process | Needs::Board)
    }

    /// Whether it is in one of the sensors.
    pub fn has_sensor(self) -> bool {
        matches!(
            self,
            Defect::LinkEncoderFrozen
                | Defect::BadSample
                | Defect::EncoderJump
                | Defect::EncoderReversed
                | Defect::EncodersSwapped
                | Defect::CountsLost
                | Defect::SensorLate
                | Defect::SensorIntermittent
                | Defect::EncoderWireOpen
                | Defect::SensorDead
                | Defect::SensorBit
                | Defect::SampleInvalid
        )
    }
}

impl Trial {
    /// A defect of medium severity that begins now.
    pub fn by_hand(kind: Defect, scenario: &Scenario, table: &TableValues, sensor: usize, seed: u64) -> Self {
        let (first, sensors) = (first_encoder(table), table.sensors());
        let sensor = match kind {
            Defect::CartEncoderFrozen => 0,
            Defect::LinkEncoderFrozen => sensor.clamp(1, sensors.max(2) - 1),
            kind if kind.is_of_some_sensors() => able(kind, table, sensor),
            Defect::EncodersSwapped => sensor.min(sensors.saturating_sub(2)).max(first),
            _ => sensor.min(sensors.saturating_sub(1)).max(first),
        };
        let sign = if seed.is_multiple_of(2) { 1.0 } else { -1.0 };
        Self {
            number: 0,
            kind,
            phase: Phase::Balancing,
            scenario: scenario.clone(),
            push: None,
            onset: 0,
            watched: 0,
            sensor,
            sign,
            size: 0.5,
            seed,
        }
    }
}

impl<'a> Defective<'a> {
    /// The defect of `trial`, which begins with the next tick.
    pub fn new(rig: &Rig, table: &'a TableValues, trial: Trial) -> Self {
        let kind = trial.kind;
        Self { injection: Injection::new(rig, table, trial), kind, since: 0 }
    }

    /// The kind of the defect.
    pub fn kind(&self) -> Defect {
        self.kind
    }

    /// Injects what happens only once: bytes on the serial line, or a fault inside the microcontroller.
    pub fn begin(&mut self, session: &mut Session<'_>) {
        self.injection.serial(session);
        if let Some(injected_fault) = self.kind.inside_the_microcontroller() {
            session.injected_fault(injected_fault);
        }
    }

    /// Whether the host still sends keep-alives.
    pub fn host_is_alive(&self) -> bool {
        self.injection.host_is_alive(Some(self.since))
    }

    /// Changes what the firmware reads in the next tick.
    pub fn inputs(&mut self, inputs: &mut Pins) {
        self.injection.inputs(self.since, inputs);
        self.since += 1;
    }

    /// Changes the output to the motor.
    pub fn output(&mut self, output: &mut Output) {
        self.injection.output(self.since, output);
    }

    /// What is wrong in this tick with a drive that takes pulses.
    pub fn step_defect(&self) -> Option<StepDefect> {
        self.injection.step_defect(self.since)
    }

    /// External force on the cart, or on the first link of a rig whose cart goes where its pulses say (N).
    pub fn push_n(&self) -> f64 {
        self.injection.push_n(self.since)
    }
}
