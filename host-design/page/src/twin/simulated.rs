//! The simulated machine: the whole firmware, the rig on its wires, and everything a person does to it.

use std::collections::VecDeque;
use std::time::Duration;

use serde_json::{Value, json};
use upright::board::Output;
use upright::control::actuator::Drive;
use upright_closed_loop::defects::{Defect, Defective, Trial, push_limit_n};
use upright_closed_loop::harness::{Harness, HarnessError, Pins, RailEnds, Target};
use upright_design::rig::{PlantDescription, Rig};
use upright_design::simulate::{Bench, Disturbance, Scenario, StepDefect};
use upright_design::table::TableValues;

use super::challenge::Challenge;
use super::console::Console;
use super::holding::ManualHold;
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
pub struct World<'a, 't> {
    machine: SimulatedMachine<'a>,
    pace: SimulationPace,
    harness: Harness<'t>,
    spring: Option<Spring>,
    pulled: Option<PulledPoint>,
    pull: Option<Pull>,
    hold: ManualHold,
    properties: Properties,
    defect: Option<Defective<'a>>,
    challenge: Option<Challenge>,
    delayed: VecDeque<Output>,
    output: Output,
    zero: Vec<u32>,
    rail: RailEnds,
    total_kg: f64,
    /// Simulated time since the start (s).
    t_s: f64,
    epoch: Duration,
    restart: Option<bool>,
    /// Travel per pulse (m) of a drive that takes them.
    pulse_m: Option<f64>,
}

impl<'a, 't> World<'a, 't> {
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
        let mut harness = Harness::new(rig, table, scenario, target)?;
        let output = if upright { harness.raise(None)? } else { Output::OFF };
        let period_s = rig.tick.period_s;
        let (spring, total_kg) = match &rig.plant {
            PlantDescription::Chain(chain) => (Some(Spring::of(chain, period_s)), chain.total_mass_kg()),
            PlantDescription::Model(_) => (None, 1.0),
        };
        let mut hold = ManualHold::new(rig);
        if !upright {
            hold.take(Holding::Hanging, harness.bench.state());
        }
        let mut zero = vec![0; table.sensors()];
        harness.bench.read_counters_at_zero(&mut zero);
        let mut world = Self {
            machine,
            pace: SimulationPace::new(period_s),
            harness,
            spring,
            pulled: None,
            pull: None,
            hold,
            properties,
            defect: None,
            challenge: None,
            delayed: VecDeque::new(),
            output,
            zero,
            rail: RailEnds::of(rig),
            total_kg,
            t_s: 0.0,
            epoch,
            restart: None,
            pulse_m: rig.actuator.pulses().map(|drive| drive.step_m),
        };
        world.rebuild()?;
        Ok(world)
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
        bench.take_over(&self.harness.bench);
        self.harness.bench = bench;
        Ok(())
    }

    /// Does what a person asks for.
    ///
    /// # Errors
    /// [`HarnessError`] if there is no such machine.
    pub fn carry_out(&mut self, request: MachineRequest, console: &mut Console) -> Result<(), HarnessError> {
        match request {
            MachineRequest::Pull { body, along, x, y } => {
                self.pulled = Some(PulledPoint { body, along, to: [x, y] });
            }
            MachineRequest::LetGo {} => self.pulled = None,
            MachineRequest::Hold { how } => self.hold.take(how, self.harness.bench.state()),
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
                self.challenge = on.then(|| Challenge::new(limit_n, self.t_s.to_bits()));
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
        let mut defect = Defective::new(rig, table, trial);
        // The conversation numbers its commands by the time.
        self.harness.session.count_from(self.now().as_micros() as u64);
        defect.begin(&mut self.harness.session);
        self.defect = Some(defect);
    }

    /// One tick of the rig, the conversation and the firmware.
    fn tick(&mut self, console: &mut Console) -> Result<(), HarnessError> {
        self.move_rig();
        let now = self.now();
        console.monitor.poll(now);
        let outgoing = console.monitor.take_outgoing();
        if self.defect.as_ref().is_none_or(Defective::host_is_alive) {
            self.harness.session.send_bytes(&outgoing);
        }
        let mut inputs = self.harness.inputs();
        self.coarsen(&mut inputs);
        self.rail.press(self.harness.bench.state()[0], &mut inputs.contacts);
        if let Some(defect) = &mut self.defect {
            defect.inputs(&mut inputs);
        }
        self.output = self.harness.session.tick(&inputs)?;
        let session = &mut self.harness.session;
        let telemetry = console.monitor.receive(session.last_bytes(), now);
        console.take(telemetry);
        session.forget_received();
        self.t_s += self.machine.rig.tick.period_s;
        Ok(())
    }

    /// Moves the rig by one tick: by hand, or by the motor and whatever pulls and pushes.
    fn move_rig(&mut self) {
        let mut output = self.output;
        if let Some(defect) = &mut self.defect {
            defect.output(&mut output);
        }
        self.delayed.push_back(output);
        while self.delayed.len() > self.properties.get(DELAY) as usize + 1 {
            self.delayed.pop_front();
        }
        let output = self.delayed.front().copied().unwrap_or(Output::OFF);
        let push_n = self.pushes();
        let status = self.harness.session.status();
        let carried_m = self.pulse_m.map(|pulse_m| pulse_m * f64::from(output.pulses()));
        if let Some(held) =
            self.hold.tick(&status, self.harness.bench.state(), carried_m.filter(|_| output.enable))
        {
            let held = held.to_vec();
            self.pull = None;
            return self.harness.bench.hold(&held);
        }
        let state = self.harness.bench.state();
        self.pull =
            self.pulled.as_ref().zip(self.spring.as_ref()).map(|(pulled, spring)| spring.pull(pulled, state));
        let stop_n = self.end_stop_n(state);
        let (cart_n, mut torques) = match &self.pull {
            Some(pull) => (pull.cart_n, pull.torques_n_m.clone()),
            None => (0.0, Vec::new()),
        };
        let is_at_stop = carried_m.is_some_and(|carried_m| stop_n * carried_m < 0.0);
        if let (Some(_), Some(spring)) = (self.pulse_m, &self.spring) {
            // The cart goes where its pulses say, whatever pushes it.
            let pushed = spring.torques_at_first(push_n, state);
            torques.resize(pushed.len(), 0.0);
            torques.iter_mut().zip(pushed).for_each(|(torque, pushed)| *torque += pushed);
        }
        self.harness.bench.pull(push_n + stop_n + cart_n, &torques);
        if let Some(defect) = self.defect.as_ref().and_then(Defective::step_defect) {
            self.harness.bench.spoil(defect);
        }
        if is_at_stop {
            self.harness.bench.spoil(StepDefect::Jammed);
        }
        // A motor that is off turns freely.
        let drive = if output.enable { output.drive } else { Drive::Force(0.0) };
        self.harness.bench.tick(drive);
    }

    /// Pushes of the defect and of the challenge (N): on the cart, or on the first link of a rig whose cart goes where
    /// its pulses say.
    fn pushes(&mut self) -> f64 {
        // A drive that takes pulses is on while it only holds the cart, too.
        let controls = self.pulse_m.is_none() || self.harness.session.status().state.controls();
        let survives = self.output.enable && controls;
        let challenge = self.challenge.as_mut();
        let defect = self.defect.as_ref().map_or(0.0, Defective::push_n);
        defect + challenge.map_or(0.0, |challenge| challenge.tick(survives, self.machine.rig.tick.period_s))
    }

    /// Force of the end stops on the cart (N): a spring and a damper each.
    fn end_stop_n(&self, state: &[f64]) -> f64 {
        let [low, high] = self.rail.stops_m();
        let beyond = if state[0] < low { state[0] - low } else { (state[0] - high).max(0.0) };
        if beyond == 0.0 {
            return 0.0;
        }
        let rate = 1.0 / self.machine.rig.tick.period_s;
        let force = -self.total_kg * (STOP[0] * rate * rate * beyond + STOP[1] * rate * state[1]);
        // A stop pushes and never pulls.
        if force * beyond < 0.0 { force } else { 0.0 }
    }

    /// Coarser encoders: the counters move in steps of several counts.
    fn coarsen(&self, inputs: &mut Pins) {
        let step = self.properties.get(COARSENESS) as i64;
        if step <= 1 {
            return;
        }
        for (sensor, (counter, &zero)) in inputs.raw_counts.iter_mut().zip(&self.zero).enumerate() {
            let counts = Bench::signed(sensor, counter.wrapping_sub(zero));
            let coarse = (counts + step / 2).div_euclid(step) * step;
            *counter = Bench::reading(sensor, zero.wrapping_add(coarse as u32));
        }
    }

    /// The part of a picture that only a simulation knows.
    pub fn picture(&self) -> Value {
        let is_pulled = self.pull.as_ref().zip(self.pulled.as_ref());
        json!({
            "t_s": self.t_s,
            "state": self.harness.bench.state(),
            "pull": is_pulled.map(|(pull, pulled)| json!({
                "body": pulled.body, "along": pulled.along, "to": pulled.to, "force_n": pull.force_n,
            })),
            "holding": self.hold.how(),
            "properties": self.properties.all().collect::<std::collections::BTreeMap<_, _>>(),
            "defect": self.defect.as_ref().map(|defect| defect.kind().name()),
            "challenge": self.challenge,
            "speed": self.pace.speed(),
            "factor": self.pace.factor(),
            "paused": self.pace.is_paused(),
        })
    }
}
