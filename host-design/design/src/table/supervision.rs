//! Limits and thresholds of the supervisor, from the rig file to the firmware's types.

use upright::table::{Limits, MotorTest, PartReading, ReadingMap, SensorKind, SensorRow, Thresholds};

use super::any_size::{MAX_SENSORS, MAX_STATES};
use super::error::{NoTable, finite};
use crate::design::DetectionDesign;
use crate::rig::{Chain, Rig, Sensor, TurnErrors, defaults};

/// Motion by hand that the sign check of an encoder requires: of a link (rad) …
const SIGN_RAD: f64 = 0.2;
/// … and of the cart (share of the rail).
const SIGN_SHARE: f64 = 0.05;

/// Motion of a noisy sensor that is still, in standard deviations of its noise: readings of two ticks differ by more
/// once in a million ticks.
const STILL_DEVIATIONS: f64 = 7.0;

/// Limits of `rig`, whose sensors have these steps (m or rad). Without steps there are no limits in counts.
pub(super) fn limits(rig: &Rig, steps: &[f64]) -> Result<Limits, NoTable> {
    let wanted = &rig.limits;
    let ticks = |seconds: f64| (seconds / rig.tick.period_s).round().clamp(1.0, f64::from(u32::MAX)) as u32;
    let none = Limits::none();
    let mut limits = Limits {
        speed_m_per_s: narrow("limits.speed_m_per_s", wanted.speed_m_per_s)?.unwrap_or(none.speed_m_per_s),
        jog_force_n: narrow("limits.jog_force_n", jog_force_n(rig))?.unwrap_or(none.jog_force_n),
        supply_min_v: narrow("limits.supply_min_v", supply_min_v(rig))?.unwrap_or(none.supply_min_v),
        supply_ticks: ticks(wanted.supply_time_s),
        saturated_ticks: ticks(wanted.saturation_time_s),
        link_ticks: ticks(wanted.link_timeout_s),
        arm_ticks: ticks(wanted.arm_time_s),
        still_ticks: ticks(wanted.still_time_s),
        ..none
    };
    if let Some(chain) = rig.chain() {
        set_limits_of_chain(&mut limits, rig, chain, steps)?;
    }
    Ok(limits)
}

fn set_limits_of_chain(limits: &mut Limits, rig: &Rig, chain: &Chain, steps: &[f64]) -> Result<(), NoTable> {
    let wanted = &rig.limits;
    let [low, high] = chain.cart.travel_m;
    let length = high - low;
    let [soft_low, soft_high] = rig.soft_rail_m(chain);
    limits.rail_m = [finite("cart.travel_m", soft_low as f32)?, finite("cart.travel_m", soft_high as f32)?];
    let angle = wanted.angle_rad.unwrap_or(defaults::ANGLE_RAD);
    limits.angle_rad = angle as f32;
    limits.arm_angle_rad = wanted.arm_angle_rad.unwrap_or(defaults::ARM_ANGLE_SHARE * angle) as f32;
    let Some(&cart) = steps.first() else { return Ok(()) };
    let tolerance = wanted.travel_tolerance_m.unwrap_or(defaults::TRAVEL_TOLERANCE_SHARE * length);
    limits.travel_counts = [counts(length, cart), counts(tolerance, cart).max(1)];
    limits.middle_counts = counts(0.5 * (low + high), cart);
    Ok(())
}

/// The sensors of `rig`, as its gain table describes them.
pub fn sensor_rows(rig: &Rig) -> Vec<SensorRow> {
    let steps: Vec<f64> = rig.sensors().iter().map(|sensor| sensor.step()).collect();
    let rounded: Vec<f32> = steps.iter().map(|&step| step as f32).collect();
    let number = steps.len().min(MAX_SENSORS);
    sensors(rig, number, &steps, &rounded)[..number].to_vec()
}

/// The `number` sensors of `rig`. With an observer they have steps, exact ones and those of the table (m or rad);
/// without one, they have no distances in counts.
pub(super) fn sensors(rig: &Rig, number: usize, steps: &[f64], rounded: &[f32]) -> [SensorRow; MAX_SENSORS] {
    let described = rig.sensors();
    core::array::from_fn(|index| {
        let state = if index < number { 2 * index } else { MAX_STATES };
        let row =
            SensorRow { state: state as u32, slow_counts: i32::MAX, still_counts: 1, ..SensorRow::default() };
        let sensor = described.get(index).zip(steps.get(index)).zip(rounded.get(index));
        sensor.map_or(row, |((sensor, &step), &rounded)| {
            let row = as_read(sensor, step, SensorRow { step: rounded, ..row });
            rig.chain().map_or(row, |chain| with_distances(rig, chain, index, step, row))
        })
    })
}

/// The row with what this sensor measures, and how it reads.
fn as_read(sensor: &Sensor, step: f64, row: SensorRow) -> SensorRow {
    let row = SensorRow { state: sensor.state as u32, delay_s: sensor.delay_s as f32, ..row };
    let Some(range) = sensor.absolute else { return row };
    let reading = ReadingMap { bits: range.bits, zero_counts: range.zero as i32 };
    SensorRow {
        kind: match sensor.part {
            Some((part, errors)) => {
                let errors = errors_from_rest(&errors, sensor.state, step);
                SensorKind::OfPart(PartReading { reading, part: part as u32, errors })
            }
            None if range.has_dead_band() => SensorKind::Potentiometer(reading),
            None => SensorKind::Absolute(reading),
        },
        still_counts: 1 + counts(STILL_DEVIATIONS * sensor.noise, step),
        ..row
    }
}

/// The errors as [`PartReading`] has them, of the sensor of this state whose step is `step` (rad): the angle is counted
/// from where the links hang, half a turn from straight for the first one.
fn errors_from_rest(errors: &TurnErrors, state: usize, step: f64) -> [f32; 4] {
    let hangs_at = if state == 2 { core::f64::consts::PI } else { 0.0 };
    let [once, twice] = errors.harmonics();
    let parts = |[amplitude, phase]: [f64; 2], turns: f64| {
        let (sin, cos) = (libm::sin(turns * hangs_at + phase), libm::cos(turns * hangs_at + phase));
        [amplitude * sin, amplitude * cos].map(|part| (part / step) as f32)
    };
    let ([c1, s1], [c2, s2]) = (parts(once, 1.0), parts(twice, 2.0));
    [c1, s1, c2, s2]
}

/// The row with the distances in counts of this sensor of a chain: the cart's is the first.
fn with_distances(rig: &Rig, chain: &Chain, index: usize, step: f64, row: SensorRow) -> SensorRow {
    let wanted = &rig.limits;
    let slow = |rate: f64| counts(rate * wanted.arm_time_s, step).max(1);
    if index == 0 {
        let [low, high] = chain.cart.travel_m;
        // The count of a drive with pulses has the sign of the pulses.
        let has_encoder = !rig.actuator.held().is_motion();
        let sign_counts = if has_encoder { counts(SIGN_SHARE * (high - low), step).max(1) } else { 0 };
        return SensorRow { slow_counts: slow(wanted.arm_speed_m_per_s), sign_counts, ..row };
    }
    SensorRow {
        turn_counts: counts(core::f64::consts::TAU, step).max(1),
        rest_counts: if index == 1 { counts(core::f64::consts::PI, step) } else { 0 },
        sign_counts: counts(SIGN_RAD, step).max(1),
        slow_counts: slow(wanted.arm_rate_rad_per_s),
        ..row
    }
}

/// Thresholds of a design; without one, thresholds that nothing exceeds.
pub(super) fn thresholds(design: Option<&DetectionDesign>) -> Thresholds<MAX_SENSORS> {
    let mut thresholds = Thresholds::none();
    let Some(design) = design else { return thresholds };
    let narrow = |to: &mut [f32], values: &[f64]| {
        to.iter_mut().zip(values).for_each(|(to, &value)| *to = threshold(value));
    };
    narrow(&mut thresholds.innovation, &design.innovation);
    narrow(&mut thresholds.frozen, &design.frozen);
    narrow(&mut thresholds.push, &design.push);
    if let Some(motor) = design.motor {
        thresholds.motor = MotorTest {
            a: motor.a.map(|a| a as f32),
            b: motor.b.map(|b| b as f32),
            ratio: motor.ratio as f32,
            energy: threshold(motor.energy),
        };
    }
    thresholds
}

/// Largest force of the jog (N), or its like for a drive that imposes the acceleration (m/s²); without a limit, only
/// what the rig file gives.
fn jog_force_n(rig: &Rig) -> Option<f64> {
    let (wanted, limit) = (rig.limits.jog_force_n, rig.actuator.largest_input());
    let derived = limit.map(|limit| defaults::JOG_FORCE_SHARE * limit);
    wanted.or(derived).map(|force| force.min(limit.unwrap_or(f64::INFINITY)))
}

fn supply_min_v(rig: &Rig) -> Option<f64> {
    let motor = rig.actuator.motor();
    rig.limits.supply_min_v.or(motor.map(|motor| defaults::SUPPLY_SHARE * motor.supply_v))
}

/// A distance in whole counts.
fn counts(distance: f64, step: f64) -> i32 {
    // Saturates far beyond any rail or turn.
    (distance / step).round() as i32
}

/// A threshold as `f32`, clamped to the positive normal numbers.
fn threshold(value: f64) -> f32 {
    (value as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
}

fn narrow(what: &'static str, value: Option<f64>) -> Result<Option<f32>, NoTable> {
    value.map(|value| finite(what, value as f32)).transpose()
}
