//! A simulated machine, and a person who does what is asked.

use std::time::Duration;

use upright::board::Output;
use upright::control::actuator::Drive;
use upright::table::Law;
use upright_closed_loop::harness::{HeldRig, Pins, RailEnds, Session, Target, healthy};
use upright_design::rig::Rig;
use upright_design::simulate::{Bench, Scenario, SimulationError};
use upright_design::table::TableValues;

use super::machine::{MachineAtHand, Stop};
use super::planted::{DefectWires, Planted};
use super::step::CommissionStep;
use super::task::{End, PersonTask};

/// Time from one exchange to the next (s), as on a serial line.
const EXCHANGE_S: f64 = 0.005;
/// Time at power-up, since 1970.
const BEGIN: Duration = Duration::from_secs(1_800_000_000);
/// Time for the longest task: a turn, or a cart from end to end.
const PATIENCE: Duration = Duration::from_secs(10);

/// Number of times that the person goes back after an excitation that was not passed.
const TRIES: u32 = 2;

/// A simulated machine with its firmware, held by a simulated hand until the hand lets go.
pub struct Simulated<'a> {
    session: Session<'a>,
    bench: Bench,
    held: HeldRig,
    task: PersonTask,
    is_free: bool,
    tries: u32,
    is_pressed: bool,
    wires: Option<DefectWires<'a>>,
    output: Output,
    counters: Vec<u32>,
    supply_v: f32,
    rail: RailEnds,
    /// Travel per pulse (m) of a drive that takes them: no hand moves its cart while it is on.
    pulse_m: Option<f64>,
    period_s: f64,
    ticks: u64,
}

impl<'a> Simulated<'a> {
    /// The machine as `machine` describes it, with its `[reality]` and a `planted` defect, and the firmware `target`
    /// with the gain table `table`, which has just started. The links hang, and the cart is in the middle.
    ///
    /// # Errors
    /// [`SimulationError`] if the machine cannot be simulated.
    pub fn new(
        machine: &Rig,
        table: &'a TableValues,
        planted: Option<Planted>,
        target: &'a mut dyn Target,
        seed: u64,
    ) -> Result<Self, SimulationError> {
        let mut machine = machine.clone();
        if let Some(planted) = planted {
            planted.change(&mut machine, table);
        }
        let held = HeldRig::hanging(&machine);
        let scenario =
            Scenario { start: held.held().to_vec(), seed, ..Scenario::at_rest(&machine, Law::Lqr) };
        Ok(Self {
            session: Session::new(target),
            bench: Bench::new(&machine, &scenario)?,
            held,
            task: PersonTask::Rest,
            is_free: false,
            tries: 0,
            is_pressed: false,
            wires: planted.map(|planted| DefectWires::new(&machine, table, &scenario, planted)),
            output: Output::OFF,
            counters: vec![0; table.sensors()],
            supply_v: table.drive.supply_v().unwrap_or_default(),
            rail: RailEnds::of(&machine),
            pulse_m: machine.actuator.pulses().map(|drive| drive.step_m),
            period_s: machine.tick.period_s,
            ticks: 0,
        })
    }

    /// The true state of the machine.
    pub fn state(&self) -> &[f64] {
        self.bench.state()
    }

    /// What the board reads now.
    fn pins(&mut self) -> Pins {
        self.bench.read_counters(&mut self.counters);
        let mut pins = healthy(&self.counters, self.supply_v * self.bench.supply_share() as f32);
        self.rail.press(self.bench.state()[0], &mut pins.contacts);
        pins.contacts.emergency_stop = self.is_pressed;
        if let Some(wires) = &mut self.wires {
            wires.inputs(&mut pins);
        }
        pins
    }

    /// One tick of person, firmware and machine.
    fn tick(&mut self) -> Result<(), Stop> {
        self.ticks += 1;
        self.by_hand();
        let pins = self.pins();
        self.output = self.session.tick(&pins)?;
        // Only the raw bytes are used: see `exchange`.
        self.session.forget_received();
        if self.is_free {
            let mut output = self.output;
            if let Some(wires) = &mut self.wires {
                if let Some(defect) = wires.step_defect().filter(|_| self.pulse_m.is_some()) {
                    self.bench.spoil(defect);
                }
                wires.output(&mut output);
            }
            // A motor that is off turns freely.
            self.bench.tick(if output.enable { output.drive } else { Drive::Force(0.0) });
        }
        Ok(())
    }

    /// What the hand does in a tick.
    fn by_hand(&mut self) {
        // A drive with pulses also holds the cart before the control law commands it.
        let controls = || self.session.status().state.controls();
        let is_on = self.output.enable && (self.pulse_m.is_none() || controls());
        let was_free = std::mem::replace(&mut self.is_free, self.task.lets_go(is_on));
        if was_free && self.is_free {
            return;
        }
        let driven_m = self.pulse_m.filter(|_| self.output.enable);
        if was_free {
            self.held.take(self.bench.state());
            self.held.stop();
        } else if let Some(pulse_m) = driven_m {
            self.held.carry(f64::from(self.output.pulses()) * pulse_m);
        }
        match self.task {
            _ if self.is_free => {}
            PersonTask::Move(0) | PersonTask::PushTo(_) | PersonTask::Centre if driven_m.is_some() => {
                self.held.rest();
            }
            PersonTask::Move(sensor) => self.held.turn(sensor),
            PersonTask::PushTo(end) => {
                self.held.push_to(self.rail.pressed_m()[usize::from(end == End::High)]);
            }
            PersonTask::Centre => {
                self.held.push_to(0.0);
            }
            PersonTask::Raise => {
                self.held.raise();
            }
            PersonTask::Catch => {}
            _ => {
                self.held.rest();
            }
        }
        self.bench.hold(self.held.held());
    }
}

impl MachineAtHand for Simulated<'_> {
    fn exchange(&mut self, bytes: &[u8]) -> Result<Vec<u8>, Stop> {
        self.session.send_bytes(bytes);
        let mut received = Vec::new();
        for _ in 0..(EXCHANGE_S / self.period_s).ceil() as u32 {
            self.tick()?;
            received.extend_from_slice(self.session.last_bytes());
        }
        Ok(received)
    }

    fn now(&self) -> Duration {
        BEGIN + Duration::from_secs_f64(self.ticks as f64 * self.period_s)
    }

    fn ask(&mut self, task: PersonTask) -> Result<(), Stop> {
        match task {
            PersonTask::PressStop => self.is_pressed = true,
            PersonTask::ReleaseStop => self.is_pressed = false,
            PersonTask::TurnAround(sensor) => self.held.wind(sensor),
            _ => {}
        }
        self.task = task;
        Ok(())
    }

    fn patience(&self) -> Duration {
        PATIENCE
    }

    /// The beginning of an excitation may be too weak for a cart that sticks: other phases are tried.
    fn again(&mut self, failed: CommissionStep, _: CommissionStep) -> bool {
        let goes_back = failed == CommissionStep::Excitation && self.tries < TRIES;
        self.tries += u32::from(goes_back);
        goes_back
    }
}
