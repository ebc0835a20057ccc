//! All values of a rig file.

use serde::Serialize;
use sha2::{Digest, Sha256};
use upright::table::Law;

use super::base::Base;
use super::defaults;
use super::quantity::Quantity;
use super::sections::actuator::Actuator;
use super::sections::chain::{Chain, PlantDescription};
use super::sections::friction::KnownFriction;
use super::sections::integral::Integral;
use super::sections::kalman::KalmanNoise;
use super::sections::limits::Limits;
use super::sections::lqr::Lqr;
use super::sections::pole_placement::PolePlacement;
use super::sections::reality::Reality;
use super::sections::robust::Tolerances;
use super::sections::swing_up::SwingUpRules;
use super::sections::tick::Tick;
use super::sections::verify::{RequiredSize, Requirements};

/// A rig file, read and checked.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rig {
    /// Name of the rig, as printed and as stored in the gain table.
    pub name: String,
    /// The plant: a chain of links on a cart, or a linear model.
    pub plant: PlantDescription,
    /// The drive of the cart.
    pub actuator: Actuator,
    /// Control period and delay.
    pub tick: Tick,
    /// Weights of the linear quadratic regulator, if one is wanted.
    pub lqr: Option<Lqr>,
    /// Poles to place, if a placement is wanted.
    pub pole_placement: Option<PolePlacement>,
    /// Noise intensities for the observer, if one is wanted.
    pub kalman: Option<KalmanNoise>,
    /// Integral action on the controlled output, if wanted.
    pub integral: Option<Integral>,
    /// Coulomb friction that the controller compensates, if any is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<KnownFriction>,
    /// Limits that the supervisor enforces.
    pub limits: Limits,
    /// What `upright verify` requires.
    #[serde(skip)]
    pub verify: Requirements,
    /// The imperfections that the loop has to survive, each alone, according to `[verify]`, with their sizes.
    #[serde(skip)]
    pub must_survive: Vec<RequiredSize>,
    /// How the simulated machine differs from the model.
    #[serde(skip)]
    pub reality: Reality,
    /// The tolerances that `upright robust` chooses gains for, if stated.
    #[serde(skip)]
    pub robust: Option<Tolerances>,
    /// Limits of the motions that `upright swing-up` plans, if the rig is to swing itself up.
    #[serde(skip)]
    pub swing_up: Option<SwingUpRules>,
}

impl Rig {
    /// What carries the links; a model has the words of a cart.
    pub fn base(&self) -> Base {
        self.chain().map_or(Base::Cart, |chain| chain.base)
    }

    /// A text about a cart, for what carries the links of this rig.
    pub fn words(&self, text: &str) -> String {
        self.base().words(text)
    }

    /// What moves the plant.
    pub fn input_quantity(&self) -> Quantity {
        match &self.plant {
            PlantDescription::Chain(chain) => chain.input.quantity(chain.base),
            PlantDescription::Model(_) => Quantity::OF_MODEL,
        }
    }

    /// What follows the set-point.
    pub fn output_quantity(&self) -> Quantity {
        match &self.plant {
            PlantDescription::Chain(chain) => chain.base.position(),
            PlantDescription::Model(_) => Quantity { name: "output", unit: "" },
        }
    }

    /// The soft limits of its rail, low and high, where the motor is turned off (m).
    pub fn soft_rail_m(&self, chain: &Chain) -> [f64; 2] {
        let [low, high] = chain.cart.travel_m;
        let margin = self.limits.rail_margin_m.unwrap_or_else(|| {
            // Position 0 stays inside the limits, however unequal the two ends are.
            (defaults::RAIL_MARGIN_SHARE * (high - low)).min(0.5 * high.min(-low))
        });
        [low + margin, high - margin]
    }

    /// The rig with `law` as its only control law, so that a design cannot fail because of the other one.
    pub fn with_law_alone(&self, law: Law) -> Self {
        let mut rig = self.clone();
        match law {
            Law::Lqr => rig.pole_placement = None,
            Law::PolePlacement => {
                rig.lqr = None;
                rig.integral = None;
            }
        }
        rig
    }

    /// Number of states: 2n + 2 for n links, or the order of the model.
    pub fn states(&self) -> usize {
        self.plant.states()
    }

    /// The chain of links; none if the plant is a linear model.
    pub fn chain(&self) -> Option<&Chain> {
        match &self.plant {
            PlantDescription::Chain(chain) => Some(chain),
            PlantDescription::Model(_) => None,
        }
    }

    /// The chain of links, to be changed; none if the plant is a linear model.
    pub fn chain_mut(&mut self) -> Option<&mut Chain> {
        match &mut self.plant {
            PlantDescription::Chain(chain) => Some(chain),
            PlantDescription::Model(_) => None,
        }
    }

    /// Number of links; 0 if the plant is a linear model.
    pub fn links(&self) -> usize {
        self.chain().map_or(0, |chain| chain.links.len())
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
    /// Comments, layout and the order of keys in the file do not change it; any value does. A gain table carries it,
    /// so that controller and host can check that they use the same rig.
    pub fn hash(&self) -> u64 {
        // Serialising plain structs of numbers and strings into memory cannot fail.
        let values = serde_json::to_vec(self).expect("a rig is representable as JSON");
        Sha256::digest(values).iter().take(8).fold(0, |hash, &byte| hash << 8 | u64::from(byte))
    }
}
