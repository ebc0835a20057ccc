//! `[actuator]`: force limit and motor, or a drive whose input is the cart's acceleration.

use serde::{Serialize, Serializer};

use super::super::error::RigError;
use super::super::held::{Held, lag_at};
use super::super::key::{Absent, Key, Section};
use super::super::node::{Node, Table};
use super::super::rule::Rule;
use super::super::value::{Keys, keys};
use super::chain::CartInput;
use super::tick::Tick;

/// `[actuator]`
pub(crate) static ACTUATOR: Section = Section {
    name: "actuator",
    title: "[actuator]",
    meaning: "with kind = \"force\": force limit and DC motor; if any motor key is given, the required motor keys must \
              be given. With kind = \"acceleration\": a stepper, see drives.md",
    absent: Absent::Follows("no limit, no motor"),
    keys: &[KIND, FORCE, Motor::KEYS, AccelerationDrive::KEYS],
};

const KIND: &[Key] = &[Key {
    name: "kind",
    unit: "",
    rule: Rule::checked_by_its_section("\"force\" or \"acceleration\""),
    meaning: "what the drive imposes on the cart: a force (DC motor, current-controlled servo), or an acceleration, \
              whatever force that takes (stepper)",
    absent: Absent::Follows("\"force\""),
}];

const FORCE: &[Key] = &[
    Key {
        name: "force_limit_n",
        unit: "N",
        rule: Rule::POSITIVE,
        meaning: "largest force on the cart",
        absent: Absent::Follows("no limit"),
    },
    Key {
        name: "driver_lag_s",
        unit: "s",
        rule: Rule::POSITIVE,
        meaning: "lag of the force: time constant of the motor driver, or of the winding (inductance by resistance)",
        absent: Absent::Follows("it follows at once"),
    },
];

/// Accepted voltages of dead zone and bridge; the section's own code compares them with the supply.
const BELOW_SUPPLY: Rule = Rule::NOT_NEGATIVE.worded("a number >= 0 and < supply_v (V)");
const WITH_A_MOTOR: Absent = Absent::RequiredIf("with a motor");

/// The drive of the cart, `[actuator]`.
#[derive(Debug, Clone, PartialEq)]
pub enum Actuator {
    /// It produces the commanded force: a motor whose current is controlled.
    Force(ForceDrive),
    /// A DC motor that is given a voltage, and the limits of its driver.
    Motor(Motor, ForceDrive),
    /// It moves the cart by pulses, whatever force that takes.
    Pulses(AccelerationDrive),
}

/// What limits and delays the force of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ForceDrive {
    /// `force_limit_n`: largest force on the cart (N); none: no limit.
    pub limit_n: Option<f64>,
    /// `driver_lag_s`: time constant (s) with which the force follows its command; none: at once.
    pub lag_s: Option<f64>,
}

impl Default for Actuator {
    /// Any force, at once.
    fn default() -> Self {
        Self::Force(ForceDrive::default())
    }
}

/// The keys of the file, in which a kind has only its own.
impl Serialize for Actuator {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct GivenKeys<'a> {
            force_limit_n: Option<f64>,
            #[serde(skip_serializing_if = "Option::is_none")]
            driver_lag_s: Option<f64>,
            motor: Option<&'a Motor>,
            #[serde(skip_serializing_if = "Option::is_none")]
            acceleration: Option<&'a AccelerationDrive>,
        }
        let force = self.force().copied().unwrap_or_default();
        GivenKeys {
            force_limit_n: force.limit_n,
            driver_lag_s: force.lag_s,
            motor: self.motor(),
            acceleration: self.pulses(),
        }
        .serialize(serializer)
    }
}

impl Actuator {
    /// What the drive holds during a tick.
    pub fn held(&self) -> Held {
        match self {
            Self::Force(_) => Held::Force,
            Self::Motor(motor, _) => Held::Voltage { braking_n_s_per_m: motor.braking_n_s_per_m() },
            Self::Pulses(drive) => match drive.bandwidth_hz {
                Some(bandwidth_hz) => Held::LaggingSpeed { lag_s: lag_at(bandwidth_hz) },
                None => Held::MeanSpeed,
            },
        }
    }

    /// What the drive imposes on the cart.
    pub fn input(&self) -> CartInput {
        if self.held().is_motion() { CartInput::Acceleration } else { CartInput::Force }
    }

    /// Largest force on the cart (N): the smaller of the file's limit and the motor's force at standstill, where given.
    /// None: no limit, or a drive that applies whatever force its motion takes.
    pub fn largest_force_n(&self) -> Option<f64> {
        let stall_n = self.motor().map(Motor::stall_force_n);
        self.force()?.limit_n.into_iter().chain(stall_n).reduce(f64::min)
    }

    /// Largest input of the plant: force on the cart (N), or its acceleration (m/s²). None: no limit.
    pub fn largest_input(&self) -> Option<f64> {
        match self {
            Self::Force(_) | Self::Motor(..) => self.largest_force_n(),
            Self::Pulses(drive) => Some(drive.acceleration_limit_m_per_s2),
        }
    }

    /// Largest speed of the cart that the drive is asked for with ticks of `period_s` (m/s); none: no limit.
    pub fn largest_speed_m_per_s(&self, period_s: f64) -> Option<f64> {
        self.pulses()?.largest_speed_m_per_s(period_s)
    }

    /// The motor of a drive that has one.
    pub fn motor(&self) -> Option<&Motor> {
        if let Self::Motor(motor, _) = self { Some(motor) } else { None }
    }

    /// The same, to be changed.
    pub fn motor_mut(&mut self) -> Option<&mut Motor> {
        if let Self::Motor(motor, _) = self { Some(motor) } else { None }
    }

    /// Limit and lag of a drive that pushes with a force.
    pub fn force(&self) -> Option<&ForceDrive> {
        match self {
            Self::Force(force) | Self::Motor(_, force) => Some(force),
            Self::Pulses(_) => None,
        }
    }

    /// The same, to be changed.
    pub fn force_mut(&mut self) -> Option<&mut ForceDrive> {
        match self {
            Self::Force(force) | Self::Motor(_, force) => Some(force),
            Self::Pulses(_) => None,
        }
    }

    /// Time constant with which the force follows its command (s); none: at once.
    pub fn lag_s(&self) -> Option<f64> {
        self.force()?.lag_s
    }

    /// The drive that takes pulses.
    pub fn pulses(&self) -> Option<&AccelerationDrive> {
        if let Self::Pulses(drive) = self { Some(drive) } else { None }
    }

    /// The same, to be changed.
    pub fn pulses_mut(&mut self) -> Option<&mut AccelerationDrive> {
        if let Self::Pulses(drive) = self { Some(drive) } else { None }
    }
}

const WITH_ACCELERATION: Absent = Absent::RequiredIf("with kind = \"acceleration\"");

keys! {
    /// A drive that imposes the cart's acceleration, by step pulses.
    pub struct AccelerationDrive {
        acceleration_limit_m_per_s2: f64, "m/s²", Rule::POSITIVE,
            "largest acceleration of the cart", WITH_ACCELERATION;
        step_m: f64, "m", Rule::POSITIVE,
            "travel of the cart per pulse, microsteps included", WITH_ACCELERATION;
        speed_limit_m_per_s: Option<f64>, "m/s", Rule::POSITIVE,
            "largest speed that the drive is asked for", Absent::Follows("no limit");
        step_rate_limit_hz: Option<f64>, "Hz", Rule::POSITIVE,
            "largest rate of pulses", Absent::Follows("no limit");
        #[serde(skip_serializing_if = "Option::is_none")]
        bandwidth_hz: Option<f64>, "Hz", Rule::POSITIVE,
            "bandwidth of a servo, which follows its speed with a lag of first order", Absent::Follows("it follows at once");
    }
}

impl AccelerationDrive {
    /// Time constant (s) with which it follows its speed; 0 without a bandwidth.
    pub fn lag_s(&self) -> f64 {
        self.bandwidth_hz.map_or(0.0, lag_at)
    }

    /// Speed above that of the cart which is commanded per acceleration (s), see [`StepMap`](upright::table::StepMap).
    pub fn lead_s(&self, period_s: f64) -> f64 {
        match self.lag_s() {
            0.0 => 0.5 * f64::from(period_s as f32),
            lag_s => -period_s / libm::expm1(-period_s / lag_s),
        }
    }

    /// Largest speed (m/s): the smaller of the file's limit and what the rate of pulses allows, where given. A tick of
    /// `period_s` (s) has up to a pulse more than its speed needs, because positions are rounded to steps.
    pub fn largest_speed_m_per_s(&self, period_s: f64) -> Option<f64> {
        let by_rate = self.step_rate_limit_hz.map(|rate_hz| (rate_hz - 1.0 / period_s) * self.step_m);
        match (self.speed_limit_m_per_s, by_rate) {
            (Some(limit), Some(by_rate)) => Some(limit.min(by_rate)),
            (limit, by_rate) => limit.or(by_rate),
        }
    }
}

keys! {
    /// A DC motor with gear and pulley.
    pub struct Motor {
        torque_constant_n_m_per_a: f64, "N·m/A", Rule::POSITIVE,
            "torque constant of the motor", WITH_A_MOTOR;
        #[serde(skip_serializing_if = "Option::is_none")]
        back_emf_constant_v_s_per_rad: Option<f64>, "V·s/rad", Rule::POSITIVE,
            "back-EMF constant of the motor, the reciprocal of its speed constant",
            Absent::Follows("equal to the torque constant");
        #[serde(skip_serializing_if = "Option::is_none")]
        efficiency: Option<f64>, "", Rule::EFFICIENCY,
            "share of the motor's torque that gear and belt hand on", Absent::Follows("1");
        resistance_ohm: f64, "Ω", Rule::POSITIVE, "winding resistance of the motor", WITH_A_MOTOR;
        gear_ratio: f64, "", Rule::POSITIVE, "number of motor turns per pulley turn", Absent::Numbers(&[1.0]);
        pulley_radius_m: f64, "m", Rule::POSITIVE, "radius of the pulley or pinion", WITH_A_MOTOR;
        supply_v: f64, "V", Rule::POSITIVE, "supply voltage of the motor driver", WITH_A_MOTOR;
        #[serde(skip_serializing_if = "Option::is_none")]
        bridge_drop_v: Option<f64>, "V", BELOW_SUPPLY,
            "voltage that the transistors of the motor driver lose, about 2 V in an L298N", Absent::Follows("0");
        dead_zone_v: f64, "V", BELOW_SUPPLY,
            "voltage below which the motor does not move", Absent::Numbers(&[0.0]);
        slew_v_per_s: Option<f64>, "V/s", Rule::POSITIVE,
            "largest rate of change of the motor's voltage", Absent::Follows("no limit");
    }
}

/// Voltages of the motor are given before the driver's bridge, where the full duty cycle is the supply: a motor behind
/// transistors that lose a part of the supply seems to have more resistance and more back-EMF.
impl Motor {
    /// Back-EMF per cart speed, `gear Ke / r` (V·s/m).
    pub fn volts_per_speed(&self) -> f64 {
        self.before_bridge() * self.back_emf_v_s_per_m()
    }

    /// Resistance of the winding (Ω).
    pub fn resistance_before_bridge_ohm(&self) -> f64 {
        self.before_bridge() * self.resistance_ohm
    }

    /// Force on the cart per current, `efficiency gear Kt / r` (N/A).
    pub fn newtons_per_amp(&self) -> f64 {
        self.delivered_torque_n_m_per_a() * self.gear_ratio / self.pulley_radius_m
    }

    /// Force on the cart per voltage at standstill, `efficiency gear Kt / (R r)` (N/V).
    pub fn newtons_per_volt(&self) -> f64 {
        self.newtons_per_amp() / self.resistance_before_bridge_ohm()
    }

    /// Back-EMF as viscous friction of the cart with the motor's terminals held at a voltage (N·s/m).
    pub fn braking_n_s_per_m(&self) -> f64 {
        self.newtons_per_amp() * self.back_emf_v_s_per_m() / self.resistance_ohm
    }

    /// Force on the cart at standstill and full supply, `efficiency gear Kt V / (R r)` (N).
    pub fn stall_force_n(&self) -> f64 {
        self.gear_ratio * self.delivered_torque_n_m_per_a() * self.supply_v
            / (self.resistance_before_bridge_ohm() * self.pulley_radius_m)
    }

    fn back_emf_v_s_per_m(&self) -> f64 {
        let constant = self.back_emf_constant_v_s_per_rad.unwrap_or(self.torque_constant_n_m_per_a);
        self.gear_ratio * constant / self.pulley_radius_m
    }

    /// Voltage before the bridge per voltage at the motor: 1 without `bridge_drop_v`.
    fn before_bridge(&self) -> f64 {
        self.supply_v / (self.supply_v - self.bridge_drop_v.unwrap_or(0.0))
    }

    /// The torque constant less what gear and belt lose.
    fn delivered_torque_n_m_per_a(&self) -> f64 {
        self.torque_constant_n_m_per_a * self.efficiency.unwrap_or(1.0)
    }
}

/// Reads `[actuator]`; a motor is described as soon as one of its keys is given.
pub(crate) fn actuator(node: &Node<'_>, tick: &Tick) -> Result<Actuator, RigError> {
    let table = node.table(&ACTUATOR)?;
    let kind = table.get("kind").map(|node| node.one_of(["force", "acceleration"], &table.asks_for("kind")));
    let is_acceleration = kind.transpose()? == Some(1);
    let (foreign, accepts, remedy) = match is_acceleration {
        true => (
            [FORCE, Motor::KEYS].concat(),
            "only with kind = \"force\"",
            "leave it out: a drive that imposes the acceleration applies whatever force that takes",
        ),
        false => (
            AccelerationDrive::KEYS.to_vec(),
            "only with kind = \"acceleration\"",
            "leave it out, or set kind = \"acceleration\" for a stepper",
        ),
    };
    if let Some(node) = foreign.iter().find_map(|key| table.get(key.name)) {
        return Err(node.out_of_range(accepts, remedy));
    }
    if is_acceleration {
        return acceleration(&table, tick).map(Actuator::Pulses);
    }
    let force = ForceDrive { limit_n: table.value("force_limit_n")?, lag_s: table.value("driver_lag_s")? };
    let described = Motor::KEYS.iter().any(|key| table.get(key.name).is_some());
    Ok(if described { Actuator::Motor(motor(&table)?, force) } else { Actuator::Force(force) })
}

/// A tick needs room for pulses, and its pulses begin in the same tick.
fn acceleration(table: &Table<'_>, tick: &Tick) -> Result<AccelerationDrive, RigError> {
    let drive = AccelerationDrive::read(table)?;
    let least_hz = 2.0 / tick.period_s;
    match (table.get("step_rate_limit_hz"), drive.step_rate_limit_hz) {
        (Some(node), Some(rate_hz)) if rate_hz < least_hz => Err(node.out_of_range(
            &format!("a number >= {least_hz} (Hz), two pulses in a tick"),
            "give the largest rate that driver and pulse generator take, or a longer period_s in [tick]",
        )),
        _ if tick.delay_ticks == 1 => Err(table.need("kind", "kind")?.out_of_range(
            "\"force\" with delay_ticks = 1",
            "leave delay_ticks in [tick] out: the pulses of a tick begin in that tick",
        )),
        _ => Ok(drive),
    }
}

fn motor(table: &Table<'_>) -> Result<Motor, RigError> {
    let motor = Motor::read(table)?;
    let less_than_supply = |key: &str, volts: f64| match table.get(key) {
        Some(node) if volts >= motor.supply_v => Err(node.out_of_range(
            BELOW_SUPPLY.accepts,
            &format!("give {}, less than supply_v", table.asks_for(key)),
        )),
        _ => Ok(()),
    };
    less_than_supply("dead_zone_v", motor.dead_zone_v)?;
    less_than_supply("bridge_drop_v", motor.bridge_drop_v.unwrap_or(0.0))?;
    Ok(motor)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::plant::MotorPlant;
    use crate::rig::Rig;

    fn parse(key: &str) -> Result<Motor, RigError> {
        let text = format!(
            "name = \"a\"\n[cart]\nmass_kg = 1\n[[link]]\nmass_kg = 1\nlength_m = 1\n[actuator]\nresistance_ohm = 2.9011\n\
             torque_constant_n_m_per_a = 0.05\npulley_radius_m = 0.01\nsupply_v = 6\n{key}\n"
        );
        Rig::from_toml(&text, Path::new("rig.toml")).map(|rig| rig.actuator.motor().unwrap().clone())
    }

    /// An L298N takes 2 V of the 6 V of a motor that would push with 10.341 N.
    #[test]
    fn a_bridge_that_loses_volts_leaves_less_force_and_less_speed_but_the_same_braking() {
        let (all, less) = (parse("").unwrap(), parse("bridge_drop_v = 2").unwrap());
        let near = |found: f64, wanted: f64| (found - wanted).abs() < 5e-4;
        assert!(
            near(all.stall_force_n(), 10.341) && near(less.stall_force_n(), 6.894),
            "{}",
            less.stall_force_n()
        );
        assert!(
            near(all.supply_v / all.volts_per_speed(), 1.2)
                && near(less.supply_v / less.volts_per_speed(), 0.8)
        );
        assert_eq!(all.braking_n_s_per_m(), less.braking_n_s_per_m());
        // At the full duty cycle the motor sees 4 V, less 5 V·s/m · 0.4 m/s of back-EMF.
        let force = MotorPlant::of(&less).force(1.0, 0.4);
        assert!(near(force, (4.0 - 5.0 * 0.4) / 2.9011 * 5.0), "{force}");
        let error = parse("bridge_drop_v = 6").unwrap_err().to_string();
        assert!(
            error.contains("actuator.bridge_drop_v: found 6, accepted: a number >= 0 and < supply_v"),
            "{error}"
        );
    }
}
