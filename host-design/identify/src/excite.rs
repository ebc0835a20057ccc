//! The force that shakes the machine, and the log of a simulated machine that is shaken.

use core::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use upright::control::actuator::Drive;
use upright::protocol::simulated_pins::BAD_SAMPLE;
use upright::supervision::shaking::SPEED_SHARE;
use upright::supervision::slow_drive::SlowDrive;
use upright::table::{Law, StepMap, without_errors};
use upright_design::plant::ChainParameters;
use upright_design::reality::hanging_by_hand;
use upright_design::rig::{Actuator, Chain, Motor, Rig};
use upright_design::simulate::{Bench, Scenario};
use upright_design::table::{NoTable, sensor_rows, step_map};

use crate::cart_force::CartForce;
use crate::channel::chain_of;
use crate::error::IdentifyError;
use crate::log::{DriveScale, Log, LogHeader, Tick};
use crate::model::Model;
use crate::modes::hanging_modes;
use crate::parameters::{Layout, priors};
use crate::record::Record;
use crate::step::Step;

/// Number of spectral lines of the excitation, for one link and for more.
const LINES: [usize; 2] = [16, 24];
/// Limits of its frequency band, as multiples of the lowest and of the highest hanging mode.
const BAND: [f64; 2] = [0.25, 1.6];
/// The lower limit, if the drive imposes the cart's motion: with accelerations of equal size, slow lines need most of
/// the rail, and no friction of the cart has to be seen in them.
const LOWEST_MOVED: f64 = 0.7;
/// Intended motion: largest angle of a link from hanging (rad), and share of the rail.
pub(crate) const AIM: (f64, f64) = (60.0 * PI / 180.0, 0.6);
/// A run is abandoned when the cart goes beyond this share of the rail, or a potentiometer does not read.
const STOP: f64 = 0.85;
/// Largest intended share of the angle that a potentiometer reads, to the nearer side of hanging. The firmware's host
/// adapts the force only every few seconds, and the cart's way back to the middle swings the links, too.
const READ_SHARE: f64 = 0.5;
/// Factors on the amplitude that are tried one after the other, in case the machine moves more than the model.
const RETRIES: [f64; 4] = [1.0, 0.7, 0.5, 0.35];
/// The amplitude is raised while the machine moves less than this share of the intended motion: the share, the largest
/// factor at a time, and the number of trial runs.
const RAISE: (f64, f64, usize) = (0.8, 1.6, 3);
/// Time over which the force is ramped up at the beginning and down at the end (s).
const RAMP_S: f64 = 1.0;
/// Longest first trial run in the search for an amplitude (s).
const TRIAL_S: f64 = 20.0;
/// Intervals for which the motion of the model is kept (s).
const REACH_S: f64 = 0.5;
/// Steps of the search for an amplitude.
const BISECTIONS: usize = 12;
/// Share of the force limit and of the speed limit that the excitation may need.
const INPUT_SHARE: f64 = 0.8;

/// A sum of sines of equal force, with a weak spring and damper that keep the cart near the middle:
/// `u = A r(t) Σ cos(2π f_i t + φ_i) - k_p x - k_d ẋ`. If the drive imposes the cart's motion, u is its acceleration:
/// m/s² take the place of newtons, and 1 that of the mass.
#[derive(Debug, Clone, PartialEq)]
pub struct Excitation {
    /// Amplitude of each line (N).
    pub amplitude_n: f64,
    /// Frequency (Hz) and phase (rad) of each line.
    pub lines: Vec<[f64; 2]>,
    /// k_p (N/m).
    pub stiffness_n_per_m: f64,
    /// k_d (N·s/m).
    pub damping_n_s_per_m: f64,
    /// Duration (s).
    pub duration_s: f64,
    /// How far the model moves in each [`REACH_S`], as a share of the intended motion.
    reach: Vec<f64>,
}

impl Excitation {
    /// The excitation for a rig, with the largest amplitude that the model of its file allows.
    ///
    /// # Errors
    /// [`IdentifyError`] if the rig has no chain with encoders, or its hanging modes cannot be computed.
    pub fn design(rig: &Rig, duration_s: f64, seed: u64) -> Result<Self, IdentifyError> {
        let chain = chain_of(rig)?;
        let [lowest, highest] = hanging_modes(chain)?;
        let count = LINES[usize::from(chain.links.len() > 1)];
        let slowest = if rig.actuator.held().is_motion() { LOWEST_MOVED } else { BAND[0] };
        let (from, to) = (slowest * lowest, BAND[1] * highest);
        let mut random = Pcg64::seed_from_u64(seed);
        let line = |i: usize| {
            let share = i as f64 / (count - 1) as f64;
            [from * libm::pow(to / from, share), random.random_range(0.0..TAU)]
        };
        let mass = moved_mass(rig, chain);
        let slow = TAU * 0.15 * lowest;
        let mut excitation = Self {
            amplitude_n: 0.0,
            lines: (0..count).map(line).collect(),
            stiffness_n_per_m: mass * slow * slow,
            damping_n_s_per_m: 1.4 * mass * slow,
            duration_s,
            reach: Vec::new(),
        };
        excitation.find_amplitude(rig, chain);
        Ok(excitation)
    }

    /// Force (N) at `time_s` with the cart at `x` (m) and `speed` (m/s).
    pub fn force_n(&self, time_s: f64, x: f64, speed: f64) -> f64 {
        self.sines_n(time_s) - self.stiffness_n_per_m * x - self.damping_n_s_per_m * speed
    }

    /// Force (N) at `time_s` without spring and damper.
    pub fn sines_n(&self, time_s: f64) -> f64 {
        let ramp = (time_s / RAMP_S).min((self.duration_s - time_s) / RAMP_S).clamp(0.0, 1.0);
        let sum: f64 = self.lines.iter().map(|[f, phase]| libm::cos(TAU * f * time_s + phase)).sum();
        self.amplitude_n * ramp * sum
    }

    /// How far the model moves from `from_s` to `to_s` (s), as a share of the intended motion: at most 1.
    pub(crate) fn reach(&self, from_s: f64, to_s: f64) -> f64 {
        let [from, to] = [from_s / REACH_S, to_s / REACH_S].map(|at| at.max(0.0) as usize);
        self.reach.iter().take(to).skip(from).copied().fold(0.0, f64::max)
    }

    /// Finds by bisection the largest amplitude for which the model stays within [`AIM`] and the limits of force and
    /// speed for the whole run. Of a long one, the beginning nearly always says enough.
    fn find_amplitude(&mut self, rig: &Rig, chain: &Chain) {
        let record = Record::of(rig, &[], 1);
        let model = record.model(chain.gravity_m_per_s2);
        let mut p: Vec<f64> = priors(rig, chain, false).iter().map(|prior| prior.value).collect();
        p[Layout { links: chain.links.len() }.delay()] = 0.0;
        let weight = moved_mass(rig, chain) * chain.gravity_m_per_s2;
        let limit = rig.actuator.largest_input().unwrap_or(f64::INFINITY);
        let mut largest = weight.min(limit);
        for length_s in [TRIAL_S.min(self.duration_s), self.duration_s] {
            let mut trial = |amplitude_n: f64| {
                self.amplitude_n = amplitude_n;
                self.moved(&model, &p, rig, length_s)
            };
            if let Some(reach) = trial(largest) {
                self.reach = reach;
                continue;
            }
            let mut low = 0.0;
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (low + largest);
                if trial(middle).is_some() {
                    low = middle;
                } else {
                    largest = middle;
                }
            }
            largest = low;
            self.reach = trial(low).unwrap_or_default();
        }
    }

    /// How far the model moves in each [`REACH_S`] of the first `length_s` (s), as a share of the intended motion; none
    /// if it goes beyond that or a limit.
    fn moved(&self, model: &Model, p: &[f64], rig: &Rig, length_s: f64) -> Option<Vec<f64>> {
        let m = model.coordinates();
        let dt_s = rig.tick.period_s * Record::usual_stride(rig.tick.period_s) as f64;
        let (widest, farthest) = (aim_rad(rig), AIM.1 * half_rail(rig.chain()?));
        let fastest = INPUT_SHARE * speed_limit(rig).unwrap_or(f64::INFINITY);
        let limit_n = rig.actuator.largest_input().unwrap_or(f64::INFINITY);
        let mut state = vec![0.0; model.states()];
        state[1..m].fill(PI);
        let mut step = Step::new(model, false);
        let mut reach = Vec::new();
        for k in 0..(length_s / dt_s) as usize {
            let force = self.force_n(k as f64 * dt_s, state[0], state[m]);
            step.take(model, p, &state, &CartForce { force, ..CartForce::default() }, dt_s);
            state.copy_from_slice(&step.end);
            let turned = state[1..m].iter().map(|phi| (phi - PI).abs()).fold(0.0, f64::max);
            let share = (turned / widest).max(state[0].abs() / farthest);
            // Written so that NaN counts as leaving the limits.
            if !(share <= 1.0 && state[m].abs() <= fastest && force.abs() <= INPUT_SHARE * limit_n) {
                return None;
            }
            reach.resize((k as f64 * dt_s / REACH_S) as usize + 1, 0.0);
            reach.iter_mut().last().into_iter().for_each(|last: &mut f64| *last = last.max(share));
        }
        Some(reach)
    }
}

/// Largest intended angle of a link from hanging (rad): that of [`AIM`], or what the links' potentiometers read.
pub(crate) fn aim_rad(rig: &Rig) -> f64 {
    let rooms = rig.sensors().into_iter().filter_map(|sensor| sensor.room_rad());
    rooms.fold(AIM.0, |aim, room| aim.min(READ_SHARE * room))
}

/// Distance from the middle (x = 0) to the nearer end of the rail (m).
pub(crate) fn half_rail(chain: &Chain) -> f64 {
    let [low, high] = chain.cart.travel_m;
    high.min(-low)
}

/// What a unit of the excitation has to move (kg): 1 if the drive imposes the acceleration.
fn moved_mass(rig: &Rig, chain: &Chain) -> f64 {
    if rig.actuator.held().is_motion() { 1.0 } else { ChainParameters::<f64>::of(chain).total_mass }
}

/// Largest speed of the cart (m/s): that of the file, and of a drive that imposes its motion; none without a limit.
fn speed_limit(rig: &Rig) -> Option<f64> {
    let of_drive = rig.actuator.largest_speed_m_per_s(rig.tick.period_s);
    of_drive.into_iter().chain(rig.limits.speed_m_per_s).reduce(f64::min)
}

/// The log of the simulated machine of `rig`, with its `[reality]`, shaken for `duration_s`.
///
/// # Errors
/// [`IdentifyError`] if it cannot be shaken within its rail.
pub fn shake(rig: &Rig, duration_s: f64, seed: u64) -> Result<Log, IdentifyError> {
    shake_machine(rig, rig, duration_s, seed)
}

/// As [`shake`], for a `machine` that differs from its `file`: the shaking host knows only the file.
pub(crate) fn shake_machine(
    file: &Rig,
    machine: &Rig,
    duration_s: f64,
    seed: u64,
) -> Result<Log, IdentifyError> {
    let mut excitation = Excitation::design(file, duration_s, seed)?;
    // Friction that the file does not have reduces the motion.
    for _ in 0..RAISE.2 {
        let trial = Excitation { duration_s: duration_s.min(TRIAL_S), ..excitation.clone() };
        let Some(log) = run(file, machine, &trial, seed)? else { break };
        let moved = motion(file, &log)?;
        if moved > RAISE.0 {
            break;
        }
        excitation.amplitude_n *= (1.0 / moved).min(RAISE.1);
    }
    let amplitude = excitation.amplitude_n;
    for share in RETRIES {
        excitation.amplitude_n = share * amplitude;
        if let Some(log) = run(file, machine, &excitation, seed)? {
            return Ok(log);
        }
    }
    Err(IdentifyError::Excitation(format!(
        "{}: the cart leaves {:.0} % of the rail, or a link what its potentiometer reads, even at {:.0} % of the force; is \
         the rail level?",
        file.name,
        100.0 * STOP,
        100.0 * RETRIES[3]
    )))
}

/// How far the machine moved in a log, as a share of the intended motion.
fn motion(rig: &Rig, log: &Log) -> Result<f64, IdentifyError> {
    let record = Record::of(rig, core::slice::from_ref(log), Record::usual_stride(rig.tick.period_s));
    let cart = record.extent(0)[0] / (AIM.1 * half_rail(chain_of(rig)?));
    Ok(cart.max(record.largest_angle() / aim_rad(rig)))
}

/// One run of `machine`, whose file is `rig`; none if the cart goes too far.
fn run(rig: &Rig, machine: &Rig, excitation: &Excitation, seed: u64) -> Result<Option<Log>, IdentifyError> {
    let chain = chain_of(rig)?;
    let channels = chain.links.len() + 1;
    let scenario = Scenario { start: hanging_by_hand(machine), seed, ..Scenario::at_rest(machine, Law::Lqr) };
    let failed = |error: &dyn std::fmt::Display| IdentifyError::Excitation(error.to_string());
    let mut bench = Bench::new(machine, &scenario).map_err(|error| failed(&error))?;
    let steps: Vec<f64> = rig.sensors().iter().map(|sensor| sensor.step()).collect();
    let (mut counters, mut at_zero) = (vec![0; channels], vec![0; channels]);
    // An absolute sensor has its own zero, which homing knows.
    bench.read_counters_at_zero(&mut at_zero);
    let hanging: Vec<u16> = (0..channels)
        .map(|channel| if channel == 1 { libm::round(PI / steps[1]) as i64 as u16 } else { 0 })
        .collect();
    let full_n = rig
        .actuator
        .largest_force_n()
        .unwrap_or(10.0 * excitation.amplitude_n * excitation.lines.len() as f64);
    let mut shaking = ShakingDrive::of(rig, full_n)?;
    let rows = sensor_rows(rig);
    let mut log = Log::new(LogHeader {
        rig: rig.name.clone(),
        hash: rig.hash(),
        period_ns: (rig.tick.period_s * 1e9).round() as u32,
        drive: DriveScale::of(rig, full_n),
        hanging,
    });
    let farthest = STOP * half_rail(chain);
    let period_s = rig.tick.period_s;
    let mut speed = Speed::new(period_s);
    for number in 0..(excitation.duration_s / period_s) as u32 {
        bench.read_counters(&mut counters);
        without_errors(&rows, &mut counters);
        let counts: Vec<u16> =
            counters.iter().zip(&at_zero).map(|(count, zero)| count.wrapping_sub(*zero) as u16).collect();
        let x = f64::from(Bench::signed(0, counters[0]) as i32) * steps[0];
        if x.abs() > farthest || counters.iter().skip(1).any(|counter| counter & BAD_SAMPLE != 0) {
            return Ok(None);
        }
        let speed = speed.after(x);
        let force = excitation.force_n(f64::from(number) * period_s, x, speed);
        let (drive, part) = shaking.command(force, speed, period_s);
        bench.tick(drive);
        let volts = rig.actuator.motor().map_or(0.0, |motor| motor.supply_v);
        let supply_mv = (1e3 * volts * bench.supply_share()).round() as u16;
        log.push(Tick { number, drive: part, supply_mv, contacts: 0 }, &counts);
    }
    Ok(Some(log))
}

/// How the host drives the cart that it shakes.
enum ShakingDrive<'a> {
    /// By a force, of which this many newtons are full scale.
    Force(f64),
    /// By a voltage that gives the force at the speed of the cart.
    Motor(&'a Motor),
    /// By pulses, as the firmware gives them.
    Pulses(StepMap, SlowDrive),
}

impl<'a> ShakingDrive<'a> {
    fn of(rig: &'a Rig, full_n: f64) -> Result<Self, IdentifyError> {
        let drive = match &rig.actuator {
            Actuator::Force(_) => return Ok(Self::Force(full_n)),
            Actuator::Motor(motor, _) => return Ok(Self::Motor(motor)),
            Actuator::Pulses(drive) => drive,
        };
        let failed = |error: NoTable| IdentifyError::Excitation(format!("{}: {error}", rig.name));
        let mut map = step_map(drive, rig.tick.period_s).map_err(failed)?;
        let most = rig.limits.speed_m_per_s.map_or(f32::MAX, |limit| SPEED_SHARE * limit as f32);
        map.speed_limit_m_per_s = map.speed_limit_m_per_s.min(most);
        Ok(Self::Pulses(map, SlowDrive::default()))
    }

    /// The command for a force (N) or an acceleration (m/s²) at a speed of the cart, and its 16-bit value in the log.
    fn command(&mut self, input: f64, speed: f64, period_s: f64) -> (Drive, i16) {
        let of = |part: f64| (part.clamp(-1.0, 1.0) * f64::from(i16::MAX)).round() as i16;
        match self {
            Self::Force(full_n) => {
                let part = of(input / *full_n);
                (Drive::Force((f64::from(part) / f64::from(i16::MAX) * *full_n) as f32), part)
            }
            Self::Motor(motor) => {
                let volts = input * motor.resistance_before_bridge_ohm() / motor.newtons_per_amp()
                    + motor.volts_per_speed() * speed;
                // The dead zone is compensated as in the firmware: without a jump.
                let lift = (10.0 * volts).clamp(-motor.dead_zone_v, motor.dead_zone_v);
                let part = of((volts + lift) / motor.supply_v);
                (Drive::Duty((f64::from(part) / f64::from(i16::MAX)) as f32), part)
            }
            Self::Pulses(map, drive) => {
                let (_, pulses) = drive.accelerate(input as f32, map, period_s as f32);
                (Drive::Steps(pulses), pulses as i16)
            }
        }
    }
}

/// Speed of the cart from its positions, through a low-pass filter with a time constant of 5 ms.
struct Speed {
    period_s: f64,
    last: Option<f64>,
    speed: f64,
}

impl Speed {
    fn new(period_s: f64) -> Self {
        Self { period_s, last: None, speed: 0.0 }
    }

    fn after(&mut self, x: f64) -> f64 {
        let raw = (x - self.last.replace(x).unwrap_or(x)) / self.period_s;
        self.speed += (raw - self.speed) * (self.period_s / 0.005).min(1.0);
        self.speed
    }
}
