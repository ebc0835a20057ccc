//! `[kalman]`: noise intensities for the observer.

use serde::Serialize;

use super::super::error::RigError;
use super::super::key::{Absent, Key, Section};
use super::super::node::Node;
use super::super::rule::Rule;
use super::chain::{CartInput, PlantDescription};

/// `[kalman]`
pub(crate) static KALMAN: Section = Section {
    name: "kalman",
    title: "[kalman]",
    meaning: "the observer: noise intensities, each the variance of a noise held for one tick, times the tick",
    absent: Absent::Follows("no observer"),
    keys: &[&[
        Key {
            name: "force_noise_n2_s",
            unit: "N²·s",
            rule: Rule::NOT_NEGATIVE,
            meaning: "intensity of the force noise: variance times hold time",
            absent: Absent::RequiredIf("with kind = \"force\" in [actuator]"),
        },
        Key {
            name: "acceleration_noise_m2_per_s3",
            unit: "m²/s³",
            rule: Rule::NOT_NEGATIVE,
            meaning: "intensity of the noise of the cart's acceleration",
            absent: Absent::RequiredIf("with kind = \"acceleration\""),
        },
        Key {
            name: "joint_noise",
            unit: "",
            rule: Rule::checked_by_its_section("one number >= 0 per joint, or per further column"),
            meaning: "intensities of the torque noise in (N·m)²·s, one per joint; with [model], one per column of \
                      noise_input after the first",
            absent: Absent::RequiredIf("unless [model] has one noise column"),
        },
    ]],
};

/// `[kalman]`: continuous noise intensities.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KalmanNoise {
    /// Intensity of the input's noise: of the force (N²·s), or of the cart's acceleration (m²/s³).
    pub force_noise_n2_s: f64,
    /// Intensity of the torque noise at each joint ((N·m)²·s); with `[model]`, of each further noise column.
    pub joint_noise: Vec<f64>,
}

/// Reads `[kalman]`, with one intensity per noise input.
pub(crate) fn kalman(
    node: &Node<'_>,
    plant: &PlantDescription,
    input: CartInput,
) -> Result<KalmanNoise, RigError> {
    let table = node.table(&KALMAN)?;
    let further = match plant {
        PlantDescription::Chain(chain) => chain.links.len(),
        PlantDescription::Model(model) => model.noise_input.as_ref().map_or(1, Vec::len) - 1,
    };
    let force_noise_n2_s = table.of_input(input, "force_noise_n2_s", "acceleration_noise_m2_per_s3")?;
    let joint_noise = if further == 0 && table.get("joint_noise").is_none() {
        Vec::new()
    } else {
        table.numbers("joint_noise", further, Rule::NOT_NEGATIVE)?
    };
    Ok(KalmanNoise { force_noise_n2_s, joint_noise })
}
