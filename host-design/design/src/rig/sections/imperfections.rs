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
#[derive(Clone, Copy, Serialize)]
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
    /// What is otherwise on an arm, besides names and units.
    #[serde(skip)]
    pub(crate) on_arm: Option<ArmSizes>,
}

/// What an imperfection is on an arm.
#[derive(Clone, Copy)]
pub(crate) struct ArmSizes {
    pub(crate) typical: [f64; 2],
    pub(crate) source: &'static str,
    pub(crate) remedy: &'static str,
    /// Unit and range of the slider, if it has one.
    pub(crate) slider: Option<(&'static str, [f64; 3])>,
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

/// Declares the rows. A row states key, unit and rule of the size, its meaning, the typical sizes, their source, the
/// remedy, and how the size is set; then, in braces, what is special.
macro_rules! imperfections {
    ($(
        $key:ident: $unit:literal, $rule:expr, $meaning:literal, $typical:expr, $source:literal, $remedy:literal, $set:expr
        $(, { $($special:tt)* })?;
    )+) => {
        /// Every imperfection that a size can be searched for, in the order of `[verify]`.
        pub static IMPERFECTIONS: &[Imperfection] = &[$(Imperfection {
            key: stringify!($key),
            unit: $unit,
            typical: $typical,
            source: $source,
            remedy: $remedy,
            requirement: concat!("runs with the motor on (", stringify!($key), ")"),
            set: $set,
            $($($special)*)?
            ..PLAIN
        }),+];

        /// The keys of `[verify]`: the sizes that the loop has to survive.
        pub(crate) static REQUIRED_SIZES: &[Key] = &[$(Key {
            name: stringify!($key),
            unit: $unit,
            rule: $rule,
            meaning: concat!($meaning, " that the loop has to survive as the only imperfection"),
            absent: Absent::Follows("not required"),
        }),+];
    };
}

/// What most rows have.
const PLAIN: Imperfection = Imperfection {
    key: "",
    unit: "",
    typical: [0.0; 2],
    source: "",
    remedy: "",
    requirement: "",
    set: |_, _| (),
    bristles_rad: &[],
    largest: LargestSize::Any,
    drives: SimulatedDrives::All,
    allowance: None,
    slider: None,
    on_arm: None,
};

imperfections! {
    joint_friction_n_m: "N·m", Rule::POSITIVE, "Coulomb friction in each joint", [1e-4, 1e-3],
        "measured: 1.9e-4 to 6.3e-4 in five of six ball bearings (docs/reality.md); greased or large ones have more",
        "smaller bearings without seals, with oil instead of grease; more weight on the angles",
        |reality, size| reality.friction.joint_friction_n_m = PerJoint::all(size), {
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
        };
    cart_friction_n: "N", Rule::POSITIVE, "Coulomb friction of the cart", [0.2, 2.0],
        "estimate: miniature ball guides, light to sealed",
        "a guide without seals; less preload",
        |reality, size| reality.friction.cart_friction_n = size, {
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
            on_arm: Some(ArmSizes {
                typical: [1e-3, 5e-2],
                source: "estimate: no-load current times torque constant, of a small motor to one behind a gear",
                remedy: "arm_n_m in [friction], rather too small than too large; a motor without a gear",
                slider: Some(("N·m more", [0.0, 0.2, 1e-3])),
            }),
        };
    homing_error_rad: "rad", Rule::ANGLE, "error of each joint's zero", [1e-3, 1e-2],
        "a hanging link stops within F / (m g c) of the vertical: friction over weight times distance",
        "home while the links swing out; integral action brings the cart back",
        |reality, size| reality.sensors.homing_error_rad = PerJoint::all(size), {
            allowance: Some(Allowance::Tolerated(Tolerances::HOMING_ERROR)),
        };
    eccentricity_rad: "rad", Rule::ANGLE,
        "amplitude of each joint encoder's once-per-turn error", [1e-3, 5e-3],
        "2 e / D: a disk of 20 mm, 0.01 to 0.05 mm off its centre",
        "centre the disk; an encoder with its own bearing",
        |reality, size| {
            reality.sensors.eccentricity_rad = PerJoint::all(size);
            reality.sensors.eccentricity_phase_rad = PerJoint::all(FRAC_PI_4);
        };
    twice_per_turn_rad: "rad", Rule::ANGLE,
        "amplitude of each joint sensor's twice-per-turn error", [1e-3, 1.7e-2],
        "data sheets: 0.05° of an AS5048 that is linearised, to 1° of an AS5046 whose magnet is 0.7 mm off",
        "centre the magnet over the sensor; a stronger magnet, further from iron",
        |reality, size| {
            reality.sensors.twice_per_turn_rad = PerJoint::all(size);
            // Near upright, the reading moves by less than the link.
            reality.sensors.twice_per_turn_phase_rad = PerJoint::all(PI);
        };
    sensor_delay_s: "s", Rule::POSITIVE, "age of the joints' readings", [1e-4, 1e-3],
        "data sheets: 96 µs (AS5045, AS5046; slow 384 µs), to a filter or a slow bus (estimate)",
        "sensor_delay_s in [[link]], which is made up for; SPI instead of I²C; a faster clock of the bus",
        |reality, size| reality.sensors.sensor_delay_s = PerJoint::all(size);
    rail_tilt_rad: "rad", Rule::ANGLE, "slope of the rail", [5e-4, 5e-3],
        "estimate: 0.5 to 5 mm over a metre, with and without a spirit level",
        "level the rail; integral action brings the cart back",
        |reality, size| reality.sensors.rail_tilt_rad = size, {
            slider: Some(Slider {
                name: "tilt",
                label: "slope of the rail",
                unit: "°",
                range: [-5.0, 5.0, 0.1],
                add: |reality, more| reality.sensors.rail_tilt_rad += more.to_radians(),
            }),
        };
    backlash_m: "m", Rule::POSITIVE, "play between motor and cart", [2e-5, 2e-4],
        "estimate: toothed belt under tension, to rack and pinion",
        "a tensioned belt instead of a rack; an encoder on the cart",
        |reality, size| reality.drive_train.backlash_m = size, {
            on_arm: Some(ArmSizes {
                typical: [5e-3, 3.5e-2],
                source: "estimate: 0.3° of a planetary gear made for little play, to 2° of a spur gear",
                remedy: "a motor without a gear, or a spring between two gears; an encoder on the arm",
                slider: None,
            }),
            drives: SimulatedDrives::OfForce("is not simulated between a stepper and its cart"),
        };
    belt_compliance_m_per_n: "m/N", Rule::POSITIVE, "stretch of belt or gear per force", [2e-6, 2e-5],
        "estimate: toothed belts 6 to 15 mm wide, a metre long",
        "a wider or shorter belt, or one with steel cords",
        |reality, size| reality.drive_train.belt_compliance_m_per_n = size, {
            on_arm: Some(ArmSizes {
                typical: [5e-3, 5e-2],
                source: "50 mm of a steel shaft of 6 mm (G J / L), to a coupling with rubber (estimate)",
                remedy: "a shorter or thicker shaft; a stiff coupling",
                slider: None,
            }),
            drives: SimulatedDrives::OfForce("is not simulated between a stepper and its cart"),
        };
    driver_lag_s: "s", Rule::POSITIVE,
        "time constant of the motor driver, beyond the stated one,", [5e-5, 1e-3],
        "L / R of small motors (0.18 mH / 2.6 Ω: 70 µs) to large ones",
        "driver_lag_s in [actuator], which is made up for; a driver with a current loop",
        |reality, size| reality.driver.driver_lag_s = Some(size), {
            drives: SimulatedDrives::OfForce(
                "is not simulated with a stepper; see `least bandwidth` of `upright verify`",
            ),
            allowance: Some(Allowance::Stated {
                key: "driver_lag_s",
                at: |actuator| Some(&mut actuator.force_mut()?.lag_s),
            }),
        };
    latency_s: "s", Rule::POSITIVE.worded("a number > 0 and < period_s"),
        "additional delay of the force", [5e-5, 5e-4],
        "a period of a PWM of 20 kHz, to a command over a bus",
        "PWM instead of a bus; a longer tick with delay_ticks = 1",
        |reality, size| reality.driver.latency_s = size, {
            drives: SimulatedDrives::OfForce(
                "is not simulated with a stepper; see `delay margin` of `upright verify`, and --late",
            ),
            // The simulated force begins within its tick.
            largest: LargestSize::Tick,
        };
    force_percent: "%", Rule::POSITIVE, "excess of the real force", [2.0, 15.0],
        "estimate: measured, to the tolerance of a catalogue's torque constant with that of the gear",
        "measure the force at standstill and correct torque_constant_n_m_per_a",
        |reality, size| reality.driver.force_percent = size, {
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
        };
    parameter_spread_percent: "%", Rule::SPREAD, "spread (±) of all masses, lengths and inertias", [0.5, 5.0],
        "estimate: weighed and measured parts, to a drawing",
        "weigh and measure the links with their screws and encoders",
        |reality, size| reality.parameters.parameter_spread_percent = size, {
            // Masses and lengths cannot be wrong by more than nine tenths.
            largest: LargestSize::Of(80.0),
            allowance: Some(Allowance::Tolerated(Tolerances::MASS)),
        };
}
