//! The imperfections that a machine may have, their typical sizes, and what to do about them.

use serde::Serialize;

use upright_design::number::significant;
use upright_design::rig::{PerJoint, Reality, Requirements, Rig};

/// One kind of imperfection.
#[derive(Debug, Serialize)]
pub struct Imperfection {
    /// Its key in `[reality]`.
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
    /// The size that the loop has to survive according to `[verify]`.
    #[serde(skip)]
    pub(super) required: fn(&Requirements) -> Option<f64>,
    #[serde(skip)]
    pub(super) set: fn(&mut Reality, f64),
}

impl Imperfection {
    /// The machine of `rig` with this imperfection alone, of this size; a lag is that beyond the stated one.
    pub fn on(&self, rig: &Rig, size: f64) -> Rig {
        self.on_with(rig, size, None)
    }

    /// The same with this angle over which joint friction builds up (rad), or the default.
    pub(super) fn on_with(&self, rig: &Rig, size: f64, bristle_rad: Option<f64>) -> Rig {
        // The motor behind the pulses is a part of the drive.
        let mut reality = Reality { step_motor: rig.reality.step_motor.clone(), ..Reality::default() };
        if let Some(bristle_rad) = bristle_rad {
            reality.friction.presliding_rad = PerJoint::all(bristle_rad);
        }
        (self.set)(&mut reality, size);
        if let (Some(real_s), Some(stated_s)) = (&mut reality.driver.driver_lag_s, rig.actuator.driver_lag_s)
        {
            *real_s += stated_s;
        }
        Rig { reality, ..rig.clone() }
    }

    /// The angles over which joint friction may build up (rad); a single none for another imperfection.
    pub(super) fn bristles_rad(&self) -> Vec<Option<f64>> {
        if self.key == "joint_friction_n_m" { BRISTLES_RAD.map(Some).to_vec() } else { vec![None] }
    }

    /// One machine for each of these angles.
    pub(super) fn on_each(&self, rig: &Rig, size: f64) -> Vec<Rig> {
        self.bristles_rad().into_iter().map(|bristle_rad| self.on_with(rig, size, bristle_rad)).collect()
    }

    /// Those that are simulated on the machine of `rig`.
    pub fn all_of(rig: &Rig) -> Vec<&'static Self> {
        IMPERFECTIONS.iter().filter(|one| one.not_on(rig).is_none()).collect()
    }

    /// Why this imperfection is not simulated on the machine of `rig`, if it is not.
    pub fn not_on(&self, rig: &Rig) -> Option<&'static str> {
        rig.actuator.acceleration.as_ref()?;
        match self.key {
            "cart_friction_n" if rig.reality.step_motor.holding_force_n.is_some() => None,
            "cart_friction_n" => Some(
                "changes nothing before the motor slips; give holding_force_n in [reality] to see from which size it does",
            ),
            "backlash_m" | "belt_compliance_m_per_n" => {
                Some("is not simulated between a stepper and its cart")
            }
            "driver_lag_s" => {
                Some("is not simulated with a stepper; see `least bandwidth` of `upright verify`")
            }
            "latency_s" => {
                Some("is not simulated with a stepper; see `delay margin` of `upright verify`, and --late")
            }
            "force_percent" => Some("a stepper has no force constant; see `gain margin` of `upright verify`"),
            _ => None,
        }
    }

    /// The typical sizes as text: `1e-4 to 0.001`.
    pub fn typical_text(&self) -> String {
        let [good, poor] = self.typical.map(|size| significant(size, 2));
        format!("{good} to {poor}")
    }
}

/// Angles over which the friction of a joint builds up (rad). Real bearings have 0.3 to 1 mrad; which end of a wider
/// range is worse depends on the law.
const BRISTLES_RAD: [f64; 2] = [1e-3, 1e-4];

/// Every imperfection that a size can be searched for.
pub static IMPERFECTIONS: [Imperfection; 13] = [
    Imperfection {
        key: "joint_friction_n_m",
        unit: "N·m",
        typical: [1e-4, 1e-3],
        source: "measured: 1.9e-4 to 6.3e-4 in five of six ball bearings (docs/reality.md); greased or large ones have more",
        remedy: "smaller bearings without seals, with oil instead of grease; more weight on the angles",
        requirement: "runs with the motor on (joint_friction_n_m)",
        required: |verify| verify.joint_friction_n_m,
        set: |reality, size| reality.friction.joint_friction_n_m = PerJoint::all(size),
    },
    Imperfection {
        key: "cart_friction_n",
        unit: "N",
        typical: [0.2, 2.0],
        source: "estimate: miniature ball guides, light to sealed",
        remedy: "a guide without seals; less preload",
        requirement: "runs with the motor on (cart_friction_n)",
        required: |verify| verify.cart_friction_n,
        set: |reality, size| reality.friction.cart_friction_n = size,
    },
    Imperfection {
        key: "homing_error_rad",
        unit: "rad",
        typical: [1e-3, 1e-2],
        source: "a hanging link stops within F / (m g c) of the vertical: friction over weight times distance",
        remedy: "home while the links swing out; integral action brings the cart back",
        requirement: "runs with the motor on (homing_error_rad)",
        required: |verify| verify.homing_error_rad,
        set: |reality, size| reality.sensors.homing_error_rad = PerJoint::all(size),
    },
    Imperfection {
        key: "eccentricity_rad",
        unit: "rad",
        typical: [1e-3, 5e-3],
        source: "2 e / D: a disk of 20 mm, 0.01 to 0.05 mm off its centre",
        remedy: "centre the disk; an encoder with its own bearing",
        requirement: "runs with the motor on (eccentricity_rad)",
        required: |verify| verify.eccentricity_rad,
        set: |reality, size| {
            reality.sensors.eccentricity_rad = PerJoint::all(size);
            reality.sensors.eccentricity_phase_rad = PerJoint::all(core::f64::consts::FRAC_PI_4);
        },
    },
    Imperfection {
        key: "twice_per_turn_rad",
        unit: "rad",
        typical: [1e-3, 1.7e-2],
        source: "data sheets: 0.05° of an AS5048 that is linearised, to 1° of an AS5046 whose magnet is 0.7 mm off",
        remedy: "centre the magnet over the sensor; a stronger magnet, further from iron",
        requirement: "runs with the motor on (twice_per_turn_rad)",
        required: |verify| verify.twice_per_turn_rad,
        set: |reality, size| {
            reality.sensors.twice_per_turn_rad = PerJoint::all(size);
            // Near upright, the reading moves by less than the link.
            reality.sensors.twice_per_turn_phase_rad = PerJoint::all(core::f64::consts::PI);
        },
    },
    Imperfection {
        key: "sensor_delay_s",
        unit: "s",
        typical: [1e-4, 1e-3],
        source: "data sheets: 96 µs (AS5045, AS5046; slow 384 µs), to a filter or a slow bus (estimate)",
        remedy: "sensor_delay_s in [[link]], which is made up for; SPI instead of I²C; a faster clock of the bus",
        requirement: "runs with the motor on (sensor_delay_s)",
        required: |verify| verify.sensor_delay_s,
        set: |reality, size| reality.sensors.sensor_delay_s = PerJoint::all(size),
    },
    Imperfection {
        key: "rail_tilt_rad",
        unit: "rad",
        typical: [5e-4, 5e-3],
        source: "estimate: 0.5 to 5 mm over a metre, with and without a spirit level",
        remedy: "level the rail; integral action brings the cart back",
        requirement: "runs with the motor on (rail_tilt_rad)",
        required: |verify| verify.rail_tilt_rad,
        set: |reality, size| reality.sensors.rail_tilt_rad = size,
    },
    Imperfection {
        key: "backlash_m",
        unit: "m",
        typical: [2e-5, 2e-4],
        source: "estimate: toothed belt under tension, to rack and pinion",
        remedy: "a tensioned belt instead of a rack; an encoder on the cart",
        requirement: "runs with the motor on (backlash_m)",
        required: |verify| verify.backlash_m,
        set: |reality, size| reality.drive_train.backlash_m = size,
    },
    Imperfection {
        key: "belt_compliance_m_per_n",
        unit: "m/N",
        typical: [2e-6, 2e-5],
        source: "estimate: toothed belts 6 to 15 mm wide, a metre long",
        remedy: "a wider or shorter belt, or one with steel cords",
        requirement: "runs with the motor on (belt_compliance_m_per_n)",
        required: |verify| verify.belt_compliance_m_per_n,
        set: |reality, size| reality.drive_train.belt_compliance_m_per_n = size,
    },
    Imperfection {
        key: "driver_lag_s",
        unit: "s",
        typical: [5e-5, 1e-3],
        source: "L / R of small motors (0.18 mH / 2.6 Ω: 70 µs) to large ones",
        remedy: "driver_lag_s in [actuator], which is made up for; a driver with a current loop",
        requirement: "runs with the motor on (driver_lag_s)",
        required: |verify| verify.driver_lag_s,
        set: |reality, size| reality.driver.driver_lag_s = Some(size),
    },
    Imperfection {
        key: "latency_s",
        unit: "s",
        typical: [5e-5, 5e-4],
        source: "a period of a PWM of 20 kHz, to a command over a bus",
        remedy: "PWM instead of a bus; a longer tick with delay_ticks = 1",
        requirement: "runs with the motor on (latency_s)",
        required: |verify| verify.latency_s,
        set: |reality, size| reality.driver.latency_s = size,
    },
    Imperfection {
        key: "force_percent",
        unit: "%",
        typical: [2.0, 15.0],
        source: "estimate: measured, to the tolerance of a catalogue's torque constant with that of the gear",
        remedy: "measure the force at standstill and correct torque_constant_n_m_per_a",
        requirement: "runs with the motor on (force_percent)",
        required: |verify| verify.force_percent,
        set: |reality, size| reality.driver.force_percent = size,
    },
    Imperfection {
        key: "parameter_spread_percent",
        unit: "%",
        typical: [0.5, 5.0],
        source: "estimate: weighed and measured parts, to a drawing",
        remedy: "weigh and measure the links with their screws and encoders",
        requirement: "runs with the motor on (parameter_spread_percent)",
        required: |verify| verify.parameter_spread_percent,
        set: |reality, size| reality.parameters.parameter_spread_percent = size,
    },
];
