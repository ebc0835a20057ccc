//! A simulated machine, and a person who does what is asked.

use std::time::Duration;

use upright::board::{Contacts, Output};
use upright::control::actuator::Drive;
use upright::table::Law;
use upright_design::harness::{Grasp, Pins, Session, Target};
use upright_design::rig::{PlantDescription, Rig};
use upright_design::simulate::{Bench, Scenario, SimulationError};
use upright_design::table::TableValues;

use super::machine::{Machine, Stop};
use super::planted::{Planted, Wires};
use super::step::Step;
use super::task::{End, Task};

/// Time from one exchange to the next (s), as on a serial line.
const EXCHANGE_S: f64 = 0.005;
/// How far the hand pushes the cart beyond an end of the rail, where the switches are (m).
const BEYOND_M: f64 = 0.002;
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
    grasp: Grasp,
    task: Task,
    is_free: bool,
    tries: u32,
    is_pressed: bool,
    wires: Option<Wires<'a>>,
    output: Output,
    counters: Vec<u32>,
    supply_v: f32,
    travel_m: [f64; 2],
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
        let grasp = Grasp::hanging(&machine);
        let scenario =
            Scenario { start: grasp.held().to_vec(), seed, ..Scenario::at_rest(&machine, Law::Lqr) };
        let travel_m = match &machine.plant {
            PlantDescription::Chain(chain) => chain.cart.travel_m,
            PlantDescription::Model(_) => [f64::NEG_INFINITY, f64::INFINITY],
        };
        Ok(Self {
            session: Session::new(target),
            bench: Bench::new(&machine, &scenario)?,
            grasp,
            task: Task::Rest,
            is_free: false,
            tries: 0,
            is_pressed: false,
            wires: planted.map(|planted| Wires::new(&machine, table, &scenario, planted)),
            output: Output::OFF,
            counters: vec![0; table.sensors()],
            supply_v: table.motor.map_or(0.0, |motor| motor.supply_v),
            travel_m,
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
        let [low, high] = self.travel_m;
        let position_m = self.bench.state()[0];
        let mut pins = Pins {
            // At most as many as a table has.
            raw_counts: heapless::Vec::from_slice(&self.counters).unwrap_or_default(),
            supply_v: self.supply_v * self.bench.supply_share() as f32,
            contacts: Contacts {
                limit_low: position_m <= low,
                limit_high: position_m >= high,
                emergency_stop: self.is_pressed,
                ..Contacts::default()
            },
            received: heapless::Vec::new(),
            injected_fault: None,
        };
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
                wires.output(&mut output);
            }
            // A motor that is off turns freely.
            self.bench.tick(if output.enable { output.drive } else { Drive::Force(0.0) });
        }
        Ok(())
    }

    /// What the hand does in a tick.
    fn by_hand(&mut self) {
        let was_free = std::mem::replace(&mut self.is_free, self.task.lets_go(self.output.enable));
        if self.is_free {
            return;
        }
        if was_free {
            self.grasp.take(self.bench.state());
            self.grasp.stop();
        }
        match self.task {
            Task::Move(sensor) => self.grasp.turn(sensor),
            Task::PushTo(end) => {
                let [low, high] = self.travel_m;
                let end_m = if end == End::Low { low - BEYOND_M } else { high + BEYOND_M };
                self.push_to(end_m);
            }
            Task::Centre => self.push_to(0.0),
            Task::Raise => {
                let mut upright = vec![0.0; self.grasp.held().len()];
                upright[0] = self.grasp.held()[0];
                self.grasp.move_to(&upright);
            }
            Task::Catch => {}
            _ => {
                self.grasp.rest();
            }
        }
        self.bench.hold(self.grasp.held());
    }

    /// Pushes the cart; the links hang.
    fn push_to(&mut self, position_m: f64) {
        let mut to = self.grasp.at_rest();
        to[0] = position_m;
        self.grasp.move_to(&to);
    }
}

impl Machine for Simulated<'_> {
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

    fn ask(&mut self, task: Task) -> Result<(), Stop> {
        match task {
            Task::PressStop => self.is_pressed = true,
            Task::ReleaseStop => self.is_pressed = false,
            Task::TurnAround(sensor) => self.grasp.wind(sensor),
            _ => {}
        }
        self.task = task;
        Ok(())
    }

    fn patience(&self) -> Duration {
        PATIENCE
    }

    /// The beginning of an excitation may be too weak for a cart that sticks: other phases are tried.
    fn again(&mut self, failed: Step) -> bool {
        let goes_back = failed == Step::Excitation && self.tries < TRIES;
        self.tries += u32::from(goes_back);
        goes_back
    }
}
