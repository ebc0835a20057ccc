//! The simulated machine: the whole firmware, the rig on its wires, and everything a person does to it.

use std::collections::VecDeque;
use std::time::Duration;

use serde_json::{Value, json};
use upright::board::Output;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;
use upright_closed_loop::defects::{Defect, Defective, Trial, push_limit_n};
use upright_closed_loop::harness::{
    Flow, HarnessError, Participant, Pins, RailEnds, Status, Target, Wish, World, until,
};
use upright_design::rig::{PlantDescription, Rig};
use upright_design::simulate::{Bench, Disturbance, Scenario, StepDefect};
use upright_design::table::TableValues;

use super::challenge::Challenge;
use super::console::Console;
use super::pace::SimulationPace;
use super::property::{COARSENESS, DELAY, FORCE_NOISE, Properties};
use super::pull::{Pull, PulledPoint, Spring};
use super::request::{Holding, MachineRequest};

/// A rig, its table, and how it is simulated.
#[derive(Clone, Copy)]
pub struct SimulatedMachine<'a> {
    /// The rig.
    pub rig: &'a Rig,
    /// Its gain table.
    pub table: &'a TableValues,
    /// How it is simulated.
    pub scenario: &'a Scenario,
}

/// End stops: stiffness and damping as fractions of what the tick allows.
const STOP: [f64; 2] = [0.05, 0.3];

/// A simulated machine under power, and what a person does to it.
pub struct PoweredMachine<'a, 't> {
    machine: SimulatedMachine<'a>,
    pace: SimulationPace,
    world: World<'t>,
    properties: Properties,
    coarse: CoarseEncoders,
    rail: RailEnds,
    defect: Option<Defective<'a>>,
    surroundings: Surroundings,
    /// Simulated time since the start (s).
    t_s: f64,
    epoch: Duration,
    restart: Option<bool>,
}

impl<'a, 't> PoweredMachine<'a, 't> {
    /// Switches the power on: `target` has just started. The rig hangs, or is raised by hand. Commands are numbered by
    /// the time, so `epoch`, the time since 1970, has to grow from one power-up to the next.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware refuses the machine, or cannot raise it.
    pub fn new(
        machine: SimulatedMachine<'a>,
        target: &'t mut dyn Target,
        properties: Properties,
        upright: bool,
        epoch: Duration,
    ) -> Result<Self, HarnessError> {
        let SimulatedMachine { rig, table, scenario } = machine;
        let mut world = World::new(rig, table, scenario, target)?;
        if upright {
            world.raise(None)?;
        }
        let mut zero = vec![0; table.sensors()];
        world.bench.read_counters_at_zero(&mut zero);
        let mut powered = Self {
            machine,
            pace: SimulationPace::new(rig.tick.period_s),
            world,
            properties,
            coarse: CoarseEncoders { step: 1, zero },
            rail: RailEnds::of(rig),
            defect: None,
            surroundings: Surroundings::new(rig, if upright { Holding::Free } else { Holding::Hanging }),
            t_s: 0.0,
            epoch,
            restart: None,
        };
        powered.rebuild()?;
        Ok(powered)
    }

    /// Simulated time, as the time since 1970: in slow motion the firmware's timeouts are slow, too.
    pub fn now(&self) -> Duration {
        self.epoch + Duration::from_secs_f64(self.t_s)
    }

    /// Begins the conversation: runs one tick per call until the first telemetry has come.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware stops.
    pub fn greet(&mut self, console: &mut Console) -> Result<(), HarnessError> {
        if console.monitor.telemetry.is_some() { Ok(()) } else { self.tick(console) }
    }

    /// Runs the ticks that are due after `passed_s` more of real time, while `goes_on` holds; the time of the others is
    /// skipped, and the page shows it.
    ///
    /// # Errors
    /// [`HarnessError`] if the firmware stops.
    pub fn run(
        &mut self,
        passed_s: f64,
        console: &mut Console,
        goes_on: &mut dyn FnMut() -> bool,
    ) -> Result<(), HarnessError> {
        let (due, mut ran) = (self.pace.due(passed_s), 0);
        while ran < due && goes_on() {
            self.tick(console)?;
            ran += 1;
        }
        self.pace.ran(ran);
        Ok(())
    }

    /// Whether the power is to be switched off and on, and whether the rig is to be raised then.
    pub fn restart(&self) -> Option<bool> {
        self.restart
    }

    /// What is true of the machine.
    pub fn properties(&self) -> &Properties {
        &self.properties
    }

    /// Builds the simulated rig again with the current properties, in the same state.
    fn rebuild(&mut self) -> Result<(), HarnessError> {
        let rig = self.properties.applied_to(self.machine.rig);
        let scenario = Scenario {
            force_noise_n: self.properties.get(FORCE_NOISE),
            torque_noise_n_m: Disturbance::of(self.machine.rig).torque_n_m,
            ..self.machine.scenario.clone()
        };
        let mut bench = Bench::new(&rig, &scenario)?;
        bench.take_over(&self.world.bench);
        self.world.bench = bench;
        Ok(())
    }

    /// Does what a person asks for.
    ///
    /// # Errors
    /// [`HarnessError`] if there is no such machine.
    pub fn carry_out(&mut self, request: MachineRequest, console: &mut Console) -> Result<(), HarnessError> {
        match request {
            MachineRequest::Pull { body, along, x, y } => {
                self.surroundings.pulled = Some(PulledPoint { body, along, to: [x, y] });
            }
            MachineRequest::LetGo {} => self.surroundings.pulled = None,
            MachineRequest::Hold { how } => self.surroundings.how = how,
            MachineRequest::Set { name, value } => match self.properties.set(&name, value) {
                Some(true) => self.rebuild()?,
                Some(false) => {}
                None => console.monitor.note(format!("`{name}` is no property of the machine")),
            },
            MachineRequest::Defect { name, sensor } => self.begin_defect(name.as_deref(), sensor, console),
            MachineRequest::Speed { factor } => self.pace.set(factor),
            MachineRequest::Pause { on } => self.pace.pause(on),
            MachineRequest::Step { ticks } => self.pace.step(ticks),
            MachineRequest::Challenge { on } => {
                let limit_n = push_limit_n(self.machine.rig, self.machine.table);
                self.surroundings.challenge = on.then(|| Challenge::new(limit_n, self.t_s.to_bits()));
            }
            MachineRequest::Restart { upright } => self.restart = Some(upright),
        }
        Ok(())
    }

    fn begin_defect(&mut self, name: Option<&str>, sensor: usize, console: &mut Console) {
        let Some(name) = name else {
            self.defect = None;
            return;
        };
        let Some(&kind) = Defect::ALL.iter().find(|kind| kind.name() == name) else {
            return console.monitor.note(format!("`{name}` is no defect"));
        };
        let SimulatedMachine { rig, table, scenario } = self.machine;
        let trial = Trial::by_hand(kind, scenario, table, sensor, self.t_s.to_bits());
        // The conversation numbers its commands by the time.
        self.world.session.count_from(self.now().as_micros() as u64);
        self.defect = Some(Defective::new(rig, table, trial, Some(self.world.ticks() + 1)));
    }

    /// One tick of the rig, the conversation and the firmware.
    fn tick(&mut self, console: &mut Console) -> Result<(), HarnessError> {
        let (now, tick) = (self.now(), self.world.ticks());
        console.monitor.poll(now);
        let outgoing = console.monitor.take_outgoing();
        if self.defect.as_ref().is_none_or(|defect| defect.host_is_alive(tick)) {
            self.world.session.send_bytes(&outgoing);
        }
        self.coarse.step = self.properties.get(COARSENESS) as i64;
        self.surroundings.delay_ticks = self.properties.get(DELAY) as usize;
        self.surroundings.defect_n = self.defect.as_ref().map_or(0.0, |defect| defect.push_n(tick));
        // What is wrong with a sensor is behind its resolution, and what is wrong with the motor before its delay.
        let participants: &mut [&mut dyn Participant] =
            &mut [&mut self.coarse, &mut self.rail, &mut self.defect, &mut self.surroundings];
        let _ = self.world.tick(participants)?;
        let telemetry = console.monitor.receive(self.world.session.last_bytes(), now);
        console.take(telemetry);
        self.world.session.forget_received();
        self.t_s += self.machine.rig.tick.period_s;
        Ok(())
    }

    /// The part of a picture that only a simulation knows.
    pub fn picture(&self) -> Value {
        let is_pulled = self.surroundings.pull.as_ref().zip(self.surroundings.pulled.as_ref());
        json!({
            "t_s": self.t_s,
            "state": self.world.bench.state(),
            "pull": is_pulled.map(|(pull, pulled)| json!({
                "body": pulled.body, "along": pulled.along, "to": pulled.to, "force_n": pull.force_n,
            })),
            "holding": self.surroundings.how,
            "properties": self.properties.all().collect::<std::collections::BTreeMap<_, _>>(),
            "defect": self.defect.as_ref().map(|defect| defect.kind().name()),
            "challenge": self.surroundings.challenge,
            "speed": self.pace.speed(),
            "factor": self.pace.factor(),
            "paused": self.pace.is_paused(),
        })
    }
}

/// Coarser encoders: the counters move in steps of several counts.
struct CoarseEncoders {
    step: i64,
    /// The counters at position 0.
    zero: Vec<u32>,
}

impl Participant for CoarseEncoders {
    fn pins(&mut self, _: &mut World<'_>, pins: &mut Pins) -> Result<(), HarnessError> {
        if self.step <= 1 {
            return Ok(());
        }
        for (sensor, (counter, &zero)) in pins.raw_counts.iter_mut().zip(&self.zero).enumerate() {
            let counts = Bench::signed(sensor, counter.wrapping_sub(zero));
            let coarse = (counts + self.step / 2).div_euclid(self.step) * self.step;
            *counter = Bench::reading(sensor, zero.wrapping_add(coarse as u32));
        }
        Ok(())
    }
}

/// What moves the rig besides its motor: the person's hand, which holds it or pulls at it, pushes, and the end stops.
struct Surroundings {
    how: Holding,
    spring: Option<Spring>,
    pulled: Option<PulledPoint>,
    pull: Option<Pull>,
    challenge: Option<Challenge>,
    /// Push of a defect (N).
    defect_n: f64,
    /// Ticks by which the motor is late, and the outputs on the way to it.
    delay_ticks: usize,
    delayed: VecDeque<Output>,
    rail: RailEnds,
    total_kg: f64,
    takes_pulses: bool,
    period_s: f64,
}

impl Surroundings {
    fn new(rig: &Rig, how: Holding) -> Self {
        let period_s = rig.tick.period_s;
        let (spring, total_kg) = match &rig.plant {
            PlantDescription::Chain(chain) => (Some(Spring::of(chain, period_s)), chain.total_mass_kg()),
            PlantDescription::Model(_) => (None, 1.0),
        };
        Self {
            how,
            spring,
            pulled: None,
            pull: None,
            challenge: None,
            defect_n: 0.0,
            delay_ticks: 0,
            delayed: VecDeque::new(),
            rail: RailEnds::of(rig),
            total_kg,
            takes_pulses: rig.actuator.pulses().is_some(),
            period_s,
        }
    }

    /// What the hand does. While the motor pushes the cart, the rig is let go, and held again afterwards.
    fn wish(&self, status: &Status) -> Wish {
        match (self.how, status.signs) {
            (Holding::Free, _) => Wish::Free,
            _ if matches!(status.state, State::Jogging | State::Stilling) => Wish::Free,
            (Holding::Guided, Signs::Move(sensor)) => Wish::Turn(sensor),
            (Holding::Guided, _) => Wish::Hang,
            (Holding::Hanging, _) => Wish::PushTo(0.0),
            (Holding::Upright, _) => Wish::Raise,
        }
    }

    /// Pushes of the defect and of the challenge (N): on the cart, or on the first link of a rig whose cart goes where
    /// its pulses say.
    fn pushes(&mut self, world: &World<'_>) -> f64 {
        // A drive that takes pulses is on while it only holds the cart, too.
        let controls = !self.takes_pulses || world.session.status().state.controls();
        let survives = world.last_output().enable && controls;
        let challenge = self.challenge.as_mut();
        self.defect_n + challenge.map_or(0.0, |challenge| challenge.tick(survives, self.period_s))
    }

    /// Force of the end stops on the cart (N): a spring and a damper each.
    fn end_stop_n(&self, state: &[f64]) -> f64 {
        let [low, high] = self.rail.stops_m();
        let beyond = if state[0] < low { state[0] - low } else { (state[0] - high).max(0.0) };
        if beyond == 0.0 {
            return 0.0;
        }
        let rate = 1.0 / self.period_s;
        let force = -self.total_kg * (STOP[0] * rate * rate * beyond + STOP[1] * rate * state[1]);
        // A stop pushes and never pulls.
        if force * beyond < 0.0 { force } else { 0.0 }
    }
}

impl Participant for Surroundings {
    fn act(&mut self, world: &mut World<'_>, output: &mut Output) -> Flow {
        self.delayed.push_back(*output);
        while self.delayed.len() > self.delay_ticks + 1 {
            self.delayed.pop_front();
        }
        *output = self.delayed.front().copied().unwrap_or(Output::OFF);
        let push_n = self.pushes(world);
        let wish = self.wish(&world.session.status());
        world.hand.does(wish, world.bench.state(), output);
        self.pull = None;
        if world.hand.has_hold() {
            return until(false);
        }
        let state = world.bench.state();
        self.pull =
            self.pulled.as_ref().zip(self.spring.as_ref()).map(|(pulled, spring)| spring.pull(pulled, state));
        let stop_n = self.end_stop_n(state);
        let (cart_n, mut torques) = match &self.pull {
            Some(pull) => (pull.cart_n, pull.torques_n_m.clone()),
            None => (0.0, Vec::new()),
        };
        if let (true, Some(spring)) = (self.takes_pulses, &self.spring) {
            // The cart goes where its pulses say, whatever pushes it.
            let pushed = spring.torques_at_first(push_n, state);
            torques.resize(pushed.len(), 0.0);
            torques.iter_mut().zip(pushed).for_each(|(torque, pushed)| *torque += pushed);
        }
        world.bench.pull(push_n + stop_n + cart_n, &torques);
        if stop_n * f64::from(output.pulses()) < 0.0 {
            world.bench.spoil(StepDefect::Jammed);
        }
        until(false)
    }
}
