//! `[integral]`: integral action on the controlled output, for the LQR.

use super::super::key::{Absent, Section};
use super::super::rule::Rule;
use super::super::value::{Keys, keys};

/// `[integral]`
pub(crate) static INTEGRAL: Section = Section {
    name: "integral",
    title: "[integral]",
    meaning: "integral action on the cart position, for the LQR",
    absent: Absent::Follows("no integral action"),
    keys: &[Integral::KEYS],
};

keys! {
    /// Integral action on the controlled output, `[integral]`.
    pub struct Integral {
        position_weight: f64, "", Rule::POSITIVE,
            "weight of the integrated position error in the cost", Absent::Required;
        setpoint_weight: f64, "", Rule::SHARE,
            "share of the precompensation gain that is used; a smaller share reduces the overshoot",
            Absent::Numbers(&[1.0]);
    }
}
