//! The law with which the motor stills links that tumble: its gains, and what its energy certifies.

use core::fmt;

use serde::Serialize;
use upright::table::Equilibrium;

use crate::number::significant;
use crate::numerics::{Matrix, eigenvalues};
use crate::plant::{ChainParameters, linearise};
use crate::rig::{CartInput, Chain, Rig};

/// Shares of the largest force that spring and damper may use.
const SHARES: [f64; 2] = [0.6, 0.4];
/// Mass of the base that the motor imitates, as a share of the base's own. A lighter one stills sooner, but the force
/// that takes the rest away is as wrong as the base's stated mass.
const OF_BASE: f64 = 0.15;
/// The same as a share of the links' mass, for a drive that imposes the base's acceleration: the base has no mass.
const OF_LINKS: f64 = 0.3;
/// A lighter base is imitated if the swings then decay by this factor faster.
const WORTH: f64 = 1.2;
/// Share of the base's viscous friction that is taken away with its mass: if the real one is 30 % less, nothing is
/// added.
const OF_VISCOUS: f64 = 0.7;
/// Share of the known dry friction of the base that is made up for: if too much is, the base wanders.
const OF_FRICTION: f64 = 0.8;
/// Acceleration by the largest force, over what is counted on for braking: links may pull at the base meanwhile.
const BRAKING: f64 = 1.5;
/// Energy for which the largest speed is computed, as a multiple of that of upright links.
const ENERGIES: f64 = 2.0;
/// Least gains, as shares of those with which the search begins: the motor damps, however much friction the base has.
const LEAST: f64 = 0.02;
/// Refinements of the search for the gains; each halves the logarithm of the step.
const REFINEMENTS: usize = 7;

/// Why the links of a rig cannot be stilled by its motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoStilling {
    /// A model has no links.
    #[error("a [model] has no links that could hang")]
    Model,
    /// The links are not measured.
    #[error(
        "no sensors measure whether the links hang: give the rig [kalman], and a sensor on the cart and every link"
    )]
    NotMeasured,
    /// A potentiometer reads nothing in its dead band.
    #[error(
        "a potentiometer does not measure links that turn over: use an encoder or a sensor of a whole turn"
    )]
    DeadBand,
    /// The motor has no largest force.
    #[error("spring and damper need a largest force: give force_limit_n in [actuator]")]
    NoLimit,
}

/// The gains with which a motor imitates spring and damper, and maybe a lighter base.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stilling {
    /// Stiffness of the spring (N/m).
    pub stiffness: f64,
    /// Constant of the damper (N·s/m).
    pub damping: f64,
    /// Largest forces of spring and damper (N).
    pub most_n: [f64; 2],
    /// Mass of the base that the motor imitates (kg); none: the real one.
    pub imitated_kg: Option<f64>,
    /// Mass (kg) and viscous friction (N·s/m) that the motor takes away.
    pub taken: [f64; 2],
    /// Dry friction that the motor makes up for (N).
    pub friction_n: f64,
    /// Rate at which the slowest swing decays (1/s).
    pub decay_per_s: f64,
    /// Deceleration that is counted on near an end of the rail (m/s²).
    pub braking_m_per_s2: f64,
    /// Speed that the base cannot exceed with twice the energy of upright links (m/s).
    pub speed_m_per_s: f64,
    /// Energy of links that stand upright, above that of links that hang (J).
    pub upright_j: f64,
    /// Distance from the middle that the base cannot exceed with this energy, and with twice of it (m), if the rail is
    /// so long: near its end, the base is braked besides.
    pub excursion_m: [f64; 2],
    /// Links and imitated base, for the table.
    #[serde(skip)]
    pub(crate) imitated: ChainParameters<f64>,
}

impl Stilling {
    /// The law for `rig`.
    ///
    /// # Errors
    /// [`NoStilling`] if its motor cannot still its links.
    pub fn of(rig: &Rig) -> Result<Self, NoStilling> {
        let chain = rig.chain().ok_or(NoStilling::Model)?;
        let sensors = rig.sensors();
        if rig.kalman.is_none() || sensors.len() != chain.links.len() + 1 {
            return Err(NoStilling::NotMeasured);
        }
        if sensors.iter().any(|sensor| sensor.absolute.is_some_and(|range| range.has_dead_band())) {
            return Err(NoStilling::DeadBand);
        }
        let most = rig.actuator.largest_input().ok_or(NoStilling::NoLimit)?;
        let real = ChainParameters::of(chain);
        let is_force = chain.input == CartInput::Force;
        let links_kg = real.total_mass - chain.cart.mass_kg.unwrap_or_default();
        let base_kg = if is_force { OF_BASE * (real.total_mass - links_kg) } else { OF_LINKS * links_kg };
        let viscous = if is_force { (1.0 - OF_VISCOUS) * real.cart_friction } else { 0.0 };
        let lighter = with_base(&real, base_kg + links_kg, viscous);
        let found = fastest(&lighter);
        let own = is_force.then(|| fastest(&real));
        Ok(match own.filter(|own| found.decay_per_s < WORTH * own.decay_per_s) {
            Some(own) => Self::with(rig, chain, &real, (None, own), most),
            None => Self::with(rig, chain, &real, (Some(lighter), found), most),
        })
    }

    fn with(
        rig: &Rig,
        chain: &Chain,
        real: &ChainParameters<f64>,
        (imitated, Fastest { gains: [stiffness, damping], decay_per_s }): (
            Option<ChainParameters<f64>>,
            Fastest,
        ),
        most: f64,
    ) -> Self {
        let is_force = chain.input == CartInput::Force;
        let total_kg = imitated.as_ref().unwrap_or(real).total_mass;
        let base_kg = chain.cart.mass_kg.unwrap_or_default() + total_kg - real.total_mass;
        let taken = imitated.as_ref().filter(|_| is_force).map_or([0.0; 2], |lighter| {
            [real.total_mass - lighter.total_mass, real.cart_friction - lighter.cart_friction]
        });
        let most_n = SHARES.map(|share| share * if is_force { most } else { most * total_kg });
        let fastest = if is_force { most / real.total_mass } else { most };
        let upright_j = 2.0 * real.weight.iter().sum::<f64>();
        let by_energy = (2.0 * ENERGIES * upright_j / base_kg).sqrt();
        let by_drive = rig.actuator.largest_speed_m_per_s(rig.tick.period_s).unwrap_or(f64::INFINITY);
        let known_n = rig.friction.as_ref().filter(|_| is_force).map_or(0.0, |friction| friction.cart_n);
        Self {
            stiffness,
            damping,
            most_n,
            imitated_kg: imitated.is_some().then_some(base_kg),
            taken,
            friction_n: OF_FRICTION * known_n,
            decay_per_s,
            braking_m_per_s2: fastest / BRAKING,
            speed_m_per_s: by_energy.min(1.01 * by_drive),
            upright_j,
            excursion_m: [1.0, ENERGIES].map(|times| excursion_m(times * upright_j, stiffness, most_n[0])),
            imitated: imitated.unwrap_or_else(|| real.clone()),
        }
    }
}

impl fmt::Display for Stilling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let short = |value: f64| significant(value, 3);
        let [spring_n, damper_n] = self.most_n.map(short);
        writeln!(f, "stilling")?;
        writeln!(f, "  spring                {} N/m, at most {spring_n} N", short(self.stiffness))?;
        writeln!(f, "  damper                {} N s/m, at most {damper_n} N", short(self.damping))?;
        let base = self.imitated_kg.map_or_else(|| "as it is".to_owned(), |kg| format!("{} kg", short(kg)));
        writeln!(f, "  imitated mass of cart {base}")?;
        writeln!(f, "  dry friction made up  {} N", short(self.friction_n))?;
        writeln!(f, "  slowest swing decays  {} 1/s", short(self.decay_per_s))?;
        let [once, twice] = self.excursion_m.map(short);
        writeln!(f, "  cart goes no further  {once} m from upright, {twice} m from twice that energy")
    }
}

/// Where a spring of this stiffness (N/m) and largest force (N) has taken an energy (J): the largest distance from the
/// middle (m) of a base that begins there.
fn excursion_m(energy_j: f64, stiffness: f64, most_n: f64) -> f64 {
    let linear_m = most_n / stiffness;
    let linear_j = 0.5 * most_n * linear_m;
    if energy_j <= linear_j {
        (2.0 * energy_j / stiffness).sqrt()
    } else {
        linear_m + (energy_j - linear_j) / most_n
    }
}

/// The chain on a base that is free to move, with this mass of base and links together (kg) and this viscous friction
/// (N·s/m).
fn with_base(real: &ChainParameters<f64>, total_mass: f64, cart_friction: f64) -> ChainParameters<f64> {
    ChainParameters { input: CartInput::Force, total_mass, cart_friction, ..real.clone() }
}

/// The gains with which the slowest swing decays fastest, and its decay.
struct Fastest {
    /// Stiffness (N/m) and constant of the damper (N·s/m).
    gains: [f64; 2],
    decay_per_s: f64,
}

/// Searches for the gains: from a point of the right size, each step goes to the best of the eight neighbours, whose
/// logarithms differ by one step, until none is better; then the step is halved.
fn fastest(chain: &ChainParameters<f64>) -> Fastest {
    let Ok(model) = linearise(chain, Equilibrium::HANGING) else {
        return Fastest { gains: [1.0, 1.0], decay_per_s: 0.0 };
    };
    let decay = |[stiffness, damping]: [f64; 2]| {
        let mut k = Matrix::zeros(1, model.a.cols());
        (k[(0, 0)], k[(0, 1)]) = (stiffness, damping);
        let poles = eigenvalues(&(&model.a - &(&model.b * &k)));
        poles.map_or(f64::NEG_INFINITY, |poles| {
            -poles.iter().map(|pole| pole.re).fold(f64::NEG_INFINITY, f64::max)
        })
    };
    // A pendulum as long as the chain's first moment over its mass swings at this rate.
    let rate = (chain.weight[0] / chain.b[(0, 0)]).sqrt();
    let mut best = [0.3 * chain.total_mass * rate * rate, chain.total_mass * rate];
    let least = best.map(|gain| LEAST * gain);
    let (mut largest, mut step) = (decay(best), 2.0f64);
    for _ in 0..REFINEMENTS {
        while let Some((next, value)) = better(best, (step, least), largest, &decay) {
            (best, largest) = (next, value);
        }
        step = step.sqrt();
    }
    Fastest { gains: best, decay_per_s: largest }
}

/// The best of the eight neighbours, if one is better than `largest`.
fn better(
    from: [f64; 2],
    (step, [least_k, least_d]): (f64, [f64; 2]),
    largest: f64,
    decay: &impl Fn([f64; 2]) -> f64,
) -> Option<([f64; 2], f64)> {
    let factors = [1.0 / step, 1.0, step];
    let neighbours = factors
        .iter()
        .flat_map(|x| factors.map(|v| [(x * from[0]).max(least_k), (v * from[1]).max(least_d)]));
    let valued = neighbours.map(|gains| (gains, decay(gains)));
    valued.filter(|(_, value)| *value > largest * (1.0 + 1e-9)).max_by(|(_, a), (_, b)| a.total_cmp(b))
}
