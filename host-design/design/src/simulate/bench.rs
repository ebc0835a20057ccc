//! The simulated rig: plant, motor, encoders and disturbances, one tick at a time.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use upright::control::actuator::Drive;
use upright::control::encoder::CounterWidth;
use upright::protocol::simulated_pins::BAD_SAMPLE;

use super::drive::{SimulatedDrive, StepDefect, commanded_n};
use super::driven_cart::DrivenCart;
use super::error::SimulationError;
use super::scenario::Scenario;
use super::sensor::SimulatedSensor;
use crate::plant::{ChainLanes, LARGEST_SHARE, LinearSimulation, MOST_STEPS, Plant};
use crate::reality::{Driver, RealEncoders, StepMotor, Timing, ideal_chain, real_plant};
use crate::rig::{Chain, Held, PlantDescription, Rig};

/// The simulated rig: everything outside the controller.
pub struct Bench {
    plant: Box<dyn Plant>,
    drive: SimulatedDrive,
    timing: Timing,
    encoders: Option<RealEncoders>,
    sensors: Vec<SimulatedSensor>,
    counter_start: u32,
    random: Pcg64,
    force_noise_n: f64,
    torque_noise_n_m: f64,
    force_offset: f64,
    is_disturbed: bool,
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
        let mut plant: Box<dyn Plant> = match &rig.plant {
            PlantDescription::Chain(chain) => match StepMotor::of(rig) {
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
        Ok(Self {
            torques: vec![0.0; plant.disturbances()],
            pull_n_m: vec![0.0; plant.disturbances()],
            plant,
            drive: SimulatedDrive::of(rig, &scenario.start),
            timing: Timing::of(rig, scenario.seed),
            encoders: RealEncoders::of(rig),
            sensors: SimulatedSensor::all(rig, scenario.counter_start, &scenario.start),
            counter_start: scenario.counter_start,
            random: Pcg64::seed_from_u64(scenario.seed),
            force_noise_n: noise(scenario.force_noise_n)?,
            torque_noise_n_m: noise(scenario.torque_noise_n_m)?,
            force_offset: finite(scenario.force_offset_n)?,
            is_disturbed: true,
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
        if let SimulatedDrive::Pulses(pulses) = &mut self.drive {
            pulses.rest_at(state);
        }
    }

    /// Continues where `before` is, which simulates the same rig with other properties.
    pub fn take_over(&mut self, before: &Self) {
        self.hold(&before.state);
        self.sensors.iter_mut().zip(&before.sensors).for_each(|(sensor, before)| sensor.take_over(before));
        if let (SimulatedDrive::Pulses(pulses), SimulatedDrive::Pulses(before)) =
            (&mut self.drive, &before.drive)
        {
            pulses.take_over(before);
        }
    }

    /// Whether the disturbances of the scenario act from now on. While they do not, none of their random numbers are
    /// drawn.
    pub fn disturb(&mut self, is_disturbed: bool) {
        self.is_disturbed = is_disturbed;
    }

    /// Spoils a drive with pulses in the next tick.
    pub fn spoil(&mut self, defect: StepDefect) {
        if let SimulatedDrive::Pulses(pulses) = &mut self.drive {
            pulses.spoil(defect);
        }
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
            if index == 0
                && let SimulatedDrive::Pulses(pulses) = &self.drive
            {
                *counter = Self::reading(0, self.counter_start.wrapping_add(pulses.counted() as u32));
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
        let (now, disturbance) = self.begin(drive);
        let before = std::mem::replace(&mut self.acting_drive, now);
        let (period_s, delay) = (self.period_s, self.delay);
        let mut cart = DrivenCart {
            plant: self.plant.as_mut(),
            state: &mut self.state,
            torques: &self.torques,
            period_s,
            substeps: self.substeps,
        };
        if let SimulatedDrive::Pulses(pulses) = &mut self.drive {
            pulses.tick(drive, now, delay, disturbance, &mut cart);
            return 0.0;
        }
        let [latency, rest] = self.timing.next_tick();
        if latency > 0.0 {
            self.drive.push(before, disturbance, latency, &mut cart);
        }
        self.drive.push(now, disturbance, rest, &mut cart)
    }

    /// Begins a tick with the command `drive`: returns the command that acts in it, which is that of the tick before
    /// if there is a delay, and the disturbing force (N). Draws the joint torques, too.
    fn begin(&mut self, drive: Drive) -> (Drive, f64) {
        let now = if self.delay { std::mem::replace(&mut self.pending_drive, drive) } else { drive };
        let push = std::mem::take(&mut self.push_n);
        if !self.is_disturbed {
            self.torques.copy_from_slice(&self.pull_n_m);
            self.pull_n_m.fill(0.0);
            return (now, push);
        }
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
        let is_simple = rig.actuator.held() == Held::Force
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
        match &self.drive {
            SimulatedDrive::Driver(driver) => driver.supply_share(),
            SimulatedDrive::Force | SimulatedDrive::Pulses(_) => 1.0,
        }
    }
}

/// Checks that a motor's speed can be followed within a tick.
fn can_be_followed(rig: &Rig, plant: &dyn Plant) -> Result<(), SimulationError> {
    let Some(motor) = rig.actuator.motor() else { return Ok(()) };
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
