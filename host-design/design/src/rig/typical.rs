//! How far a machine that was built with care is from its file: what fault detection tolerates in any case.

use super::Rig;
use super::base::Base;
use super::sections::chain::Chain;
use super::sections::robust::Tolerances;

/// Friction of a joint, as a share of the moment of the links' weight that it carries. Measured bearings have 0.06 to
/// 0.3 %.
const JOINT_SHARE: f64 = 0.003;
/// Friction of the cart, as a share of the weight on the rail; of an arm, of the moment of its links' weight.
const CART_SHARE: f64 = 0.05;
/// Error of the masses (%).
const MASS_PERCENT: f64 = 3.0;

impl Tolerances {
    /// Those of a machine that was built with care: they follow from its weights and lengths. A joint that sticks by a
    /// share of its weight's moment stops that share of a radian off the vertical, which is its wrong zero. A tilt of
    /// the rail of some mrad is a small part of the cart's friction.
    pub fn typical(chain: &Chain) -> Self {
        let gravity = chain.gravity_m_per_s2;
        let (mut outer_kg, mut least_n_m) = (0.0, f64::INFINITY);
        for link in chain.links.iter().rev() {
            let own = link.mass_kg * link.centre_m();
            least_n_m = f64::min(least_n_m, gravity * (own + outer_kg * link.length_m));
            outer_kg += link.mass_kg;
        }
        // An arm's bearing carries the links beside it.
        let carried = match chain.base {
            Base::Cart => chain.cart.mass_kg.unwrap_or_default() + outer_kg,
            Base::Arm => chain.links.iter().map(|link| link.mass_kg * link.radius_m).sum(),
        };
        Self {
            mass_percent: MASS_PERCENT,
            joint_friction_n_m: JOINT_SHARE * least_n_m,
            cart_friction_n: CART_SHARE * gravity * carried,
            homing_error_rad: JOINT_SHARE,
            latency_s: 0.0,
        }
    }
}

impl Rig {
    /// What fault detection tolerates: `[robust]`, but at least a typical machine. None for a model.
    ///
    /// A drive that imposes the cart's acceleration overcomes its friction.
    pub fn detection_tolerances(&self) -> Option<Tolerances> {
        let mut typical = Tolerances::typical(self.chain()?);
        if self.actuator.held().is_motion() {
            typical.cart_friction_n = 0.0;
        }
        Some(self.robust.as_ref().map_or_else(|| typical.clone(), |stated| stated.at_least(&typical)))
    }
}
