//! `[kalman]`: noise intensities for the observer.

use serde::Serialize;

use super::super::error::RigError;
use super::super::key::{Absent, Key, Section};
use super::super::node::Node;
use super::super::rule::Rule;
use super::chain::{CartInput, PlantDescription};
use super::pole_placement;

/// `[kalman]`
pub(crate) static KALMAN: Section = Section {
    name: "kalman",
    title: "[kalman]",
    meaning: "the observer: noise intensities, each the variance of a noise held for one tick, times the tick",
    absent: Absent::Follows("no observer"),
    keys: &[&[
        Key {
            name: "observer_poles",
            unit: "1/s",
            rule: Rule::checked_by_its_section(POLES_ACCEPTED),
            meaning: "poles of the observer's error instead of those of the Kalman filter, [re, im] with re < 0, two \
                      per encoder: cart, θ1, …; the noise then only sets the thresholds of fault detection",
            absent: Absent::Follows("those of the Kalman filter"),
        },
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

const POLES_ACCEPTED: &str =
    "for each encoder a conjugate pair or two real poles, [re < 0, im] each; not with [model]";

/// `[kalman]`: continuous noise intensities, and poles if they are chosen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KalmanNoise {
    /// Intensity of the input's noise: of the force (N²·s), or of the cart's acceleration (m²/s³).
    pub force_noise_n2_s: f64,
    /// Intensity of the torque noise at each joint ((N·m)²·s); with `[model]`, of each further noise column.
    pub joint_noise: Vec<f64>,
    /// Poles of the observer's error as [re, im] (1/s), two per encoder; empty for those of the Kalman filter.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub observer_poles: Vec<[f64; 2]>,
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
    if input == CartInput::Acceleration {
        table.refuse_for_acceleration(&["observer_poles"])?;
    }
    let observer_poles = match table.get("observer_poles") {
        Some(node) => observer_poles(&node, plant, &table.asks_for("observer_poles"))?,
        None => Vec::new(),
    };
    Ok(KalmanNoise { force_noise_n2_s, joint_noise, observer_poles })
}

/// Poles in pairs, one pair per encoder of a chain: half of the states are measured.
fn observer_poles(
    node: &Node<'_>,
    plant: &PlantDescription,
    asks_for: &str,
) -> Result<Vec<[f64; 2]>, RigError> {
    if !matches!(plant, PlantDescription::Chain(_)) {
        return Err(node.out_of_range(POLES_ACCEPTED, "leave it out: its sensors need not show every state"));
    }
    let poles = pole_placement::poles(node, plant.states(), asks_for)?;
    match poles.chunks(2).position(|two| two[0][1] != -two[1][1]) {
        None => Ok(poles),
        Some(encoder) => Err(node.out_of_range(
            POLES_ACCEPTED,
            &format!("put the two poles of encoder {} side by side", encoder + 1),
        )),
    }
}
