//! The simulated rig: plant, motor, encoders and disturbances, one tick at a time.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use upright::control::actuator::Drive;
use upright::control::encoder::CounterWidth;
use upright::protocol::simulated_pins::BAD_SAMPLE;

use super::error::SimulationError;
use super::scenario::Scenario;
use super::sensor::{SimulatedSensor, nearest};
use super::servo::Servo;
use crate::plant::{ChainLanes, LARGEST_SHARE, LinearSimulation, MOST_STEPS, Plant};
use crate::reality::{Driver, RealEncoders, StepMotor, Timing, ideal_chain, real_plant};
use crate::rig::{Chain, PlantDescription, Rig};

/// What is wrong with a drive that takes pulses. The board counts its pulses whatever it does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepDefect {
    /// It is off: it lets go of a cart that its motor moved; without a motor, the cart stands.
    Off,
    /// The cart is stuck.
    Jammed,
    /// It misses this share of its pulses.
    Misses(f64),
}

/// The simulated rig: everything outside the controller.
pub struct Bench {
    plant: Box<dyn Plant>,
    /// Travel per pulse (m) of a drive that imposes the cart's motion.
    step_m: Option<f64>,
    /// Its pulses so far, from position 0.
    pulses: i64,
    /// Those that it has missed.
    missed: i64,
    /// What is wrong with it in the next tick.
    step_defect: Option<StepDefect>,
    /// Its motor, unless it goes where its pulses say.
    step_motor: Option<StepMotor>,
    /// A servo that follows late.
    servo: Option<Servo>,
    /// Motor and driver, unless the force is the commanded one.
    driver: Option<Driver>,
    timing: Timing,
    encoders: Option<RealEncoders>,
    sensors: Vec<SimulatedSensor>,
    counter_start: u32,
    random: Pcg64,
    force_noise_n: f64,
    torque_noise_n_m: f64,
    force_offset: f64,
    push_n: f64,
    pull_n_m: Vec<f64>,
    torques: Vec<f64>,
    state: Vec<f64>,
    period_s: f64,
    substeps: usize,
    delay: bool,
    pending_drive: Drive,
    /// The command that still acts during the latency of the next tick.
    acting_drive: Drive,
}

impl Bench {
    /// The simulation of `rig` at the start of `scenario`.
    ///
    /// # Errors
    /// [`SimulationError`] if the plant cannot be built or a noise level is impossible.
    pub fn new(rig: &Rig, scenario: &Scenario) -> Result<Self, SimulationError> {
        let step_motor = StepMotor::of(rig);
        let mut plant: Box<dyn Plant> = match &rig.plant {
            PlantDescription::Chain(chain) => match &step_motor {
                Some(motor) => real_plant(&motor.pulled(chain), rig)?,
                None => real_plant(chain, rig)?,
            },
            PlantDescription::Model(model) => Box::new(LinearSimulation::of(model)),
        };
        plant.set_state(&scenario.start);
        can_be_followed(rig, plant.as_ref())?;
        let noise = |level: f64| {
            if level.is_finite() && level >= 0.0 { Ok(level) } else { Err(SimulationError::Noise(level)) }
        };
        let finite =
            |offset: f64| if offset.is_finite() { Ok(offset) } else { Err(SimulationError::Offset(offset)) };
        let step_m = rig.actuator.acceleration.as_ref().map(|drive| drive.step_m);
        let servo = Servo::of(rig);
        Ok(Self {
            torques: vec![0.0; plant.disturbances()],
            pull_n_m: vec![0.0; plant.disturbances()],
            plant,
            step_m,
            pulses: pulses_at(&scenario.start, step_m, servo.as_ref()),
            missed: 0,
            step_defect: None,
            step_motor,
            servo,
            driver: Driver::of(rig),
            timing: Timing::of(rig, scenario.seed),
            encoders: RealEncoders::of(rig),
            sensors: SimulatedSensor::all(rig, scenario.counter_start, &scenario.start),
            counter_start: scenario.counter_start,
            random: Pcg64::seed_from_u64(scenario.seed),
            force_noise_n: noise(scenario.force_noise_n)?,
            torque_noise_n_m: noise(scenario.torque_noise_n_m)?,
            force_offset: finite(scenario.force_offset_n)?,
            push_n: 0.0,
            state: scenario.start.clone(),
            period_s: rig.tick.period_s,
            substeps: scenario.substeps.max(1),
            delay: rig.tick.delay_ticks == 1,
            pending_drive: Drive::OFF,
            acting_drive: Drive::OFF,
        })
    }

    /// The true state.
    pub fn state(&self) -> &[f64] {
        &self.state
    }

    /// Control period (s).
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Sets the state (m, m/s, rad, rad/s …), as a hand that holds the rig does.
    pub fn hold(&mut self, state: &[f64]) {
        self.plant.set_state(state);
        self.state.copy_from_slice(state);
        self.sensors.iter_mut().for_each(|sensor| sensor.carry(state[sensor.state]));
        self.servo.iter_mut().for_each(Servo::rest);
        self.pulses = pulses_at(state, self.step_m, self.servo.as_ref());
        self.missed = 0;
    }

    /// Continues where `before` is, which simulates the same rig with other properties.
    pub fn take_over(&mut self, before: &Self) {
        self.hold(&before.state);
        self.sensors.iter_mut().zip(&before.sensors).for_each(|(sensor, before)| sensor.take_over(before));
        (self.pulses, self.missed) = (before.pulses, before.missed);
    }

    /// Spoils a drive with pulses in the next tick.
    pub fn spoil(&mut self, defect: StepDefect) {
        self.step_defect = Some(defect);
    }

    /// Widths of the hardware counters: 32 bits for the cart, 16 for the links.
    pub const fn widths<const NY: usize>() -> [CounterWidth; NY] {
        let mut widths = [CounterWidth::Bits16; NY];
        if let [cart, ..] = widths.as_mut_slice() {
            *cart = Self::width(0);
        }
        widths
    }

    /// Width of the hardware counter of sensor number `sensor` (0: cart).
    pub const fn width(sensor: usize) -> CounterWidth {
        if sensor == 0 { CounterWidth::Bits32 } else { CounterWidth::Bits16 }
    }

    /// Writes the readings of the hardware counters into `counters`, with [`BAD_SAMPLE`] in the dead band of a
    /// potentiometer; entries without a sensor keep their value.
    pub fn read_counters(&mut self, counters: &mut [u32]) {
        for (index, (counter, sensor)) in counters.iter_mut().zip(&mut self.sensors).enumerate() {
            if index == 0 && self.step_m.is_some() {
                *counter = Self::reading(0, self.counter_start.wrapping_add(self.pulses as u32));
                continue;
            }
            let state = sensor.state;
            let mut position = match &self.encoders {
                Some(errors) => errors.measured(state, &self.state),
                None => self.state[state],
            };
            if sensor.noise > 0.0 {
                let normal: f64 = StandardNormal.sample(&mut self.random);
                position += sensor.noise * normal;
            }
            let count = sensor.count(position, self.counter_start);
            *counter = Self::reading(index, count) | if sensor.is_dead(count) { BAD_SAMPLE } else { 0 };
        }
    }

    /// As [`Bench::read_counters`], for as many sensors as the firmware has.
    pub fn counters<const NY: usize>(&mut self) -> [u32; NY] {
        let mut counters = [0; NY];
        self.read_counters(&mut counters);
        counters
    }

    /// Writes the readings of the counters at position 0 into `counters`: on the turn of the state in which the rig was
    /// switched on.
    pub fn read_counters_at_zero(&self, counters: &mut [u32]) {
        for (index, counter) in counters.iter_mut().enumerate() {
            let at_zero = self.sensors.get(index).map(|sensor| sensor.at_zero(self.counter_start));
            *counter = Self::reading(index, at_zero.unwrap_or(self.counter_start));
        }
    }

    /// Reading of the counter of sensor number `sensor` after `counts`: their low bits.
    pub const fn reading(sensor: usize, counts: u32) -> u32 {
        match Self::width(sensor) {
            CounterWidth::Bits16 => counts & 0xffff,
            CounterWidth::Bits32 => counts,
        }
    }

    /// The difference of two readings of sensor number `sensor`, with its sign (counts).
    pub const fn signed(sensor: usize, difference: u32) -> i64 {
        match Self::width(sensor) {
            CounterWidth::Bits16 => difference as i16 as i64,
            CounterWidth::Bits32 => difference as i32 as i64,
        }
    }

    /// Adds an external force on the cart in the next tick (N).
    pub fn push(&mut self, force_n: f64) {
        self.push_n = force_n;
    }

    /// Adds an external force on the cart (N) and external torques at the joints (N·m; missing ones are 0) in the next
    /// tick: those of a hand that pulls.
    pub fn pull(&mut self, force_n: f64, torques_n_m: &[f64]) {
        self.push_n = force_n;
        self.pull_n_m.iter_mut().zip(torques_n_m).for_each(|(pull, &torque)| *pull = torque);
    }

    /// Simulates one tick with the command `drive`, issued at its start; returns the motor's force on the cart at the
    /// start of the tick (N), without the disturbance; 0 for a drive that imposes the cart's motion.
    pub fn tick(&mut self, drive: Drive) -> f64 {
        if let Some(step_m) = self.step_m {
            self.step(drive, step_m);
            return 0.0;
        }
        let (now, disturbance) = self.begin(drive);
        let before = std::mem::replace(&mut self.acting_drive, now);
        let [latency, rest] = self.timing.next_tick();
        if latency > 0.0 {
            self.advance(before, disturbance, latency);
        }
        self.advance(now, disturbance, rest)
    }

    /// Simulates one tick of a drive that imposes the cart's motion by pulses, spread evenly. Without a motor they are
    /// a constant speed, and forces on the cart change nothing. A drive that is off lets go of a cart that its motor
    /// moved; without a motor, the cart stands. With a delay, it moves a tick after its pulses were counted.
    fn step(&mut self, drive: Drive, step_m: f64) {
        let (now, disturbance) = self.begin(drive);
        let of = |drive: Drive| if let Drive::Steps(pulses) = drive { Some(pulses) } else { None };
        let (counted, pulses) = (of(drive).unwrap_or(0), of(now).unwrap_or(0));
        let defect = self.step_defect.take();
        let missed = match defect {
            None => 0.0,
            Some(StepDefect::Off | StepDefect::Jammed) if self.step_motor.is_some() => 0.0,
            Some(StepDefect::Off | StepDefect::Jammed) => f64::from(pulses),
            Some(StepDefect::Misses(share)) => (share * f64::from(pulses)).round(),
        };
        let is_on = of(drive).is_some() && defect != Some(StepDefect::Off);
        let on_the_way = if self.delay { i64::from(pulses) } else { 0 };
        let (before, arrive) = (self.pulses - self.missed - on_the_way, f64::from(pulses) - missed);
        self.pulses += i64::from(counted);
        self.missed += missed as i64;
        let speed = arrive * step_m / self.period_s;
        let Some(motor) = &self.step_motor else {
            if let Some(mut servo) = self.servo.take() {
                self.follow(speed, &mut servo);
                self.servo = Some(servo);
                return;
            }
            self.plant.set_cart_speed(speed);
            self.plant.advance(0.0, &self.torques, self.period_s, self.substeps);
            self.plant.write_state(&mut self.state);
            return;
        };
        let parts = motor.parts(self.period_s);
        for part in 0..parts {
            // Pulse j of n begins at (j + 1/2) / n of the tick.
            let given = ((part as f64 + 0.5) / parts as f64 * arrive).round() as i64;
            let commanded = [(before + given) as f64 * step_m, speed];
            if defect == Some(StepDefect::Jammed) {
                self.plant.set_cart_speed(0.0);
            }
            let force = if is_on { motor.force_n(commanded, [self.state[0], self.state[1]]) } else { 0.0 };
            self.plant.advance(force + disturbance, &self.torques, self.period_s / parts as f64, 1);
            self.plant.write_state(&mut self.state);
        }
    }

    /// Simulates a tick in which the cart approaches a speed (m/s) as its servo does.
    fn follow(&mut self, speed: f64, servo: &mut Servo) {
        let parts = servo.parts(self.period_s, self.substeps);
        let part_s = self.period_s / parts as f64;
        for _ in 0..parts {
            let approached = servo.approach(self.state[1] - speed, part_s);
            self.plant.advance(approached / part_s, &self.torques, part_s, 1);
            self.plant.write_state(&mut self.state);
        }
    }

    /// Begins a tick with the command `drive`: returns the command that acts in it, which is that of the tick before
    /// if there is a delay, and the disturbing force (N). Draws the joint torques, too.
    fn begin(&mut self, drive: Drive) -> (Drive, f64) {
        let now = if self.delay { std::mem::replace(&mut self.pending_drive, drive) } else { drive };
        let push = std::mem::take(&mut self.push_n);
        let disturbance = self.force_offset + push + self.force_noise_n * self.standard_normal();
        for joint in 0..self.torques.len() {
            let noise = self.torque_noise_n_m * self.standard_normal();
            self.torques[joint] = noise + std::mem::take(&mut self.pull_n_m[joint]);
        }
        (now, disturbance)
    }

    /// The next random number of the standard normal distribution.
    #[inline]
    fn standard_normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.random)
    }

    /// The chain, if it can be simulated in lockstep: nothing in `[reality]` changes its motion, and a tick has a
    /// single force and always the same length.
    pub(super) fn lockstep_chain(rig: &Rig) -> Option<Chain> {
        let chain = rig.chain()?;
        let driver = &rig.reality.driver;
        let is_simple = rig.actuator.acceleration.is_none()
            && Driver::of(rig).is_none()
            && driver.latency_s == 0.0
            && driver.jitter_s == 0.0;
        ideal_chain(chain, rig).filter(|_| is_simple)
    }

    /// Begins a tick in lockstep: puts force and torques into a lane, and returns the motor's force (N).
    pub(super) fn push_lane(&mut self, drive: Drive, lanes: &mut dyn ChainLanes, lane: usize) -> f64 {
        let (now, disturbance) = self.begin(drive);
        let force = commanded_n(now);
        lanes.push(lane, force + disturbance, &self.torques);
        force
    }

    /// Ends a tick in lockstep: reads the state from a lane.
    pub(super) fn read_lane(&mut self, lanes: &dyn ChainLanes, lane: usize) {
        lanes.write_state(lane, &mut self.state);
    }

    /// The supply voltage, as a share of the voltage without load.
    pub fn supply_share(&self) -> f64 {
        self.driver.as_ref().map_or(1.0, Driver::supply_share)
    }

    /// Simulates a part of a tick of `length_s` (s), in which the command does not change; returns the motor's force
    /// at its start (N).
    fn advance(&mut self, drive: Drive, disturbance: f64, length_s: f64) -> f64 {
        let substeps = self.substeps_in(length_s);
        let Some(driver) = &mut self.driver else {
            let force = commanded_n(drive);
            self.plant.advance(force + disturbance, &self.torques, length_s, substeps);
            self.plant.write_state(&mut self.state);
            return force;
        };
        let acting = driver.acting(drive, disturbance);
        let at_start = acting.first_n(motor_speed(self.plant.as_ref(), &self.state));
        self.plant.advance_with(&acting, &self.torques, length_s, substeps);
        self.plant.write_state(&mut self.state);
        driver.finish(drive, length_s, motor_speed(self.plant.as_ref(), &self.state));
        at_start
    }

    /// Number of integration steps in a part of a tick, in proportion to its length (s).
    fn substeps_in(&self, length_s: f64) -> usize {
        if length_s == self.period_s {
            return self.substeps;
        }
        (self.substeps as f64 * length_s / self.period_s).ceil().max(1.0) as usize
    }
}

/// Speed of the motor, converted to speed of the cart (m/s).
fn motor_speed(plant: &dyn Plant, state: &[f64]) -> f64 {
    plant.motor_speed().or(state.get(1).copied()).unwrap_or_default()
}

/// Checks that a motor's speed can be followed within a tick.
fn can_be_followed(rig: &Rig, plant: &dyn Plant) -> Result<(), SimulationError> {
    let Some(motor) = &rig.actuator.motor else { return Ok(()) };
    let (period_s, damping) = (rig.tick.period_s, motor.braking_n_s_per_m());
    let steps = plant.steps(damping, period_s, 1);
    if steps <= MOST_STEPS {
        return Ok(());
    }
    Err(SimulationError::StiffMotor {
        within_s: period_s / (LARGEST_SHARE * steps as f64),
        period_s,
        speed_m_per_s: motor.supply_v / motor.volts_per_speed(),
    })
}

/// Force on the cart (N) of a drive without a motor, which produces the commanded one.
fn commanded_n(drive: Drive) -> f64 {
    match drive {
        Drive::Force(force) => f64::from(force),
        Drive::Duty(_) | Drive::Steps(_) => 0.0,
    }
}

/// The pulses that have been given to a drive whose cart is in this state: a servo's cart is behind its command.
fn pulses_at(state: &[f64], step_m: Option<f64>, servo: Option<&Servo>) -> i64 {
    let lag_s = servo.map_or(0.0, Servo::lag_s);
    step_m.map_or(0, |step_m| nearest((state[0] + lag_s * state[1]) / step_m))
}
