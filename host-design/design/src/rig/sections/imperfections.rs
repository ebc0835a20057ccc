//! The imperfections that a size is searched for, one row each.
//!
//! A row is all that `[verify]`, the search of `upright verify --imperfections`, its cures and the twin's sliders know
//! of an imperfection. What it does to the machine is simulated in `reality/`, from the key of `[reality]` that the row
//! names.

use core::f64::consts::{FRAC_PI_4, PI};
use core::fmt;

use serde::Serialize;

use super::super::key::{Absent, Key};
use super::super::rule::Rule;
use super::super::value::PerJoint;
use super::actuator::Actuator;
use super::reality::Reality;
use super::robust::{ToleranceKey, Tolerances};
use crate::number::significant;

/// One kind of imperfection.
#[derive(Serialize)]
pub struct Imperfection {
    /// Its key in `[reality]` and in `[verify]`.
    pub key: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Typical size in a carefully built machine, from a good one to a poor one.
    pub typical: [f64; 2],
    /// Where the typical sizes come from.
    pub source: &'static str,
    /// How to make the imperfection smaller or harmless.
    pub remedy: &'static str,
    /// The requirement that can be made for it, which has the same key in `[verify]`.
    pub requirement: &'static str,
    /// The key in `[verify]`: the size that the loop has to survive.
    #[serde(skip)]
    pub(in crate::rig) required: Key,
    /// Makes it the only imperfection of a machine without any, in its worst form.
    #[serde(skip)]
    pub set: fn(&mut Reality, f64),
    /// For friction of the joints, the angles over which it may build up (rad): which is worse depends on the law.
    #[serde(skip)]
    pub bristles_rad: &'static [f64],
    /// The largest size that can be simulated.
    #[serde(skip)]
    pub largest: LargestSize,
    /// The drives with which it is simulated.
    #[serde(skip)]
    drives: SimulatedDrives,
    /// How a rig file allows for it.
    #[serde(skip)]
    pub allowance: Option<Allowance>,
    /// The slider of the twin that adds to it.
    #[serde(skip)]
    pub slider: Option<Slider>,
}

/// The largest size that can be simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LargestSize {
    /// Any.
    Any,
    /// This one.
    Of(f64),
    /// A time shorter than a tick.
    Tick,
}

/// The drives with which an imperfection is simulated; otherwise, why it is not.
#[derive(Debug, Clone, Copy)]
enum SimulatedDrives {
    All,
    /// Those that impose a force.
    OfForce(&'static str),
    /// Those that impose a force, and step motors that have a largest one.
    WithLargestForce(&'static str),
}

/// How a rig file allows for an imperfection.
#[derive(Debug, Clone, Copy)]
pub enum Allowance {
    /// Fault detection tolerates it, by a key of `[robust]`.
    Tolerated(ToleranceKey),
    /// The law is designed for it, by a key of `[actuator]`.
    Stated {
        /// The key.
        key: &'static str,
        /// Its value.
        at: fn(&mut Actuator) -> Option<&mut Option<f64>>,
    },
}

/// A slider of the twin.
#[derive(Debug, Clone, Copy)]
pub struct Slider {
    /// Its name in messages.
    pub name: &'static str,
    /// Its name on the page.
    pub label: &'static str,
    /// Its unit on the page.
    pub unit: &'static str,
    /// Lowest and highest value, and the step between values.
    pub range: [f64; 3],
    /// Adds this much, in its unit, to the imperfection.
    pub add: fn(&mut Reality, f64),
}

impl Imperfection {
    /// Why it is not simulated with this drive and the motor of `reality`, if it is not.
    pub(crate) fn not_with(&self, actuator: &Actuator, reality: &Reality) -> Option<&'static str> {
        match self.drives {
            _ if actuator.input().is_force() => None,
            SimulatedDrives::All => None,
            SimulatedDrives::OfForce(reason) => Some(reason),
            SimulatedDrives::WithLargestForce(reason) => {
                reality.step_motor.holding_force_n.is_none().then_some(reason)
            }
        }
    }

    /// The typical sizes as text: `1e-4 to 0.001`.
    pub fn typical_text(&self) -> String {
        let [good, poor] = self.typical.map(|size| significant(size, 2));
        format!("{good} to {poor}")
    }
}

impl fmt::Debug for Imperfection {
    /// The key alone: shards of a study agree on their rig by this text, and addresses of functions differ.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.key)
    }
}

impl PartialEq for Imperfection {
    /// A key has one row.
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

/// The part of a row that every imperfection has: key, unit, rule and meaning of its size, and how it is set.
macro_rules! imperfection {
    ($key:literal, $unit:literal, $rule:expr, $meaning:literal, $set:expr) => {
        Imperfection {
            key: $key,
            unit: $unit,
            typical: [0.0; 2],
            source: "",
            remedy: "",
            requirement: concat!("runs with the motor on (", $key, ")"),
            required: Key {
                name: $key,
                unit: $unit,
                rule: $rule,
                meaning: concat!($meaning, " that the loop has to survive as the only imperfection"),
                absent: Absent::Follows("not required"),
            },
            set: $set,
            bristles_rad: &[],
            largest: LargestSize::Any,
            drives: SimulatedDrives::All,
            allowance: None,
            slider: None,
        }
    };
}

/// Every imperfection that a size can be searched for, in the order of `[verify]`.
pub static IMPERFECTIONS: [Imperfection; 13] = [
    Imperfection {
        typical: [1e-4, 1e-3],
        source: "measured: 1.9e-4 to 6.3e-4 in five of six ball bearings (docs/reality.md); greased or large ones have more",
        remedy: "smaller bearings without seals, with oil instead of grease; more weight on the angles",
        // Real bearings have 0.3 to 1 mrad.
        bristles_rad: &[1e-3, 1e-4],
        allowance: Some(Allowance::Tolerated(Tolerances::JOINT_FRICTION)),
        slider: Some(Slider {
            name: "joint-dry",
            label: "dry friction in each joint",
            unit: "mN·m more",
            range: [0.0, 20.0, 0.01],
            add: |reality, more| {
                let each = &mut reality.friction.joint_friction_n_m;
                *each = each.plus(1e-3 * more);
            },
        }),
        ..imperfection!(
            "joint_friction_n_m",
            "N·m",
            Rule::POSITIVE,
            "Coulomb friction in each joint",
            |reality, size| reality.friction.joint_friction_n_m = PerJoint::all(size)
        )
    },
    Imperfection {
        typical: [0.2, 2.0],
        source: "estimate: miniature ball guides, light to sealed",
        remedy: "a guide without seals; less preload",
        drives: SimulatedDrives::WithLargestForce(
            "changes nothing before the motor slips; give holding_force_n in [reality] to see from which size it does",
        ),
        allowance: Some(Allowance::Tolerated(Tolerances::CART_FRICTION)),
        slider: Some(Slider {
            name: "cart-dry",
            label: "dry friction of the cart",
            unit: "N more",
            range: [0.0, 5.0, 0.05],
            add: |reality, more| reality.friction.cart_friction_n += more,
        }),
        ..imperfection!(
            "cart_friction_n",
            "N",
            Rule::POSITIVE,
            "Coulomb friction of the cart",
            |reality, size| reality.friction.cart_friction_n = size
        )
    },
    Imperfection {
        typical: [1e-3, 1e-2],
        source: "a hanging link stops within F / (m g c) of the vertical: friction over weight times distance",
        remedy: "home while the links swing out; integral action brings the cart back",
        allowance: Some(Allowance::Tolerated(Tolerances::HOMING_ERROR)),
        ..imperfection!(
            "homing_error_rad",
            "rad",
            Rule::ANGLE,
            "error of each joint's zero",
            |reality, size| reality.sensors.homing_error_rad = PerJoint::all(size)
        )
    },
    Imperfection {
        typical: [1e-3, 5e-3],
        source: "2 e / D: a disk of 20 mm, 0.01 to 0.05 mm off its centre",
        remedy: "centre the disk; an encoder with its own bearing",
        ..imperfection!(
            "eccentricity_rad",
            "rad",
            Rule::ANGLE,
            "amplitude of each joint encoder's once-per-turn error",
            |reality, size| {
                reality.sensors.eccentricity_rad = PerJoint::all(size);
                reality.sensors.eccentricity_phase_rad = PerJoint::all(FRAC_PI_4);
            }
        )
    },
    Imperfection {
        typical: [1e-3, 1.7e-2],
        source: "data sheets: 0.05° of an AS5048 that is linearised, to 1° of an AS5046 whose magnet is 0.7 mm off",
        remedy: "centre the magnet over the sensor; a stronger magnet, further from iron",
        ..imperfection!(
            "twice_per_turn_rad",
            "rad",
            Rule::ANGLE,
            "amplitude of each joint sensor's twice-per-turn error",
            |reality, size| {
                reality.sensors.twice_per_turn_rad = PerJoint::all(size);
                // Near upright, the reading moves by less than the link.
                reality.sensors.twice_per_turn_phase_rad = PerJoint::all(PI);
            }
        )
    },
    Imperfection {
        typical: [1e-4, 1e-3],
        source: "data sheets: 96 µs (AS5045, AS5046; slow 384 µs), to a filter or a slow bus (estimate)",
        remedy: "sensor_delay_s in [[link]], which is made up for; SPI instead of I²C; a faster clock of the bus",
        ..imperfection!(
            "sensor_delay_s",
            "s",
            Rule::POSITIVE,
            "age of the joints' readings",
            |reality, size| reality.sensors.sensor_delay_s = PerJoint::all(size)
        )
    },
    Imperfection {
        typical: [5e-4, 5e-3],
        source: "estimate: 0.5 to 5 mm over a metre, with and without a spirit level",
        remedy: "level the rail; integral action brings the cart back",
        slider: Some(Slider {
            name: "tilt",
            label: "slope of the rail",
            unit: "°",
            range: [-5.0, 5.0, 0.1],
            add: |reality, more| reality.sensors.rail_tilt_rad += more.to_radians(),
        }),
        ..imperfection!("rail_tilt_rad", "rad", Rule::ANGLE, "slope of the rail", |reality, size| reality
            .sensors
            .rail_tilt_rad =
            size)
    },
    Imperfection {
        typical: [2e-5, 2e-4],
        source: "estimate: toothed belt under tension, to rack and pinion",
        remedy: "a tensioned belt instead of a rack; an encoder on the cart",
        drives: SimulatedDrives::OfForce("is not simulated between a stepper and its cart"),
        ..imperfection!("backlash_m", "m", Rule::POSITIVE, "play between motor and cart", |reality, size| {
            reality.drive_train.backlash_m = size
        })
    },
    Imperfection {
        typical: [2e-6, 2e-5],
        source: "estimate: toothed belts 6 to 15 mm wide, a metre long",
        remedy: "a wider or shorter belt, or one with steel cords",
        drives: SimulatedDrives::OfForce("is not simulated between a stepper and its cart"),
        ..imperfection!(
            "belt_compliance_m_per_n",
            "m/N",
            Rule::POSITIVE,
            "stretch of belt or gear per force",
            |reality, size| reality.drive_train.belt_compliance_m_per_n = size
        )
    },
    Imperfection {
        typical: [5e-5, 1e-3],
        source: "L / R of small motors (0.18 mH / 2.6 Ω: 70 µs) to large ones",
        remedy: "driver_lag_s in [actuator], which is made up for; a driver with a current loop",
        drives: SimulatedDrives::OfForce(
            "is not simulated with a stepper; see `least bandwidth` of `upright verify`",
        ),
        allowance: Some(Allowance::Stated {
            key: "driver_lag_s",
            at: |actuator| Some(&mut actuator.force_mut()?.lag_s),
        }),
        ..imperfection!(
            "driver_lag_s",
            "s",
            Rule::POSITIVE,
            "time constant of the motor driver, beyond the stated one,",
            |reality, size| reality.driver.driver_lag_s = Some(size)
        )
    },
    Imperfection {
        typical: [5e-5, 5e-4],
        source: "a period of a PWM of 20 kHz, to a command over a bus",
        remedy: "PWM instead of a bus; a longer tick with delay_ticks = 1",
        drives: SimulatedDrives::OfForce(
            "is not simulated with a stepper; see `delay margin` of `upright verify`, and --late",
        ),
        // The simulated force begins within its tick.
        largest: LargestSize::Tick,
        ..imperfection!(
            "latency_s",
            "s",
            Rule::POSITIVE.worded("a number > 0 and < period_s"),
            "additional delay of the force",
            |reality, size| reality.driver.latency_s = size
        )
    },
    Imperfection {
        typical: [2.0, 15.0],
        source: "estimate: measured, to the tolerance of a catalogue's torque constant with that of the gear",
        remedy: "measure the force at standstill and correct torque_constant_n_m_per_a",
        drives: SimulatedDrives::OfForce(
            "a stepper has no force constant; see `gain margin` of `upright verify`",
        ),
        slider: Some(Slider {
            name: "force",
            label: "force of the motor",
            unit: "% more",
            range: [-100.0, 100.0, 1.0],
            add: |reality, more| reality.driver.force_percent += more,
        }),
        ..imperfection!("force_percent", "%", Rule::POSITIVE, "excess of the real force", |reality, size| {
            reality.driver.force_percent = size
        })
    },
    Imperfection {
        typical: [0.5, 5.0],
        source: "estimate: weighed and measured parts, to a drawing",
        remedy: "weigh and measure the links with their screws and encoders",
        // Masses and lengths cannot be wrong by more than nine tenths.
        largest: LargestSize::Of(80.0),
        allowance: Some(Allowance::Tolerated(Tolerances::MASS)),
        ..imperfection!(
            "parameter_spread_percent",
            "%",
            Rule::SPREAD,
            "spread (±) of all masses, lengths and inertias",
            |reality, size| reality.parameters.parameter_spread_percent = size
        )
    },
];

/// The keys of `[verify]`.
pub(super) static REQUIRED_SIZES: [Key; IMPERFECTIONS.len()] = {
    let mut keys = [IMPERFECTIONS[0].required; IMPERFECTIONS.len()];
    let mut row = 1;
    while row < keys.len() {
        keys[row] = IMPERFECTIONS[row].required;
        row += 1;
    }
    keys
};
