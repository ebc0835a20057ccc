//! A simulated machine, and a person who does what is asked.

use std::time::Duration;

use upright::board::Output;
use upright::table::Law;
use upright_closed_loop::harness::{
    Flow, Hand, HarnessError, Participant, Pins, RailEnds, Target, Wish, World, until,
};
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, SimulationError};
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
    world: World<'a>,
    person: PromptedPerson,
    wires: Option<DefectWires<'a>>,
    tries: u32,
    period_s: f64,
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
        let start = Hand::hanging(&machine).held().to_vec();
        let scenario = Scenario { start, seed, ..Scenario::at_rest(&machine, Law::Lqr) };
        Ok(Self {
            world: World::powered(&machine, table, &scenario, target)?,
            person: PromptedPerson {
                task: PersonTask::Rest,
                is_pressed: false,
                takes_pulses: table.drive.pulses().is_some(),
                rail: RailEnds::of(&machine),
            },
            wires: planted.map(|planted| DefectWires::new(&machine, table, &scenario, planted)),
            tries: 0,
            period_s: machine.tick.period_s,
        })
    }

    /// The true state of the machine.
    pub fn state(&self) -> &[f64] {
        self.world.bench.state()
    }
}

/// The person at the machine, who does what is asked.
struct PromptedPerson {
    task: PersonTask,
    /// Whether the emergency stop is pressed.
    is_pressed: bool,
    /// Whether the drive takes pulses.
    takes_pulses: bool,
    rail: RailEnds,
}

impl Participant for PromptedPerson {
    fn act(&mut self, world: &mut World<'_>, output: &mut Output) -> Flow {
        // A drive with pulses also holds the cart before the control law commands it.
        let is_on = output.enable && (!self.takes_pulses || world.session.status().state.controls());
        let wish = match self.task {
            task if task.lets_go(is_on) => Wish::Free,
            PersonTask::Move(sensor) => Wish::Turn(sensor),
            PersonTask::PushTo(end) => Wish::PushTo(self.rail.pressed_m()[usize::from(end == End::High)]),
            PersonTask::Centre => Wish::PushTo(0.0),
            PersonTask::Raise => Wish::Raise,
            PersonTask::Catch => Wish::Still,
            _ => Wish::Rest,
        };
        world.hand.does(wish, world.bench.state(), output);
        until(false)
    }

    fn pins(&mut self, world: &mut World<'_>, pins: &mut Pins) -> Result<(), HarnessError> {
        pins.contacts.emergency_stop = self.is_pressed;
        self.rail.pins(world, pins)
    }
}

impl MachineAtHand for Simulated<'_> {
    fn exchange(&mut self, bytes: &[u8]) -> Result<Vec<u8>, Stop> {
        self.world.session.send_bytes(bytes);
        let mut received = Vec::new();
        for _ in 0..(EXCHANGE_S / self.period_s).ceil() as u32 {
            self.world.run(1, &mut [&mut self.person, &mut self.wires])?;
            received.extend_from_slice(self.world.session.last_bytes());
        }
        Ok(received)
    }

    fn now(&self) -> Duration {
        BEGIN + Duration::from_secs_f64(self.world.ticks() as f64 * self.period_s)
    }

    fn ask(&mut self, task: PersonTask) -> Result<(), Stop> {
        match task {
            PersonTask::PressStop => self.person.is_pressed = true,
            PersonTask::ReleaseStop => self.person.is_pressed = false,
            PersonTask::TurnAround(sensor) => self.world.hand.wind(sensor),
            _ => {}
        }
        self.person.task = task;
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
