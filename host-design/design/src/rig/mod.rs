//! The rig file: what the user knows about the machine on the bench, in SI units.
//!
//! [`Rig`] holds the values as the file gives them; defaults that follow from other values (the centre of mass of a
//! uniform rod, its inertia, an encoder's step from its counts) stay `None` here and are worked out where they are
//! used, in that place's precision.

pub mod defaults;
mod describe;
mod error;
mod limits;
mod load;
mod node;
mod parse;
mod requirements;
mod rule;
mod sensors;

pub use error::{Place, RigError, RigErrorKind};
pub use limits::Limits;
pub use load::MAX_BYTES;
pub use requirements::Requirements;
pub use sensors::Sensor;

use serde::Serialize;
use sha2::{Digest, Sha256};

/// Most links of a chain: plants of more are not compiled.
pub const MAX_LINKS: usize = 14;

/// A rig file, read and checked.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rig {
    /// Name of the rig, as printed and as stored in the gain table.
    pub name: String,
    /// The plant: a chain of links on a cart, or a linear model.
    pub plant: PlantDescription,
    /// Force limit and motor.
    pub actuator: Actuator,
    /// Control period and delay.
    pub tick: Tick,
    /// Weights of the linear quadratic regulator, if one is wanted.
    pub lqr: Option<Lqr>,
    /// Poles to place, if a placement is wanted.
    pub pole_placement: Option<PolePlacement>,
    /// Noise intensities for the observer, if one is wanted.
    pub kalman: Option<Kalman>,
    /// Integral action on the controlled output, if wanted.
    pub integral: Option<Integral>,
    /// Limits the supervisor enforces.
    pub limits: Limits,
    /// What `upright verify` requires.
    #[serde(skip)]
    pub verify: Requirements,
}

/// What is to be balanced.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum PlantDescription {
    /// Links on a cart.
    Chain(Chain),
    /// A linear single-input plant given by its matrices.
    Model(LinearPlant),
}

/// `n >= 1` links on a cart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chain {
    /// The cart.
    pub cart: Cart,
    /// Links from the cart outwards.
    pub links: Vec<Link>,
    /// Acceleration of gravity (m/s²).
    pub gravity_m_per_s2: f64,
}

/// `[cart]`
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cart {
    /// Mass (kg).
    pub mass_kg: f64,
    /// Viscous friction on the rail (N·s/m).
    pub friction_n_s_per_m: f64,
    /// Ends of the rail (m).
    pub travel_m: [f64; 2],
    /// Travel per encoder count (m).
    pub encoder_step_m: Option<f64>,
}

/// `[[link]]`
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Link {
    /// Mass (kg).
    pub mass_kg: f64,
    /// Distance from this link's joint to the next one (m).
    pub length_m: f64,
    /// Distance from the joint to the centre of mass (m); half the length if not given.
    pub centre_of_mass_m: Option<f64>,
    /// Moment of inertia about the centre of mass (kg·m²); that of a uniform rod, m l²/12, if not given.
    pub inertia_kg_m2: Option<f64>,
    /// Viscous friction in the lower joint, on the relative rate (N·m·s/rad).
    pub friction_n_m_s_per_rad: f64,
    /// Resolution of the joint's encoder.
    pub encoder: Option<LinkEncoder>,
}

/// Resolution of a joint encoder, in whichever way the file gives it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub enum LinkEncoder {
    /// `encoder_step_rad`: angle per count (rad).
    StepRad(f64),
    /// `encoder_counts_per_rev`: counts per revolution; the step is 2π over it.
    CountsPerRev(f64),
}

/// `[model]`: `ẋ = A x + B u` with one input.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LinearPlant {
    /// Rows of A, s×s.
    pub a: Vec<Vec<f64>>,
    /// Entries of B, s.
    pub b: Vec<f64>,
    /// Index of the state that follows the set-point.
    pub output: usize,
    /// Indices of the measured states, in the order of the sensors.
    pub measured: Vec<usize>,
    /// Sensor step of each measured state.
    pub measured_steps: Vec<f64>,
    /// Columns through which process noise enters, each of length s; default: B alone.
    pub noise_input: Option<Vec<Vec<f64>>>,
}

/// `[actuator]`
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct Actuator {
    /// Largest force on the cart (N); none given: no limit.
    pub force_limit_n: Option<f64>,
    /// The DC motor, if described.
    pub motor: Option<Motor>,
}

/// A DC motor with gear and pulley.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Motor {
    /// Torque constant = back-EMF constant (N·m/A).
    pub torque_constant_n_m_per_a: f64,
    /// Winding resistance (Ω).
    pub resistance_ohm: f64,
    /// Motor turns per pulley turn.
    pub gear_ratio: f64,
    /// Pulley or pinion radius (m).
    pub pulley_radius_m: f64,
    /// Supply voltage (V).
    pub supply_v: f64,
    /// Voltage below which the motor does not move (V).
    pub dead_zone_v: f64,
    /// Largest change of voltage (V/s), if limited.
    pub slew_v_per_s: Option<f64>,
}

/// `[tick]`
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tick {
    /// Control period (s).
    pub period_s: f64,
    /// Ticks between measurement and the force computed from it: 0 or 1.
    pub delay_ticks: u8,
}

/// `[lqr]`: minimise the integral of `xᵀ diag(q) x + r u²`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Lqr {
    /// Diagonal of Q, one weight per state.
    pub state_weights: Vec<f64>,
    /// R > 0.
    pub force_weight: f64,
}

/// `[pole_placement]`
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum PolePlacement {
    /// A dominant pair from a second-order response, and real far poles.
    Response {
        /// Overshoot of the dominant pair (%), 0 < PO < 100.
        overshoot_percent: f64,
        /// Settling time of the dominant pair (s): ωn = 4 / (ζ ts).
        settling_time_s: f64,
        /// The other poles (1/s), all real.
        far_poles: Vec<f64>,
    },
    /// Every pole as [re, im] (1/s), complex ones in conjugate pairs.
    Poles(Vec<[f64; 2]>),
}

/// `[kalman]`: continuous noise intensities.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Kalman {
    /// Intensity of the force noise (N²·s).
    pub force_noise_n2_s: f64,
    /// Intensity of the torque noise at each joint ((N·m)²·s); with `[model]`, of each further noise column.
    pub joint_noise: Vec<f64>,
}

/// `[integral]`
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Integral {
    /// Weight of the integrated position error in the cost.
    pub position_weight: f64,
}

impl Default for Tick {
    fn default() -> Self {
        Tick { period_s: defaults::PERIOD_S, delay_ticks: defaults::DELAY_TICKS }
    }
}

impl PlantDescription {
    /// Number of states: 2n + 2 for n links, or the order of the model.
    pub fn states(&self) -> usize {
        match self {
            PlantDescription::Chain(chain) => 2 * chain.links.len() + 2,
            PlantDescription::Model(model) => model.b.len(),
        }
    }
}

impl Motor {
    /// Back-EMF per cart speed, `gear Kt / r` (V·s/m), which is also the force per current (N/A).
    pub fn volts_per_speed(&self) -> f64 {
        self.gear_ratio * self.torque_constant_n_m_per_a / self.pulley_radius_m
    }

    /// Force on the cart at standstill and full supply, `gear Kt V / (R r)` (N).
    pub fn stall_force_n(&self) -> f64 {
        self.gear_ratio * self.torque_constant_n_m_per_a * self.supply_v
            / (self.resistance_ohm * self.pulley_radius_m)
    }
}

impl Rig {
    /// Number of states: 2n + 2 for n links, or the order of the model.
    pub fn states(&self) -> usize {
        self.plant.states()
    }

    /// The largest force on the cart (N): the limit the file gives, and what the motor can push at standstill, if there
    /// is one; the smaller of the two. None: no limit.
    pub fn force_limit_n(&self) -> Option<f64> {
        let stall = self.actuator.motor.as_ref().map(Motor::stall_force_n);
        match (self.actuator.force_limit_n, stall) {
            (Some(limit), Some(stall)) => Some(limit.min(stall)),
            (limit, stall) => limit.or(stall),
        }
    }

    /// Index of the state that follows the set-point: the cart position, or the model's output.
    pub fn output(&self) -> usize {
        match &self.plant {
            PlantDescription::Chain(_) => 0,
            PlantDescription::Model(model) => model.output,
        }
    }

    /// The first eight bytes of the SHA-256 of the checked values, as a big-endian number.
    ///
    /// Comments, layout and the order of keys in the file do not change it; any value does. A gain table carries it, so
    /// that a controller and a host can tell whether they speak of the same rig.
    pub fn hash(&self) -> u64 {
        // Serialising plain structs of numbers and strings into memory cannot fail.
        let values = serde_json::to_vec(self).expect("a rig is representable as JSON");
        Sha256::digest(values).iter().take(8).fold(0, |hash, &byte| hash << 8 | u64::from(byte))
    }
}
