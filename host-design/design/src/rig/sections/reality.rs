//! `[reality]`: how the machine on the bench differs from the model.

use super::super::base::Base;
use super::super::error::RigError;
use super::super::key::{Absent, Section};
use super::super::node::{Node, Table};
use super::super::rule::Rule;
use super::super::value::{Keys, PerJoint, Value, keys};
use super::chain::{CartInput, Chain, PlantDescription};

/// `[reality]`
pub(crate) static REALITY: Section = Section {
    name: "reality",
    title: "[reality]",
    meaning: "imperfections of the simulated machine, not with [model]; they change no gain",
    absent: Absent::Follows("the machine matches the model"),
    keys: &[
        DryFriction::KEYS,
        AirDrag::KEYS,
        DriveTrain::KEYS,
        DriverErrors::KEYS,
        StepMotorData::KEYS,
        SensorErrors::KEYS,
        ParameterErrors::KEYS,
    ],
};

const NONE: Absent = Absent::Numbers(&[0.0]);
const EACH_NOT_NEGATIVE: Rule = Rule::NOT_NEGATIVE.worded("a number >= 0, or one per joint");
const EACH_PRESLIDING: Rule = Rule::AT_LEAST_A_MILLIONTH.worded("a number >= 1e-6, or one per joint");
const EACH_ANGLE: Rule = Rule::SIGNED_ANGLE.worded("a number from -pi to pi (rad), or one per joint");
const EACH_PERCENT: Rule = Rule::SIGNED_PERCENT.worded("a number > -100 and <= 900 (%), or one per joint");

keys! {
    /// Dry friction, simulated as a bristle that bends and then slides.
    pub struct DryFriction {
        joint_friction_n_m: PerJoint, "N·m", EACH_NOT_NEGATIVE, "Coulomb friction in each joint", NONE;
        cart_friction_n: f64, "N", Rule::NOT_NEGATIVE, "Coulomb friction of the cart on its rail", NONE;
        breakaway_percent: f64, "%", Rule::NOT_NEGATIVE,
            "excess of the friction at rest over the Coulomb friction", NONE;
        stribeck_rad_per_s: f64, "rad/s", Rule::POSITIVE,
            "rate of a joint at which half of that excess is left", Absent::Numbers(&[0.1]);
        stribeck_m_per_s: f64, "m/s", Rule::POSITIVE,
            "speed of the cart at which half of that excess is left", Absent::Numbers(&[0.01]);
        presliding_rad: PerJoint, "rad", EACH_PRESLIDING,
            "angle over which the friction of each joint builds up", Absent::Numbers(&[0.001]);
        presliding_m: f64, "m", Rule::AT_LEAST_A_MILLIONTH,
            "travel over which the friction of the cart builds up", Absent::Numbers(&[5e-5]);
    }
}

keys! {
    /// Air drag of the links.
    pub struct AirDrag {
        air_drag_n_m_s2_per_rad2: PerJoint, "N·m·s²/rad²", EACH_NOT_NEGATIVE,
            "air drag of each link: torque per square of its rate", NONE;
    }
}

keys! {
    /// Backlash and elastic belt between motor and cart.
    pub struct DriveTrain {
        backlash_m: f64, "m", Rule::NOT_NEGATIVE, "play between motor and cart, as travel of the cart", NONE;
        belt_compliance_m_per_n: f64, "m/N", Rule::NOT_NEGATIVE, "stretch of belt or gear per force", NONE;
        rotor_mass_kg: Option<f64>, "kg", Rule::POSITIVE.worded("a number > 0 and < mass_kg of [cart]"),
            "part of the cart's mass that is on the motor's side of backlash and belt",
            Absent::Follows("10 % of the cart's mass");
    }
}

keys! {
    /// Errors of motor driver and supply, and of the instants at which a force begins.
    pub struct DriverErrors {
        driver_lag_s: Option<f64>, "s", Rule::NOT_NEGATIVE, "real time constant of the motor driver",
            Absent::Follows("that of [actuator]");
        current_limit_a: Option<f64>, "A", Rule::POSITIVE, "largest current of the motor driver",
            Absent::Follows("no limit");
        supply_resistance_ohm: f64, "Ω", Rule::NOT_NEGATIVE,
            "internal resistance of the supply, which sags under load", NONE;
        force_percent: f64, "%", Rule::SIGNED_PERCENT, "excess of the real force over the commanded one", NONE;
        latency_s: f64, "s", Rule::NOT_NEGATIVE,
            "delay of the force in addition to delay_ticks", NONE;
        jitter_s: f64, "s",
            Rule::NOT_NEGATIVE.worded("a number >= 0; 2 jitter_s + latency_s < period_s"),
            "largest time by which a tick begins early or late", NONE;
    }
}

keys! {
    /// The motor of a drive with pulses, which is a spring between its field and its rotor.
    pub struct StepMotorData {
        holding_force_n: Option<f64>, "N", Rule::POSITIVE,
            "largest force of a step motor at rest, a full step away", Absent::Follows("it goes where its pulses say");
        full_step_m: Option<f64>, "m", Rule::POSITIVE,
            "travel of the cart per full step of the motor", Absent::RequiredIf("with holding_force_n");
        corner_speed_m_per_s: Option<f64>, "m/s", Rule::POSITIVE,
            "speed at which 71 % of that force is left", Absent::Follows("the force does not fall");
        bandwidth_hz: Option<f64>, "Hz", Rule::POSITIVE,
            "real bandwidth of a servo", Absent::Follows("that of [actuator]");
        servo_damping_percent: Option<f64>, "%", Rule::PERCENT,
            "damping of a servo of second order, whose natural frequency is the bandwidth",
            Absent::Follows("it is of first order");
        motor_damping_percent: f64, "%", Rule::NOT_NEGATIVE,
            "damping of the motor's resonance with the cart", Absent::Numbers(&[10.0]);
    }
}

keys! {
    /// Errors of the encoders and of their zeros, and the slope of the rail.
    pub struct SensorErrors {
        homing_error_rad: PerJoint, "rad", EACH_ANGLE, "measured minus true angle of each joint", NONE;
        eccentricity_rad: PerJoint, "rad", EACH_NOT_NEGATIVE,
            "amplitude of each joint encoder's once-per-turn error", NONE;
        eccentricity_phase_rad: PerJoint, "rad", EACH_ANGLE,
            "phase of that error when the joint is straight", NONE;
        twice_per_turn_rad: PerJoint, "rad", EACH_NOT_NEGATIVE,
            "amplitude of each joint sensor's twice-per-turn error", NONE;
        twice_per_turn_phase_rad: PerJoint, "rad", EACH_ANGLE,
            "phase of that error when the joint is straight", NONE;
        sensor_delay_s: PerJoint, "s", EACH_NOT_NEGATIVE,
            "age of each joint sensor's reading, in addition to the stated one", NONE;
        rail_tilt_rad: f64, "rad", Rule::SIGNED_ANGLE, "slope of the rail, positive if it rises towards +x", NONE;
    }
}

keys! {
    /// Parameters of the machine that differ from those in the file.
    pub struct ParameterErrors {
        cart_mass_percent: f64, "%", Rule::SIGNED_PERCENT, "excess of the real mass of the cart", NONE;
        link_mass_percent: PerJoint, "%", EACH_PERCENT, "excess of the real mass of each link", NONE;
        link_length_percent: PerJoint, "%", EACH_PERCENT,
            "excess of the real length of each link; its centre of mass moves in proportion", NONE;
        link_inertia_percent: PerJoint, "%", EACH_PERCENT,
            "excess of the real inertia of each link, in addition to the effect of mass and length", NONE;
        parameter_spread_percent: f64, "%", Rule::SPREAD,
            "additional random spread (±) of all masses, lengths and inertias, drawn once", NONE;
        parameter_seed: u8, "", Rule::NOT_NEGATIVE.worded("a whole number from 0 to 255"),
            "seed of that random spread", NONE;
    }
}

impl ParameterErrors {
    /// Names of the keys that say how far a mass, a length or an inertia is from the file.
    pub fn percentages() -> impl Iterator<Item = &'static str> {
        Self::KEYS.iter().filter(|key| key.unit == "%").map(|key| key.name)
    }
}

/// How the dry friction of the simulated machine depends on travel and speed. A rig file has no key for it: its
/// machine has the first. `upright identify --coverage` simulates the others, too.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FrictionLaw {
    /// An elasto-plastic bristle, which sticks.
    #[default]
    ElastoPlastic,
    /// A bristle that always slides a little (P. R. Dahl, "Solid friction damping of mechanical vibrations", AIAA
    /// Journal 14(12), 1976). With an excess at rest it is the LuGre model (C. Canudas de Wit, H. Olsson, K. J. Åström,
    /// P. Lischinsky, IEEE Trans. Automatic Control 40(3), 1995).
    Dahl,
    /// The Coulomb friction times the tanh of the speed, which is divided by that at which half of an excess at rest
    /// would be left: a contact that never sticks.
    Creeping,
}

/// How the simulated machine differs from the model, `[reality]`. It changes no gain, so it is not part of the rig's
/// hash.
#[derive(Debug, Clone, PartialEq)]
pub struct Reality {
    /// Dry friction of joints and cart.
    pub friction: DryFriction,
    /// The law of this dry friction.
    pub friction_law: FrictionLaw,
    /// Air drag of the links.
    pub air_drag: AirDrag,
    /// Backlash and belt.
    pub drive_train: DriveTrain,
    /// Motor driver, supply and timing.
    pub driver: DriverErrors,
    /// The motor of a drive with pulses.
    pub step_motor: StepMotorData,
    /// Encoders, their zeros, and the slope of the rail.
    pub sensors: SensorErrors,
    /// Errors of masses, lengths and inertias.
    pub parameters: ParameterErrors,
}

impl Default for Reality {
    /// A machine that matches the model: no imperfections.
    fn default() -> Self {
        fn absent<T: Keys>() -> T {
            T::when_absent().expect("no key of [reality] is required")
        }
        Self {
            friction: absent(),
            friction_law: FrictionLaw::default(),
            air_drag: absent(),
            drive_train: absent(),
            driver: absent(),
            step_motor: absent(),
            sensors: absent(),
            parameters: absent(),
        }
    }
}

impl Reality {
    /// Names of the keys whose values are not those of a machine that matches the model.
    pub fn given_keys(&self) -> impl Iterator<Item = &'static str> {
        fn given<T: Keys>(values: &T, matching: &T) -> Vec<&'static str> {
            let pairs = values.values().into_iter().zip(matching.values());
            let keys = T::KEYS.iter().zip(pairs);
            keys.filter(|(_, (value, matching))| value != matching).map(|(key, _)| key.name).collect()
        }
        let matching = Self::default();
        [
            given(&self.friction, &matching.friction),
            given(&self.air_drag, &matching.air_drag),
            given(&self.drive_train, &matching.drive_train),
            given(&self.driver, &matching.driver),
            given(&self.step_motor, &matching.step_motor),
            given(&self.sensors, &matching.sensors),
            given(&self.parameters, &matching.parameters),
        ]
        .into_iter()
        .flatten()
    }

    /// The same imperfections of a machine with this base, whose dry friction has the values of that base where it is
    /// left out.
    #[must_use]
    pub fn on(mut self, base: Base) -> Self {
        let value = |name| f64::when_absent(base.key(&REALITY, name).absent).unwrap_or_default();
        self.friction.stribeck_m_per_s = value("stribeck_m_per_s");
        self.friction.presliding_m = value("presliding_m");
        self
    }
}

/// Keys of what lies between a force and the cart.
fn of_force() -> Vec<&'static str> {
    [DriveTrain::KEYS, DriverErrors::KEYS].concat().iter().map(|key| key.name).collect()
}

/// Reads `[reality]`, which needs a chain.
pub(crate) fn reality(
    node: &Node<'_>,
    plant: &PlantDescription,
    period_s: f64,
    has_motor: bool,
) -> Result<Reality, RigError> {
    let PlantDescription::Chain(chain) = plant else {
        let remedy = "describe the machine by [cart] and [[link]], or leave [reality] out";
        return Err(node.out_of_range("only a chain of links", remedy));
    };
    let table = node.table(&REALITY)?;
    let reality = Reality {
        friction: DryFriction::read(&table)?,
        friction_law: FrictionLaw::default(),
        air_drag: AirDrag::read(&table)?,
        drive_train: DriveTrain::read(&table)?,
        driver: DriverErrors::read(&table)?,
        step_motor: StepMotorData::read(&table)?,
        sensors: SensorErrors::read(&table)?,
        parameters: ParameterErrors::read(&table)?,
    };
    lists_fit(&table, chain.links.len())?;
    within_the_rig(&table, &reality, chain, period_s, has_motor)?;
    Ok(reality)
}

/// A list has one entry per joint.
fn lists_fit(table: &Table<'_>, joints: usize) -> Result<(), RigError> {
    for key in REALITY.keys() {
        if let Some(list) = table.get(key.name).filter(Node::is_list) {
            list.numbers(joints, Rule::ANY, &table.asks_for(key.name))?;
        }
    }
    Ok(())
}

/// A step motor moves a mass and has steps; only with it do friction and mass of the cart matter.
fn step_motor(table: &Table<'_>, motor: &StepMotorData, chain: &Chain) -> Result<(), RigError> {
    if let (CartInput::Force, Some(key)) =
        (chain.input, StepMotorData::KEYS.iter().find(|key| table.get(key.name).is_some()))
    {
        let accepts = "only with kind = \"acceleration\" in [actuator]";
        return Err(table.required(key.name)?.out_of_range(accepts, "leave it out, or describe a stepper"));
    }
    if let (Some(node), None) = (table.get("servo_damping_percent"), motor.bandwidth_hz) {
        let remedy = "give its natural frequency as bandwidth_hz in [reality], or leave it out";
        return Err(node.out_of_range("only with bandwidth_hz", remedy));
    }
    match table.get("holding_force_n") {
        None if chain.input == CartInput::Acceleration => table.refuse_for_acceleration(&[
            "cart_friction_n",
            "stribeck_m_per_s",
            "presliding_m",
            "cart_mass_percent",
        ]),
        Some(node) if chain.cart.mass_kg.is_none() => Err(node.out_of_range(
            "only with mass_kg of [cart]",
            "give the mass that the motor moves, rotor included",
        )),
        Some(_) if motor.bandwidth_hz.is_some() => Err(table.required("bandwidth_hz")?.out_of_range(
            "only without holding_force_n",
            "leave one of them out: the drive is a servo, or a step motor",
        )),
        Some(_) if motor.full_step_m.is_none() => {
            Err(table.missing("full_step_m", &table.asks_for("full_step_m")))
        }
        _ => Ok(()),
    }
}

/// Conditions that involve other values of the file.
fn within_the_rig(
    table: &Table<'_>,
    reality: &Reality,
    chain: &Chain,
    period_s: f64,
    has_motor: bool,
) -> Result<(), RigError> {
    let refused = |name: &str, accepts: &str, remedy: &str| match table.get(name) {
        Some(node) => Err(node.out_of_range(accepts, remedy)),
        None => Ok(()),
    };
    if chain.input == CartInput::Acceleration {
        table.refuse_for_acceleration(&of_force())?;
    }
    step_motor(table, &reality.step_motor, chain)?;
    if reality.drive_train.rotor_mass_kg.zip(chain.cart.mass_kg).is_some_and(|(mass, cart)| mass >= cart) {
        refused("rotor_mass_kg", "a number > 0 and < mass_kg of [cart]", "give the smaller part of it")?;
    }
    let DriverErrors { latency_s, jitter_s, .. } = reality.driver;
    if 2.0 * jitter_s + latency_s >= period_s {
        let name = if latency_s >= period_s { "latency_s" } else { "jitter_s" };
        let remedy = "give less, or set delay_ticks = 1 in [tick] for a further tick of delay";
        refused(name, &format!("2 jitter_s + latency_s < period_s = {period_s} (s)"), remedy)?;
    }
    for (name, given) in [
        ("current_limit_a", reality.driver.current_limit_a.is_some()),
        ("supply_resistance_ohm", reality.driver.supply_resistance_ohm > 0.0),
    ] {
        if given && !has_motor {
            refused(name, "only with a motor", "describe the motor in [actuator], or leave the key out")?;
        }
    }
    Ok(())
}
