//! Fault injection: a defect between rig and firmware, tick by tick.

use rand::RngExt;
use rand_pcg::Pcg64;
use upright::board::Output;
use upright::boards::parts::PartInterface;
use upright::control::actuator::Drive;
use upright::control::encoder::{AbsoluteSensor, is_at_end};
use upright::protocol::frame::DELIMITER;
use upright::protocol::message::{Command, Request};
use upright::protocol::simulated_pins::BAD_SAMPLE;
use upright::table::{DriveMap, Thresholds};

use super::defect::Defect;
use super::expected::Phase;
use super::trial::Trial;
use crate::client::command_frame;
use crate::harness::{Pins, Session};
use upright_design::rig::Rig;
use upright_design::simulate::{Bench, StepDefect};
use upright_design::table::{MAX_SENSORS, TableValues};

/// Duration of a push on the cart (s).
const PUSH_S: f64 = 0.05;

/// Ticks for which a limit switch is pressed: a board debounces it.
const PRESSED_TICKS: usize = 3;
/// Longest delay of a measurement (ticks).
const LONGEST_LATENESS: usize = 20;

/// The raw counters of one tick.
type Counters = heapless::Vec<u32, MAX_SENSORS>;

/// The defect of a trial, tick by tick.
pub(super) struct Injection<'a> {
    trial: Trial,
    table: &'a TableValues,
    random: Pcg64,
    /// Counters at the onset.
    at_onset: Option<Counters>,
    past: Vec<Counters>,
    /// Thresholds of the firmware's tests.
    thresholds: &'a Thresholds<MAX_SENSORS>,
    /// Error of each sensor above which the firmware's tests can detect it (counts).
    visible_counts: Vec<i64>,
    /// Position and speed that the missing force or the missing pulses would have given the cart (m, m/s).
    missing: [f64; 2],
    full_force_n: f64,
    push_ticks: usize,
    supply_ticks: usize,
    /// What a board makes of the readings of a defective absolute sensor.
    board: Option<AbsoluteReading>,
}

/// A board's count for an absolute sensor.
struct AbsoluteReading {
    sensor: AbsoluteSensor,
    /// Bits of a reading.
    bits: u32,
    /// Its counter for a count of 0.
    at_zero: u32,
    /// Whether its counter is its reading, which is bad at the ends of the range.
    is_analog: bool,
}

impl AbsoluteReading {
    /// That of this sensor, whose counter is `counter`.
    fn of(table: &TableValues, sensor: usize, counter: u32) -> Self {
        let kind = table.sensors[sensor].kind;
        let bits = kind.reading().map_or(0, |reading| reading.bits);
        let mut board = AbsoluteSensor::new(bits);
        let at_zero = counter.wrapping_sub(board.count(counter & ((1 << bits) - 1)));
        Self { sensor: board, bits, at_zero, is_analog: kind.interface() == Some(PartInterface::Analog) }
    }

    /// The counter for a reading, of which only the bits that the sensor has are taken.
    fn counter(&mut self, reading: u32) -> u32 {
        let reading = reading & ((1 << self.bits) - 1);
        if self.is_analog { reading } else { self.at_zero.wrapping_add(self.sensor.count(reading)) }
    }

    /// Whether a board knows that this counter is bad.
    fn knows_bad(&self, counter: u32) -> bool {
        self.is_analog && is_at_end(counter, self.bits)
    }
}

/// Largest force of a push (N): the motor's; on a rig whose cart goes where its pulses say, a twentieth of its links'
/// weight.
pub fn push_limit_n(rig: &Rig, table: &TableValues) -> f64 {
    match rig.chain().filter(|_| table.drive.pulses().is_some()) {
        Some(chain) => 0.05 * chain.gravity_m_per_s2 * chain.links_mass_kg(),
        None => f64::from(table.drive.largest_force_n()),
    }
}

/// Number of ticks from one error to the next, for a defect of this severity.
fn every(size: f64) -> usize {
    5 + (45.0 * size) as usize
}

impl<'a> Injection<'a> {
    /// The defect of `trial` in a rig with this table.
    pub(super) fn new(rig: &Rig, table: &'a TableValues, trial: Trial) -> Self {
        let ticks = |seconds: f64| (seconds / rig.tick.period_s).ceil() as usize;
        let thresholds = match (&table.swing_up, trial.phase) {
            (None, _) | (_, Phase::Balancing | Phase::Jogging | Phase::Shaken) => &table.thresholds,
            (Some(swing_up), Phase::Raising | Phase::Lowering) => &swing_up.thresholds,
        };
        let visible = |sensor: usize| match table.observer {
            Some(_) => {
                let threshold = thresholds.innovation[sensor];
                (threshold / table.sensors[sensor].step).ceil().min(1e9) as i64
            }
            None => i64::MAX,
        };
        Self {
            random: trial.random(),
            trial,
            table,
            thresholds,
            at_onset: None,
            past: Vec::new(),
            visible_counts: (0..table.sensors()).map(visible).collect(),
            missing: [0.0; 2],
            full_force_n: push_limit_n(rig, table),
            push_ticks: ticks(PUSH_S),
            supply_ticks: table.limits.supply_ticks as usize,
            board: None,
        }
    }

    /// Whether the host still sends keep-alives, `since` ticks after the onset.
    pub(super) fn host_is_alive(&self, since: Option<usize>) -> bool {
        self.trial.kind != Defect::HostSilent || since.is_none()
    }

    /// Changes what the firmware reads, `since` ticks after the onset; returns whether it differs visibly from a
    /// healthy rig.
    pub(super) fn inputs(&mut self, since: usize, inputs: &mut Pins) -> bool {
        let Trial { kind, sensor, sign, size, .. } = self.trial;
        let truth = inputs.raw_counts.clone();
        let began = self.at_onset.get_or_insert_with(|| truth.clone()).clone();
        self.past.push(truth.clone());
        if self.past.len() > 2 * LONGEST_LATENESS {
            self.past.drain(..LONGEST_LATENESS);
        }
        let (contacts, surge) = (&mut inputs.contacts, 1.3 + 0.3 * size as f32);
        let moved = |sensor: usize| Bench::signed(sensor, truth[sensor].wrapping_sub(began[sensor]));
        let off = (self.visible_counts[sensor] as f64 * (2.0 + 18.0 * size) * sign) as i64;
        let shows = |sensor: usize, counts: i64| (sensor, began[sensor].wrapping_add(counts as u32));
        let mut shown = Vec::new();
        match kind {
            Defect::SupplyNotANumber if since == 0 => inputs.supply_v = f32::NAN,
            Defect::SupplySag => inputs.supply_v = self.table.limits.supply_min_v * (0.2 + 0.7 * size as f32),
            Defect::SupplyDip if since < self.supply_ticks => {
                inputs.supply_v = self.table.limits.supply_min_v * (0.2 + 0.7 * size as f32);
            }
            Defect::SupplySurge => inputs.supply_v *= surge,
            Defect::SupplySpike if since < 1 + usize::from(size > 0.5) => inputs.supply_v *= surge,
            Defect::EmergencyStop if since == 0 => contacts.emergency_stop = true,
            Defect::DriverFault if since == 0 => contacts.driver_fault = true,
            Defect::LimitSwitch if since < PRESSED_TICKS && sign > 0.0 => contacts.limit_high = true,
            Defect::LimitSwitch if since < PRESSED_TICKS => contacts.limit_low = true,
            Defect::OneOverrun => contacts.overrun = since < 1 + usize::from(size > 0.5),
            Defect::Overruns => contacts.overrun = since < 3,
            Defect::LinkEncoderFrozen | Defect::CartEncoderFrozen => shown.push(shows(sensor, 0)),
            Defect::BadSample if since == 0 => shown.push(shows(sensor, moved(sensor) + off)),
            Defect::EncoderJump => shown.push(shows(sensor, moved(sensor) + off)),
            Defect::SensorIntermittent if since % 3 < 2 => shown.push(shows(sensor, moved(sensor) + off)),
            Defect::EncoderReversed => shown.push(shows(sensor, -moved(sensor))),
            Defect::EncoderWireOpen => {
                // The edges of the other channel are counted up and down in turn.
                shown.push(shows(sensor, i64::from(moved(sensor).rem_euclid(4) >= 2)));
            }
            Defect::EncodersSwapped if truth.len() > 1 => {
                shown.push(shows(sensor, moved(sensor + 1)));
                shown.push(shows(sensor + 1, moved(sensor)));
            }
            Defect::CountsLost => {
                let lost = sign * (since / every(size)) as f64;
                shown.push(shows(sensor, moved(sensor) - lost as i64));
            }
            Defect::SensorDead | Defect::SensorBit => {
                shown.extend(self.of_reading(since, [truth[sensor], began[sensor]], inputs));
            }
            Defect::SampleInvalid => inputs.raw_counts[sensor] |= BAD_SAMPLE,
            Defect::SensorLate => {
                let late = 1 + ((LONGEST_LATENESS - 1) as f64 * size) as usize;
                let then = self.past[self.past.len().saturating_sub(1 + late)][sensor];
                inputs.raw_counts[sensor] = then;
                return (Bench::signed(sensor, truth[sensor].wrapping_sub(then))).abs()
                    > self.visible_counts[sensor];
            }
            _ => {}
        }
        self.show(&shown, &truth, inputs)
    }

    /// The counter that a board makes of the readings of a defective absolute sensor, whose counter would be `truth`,
    /// and was `began` at the onset; none if the board knows that it is bad.
    fn of_reading(
        &mut self,
        since: usize,
        [truth, began]: [u32; 2],
        inputs: &mut Pins,
    ) -> Option<(usize, u32)> {
        let Trial { kind, sensor, sign, size, .. } = self.trial;
        let table = self.table;
        let board = self.board.get_or_insert_with(|| AbsoluteReading::of(table, sensor, began));
        let counter = board.counter(match kind {
            Defect::SensorDead if sign > 0.0 => u32::MAX,
            Defect::SensorDead => 0,
            _ if since.is_multiple_of(every(size)) => truth ^ 1 << self.random.random_range(0..board.bits),
            _ => truth,
        });
        if board.knows_bad(counter) {
            inputs.raw_counts[sensor] = counter | BAD_SAMPLE;
            return None;
        }
        Some((sensor, counter))
    }

    /// Sets encoders to wrong counters; returns whether one is visibly wrong.
    fn show(&self, shown: &[(usize, u32)], truth: &[u32], inputs: &mut Pins) -> bool {
        let mut visible = false;
        for (sensor, counter) in shown.iter().copied() {
            let counter = Bench::reading(sensor, counter);
            let wrong = Bench::signed(sensor, counter.wrapping_sub(truth[sensor]));
            visible |= wrong.abs() > self.visible_counts[sensor];
            inputs.raw_counts[sensor] = counter;
        }
        visible
    }

    /// Changes the output to the motor, `since` ticks after the onset; returns whether the effect by now differs
    /// visibly from a healthy rig.
    pub(super) fn output(&mut self, since: usize, output: &mut Output) -> bool {
        if let Drive::Steps(pulses) = output.drive {
            return self.misses(pulses, since);
        }
        let (Drive::Force(command) | Drive::Duty(command)) = &mut output.drive else { return false };
        let asked = *command;
        let (full, force_per_command) = match &self.table.drive {
            DriveMap::Volts(motor) => (1.0, f64::from(motor.supply_v / motor.volts_per_newton)),
            _ => (self.full_force_n as f32, 1.0),
        };
        *command = match self.trial.kind {
            Defect::MotorDead => 0.0,
            Defect::MotorReversed => -asked,
            Defect::MotorStuck => full * self.trial.sign as f32,
            Defect::MotorWeak => asked * (0.1 + 0.4 * self.trial.size as f32),
            _ => return false,
        };
        let missing_n = f64::from(asked - *command) * force_per_command;
        let Some(observer) = &self.table.observer else { return false };
        let [b_p, b_v] = [0, 1].map(|state| f64::from(observer.bd[state]));
        let [p, v] = self.missing;
        self.missing = [p + v * f64::from(self.table.tick_s) + b_p * missing_n, v + b_v * missing_n];
        self.missing[0].abs() > f64::from(self.thresholds.innovation[0])
    }

    /// What is wrong, `since` ticks after the onset, with a drive that takes pulses.
    pub(super) fn step_defect(&self, since: usize) -> Option<StepDefect> {
        let Trial { kind, size, .. } = self.trial;
        self.table.drive.pulses()?;
        match kind {
            Defect::MotorDead => Some(StepDefect::Off),
            Defect::CartJammed => Some(StepDefect::Jammed),
            // A step back for each one forward.
            Defect::MotorReversed => Some(StepDefect::Misses(2.0)),
            Defect::PulsesMissing => Some(StepDefect::Misses(0.5 + 0.45 * size)),
            Defect::SomePulsesMissing => Some(StepDefect::Misses(0.05 + 0.45 * size)),
            Defect::StepsLost if since < 1 + (10.0 * size) as usize => Some(StepDefect::Misses(1.0)),
            _ => None,
        }
    }

    /// Takes note of the pulses of a tick in which a drive is defective; returns whether the first link shows by now
    /// that some are missing.
    fn misses(&mut self, pulses: i32, since: usize) -> bool {
        let share = match self.step_defect(since) {
            None => 0.0,
            Some(StepDefect::Off | StepDefect::Jammed) => 1.0,
            Some(StepDefect::Misses(share)) => share,
        };
        let (Some(steps), Some(observer)) = (self.table.drive.pulses(), &self.table.observer) else {
            return false;
        };
        self.missing[0] += share * f64::from(pulses) * f64::from(steps.step_m);
        // The link turns by this for each metre that the cart has gone (rad/m).
        let turns = observer.bd.get(3).map_or(0.0, |&rate| f64::from(rate / self.table.tick_s));
        (self.missing[0] * turns).abs() > f64::from(self.thresholds.innovation[1])
    }

    /// External force (N): on the cart, or on the first link of a rig whose cart goes where its pulses say.
    pub(super) fn push_n(&self, since: usize) -> f64 {
        let pushes = self.trial.kind == Defect::Push && since < self.push_ticks;
        if pushes { self.trial.sign * self.trial.size * self.full_force_n } else { 0.0 }
    }

    /// Sends what the defect sends over the serial line, at the onset.
    pub(super) fn serial(&mut self, session: &mut Session<'_>) {
        let Trial { kind, sign, size, .. } = self.trial;
        let disarm = |id: u64| command_frame(&Command { id, request: Request::Disarm });
        let mut next = disarm(session.last_id() + 1);
        match kind {
            Defect::FrameDamaged => {
                let bit = self.random.random_range(0..8 * (next.len() - 1));
                next[bit / 8] ^= 1 << (bit % 8);
                session.send_bytes(&next);
            }
            Defect::FrameTruncated => {
                let left = self.random.random_range(1..next.len() - 1);
                next.truncate(left);
                next.push(DELIMITER);
                session.send_bytes(&next);
            }
            Defect::FrameReplayed => {
                session.send_bytes(&disarm(1 + self.trial.seed % session.last_id().max(1)))
            }
            Defect::Rubbish => {
                let mut rubbish: Vec<u8> =
                    (0..self.random.random_range(1..60)).map(|_| self.random.random()).collect();
                // The frames after it have to be readable again.
                rubbish.push(DELIMITER);
                session.send_bytes(&rubbish);
            }
            Defect::SetpointNotANumber => {
                let values = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
                let _ = session.send(Request::Setpoint(values[(size * 2.99) as usize]));
            }
            Defect::SetpointOutOfRange => {
                let [low, high] = self.table.limits.rail_m;
                let beyond = if sign > 0.0 { high } else { low } * (1.01 + 100.0 * size as f32);
                let _ = session.send(Request::Setpoint(beyond));
            }
            _ => {}
        }
    }
}
