//! What carries the links.

use serde::Serialize;

/// What carries the links: a cart on a rail, or an arm that turns about a vertical axis.
///
/// The code names the quantities of the base and their units after the cart. An arm moves by an angle, so that its
/// quantities are in rad, N·m and kg·m² in the places of m, N and kg.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub enum Base {
    /// A cart on a straight rail.
    #[default]
    Cart,
    /// An arm.
    Arm {
        /// Distance from the arm's axis to the plane in which links turn that do not say another one (m).
        radius_m: f64,
    },
}

impl Base {
    /// Whether it is a cart.
    pub fn is_cart(&self) -> bool {
        *self == Self::Cart
    }
}
