//! A defect that a person starts while the rig runs.

use crate::harness::{Flow, HarnessError, Participant, Pins, World, until};
use upright::board::Output;
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;

use super::defect::{Defect, Needs};
use super::expected::Expected;
use super::expected::Phase;
use super::injection::Injection;
use super::trial::{Trial, able, first_encoder};

/// A defect in a running rig, tick by tick.
pub struct Defective<'a> {
    injection: Injection<'a>,
    kind: Defect,
    /// The firmware's tick in which it begins, as [`World::ticks`] counts them after that tick.
    onset: Option<usize>,
    is_visible: bool,
}

impl Defect {
    /// Whether a person can start it while the rig balances: it changes what the firmware reads or drives, or stops
    /// its program, but changes no parts of the board.
    pub fn can_begin_while_balancing(self) -> bool {
        let is_before_balancing = matches!(self.expected(), Expected::Refused(_));
        let stops_program = self.inside_the_microcontroller().is_some();
        !is_before_balancing && (stops_program || !matches!(self.needs(), Needs::Process | Needs::Board))
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
    /// The defect of `trial`, which begins in the firmware's tick `onset`; without one, not before
    /// [`begin_in`](Self::begin_in).
    pub fn new(rig: &Rig, table: &'a TableValues, trial: Trial, onset: Option<usize>) -> Self {
        let kind = trial.kind;
        Self { injection: Injection::new(rig, table, trial), kind, onset, is_visible: false }
    }

    /// The kind of the defect.
    pub fn kind(&self) -> Defect {
        self.kind
    }

    /// Lets it begin in this tick of the firmware.
    pub fn begin_in(&mut self, tick: usize) {
        self.onset = Some(tick);
    }

    /// Number of ticks since the onset in this tick of the firmware; none before.
    pub fn since(&self, tick: usize) -> Option<usize> {
        tick.checked_sub(self.onset?)
    }

    /// Whether the host still sends keep-alives.
    pub fn host_is_alive(&self, tick: usize) -> bool {
        self.injection.host_is_alive(self.since(tick))
    }

    /// External force in this tick (N): on the cart, or on the first link of a rig whose cart goes where its pulses
    /// say.
    pub fn push_n(&self, tick: usize) -> f64 {
        self.since(tick).map_or(0.0, |since| self.injection.push_n(since))
    }

    /// Whether what the firmware has read in the last tick, or its motor by now, differs visibly from that of a healthy
    /// rig.
    pub fn is_visible(&self) -> bool {
        self.is_visible
    }
}

impl Participant for Defective<'_> {
    fn act(&mut self, world: &mut World<'_>, output: &mut Output) -> Flow {
        let Some(since) = self.since(world.ticks()) else { return until(false) };
        if since == 0 {
            self.injection.serial(&mut world.session);
            self.is_visible |= self.kind == Defect::TableBit;
        }
        if let Some(defect) = self.injection.step_defect(since) {
            world.bench.spoil(defect);
        }
        let drive = output.drive;
        self.is_visible |= self.injection.output(since, output);
        if !output.enable {
            // No defect drives a motor that is off: it turns freely.
            output.drive = drive;
        }
        until(false)
    }

    fn pins(&mut self, world: &mut World<'_>, pins: &mut Pins) -> Result<(), HarnessError> {
        let Some(since) = self.since(world.ticks() + 1) else { return Ok(()) };
        self.is_visible = self.injection.inputs(since, pins);
        if since == 0 {
            if let Some(fault) = self.kind.inside_the_microcontroller() {
                world.session.injected_fault(fault);
            }
            if self.kind == Defect::HostDeaf {
                world.session.stop_reading()?;
            }
        }
        Ok(())
    }
}
