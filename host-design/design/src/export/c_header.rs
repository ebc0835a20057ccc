//! The header: what it is for, constants, table, and the controller itself, which is the C source beside this file.

use core::fmt::Write;

use upright::control::observer::PredictionPattern;
use upright::supervision::jumps::furthest_counts;
use upright::table::{DriveMap, Law, LawGains, ObserverGains, SensorRow};

use super::absolute::Readings;
use super::initializer::Initializer;
use super::{calling, faults};
use crate::rig::Rig;
use crate::table::{MAX_SENSORS, MAX_STATES, TableValues};

const HEAD: &str = include_str!("head.txt");
const STEPS: &str = include_str!("steps.txt");
const COMPILER: &str = include_str!("compiler.h");
const STATE: &str = include_str!("state.h");
const READINGS: &str = include_str!("readings.h");
const PARTS: &str = include_str!("parts.h");
const TESTS_OF_PUSHES: &str = include_str!("tests_of_pushes.h");
const TESTS_OF_SIZES: &str = include_str!("tests_of_sizes.h");
const CALLS: &str = include_str!("calls.h");

/// Why a rig cannot have a C header.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoHeader {
    /// The header does not take the errors of a sensor out.
    #[error(
        "a C header takes no errors per turn out of a sensor's readings: leave sensor_once_per_turn_rad and \
         sensor_twice_per_turn_rad out, and take them out in your program"
    )]
    TurnErrors,
    /// Without an observer, the controller would need every speed measured.
    #[error(
        "a C header computes the speeds from encoder counts, and this rig has no observer: give it [kalman], and encoders \
         on the cart and on every link"
    )]
    NoObserver,
}

/// The C99 header with the table and the controller of `rig`.
///
/// # Errors
/// [`NoHeader`] if the controller in C cannot serve this rig.
pub fn c_header(rig: &Rig, table: &TableValues) -> Result<String, NoHeader> {
    let observer = table.observer.as_ref().ok_or(NoHeader::NoObserver)?;
    if rig.chain().is_some_and(|chain| chain.links.iter().any(|link| !link.errors.are_none())) {
        return Err(NoHeader::TurnErrors);
    }
    let name = plain(&rig.name);
    let title = format!("Controller of the rig \"{name}\", written by `upright export --c`; do not edit.");
    let steps = if table.drive.pulses().is_some() { STEPS } else { "" };
    let readings = Readings::of(rig);
    let absolute = readings.comment();
    let mut out = format!("/* {title}\n\n{HEAD}{}{absolute}{steps}*/\n\n", calling::comment());
    out += "#ifndef UPRIGHT_CONTROLLER_H\n#define UPRIGHT_CONTROLLER_H\n\n";
    // Writing into a String cannot fail.
    let _ = constants(&mut out, &name, table, readings.are_absolute());
    out += &faults::enumeration();
    out.push_str(COMPILER);
    out += &format!(
        "static const upright_table_type upright_table = {{\n{}}};\n\n",
        initializer(table, observer, &readings)
    );
    out.push_str(STATE);
    out += &faults::functions(table.drive.pulses().is_some());
    out.push_str(READINGS);
    out.push_str(PARTS);
    out.push_str(if table.thresholds.survives_pushes() { TESTS_OF_PUSHES } else { TESTS_OF_SIZES });
    out.push_str(CALLS);
    out += "\n#endif\n";
    Ok(out)
}

/// A rig's name as the text of a C comment and string.
fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || "-_. ".contains(c) { c } else { '_' }).collect()
}

type WidestObserver = ObserverGains<MAX_STATES, MAX_SENSORS>;

/// The preprocessor's constants.
fn constants(out: &mut String, name: &str, table: &TableValues, is_absolute: bool) -> core::fmt::Result {
    let laws: Vec<Law> = table.laws.present().map(|(law, _)| law).collect();
    let pattern = match table.observer.as_ref().map(WidestObserver::pattern) {
        Some(PredictionPattern::Frictionless) if table.states().is_multiple_of(2) => 2,
        Some(PredictionPattern::Frictionless | PredictionPattern::SameEverywhere) => 1,
        Some(PredictionPattern::Any) | None => 0,
    };
    let mut define = |name: &str, value: String| writeln!(out, "#define UPRIGHT_{name} {value}");
    define("RIG", format!("\"{name}\""))?;
    define("RIG_HASH", format!("\"{:016x}\"", table.rig_hash))?;
    define("TICK_S", format!("{:?}f", table.tick_s))?;
    define("ARM_S", format!("({:?}f * {}ul)", table.tick_s, table.limits.arm_ticks))?;
    define("STATES", table.states().to_string())?;
    define("SENSORS", table.sensors().to_string())?;
    define("OUTPUT", table.output.to_string())?;
    let is_late = has_delay(table.rows());
    define("HAS_DELAY", u8::from(is_late).to_string())?;
    define("HAS_PENDING", u8::from(table.drive.late().acts != 0.0).to_string())?;
    define("LAWS", laws.len().to_string())?;
    for (index, law) in laws.into_iter().enumerate() {
        define(&law.key().to_uppercase(), index.to_string())?;
    }
    define("HAS_MOTOR", u8::from(table.drive.supply_v().is_some()).to_string())?;
    define("HAS_STEPS", u8::from(table.drive.pulses().is_some()).to_string())?;
    define(
        "MOTOR_SENSOR",
        format!("{} /* whose innovation shows what the motor does */", table.drive.witness()),
    )?;
    define("HAS_PUSHES", u8::from(table.thresholds.survives_pushes()).to_string())?;
    define("HAS_FRICTION", u8::from(table.friction.is_some()).to_string())?;
    define("PATTERN", format!("{pattern} /* of Ad: see upright_predict_state */"))?;
    define("HAS_ABSOLUTE", u8::from(is_absolute).to_string())?;
    writeln!(out)
}

/// Whether a sensor's reading is old.
fn has_delay(sensors: &[SensorRow]) -> bool {
    sensors.iter().any(|sensor| sensor.delay_s != 0.0)
}

/// The members of `upright_table_type`, in the order of their declaration.
fn initializer(table: &TableValues, observer: &WidestObserver, readings: &Readings) -> String {
    let (states, sensors, rows) = (table.states(), table.sensors(), table.rows());
    let mut out = Initializer::new();
    out.line("    {");
    for (_, gains) in table.laws.present() {
        law(&mut out, gains, states);
    }
    out.line("    },");
    out.float("force_limit_n", table.drive.largest_force_n());
    let late = table.drive.late();
    if late.acts != 0.0 {
        out.float("pending_acts", late.acts);
        out.float("pending_stays", late.stays);
    }
    let column = |values: &[f32]| values[..states].to_vec();
    out.columns("ad", observer.ad.data.0[..states].iter().map(|values| column(values)));
    out.floats("bd", column(&observer.bd.data.0[0]));
    out.columns("l", observer.l.data.0[..sensors].iter().map(|values| column(values)));
    if has_delay(rows) {
        out.floats("delay_s", rows.iter().map(|sensor| sensor.delay_s));
    }
    out.floats("step", rows.iter().map(|sensor| sensor.step));
    if let Some(friction) = &table.friction {
        let laws: Vec<usize> = table.laws.present().map(|(law, _)| 2 + law as usize).collect();
        let axis = |values: &[f32; 4]| [0, 1].iter().chain(&laws).map(|&row| values[row]).collect();
        out.columns("friction", friction.axes.data.0[..sensors].iter().map(axis));
        out.columns("friction_effect", friction.effect.data.0[..sensors].iter().map(|values| column(values)));
    }
    drive(&mut out, &table.drive);
    supervision(&mut out, table);
    out.indices("measured", rows.iter().map(|sensor| sensor.state));
    out.counts("slow_counts", rows.iter().map(|sensor| sensor.slow_counts));
    out.counts("rest_counts", rows.iter().map(|sensor| sensor.rest_counts));
    out.counts("turn_counts", rows.iter().map(|sensor| sensor.turn_counts));
    let furthest = furthest_counts(&table.limits, &table.sensors, table.tick_s);
    // At most what C compares with: nothing is too far.
    let furthest = furthest.map(|counts| i32::try_from(counts).unwrap_or(i32::MAX));
    out.counts("furthest_counts", furthest.into_iter().take(sensors));
    readings.initialise(&mut out);
    out.sealed()
}

/// How the drive gives the force, or moves the cart.
fn drive(out: &mut Initializer, drive: &DriveMap) {
    match drive {
        DriveMap::Force(_) => {}
        DriveMap::Volts(motor) => {
            out.float("volts_per_newton", motor.volts_per_newton);
            out.float("volts_per_speed", motor.volts_per_speed);
            out.float("dead_zone_v", motor.dead_zone_v);
            out.float("slew_v_per_tick", motor.slew_v_per_tick);
            out.float("supply_v", motor.supply_v);
        }
        DriveMap::Pulses(steps) => {
            out.float("step_m", steps.step_m);
            out.float("acceleration_limit_m_per_s2", steps.acceleration_limit_m_per_s2);
            out.float("speed_limit_m_per_s", steps.speed_limit_m_per_s);
            out.float("lag_s", steps.lag_s);
            out.float("lead_s", steps.lead_s);
        }
    }
}

fn law(out: &mut Initializer, gains: &LawGains<MAX_STATES>, states: usize) {
    out.line("    {");
    out.floats("k", gains.k.data.0[0][..states].iter().copied());
    out.float("k_pending", gains.k_pending);
    out.float("k_integral", gains.k_integral);
    out.float("n", gains.n);
    out.float("setpoint_step_m", gains.setpoint_step);
    out.line("    },");
}

/// Limits and thresholds, up to those that are numbers of ticks.
fn supervision(out: &mut Initializer, table: &TableValues) {
    let (limits, thresholds, sensors) = (&table.limits, &table.thresholds, table.sensors());
    out.floats("rail_m", limits.rail_m);
    out.floats("setpoints_m", limits.setpoints_m());
    out.float("angle_rad", limits.angle_rad);
    out.float("speed_m_per_s", limits.speed_m_per_s);
    out.float("arm_angle_rad", limits.arm_angle_rad);
    out.floats("innovation", thresholds.innovation[..sensors].iter().copied());
    out.floats("frozen", thresholds.frozen[..sensors].iter().copied());
    out.floats("push", thresholds.push[..sensors].iter().copied());
    out.floats("motor_a", thresholds.motor.a);
    out.floats("motor_b", thresholds.motor.b);
    out.float("motor_ratio", thresholds.motor.ratio);
    out.float("motor_energy", thresholds.motor.energy);
    out.ticks("saturated_ticks", limits.saturated_ticks);
    out.ticks("arm_ticks", limits.arm_ticks);
}
