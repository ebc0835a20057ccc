//! What is identified: the parameters of a chain, their start values from the rig file, and their prior deviations.

use upright::boards::parts::PARTS;
use upright_design::plant::ChainParameters;
use upright_design::reality::PRESLIDING_PER_DEFLECTION;
use upright_design::rig::{Chain, LinkEncoder, Rig, SensorErrors};

/// Travel (m) over which the bristle of the cart reverses, and rate (rad/s) below which the dry friction of a joint is
/// about proportional to the rate: δ and ε of the model.
pub(crate) const SMOOTHING: [f64; 2] = [3e-5, 0.02];

/// A parameter of a chain; links and joints are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterKind {
    /// M_t: mass of cart and links (kg).
    TotalMass,
    /// a_j: first moment at the joint of link j, of everything it carries (kg·m).
    FirstMoment(usize),
    /// l_j: distance of the joints at the ends of link j (m).
    Length(usize),
    /// J_j: moment of inertia at the joint of link j, of everything it carries (kg·m²).
    SecondMoment(usize),
    /// d_0: viscous friction of the cart (N·s/m).
    CartViscous,
    /// d_j: viscous friction of a joint (N·m·s/rad).
    JointViscous(usize),
    /// c_0: dry friction of the cart (N).
    CartDry,
    /// c_j: dry friction of a joint (N·m).
    JointDry(usize),
    /// q_j: air drag of a link, by the square of its rate (N·m·s²/rad²).
    AirDrag(usize),
    /// δ_j: deflection of a joint's bristle under its dry friction (rad).
    Presliding(usize),
    /// Slope of the rail (rad).
    Tilt,
    /// Delay of the force beyond `delay_ticks` (ticks).
    Delay,
    /// Dead zone of the motor (V).
    DeadZone,
    /// Travel of the cart per count of its sensor, or per step of a drive that imposes its motion, as a multiple of
    /// that of the file.
    Travel,
    /// Zero error of a joint's encoder (rad).
    Zero(usize),
    /// Amplitude of the part of an eccentric encoder's error that follows the sine of the angle (rad).
    EccentricSine(usize),
    /// Amplitude of the part that follows the cosine (rad).
    EccentricCosine(usize),
    /// Amplitude of the part of a sensor's error twice per turn that follows the sine of twice the angle (rad).
    TwiceSine(usize),
    /// Amplitude of the part that follows the cosine (rad).
    TwiceCosine(usize),
}

impl ParameterKind {
    /// What the parameter is multiplied by to give the value of the rig file.
    pub(crate) fn of_file(self) -> f64 {
        if let ParameterKind::Presliding(_) = self { PRESLIDING_PER_DEFLECTION } else { 1.0 }
    }

    /// Whether a common factor of all masses and frictions of the links multiplies the parameter.
    pub(crate) fn is_of_masses(self) -> bool {
        matches!(
            self,
            ParameterKind::FirstMoment(_)
                | ParameterKind::SecondMoment(_)
                | ParameterKind::JointViscous(_)
                | ParameterKind::JointDry(_)
                | ParameterKind::AirDrag(_)
        )
    }

    /// Whether it is a mass or a friction of the cart.
    pub(crate) fn is_of_cart(self) -> bool {
        matches!(self, ParameterKind::TotalMass | ParameterKind::CartViscous | ParameterKind::CartDry)
    }

    /// Name, with links and joints counted from 1, and SI unit.
    pub fn name_and_unit(self) -> (String, &'static str) {
        let of = |what: &str, joint: usize| format!("{what} {}", joint + 1);
        match self {
            ParameterKind::TotalMass => ("total mass".to_owned(), "kg"),
            ParameterKind::FirstMoment(j) => (of("first moment, link", j), "kg·m"),
            ParameterKind::Length(j) => (of("length, link", j), "m"),
            ParameterKind::SecondMoment(j) => (of("second moment, link", j), "kg·m²"),
            ParameterKind::CartViscous => ("viscous friction, cart".to_owned(), "N·s/m"),
            ParameterKind::JointViscous(j) => (of("viscous friction, joint", j), "N·m·s/rad"),
            ParameterKind::CartDry => ("dry friction, cart".to_owned(), "N"),
            ParameterKind::JointDry(j) => (of("dry friction, joint", j), "N·m"),
            ParameterKind::AirDrag(j) => (of("air drag, link", j), "N·m·s²/rad²"),
            ParameterKind::Presliding(j) => (of("presliding, joint", j), "rad"),
            ParameterKind::Tilt => ("tilt of the rail".to_owned(), "rad"),
            ParameterKind::Delay => ("delay".to_owned(), "ticks"),
            ParameterKind::DeadZone => ("dead zone".to_owned(), "V"),
            ParameterKind::Travel => ("travel per count, cart".to_owned(), "of the file's"),
            ParameterKind::Zero(j) => (of("zero, joint", j), "rad"),
            ParameterKind::EccentricSine(j) => (of("eccentricity (sine), joint", j), "rad"),
            ParameterKind::EccentricCosine(j) => (of("eccentricity (cosine), joint", j), "rad"),
            ParameterKind::TwiceSine(j) => (of("twice per turn (sine), joint", j), "rad"),
            ParameterKind::TwiceCosine(j) => (of("twice per turn (cosine), joint", j), "rad"),
        }
    }
}

/// Index of each parameter in the parameter vector, for n links.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Layout {
    pub(crate) links: usize,
}

impl Layout {
    pub(crate) const TOTAL_MASS: usize = 0;

    pub(crate) fn first_moment(self, link: usize) -> usize {
        1 + link
    }
    pub(crate) fn length(self, link: usize) -> usize {
        1 + self.links + link
    }
    pub(crate) fn second_moment(self, link: usize) -> usize {
        2 * self.links + link
    }
    pub(crate) fn viscous(self, contact: usize) -> usize {
        3 * self.links + contact
    }
    pub(crate) fn dry(self, contact: usize) -> usize {
        4 * self.links + 1 + contact
    }
    pub(crate) fn drag(self, link: usize) -> usize {
        5 * self.links + 2 + link
    }
    pub(crate) fn presliding(self, joint: usize) -> usize {
        6 * self.links + 2 + joint
    }
    pub(crate) fn tilt(self) -> usize {
        7 * self.links + 2
    }
    pub(crate) fn delay(self) -> usize {
        7 * self.links + 3
    }
    pub(crate) fn dead_zone(self) -> usize {
        7 * self.links + 4
    }
    pub(crate) fn travel(self) -> usize {
        7 * self.links + 5
    }
    pub(crate) fn zero(self, joint: usize) -> usize {
        7 * self.links + 6 + joint
    }
    pub(crate) fn sine(self, joint: usize) -> usize {
        8 * self.links + 6 + joint
    }
    pub(crate) fn cosine(self, joint: usize) -> usize {
        9 * self.links + 6 + joint
    }
    pub(crate) fn twice_sine(self, joint: usize) -> usize {
        10 * self.links + 6 + joint
    }
    pub(crate) fn twice_cosine(self, joint: usize) -> usize {
        11 * self.links + 6 + joint
    }
    /// Whether a parameter is the friction of a joint or the drag of a link.
    pub(crate) fn is_dissipative(self, index: usize) -> bool {
        (self.viscous(1)..self.presliding(0)).contains(&index) && index != self.dry(0)
    }
    /// Number of parameters on which the motion may depend: they come first; the others belong to the encoders.
    pub(crate) fn of_motion(self) -> usize {
        7 * self.links + 6
    }
    pub(crate) fn count(self) -> usize {
        12 * self.links + 6
    }

    /// What each parameter is, in order.
    pub(crate) fn kinds(self) -> Vec<ParameterKind> {
        let n = self.links;
        let mut kinds = vec![ParameterKind::TotalMass];
        kinds.extend((0..n).map(ParameterKind::FirstMoment));
        kinds.extend((0..n - 1).map(ParameterKind::Length));
        kinds.extend((0..n).map(ParameterKind::SecondMoment));
        kinds.push(ParameterKind::CartViscous);
        kinds.extend((0..n).map(ParameterKind::JointViscous));
        kinds.push(ParameterKind::CartDry);
        kinds.extend((0..n).map(ParameterKind::JointDry));
        kinds.extend((0..n).map(ParameterKind::AirDrag));
        kinds.extend((0..n).map(ParameterKind::Presliding));
        kinds.extend([
            ParameterKind::Tilt,
            ParameterKind::Delay,
            ParameterKind::DeadZone,
            ParameterKind::Travel,
        ]);
        kinds.extend((0..n).map(ParameterKind::Zero));
        kinds.extend((0..n).map(ParameterKind::EccentricSine));
        kinds.extend((0..n).map(ParameterKind::EccentricCosine));
        kinds.extend((0..n).map(ParameterKind::TwiceSine));
        kinds.extend((0..n).map(ParameterKind::TwiceCosine));
        kinds
    }
}

/// Prior knowledge about a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Prior {
    /// Mean and start value: that of the rig file, or an assumed one if the file has none.
    pub(crate) value: f64,
    /// Standard deviation; 0: the parameter is not identified.
    pub(crate) deviation: f64,
}

/// How far each parameter may fall, in its prior deviations: frictions of joints and drags of links are at least 0, and
/// a bristle has a length.
pub(crate) fn room_below(layout: Layout, priors: &[Prior], p: &[f64]) -> Vec<f64> {
    let of = |(index, (prior, p)): (usize, (&Prior, &f64))| {
        let is_length = (layout.presliding(0)..layout.tilt()).contains(&index);
        let least = if is_length { LEAST_PRESLIDING_RAD } else { 0.0 };
        let is_bounded = (is_length || layout.is_dissipative(index)) && prior.deviation > 0.0;
        if is_bounded { (least - p) / prior.deviation } else { f64::NEG_INFINITY }
    };
    priors.iter().zip(p).enumerate().map(of).collect()
}

/// Least length of a joint's bristle (rad).
const LEAST_PRESLIDING_RAD: f64 = 5e-5;

/// Relative deviation of masses, lengths and moments.
const SHAPE: f64 = 0.5;
/// Deviation of the zeros and of the tilt (rad).
const ZERO_RAD: f64 = 0.03;
/// Deviation of the eccentricity of an encoder (rad).
const ECCENTRICITY_RAD: f64 = 0.002;
/// The same for the magnet of an absolute sensor, whose eccentricity is always identified (rad).
const MAGNET_RAD: f64 = 0.01;
/// That of its error twice per turn: 46 mrad have been measured of a cheap one.
const MAGNET_TWICE_RAD: f64 = 0.02;
/// That of an encoder's error twice per turn, if its eccentricity is identified (rad).
const ENCODER_TWICE_RAD: f64 = 0.0005;
/// The same for a potentiometer, which is linear to this share of its travel.
const LINEARITY: f64 = 0.005;
/// Prior deviation of a friction, as a multiple of its expected value.
pub(crate) const FRICTION: f64 = 10.0;
/// Drag of a link as a multiple of its moment of inertia (1/rad²): measured ones are 0.004 to 0.006.
pub(crate) const USUAL_DRAG: f64 = 0.005;
/// Prior deviation of a drag, as a multiple of the usual one.
pub(crate) const DRAG: f64 = 10.0;
/// Prior deviation of the travel per count of the cart: a pulley is measured with a caliper.
const TRAVEL: f64 = 0.05;

/// Start values and deviations of all parameters, from a rig file.
pub(crate) fn priors(rig: &Rig, chain: &Chain, eccentricity: bool) -> Vec<Prior> {
    let layout = Layout { links: chain.links.len() };
    let constants = ChainParameters::<f64>::of(chain);
    let gravity = constants.gravity;
    let weight = constants.total_mass * gravity;
    let shape = |value: f64| Prior { value, deviation: SHAPE * value };
    let motor = rig.actuator.motor();
    // One percent of critical damping.
    let joint_viscous = |j: usize| 0.02 * (constants.b[(j, j)] * constants.a[j] * gravity).sqrt();
    let viscous =
        |given: f64, usual: f64| Prior { value: given, deviation: FRICTION * given.max(0.1 * usual) };
    let dry = |given: f64, usual: f64| Prior {
        value: if given > 0.0 { given } else { usual },
        deviation: FRICTION * given.max(usual),
    };
    let friction = &rig.reality.friction;
    let of_sensor = |joint: usize, harmonic: usize, part: fn(f64) -> f64| Prior {
        value: periodic(&rig.reality.sensors, joint, harmonic, part),
        deviation: periodic_deviations(chain, joint, eccentricity)[harmonic],
    };
    let prior = |kind: ParameterKind| match kind {
        ParameterKind::TotalMass => shape(constants.total_mass),
        ParameterKind::FirstMoment(j) => shape(constants.a[j]),
        ParameterKind::Length(j) => shape(chain.links[j].length_m),
        ParameterKind::SecondMoment(j) => shape(constants.b[(j, j)]),
        ParameterKind::CartViscous => viscous(constants.cart_friction, constants.total_mass),
        ParameterKind::JointViscous(j) => viscous(constants.joint_frictions[j], joint_viscous(j)),
        ParameterKind::CartDry => dry(friction.cart_friction_n, 0.01 * weight),
        ParameterKind::JointDry(j) => {
            dry(friction.joint_friction_n_m.of_joint(j), 0.001 * gravity * constants.a[j])
        }
        ParameterKind::AirDrag(j) => Prior {
            value: rig.reality.air_drag.air_drag_n_m_s2_per_rad2.of_joint(j),
            deviation: DRAG * USUAL_DRAG * constants.b[(j, j)],
        },
        ParameterKind::Presliding(j) => {
            Prior { value: friction.presliding_rad.of_joint(j) / PRESLIDING_PER_DEFLECTION, deviation: 0.0 }
        }
        ParameterKind::Tilt => Prior { value: 0.0, deviation: ZERO_RAD },
        ParameterKind::Delay => Prior { value: 0.5, deviation: 0.5 },
        ParameterKind::DeadZone => motor.map_or(Prior { value: 0.0, deviation: 0.0 }, |motor| Prior {
            value: motor.dead_zone_v,
            deviation: motor.dead_zone_v.max(0.02 * motor.supply_v),
        }),
        ParameterKind::Travel => Prior { value: 1.0, deviation: TRAVEL },
        ParameterKind::Zero(_) => Prior { value: 0.0, deviation: ZERO_RAD },
        ParameterKind::EccentricSine(j) => of_sensor(j, 0, libm::cos),
        ParameterKind::EccentricCosine(j) => of_sensor(j, 0, libm::sin),
        ParameterKind::TwiceSine(j) => of_sensor(j, 1, libm::cos),
        ParameterKind::TwiceCosine(j) => of_sensor(j, 1, libm::sin),
    };
    layout.kinds().into_iter().map(prior).collect()
}

/// The priors for a check of the wiring: what a few seconds hardly show is that of the file.
pub(crate) fn for_wiring(layout: Layout, priors: &[Prior]) -> Vec<Prior> {
    let mut priors = priors.to_vec();
    priors[layout.travel()].deviation = 0.0;
    for joint in 0..layout.links {
        for index in [layout.drag(joint), layout.twice_sine(joint), layout.twice_cosine(joint)] {
            priors[index].deviation = 0.0;
        }
    }
    priors
}

/// Part of the file's error of a joint's sensor once (0) or twice (1) per turn (rad): `part` is the cosine of its phase
/// for the sine of the angle, and the sine for the cosine.
pub(crate) fn periodic(sensors: &SensorErrors, joint: usize, harmonic: usize, part: fn(f64) -> f64) -> f64 {
    let [amplitude_rad, phase_rad] = match harmonic {
        0 => [&sensors.eccentricity_rad, &sensors.eccentricity_phase_rad],
        _ => [&sensors.twice_per_turn_rad, &sensors.twice_per_turn_phase_rad],
    };
    amplitude_rad.of_joint(joint) * part(phase_rad.of_joint(joint))
}

/// Prior deviations of the error of a joint's sensor once and twice per turn (rad).
fn periodic_deviations(chain: &Chain, joint: usize, eccentricity: bool) -> [f64; 2] {
    match chain.links[joint].encoder {
        Some(LinkEncoder::Absolute { travel_rad: Some(travel_rad), .. }) => [LINEARITY * travel_rad; 2],
        Some(LinkEncoder::Absolute { .. }) => {
            let row = chain.links[joint].part.and_then(|number| PARTS.get(number));
            row.map_or([MAGNET_RAD, MAGNET_TWICE_RAD], |row| row.error_rad)
        }
        _ if eccentricity => [ECCENTRICITY_RAD, ENCODER_TWICE_RAD],
        _ => [0.0; 2],
    }
}

#[cfg(test)]
mod tests {
    use upright_design::rig::PerJoint;

    use super::*;

    #[test]
    fn a_presliding_is_given_as_in_the_rig_file() {
        let mut rig = Rig::from_path("../../rigs/single-quanser-ip02.toml".as_ref()).unwrap();
        rig.reality.friction.presliding_rad = PerJoint::each(vec![2e-3]);
        let bend = priors(&rig, rig.chain().unwrap(), false)[Layout { links: 1 }.presliding(0)].value;
        let given = ParameterKind::Presliding(0).of_file() * bend;
        assert!((given - 2e-3).abs() < 1e-15 && bend < 1.6e-3, "{given} {bend}");
        assert_eq!(ParameterKind::JointDry(0).of_file(), 1.0);
    }

    #[test]
    fn a_potentiometer_is_taken_for_less_exact_than_a_magnetic_sensor_and_an_encoder_for_exact() {
        let mut rig = Rig::from_path("../../rigs/single-absolute.toml".as_ref()).unwrap();
        let mut off = |encoder| {
            let Some(chain) = rig.chain_mut() else { panic!() };
            chain.links[0].encoder = Some(encoder);
            let kinds = Layout { links: 1 }.kinds();
            let at = kinds.iter().position(|kind| *kind == ParameterKind::EccentricSine(0)).unwrap();
            priors(&rig, rig.chain().unwrap(), false)[at].deviation
        };
        let mut absolute = |travel_rad| {
            off(LinkEncoder::Absolute { bits: 12, travel_rad, zero_counts: 3100, noise_rad: 1e-3 })
        };
        assert_eq!([absolute(None), absolute(Some(6.0))], [0.01, 0.03]);
        assert_eq!(off(LinkEncoder::CountsPerRev(4096.0)), 0.0);
    }
}
