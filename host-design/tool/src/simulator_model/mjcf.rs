//! The machine as MJCF (<https://mujoco.readthedocs.io/en/stable/XMLreference.html>).

use std::f64::consts::PI;
use std::fmt::Write as _;

use upright_design::rig::{Actuator, Chain, Motor, Rig};

use super::machine::{NoModel, facts, inertia_kg_m2, machine, plain};

/// Longest step of the simulation (s); a tick is a whole number of steps.
const LONGEST_STEP_S: f64 = 5e-4;

/// How much heavier than the links a cart is whose motion is imposed: no link moves it, to a ten-thousand-millionth.
const IMMOVABLE: f64 = 1e10;
/// Tolerance of MuJoCo's solver, which it takes as a share of the mean mass.
const TOLERANCE: f64 = 1e-8;

/// Keys of `[reality]` that the file has beside those of the chain.
const CARRIED: &[&str] = &["force_percent", "driver_lag_s"];
/// Further ones, where a force moves the cart.
const CARRIED_WITH_FORCE: &[&str] = &["cart_friction_n", "current_limit_a"];

/// The machine of `rig` as an MJCF file. In it, `ctrl` is the force (N), the motor's voltage (V) or the cart's
/// acceleration (m/s²), as the rig's drive has it.
///
/// # Errors
/// [`NoModel::NoBodies`] for a rig that is given by matrices.
pub fn mjcf(rig: &Rig) -> Result<String, NoModel> {
    let chain = machine(rig)?;
    let steps = (rig.tick.period_s / LONGEST_STEP_S).ceil().max(1.0);
    let carried =
        if chain.input.is_force() { [CARRIED, CARRIED_WITH_FORCE].concat() } else { CARRIED.to_vec() };
    let name = plain(&rig.name);
    let mut out = format!(
        "<!--\n  The machine of the rig \"{name}\", written by \"upright export\".\n{}{}  {steps} steps are a tick: hold ctrl \
         during them.\n-->\n<mujoco model=\"{name}\">\n  <compiler angle=\"radian\" inertiafromgeom=\"false\"/>\n  \
         <option timestep=\"{}\" gravity=\"0 0 {}\" integrator=\"implicitfast\"\n          \
         tolerance=\"{}\"/>\n",
        drive_in_words(rig),
        facts(rig, &carried),
        rig.tick.period_s / steps,
        -chain.gravity_m_per_s2,
        if chain.input.is_force() { TOLERANCE } else { TOLERANCE / IMMOVABLE },
    );
    bodies(&mut out, rig, &chain);
    let straight = vec!["0"; chain.links.len() - 1].join(" ");
    let _ = write!(
        out,
        "  <actuator>\n    {}\n  </actuator>\n  <sensor>\n{}  </sensor>\n  <keyframe>\n    <key name=\"upright\" qpos=\"0 0 \
         {straight}\"/>\n    <key name=\"hanging\" qpos=\"0 {PI} {straight}\"/>\n  </keyframe>\n</mujoco>\n",
        drive(rig, &chain),
        sensors(rig),
    );
    Ok(out)
}

/// Cart and links, each within the one before.
fn bodies(out: &mut String, rig: &Rig, chain: &Chain) {
    let friction = &rig.reality.friction;
    let [low, high] = chain.cart.travel_m;
    let cart_kg = chain.cart.mass_kg.unwrap_or(chain.links_mass_kg());
    let moved = match chain.input.is_force() {
        true => format!(
            "damping=\"{}\" frictionloss=\"{}\"",
            chain.cart.friction_n_s_per_m, friction.cart_friction_n
        ),
        false => format!("armature=\"{}\"", imposed_kg(chain)),
    };
    let _ = write!(
        out,
        "  <default>\n    <geom contype=\"0\" conaffinity=\"0\"/>\n  </default>\n  <worldbody>\n    \
         <light pos=\"0 -2 3\" dir=\"0 0.5 -1\"/>\n    <body name=\"cart\">\n      \
         <inertial pos=\"0 0 0\" mass=\"{cart_kg}\" diaginertia=\"{cart_kg} {cart_kg} {cart_kg}\"/>\n      \
         <joint name=\"slide\" type=\"slide\" axis=\"1 0 0\" range=\"{low} {high}\" {moved}/>\n      \
         <geom type=\"box\" size=\"0.06 0.04 0.03\"/>\n"
    );
    let mut from_m = 0.0;
    for (index, link) in chain.links.iter().enumerate() {
        // A body that turns needs some inertia; the one of a point mass is too small to be seen.
        let (length_m, inertia) = (link.length_m, inertia_kg_m2(link).max(1e-12));
        let _ = write!(
            out,
            "      <body name=\"link_{0}\" pos=\"0 0 {from_m}\">\n        \
             <inertial pos=\"0 0 {1}\" mass=\"{2}\" diaginertia=\"{inertia} {inertia} {inertia}\"/>\n        \
             <joint name=\"hinge_{0}\" type=\"hinge\" axis=\"0 -1 0\" damping=\"{3}\" frictionloss=\"{4}\"/>\n        \
             <geom type=\"capsule\" fromto=\"0 0 0 0 0 {length_m}\" size=\"0.01\"/>\n",
            index + 1,
            link.centre_m(),
            link.mass_kg,
            link.friction_n_m_s_per_rad,
            friction.joint_friction_n_m.of_joint(index),
        );
        from_m = length_m;
    }
    let _ = writeln!(out, "      {}\n    </body>\n  </worldbody>", "</body>".repeat(chain.links.len()));
}

/// Mass of a cart whose acceleration is imposed (kg).
fn imposed_kg(chain: &Chain) -> f64 {
    IMMOVABLE * chain.links_mass_kg()
}

fn drive_in_words(rig: &Rig) -> String {
    let most = |limit: Option<f64>, unit: &str| {
        limit.map_or(String::new(), |limit| format!(", at most {limit} {unit}"))
    };
    match &rig.actuator {
        Actuator::Force(_) => {
            format!("  ctrl is the force on the cart in N{}.\n", most(rig.actuator.largest_force_n(), "N"))
        }
        Actuator::Motor(motor, _) => format!(
            "  ctrl is the motor's voltage in V; 0 brakes, as a bridge does. The firmware asks for at most {} N.\n{}{}",
            rig.actuator.largest_force_n().unwrap_or_default(),
            match motor.dead_zone_v {
                0.0 => String::new(),
                volts => format!(
                    "  {volts} V of a command are lost: subtract them from its magnitude, down to 0.\n"
                ),
            },
            motor.slew_v_per_s.map_or(String::new(), |slew| format!("  It changes by at most {slew} V/s.\n")),
        ),
        Actuator::Pulses(pulses) => format!(
            "  ctrl is the cart's acceleration in m/s², whatever force that takes. A pulse is {} m{}{}.\n",
            pulses.step_m,
            most(pulses.speed_limit_m_per_s, "m/s"),
            pulses
                .bandwidth_hz
                .map_or(String::new(), |hz| format!("; the servo's {hz} Hz are not in this file")),
        ),
    }
}

/// The element of the drive.
fn drive(rig: &Rig, chain: &Chain) -> String {
    let factor = 1.0 + rig.reality.driver.force_percent / 100.0;
    let lag = match rig.reality.driver.driver_lag_s.or(rig.actuator.lag_s()) {
        Some(lag_s) if lag_s > 0.0 => format!(" dyntype=\"filterexact\" dynprm=\"{lag_s}\""),
        _ => String::new(),
    };
    let range = |name: &str, most: Option<f64>| {
        most.map_or(String::new(), |most| format!(" {name}range=\"{} {most}\"", -most))
    };
    let (gain, bias, limits) = match &rig.actuator {
        Actuator::Force(_) => (factor, String::new(), range("ctrl", rig.actuator.largest_force_n())),
        Actuator::Motor(motor, _) => {
            let most_n = rig.reality.driver.current_limit_a.map(|amp| amp * motor.newtons_per_amp() * factor);
            let limits = range("ctrl", Some(motor.supply_v)) + &range("force", most_n);
            (factor * motor.newtons_per_volt(), braking(motor, factor), limits)
        }
        Actuator::Pulses(pulses) => {
            (imposed_kg(chain), String::new(), range("ctrl", Some(pulses.acceleration_limit_m_per_s2)))
        }
    };
    format!("<general name=\"drive\" joint=\"slide\" gainprm=\"{gain}\"{bias}{lag}{limits}/>")
}

/// The back-EMF, as a force against the speed.
fn braking(motor: &Motor, factor: f64) -> String {
    format!(" biastype=\"affine\" biasprm=\"0 0 {}\"", -factor * motor.braking_n_s_per_m())
}

/// Positions and speeds of the joints that the rig measures.
fn sensors(rig: &Rig) -> String {
    let joints = rig.sensors().into_iter().map(|sensor| match sensor.state {
        0 => "slide".to_owned(),
        state => format!("hinge_{}", state / 2),
    });
    let lines = joints.map(|joint| {
        format!(
            "    <jointpos name=\"{joint}_position\" joint=\"{joint}\"/>\n    <jointvel name=\"{joint}_speed\" joint=\"{joint}\"/>\n"
        )
    });
    lines.collect()
}
