//! Simulated machines that differ from their rig file in everything that is identified.

use core::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use upright_design::plant::ChainParameters;
use upright_design::reality::real_chain;
use upright_design::rig::{FrictionLaw, PerJoint, Rig};

use crate::channel::chain_of;
use crate::error::IdentifyError;
use crate::parameters::{FRICTION, Layout, ParameterKind, Prior, USUAL_DRAG, periodic, priors};

/// Friction is drawn between the usual value divided by this factor and multiplied by it.
const FRICTION_FACTOR: f64 = 3.0;
/// Largest homing error of a joint (rad), and largest tilt of the rail.
const HOMING_RAD: f64 = 0.5 * PI / 180.0;
const TILT_RAD: f64 = 0.3 * PI / 180.0;
/// Largest latency, in ticks: less than one.
const LATENCY_TICKS: f64 = 0.95;
/// Largest relative error of the travel per count of the cart.
const TRAVEL: f64 = 0.02;
/// Largest relative error of the motor's dead zone.
const DEAD_ZONE: f64 = 0.5;

/// What is drawn for other laws of friction: excess at rest (%), speed of the cart (m/s) and rate of a joint (rad/s) at
/// which half of it is left, the same for a contact that never sticks, and the factor within which these speeds and the
/// presliding of the file are drawn.
const EXCESS_PERCENT: [f64; 2] = [20.0, 60.0];
const STRIBECK: [f64; 2] = [0.01, 0.1];
const CREEPING: [f64; 2] = [0.004, 0.02];
const LAW_FACTOR: f64 = 2.0;

/// The law of the dry friction of drawn machines.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TrueFriction {
    /// The elasto-plastic bristle of `[reality]`.
    #[default]
    OfFile,
    /// The same, larger at rest than in motion.
    Stribeck,
    /// Coulomb friction times the tanh of the speed.
    Tanh,
    /// Dahl's bristle.
    Dahl,
    /// Dahl's bristle, larger at rest than in motion.
    LuGre,
}

/// A simulated machine, and the true value of each parameter that is identified.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnMachine {
    /// The rig as it is simulated, with the drawn errors.
    pub rig: Rig,
    truth: Vec<(ParameterKind, f64)>,
}

impl DrawnMachine {
    /// Draws machine `number` of those that differ from `file` by up to `off_percent` in masses, lengths and inertias.
    /// Friction, air drag, homing, tilt, latency, dead zone, travel per count and errors of absolute sensors are
    /// drawn, too; the motor's other constants are the file's. The true dry friction is that at high speed.
    ///
    /// # Errors
    /// [`IdentifyError`] if the rig has no chain with encoders.
    pub fn draw(
        file: &Rig,
        off_percent: f64,
        law: TrueFriction,
        seed: u64,
        number: u64,
    ) -> Result<Self, IdentifyError> {
        let chain = chain_of(file)?;
        // Each machine has its own generator, so that it does not depend on the others.
        let mut random = Pcg64::seed_from_u64(seed.rotate_left(32) ^ number);
        let links = chain.links.len();
        let layout = Layout { links };
        let priors = priors(file, chain, false);
        let mut percent = || off_percent * random.random_range(-1.0..=1.0);
        let mut rig = file.clone();
        let parameters = &mut rig.reality.parameters;
        parameters.cart_mass_percent = percent();
        let mut each = || PerJoint::each((0..links).map(|_| percent()).collect());
        (parameters.link_mass_percent, parameters.link_length_percent) = (each(), each());
        parameters.link_inertia_percent = each();
        let mut friction = |index: usize| {
            let usual = priors[index].deviation / FRICTION;
            usual * libm::pow(FRICTION_FACTOR, random.random_range(-1.0..=1.0))
        };
        if let Some(chain) = rig.chain_mut() {
            chain.cart.friction_n_s_per_m = friction(layout.viscous(0));
            for (joint, link) in chain.links.iter_mut().enumerate() {
                link.friction_n_m_s_per_rad = friction(layout.viscous(joint + 1));
            }
        }
        let dry = &mut rig.reality.friction;
        dry.cart_friction_n = friction(layout.dry(0));
        let joints = (0..links).map(|joint| friction(layout.dry(joint + 1)));
        dry.joint_friction_n_m = PerJoint::each(joints.collect());
        let mut within = |most: f64| most * random.random_range(-1.0..=1.0);
        rig.reality.sensors.homing_error_rad =
            PerJoint::each((0..links).map(|_| within(HOMING_RAD)).collect());
        rig.reality.sensors.rail_tilt_rad = within(TILT_RAD);
        if let Some(motor) = rig.actuator.motor_mut() {
            motor.dead_zone_v *= 1.0 + within(DEAD_ZONE);
        }
        rig.reality.driver.latency_s = 0.5 * (LATENCY_TICKS + within(LATENCY_TICKS)) * rig.tick.period_s;
        let mut random_in = |low: f64, high: f64| random.random_range(low..=high);
        draw_law(&mut rig, law, &mut random_in);
        let usual_drag: Vec<f64> =
            (0..links).map(|link| USUAL_DRAG * priors[layout.second_moment(link)].value).collect();
        draw_air(&mut rig, &usual_drag, &mut random_in);
        draw_sensors(&mut rig, &priors, &mut random_in);
        let mut truth = truth(file, &rig)?;
        if file.actuator.held().is_motion() {
            // Pulses begin in their tick, and are felt by the links alone, as ratios to the last first moment.
            rig.reality.driver = file.reality.driver.clone();
            let of_file = priors[layout.first_moment(links - 1)].value;
            let of_machine = truth.iter().find(|(kind, _)| *kind == ParameterKind::FirstMoment(links - 1));
            let ratio = of_machine.map_or(1.0, |(_, moment)| of_file / moment);
            truth.iter_mut().filter(|(kind, _)| kind.is_of_masses()).for_each(|(_, value)| *value *= ratio);
        }
        Ok(Self { rig, truth })
    }

    /// The true value of a parameter, if the machine has it.
    pub fn truth(&self, kind: ParameterKind) -> Option<f64> {
        self.truth.iter().find(|(known, _)| *known == kind).map(|(_, value)| *value)
    }
}

/// Draws the numbers of another `law` of friction into `rig`; `random` gives a number between two.
fn draw_law(rig: &mut Rig, law: TrueFriction, random: &mut dyn FnMut(f64, f64) -> f64) {
    let mut factor = || libm::pow(LAW_FACTOR, random(-1.0, 1.0));
    let factors = [factor(), factor(), factor(), factor()];
    let links = rig.chain().map_or(0, |chain| chain.links.len());
    let reality = &mut rig.reality;
    let friction = &mut reality.friction;
    let speeds = match law {
        TrueFriction::OfFile | TrueFriction::Dahl => None,
        TrueFriction::Stribeck | TrueFriction::LuGre => {
            friction.breakaway_percent = random(EXCESS_PERCENT[0], EXCESS_PERCENT[1]);
            Some(STRIBECK)
        }
        TrueFriction::Tanh => {
            reality.friction_law = FrictionLaw::Creeping;
            Some(CREEPING)
        }
    };
    if let Some([cart, joint]) = speeds {
        (friction.stribeck_m_per_s, friction.stribeck_rad_per_s) = (factors[0] * cart, factors[1] * joint);
    }
    if let TrueFriction::Dahl | TrueFriction::LuGre = law {
        reality.friction_law = FrictionLaw::Dahl;
        friction.presliding_m *= factors[2];
        let joints = (0..links).map(|joint| factors[3] * friction.presliding_rad.of_joint(joint));
        friction.presliding_rad = PerJoint::each(joints.collect());
    }
}

/// Draws the drag of each link around its `usual` one.
fn draw_air(rig: &mut Rig, usual: &[f64], random: &mut dyn FnMut(f64, f64) -> f64) {
    let drags = usual.iter().map(|usual| usual * libm::pow(FRICTION_FACTOR, random(-1.0, 1.0)));
    rig.reality.air_drag.air_drag_n_m_s2_per_rad2 = PerJoint::each(drags.collect());
}

/// Draws the travel per count of the cart, and the errors once and twice per turn of sensors that have some.
fn draw_sensors(rig: &mut Rig, priors: &[Prior], random: &mut dyn FnMut(f64, f64) -> f64) {
    let travel = 1.0 + random(-TRAVEL, TRAVEL);
    if let Some(drive) = rig.actuator.pulses_mut() {
        drive.step_m *= travel;
    }
    if let Some(chain) = rig.chain_mut() {
        chain.cart.encoder_step_m = chain.cart.encoder_step_m.map(|step_m| travel * step_m);
    }
    let links = rig.links();
    let layout = Layout { links };
    let mut each = |largest: &dyn Fn(usize) -> f64| {
        let drawn: Vec<f64> = (0..links).map(|joint| largest(joint) * random(-1.0, 1.0)).collect();
        PerJoint::each(drawn)
    };
    let amplitude =
        |largest: PerJoint| PerJoint::each((0..links).map(|j| largest.of_joint(j).abs()).collect());
    let sensors = &mut rig.reality.sensors;
    sensors.eccentricity_rad = amplitude(each(&|joint| priors[layout.sine(joint)].deviation));
    sensors.twice_per_turn_rad = amplitude(each(&|joint| priors[layout.twice_sine(joint)].deviation));
    sensors.eccentricity_phase_rad = each(&|_| PI);
    sensors.twice_per_turn_phase_rad = each(&|_| PI);
}

/// The true parameters of the machine of `rig`, including its `[reality]`, of which `file` is known.
fn truth(file: &Rig, rig: &Rig) -> Result<Vec<(ParameterKind, f64)>, IdentifyError> {
    let real = real_chain(chain_of(rig)?, &rig.reality.parameters);
    let constants = ChainParameters::<f64>::of(&real);
    let (friction, sensors) = (&rig.reality.friction, &rig.reality.sensors);
    let value = |kind: ParameterKind| match kind {
        ParameterKind::TotalMass => Some(constants.total_mass),
        ParameterKind::FirstMoment(j) => Some(constants.a[j]),
        ParameterKind::Length(j) => Some(real.links[j].length_m),
        ParameterKind::SecondMoment(j) => Some(constants.b[(j, j)]),
        ParameterKind::CartViscous => Some(constants.cart_friction),
        ParameterKind::JointViscous(j) => Some(constants.joint_frictions[j]),
        ParameterKind::CartDry => Some(friction.cart_friction_n),
        ParameterKind::JointDry(j) => Some(friction.joint_friction_n_m.of_joint(j)),
        ParameterKind::Tilt => Some(sensors.rail_tilt_rad),
        ParameterKind::Delay => Some(rig.reality.driver.latency_s / rig.tick.period_s),
        ParameterKind::DeadZone => rig.actuator.motor().map(|motor| motor.dead_zone_v),
        ParameterKind::Zero(j) => Some(sensors.homing_error_rad.of_joint(j)),
        ParameterKind::AirDrag(j) => Some(rig.reality.air_drag.air_drag_n_m_s2_per_rad2.of_joint(j)),
        ParameterKind::Travel => Some(rig.sensors()[0].step::<f64>() / file.sensors()[0].step::<f64>()),
        ParameterKind::EccentricSine(j) => Some(periodic(sensors, j, 0, libm::cos)),
        ParameterKind::EccentricCosine(j) => Some(periodic(sensors, j, 0, libm::sin)),
        ParameterKind::TwiceSine(j) => Some(periodic(sensors, j, 1, libm::cos)),
        ParameterKind::TwiceCosine(j) => Some(periodic(sensors, j, 1, libm::sin)),
        ParameterKind::Presliding(_) => None,
    };
    let kinds = Layout { links: real.links.len() }.kinds();
    Ok(kinds.into_iter().filter_map(|kind| Some((kind, value(kind)?))).collect())
}
