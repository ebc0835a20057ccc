//! From the tables of a rig file to a checked [`Rig`].

mod design;
mod limits;
mod plant;

use super::error::RigError;
use super::node::{Node, Section, Source};
use super::rule::Rule;
use super::{Actuator, Limits, Motor, PlantDescription, Requirements, Rig, Tick, defaults};

const TABLES: &[&str] = &[
    "name",
    "cart",
    "link",
    "model",
    "gravity",
    "actuator",
    "tick",
    "lqr",
    "pole_placement",
    "kalman",
    "integral",
    "limits",
    "verify",
];

/// Checks a whole rig file.
pub(super) fn rig(source: &Source<'_>) -> Result<Rig, RigError> {
    let document = source.document()?;
    let root = Section::root(source, &document, TABLES)?;
    let name = name(&root)?;
    let plant = plant::plant(&root)?;
    let states = plant.states();
    let rig = Rig {
        name,
        actuator: root.get("actuator").map_or(Ok(Actuator::default()), |node| actuator(&node))?,
        tick: root.get("tick").map_or(Ok(Tick::default()), |node| tick(&node))?,
        lqr: root.get("lqr").map(|node| design::lqr(&node, states)).transpose()?,
        pole_placement: root
            .get("pole_placement")
            .map(|node| design::pole_placement(&node, states))
            .transpose()?,
        kalman: root.get("kalman").map(|node| design::kalman(&node, &plant)).transpose()?,
        integral: root.get("integral").map(|node| design::integral(&node)).transpose()?,
        limits: root.get("limits").map_or(Ok(Limits::default()), |node| limits::limits(&node, &plant))?,
        verify: root.get("verify").map_or(Ok(Requirements::default()), |node| requirements(&node))?,
        plant,
    };
    if rig.kalman.is_some() {
        position_is_measured(&root, &rig.plant)?;
    }
    Ok(rig)
}

/// The name goes into the gain table and onto terminals: short, and nothing that moves a cursor.
fn name(root: &Section<'_>) -> Result<String, RigError> {
    const LONGEST: usize = 64;
    const ACCEPTS: &str = "1 to 64 bytes of printable text";
    const MEANING: &str = "`name = \"...\"`, the name of the rig, at the top of the file";
    let node = root.need("name", MEANING)?;
    let name = node.text(ACCEPTS, "the name in quotes")?;
    let plain = name.replace(['"', '\'', '\\'], "_");
    let printable = plain.escape_debug().eq(plain.chars());
    if name.trim().is_empty() || name.len() > LONGEST || !printable {
        return Err(
            node.out_of_range(ACCEPTS, "shorten it, and leave out line breaks and control characters")
        );
    }
    Ok(name.to_owned())
}

fn actuator(node: &Node<'_>) -> Result<Actuator, RigError> {
    const MOTOR_KEYS: &[&str] = &[
        "torque_constant_n_m_per_a",
        "resistance_ohm",
        "gear_ratio",
        "pulley_radius_m",
        "supply_v",
        "dead_zone_v",
        "slew_v_per_s",
    ];
    let table = node.section(&[&["force_limit_n"], MOTOR_KEYS].concat())?;
    let limit = "the largest force on the cart in N, or leave it out for no limit";
    let force_limit_n = table.number_if_given("force_limit_n", Rule::POSITIVE, limit)?;
    let described = MOTOR_KEYS.iter().any(|key| table.get(key).is_some());
    Ok(Actuator { force_limit_n, motor: described.then(|| motor(&table)).transpose()? })
}

fn motor(table: &Section<'_>) -> Result<Motor, RigError> {
    let positive = |name, meaning| table.number(name, Rule::POSITIVE, meaning);
    let supply_v = positive("supply_v", "the supply voltage of the motor driver in V")?;
    let dead_zone = "the voltage in V below which the motor does not move, less than supply_v";
    let dead_zone_v =
        table.number_if_given("dead_zone_v", Rule::NOT_NEGATIVE, dead_zone)?.unwrap_or(defaults::DEAD_ZONE_V);
    match table.get("dead_zone_v") {
        Some(node) if dead_zone_v >= supply_v => {
            return Err(node.out_of_range("a number >= 0 and < supply_v (V)", &format!("give {dead_zone}")));
        }
        _ => {}
    }
    Ok(Motor {
        torque_constant_n_m_per_a: positive(
            "torque_constant_n_m_per_a",
            "the torque constant of the motor in N·m/A (equal to its back-EMF constant in V·s/rad)",
        )?,
        resistance_ohm: positive("resistance_ohm", "the winding resistance of the motor in ohm")?,
        gear_ratio: table
            .number_if_given("gear_ratio", Rule::POSITIVE, "the motor turns per pulley turn")?
            .unwrap_or(defaults::GEAR_RATIO),
        pulley_radius_m: positive("pulley_radius_m", "the radius of the pulley or pinion in m")?,
        supply_v,
        dead_zone_v,
        slew_v_per_s: table.number_if_given(
            "slew_v_per_s",
            Rule::POSITIVE,
            "the largest change of voltage in V/s, or leave it out for no limit",
        )?,
    })
}

fn tick(node: &Node<'_>) -> Result<Tick, RigError> {
    let table = node.section(&["period_s", "delay_ticks"])?;
    let delay = "the ticks between a measurement and the force computed from it";
    Ok(Tick {
        period_s: table
            .number_if_given("period_s", Rule::PERIOD, "the control period in s")?
            .unwrap_or(defaults::PERIOD_S),
        delay_ticks: match table.get("delay_ticks") {
            Some(node) => u8::from(node.index(1, "0 or 1", delay)? == 1),
            None => defaults::DELAY_TICKS,
        },
    })
}

fn requirements(node: &Node<'_>) -> Result<Requirements, RigError> {
    let table = node.section(&[
        "gain_margin",
        "phase_margin_deg",
        "delay_margin_ticks",
        "peak_sensitivity",
        "tilt_rad",
        "spread_percent",
        "corner_percent",
        "success_percent",
        "encoder_factor",
        "force_rms_n",
        "torque_rms_n_m",
    ])?;
    let usual = Requirements::default();
    let number = |name, rule, meaning: &str, usual| {
        Ok::<f64, RigError>(table.number_if_given(name, rule, meaning)?.unwrap_or(usual))
    };
    Ok(Requirements {
        gain_margin: number(
            "gain_margin",
            Rule::POSITIVE,
            "the least gain margin, as a factor",
            usual.gain_margin,
        )?,
        phase_margin_deg: number(
            "phase_margin_deg",
            Rule::NOT_NEGATIVE,
            "the least phase margin in degrees",
            usual.phase_margin_deg,
        )?,
        delay_margin_ticks: number(
            "delay_margin_ticks",
            Rule::NOT_NEGATIVE,
            "the least delay margin in ticks",
            usual.delay_margin_ticks,
        )?,
        peak_sensitivity: number(
            "peak_sensitivity",
            Rule::POSITIVE,
            "the largest peak of the sensitivity",
            usual.peak_sensitivity,
        )?,
        tilt_rad: number(
            "tilt_rad",
            Rule::ANGLE,
            "the least tilt of any link to recover from, in rad",
            usual.tilt_rad,
        )?,
        spread_percent: number(
            "spread_percent",
            Rule::PERCENT,
            "the spread of the plant's parameters in percent",
            usual.spread_percent,
        )?,
        corner_percent: number(
            "corner_percent",
            Rule::PERCENT,
            "the spread of the masses at the corners in percent",
            usual.corner_percent,
        )?,
        success_percent: number(
            "success_percent",
            Rule::PERCENT,
            "the least share of runs that stand, in percent",
            usual.success_percent,
        )?,
        encoder_factor: number(
            "encoder_factor",
            Rule::POSITIVE,
            "the factor by which encoders may be coarser",
            usual.encoder_factor,
        )?,
        force_rms_n: table.number_if_given(
            "force_rms_n",
            Rule::NOT_NEGATIVE,
            "the disturbing force in N rms",
        )?,
        torque_rms_n_m: table.number_if_given(
            "torque_rms_n_m",
            Rule::NOT_NEGATIVE,
            "the disturbing torque at each joint in N·m rms",
        )?,
    })
}

/// An observer needs the resolution of its sensors; and no observer finds the cart's position from the angles alone.
fn position_is_measured(root: &Section<'_>, plant: &PlantDescription) -> Result<(), RigError> {
    match plant {
        PlantDescription::Chain(chain) if chain.cart.encoder_step_m.is_none() => Err(root
            .need("cart", "[cart]")?
            .section(plant::CART_KEYS)?
            .missing("encoder_step_m", "the travel per encoder count in m: [kalman] needs it")),
        PlantDescription::Model(model) if model.measured_steps.is_empty() => Err(root
            .need("model", "[model]")?
            .section(plant::MODEL_KEYS)?
            .missing("measured_steps", "the step of each sensor: [kalman] needs them")),
        _ => Ok(()),
    }
}
