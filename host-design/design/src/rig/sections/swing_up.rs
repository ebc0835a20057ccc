//! `[swing_up]`: the motions from hanging to upright and back.

use super::super::error::RigError;
use super::super::key::{Absent, Section};
use super::super::node::Node;
use super::super::rule::Rule;
use super::super::value::{Keys, keys};
use super::chain::CartInput;

/// `[swing_up]`
pub(crate) static SWING_UP: Section = Section {
    name: "swing_up",
    title: "[swing_up]",
    meaning: "limits of the motions that `upright swing-up` plans, and errors that they have to survive; changes no \
              gain",
    absent: Absent::Follows("as below"),
    keys: &[SwingUpRules::KEYS],
};

const DURATION: Rule = Rule::DURATION.worded("a number > 0 and <= 60 (s), shortest_s at most longest_s");

keys! {
    /// Limits of the planned motions, and the errors that they have to survive. They change no gain, so they are not
    /// part of the rig's hash.
    pub struct SwingUpRules {
        shortest_s: Option<f64>, "s", DURATION,
            "shortest duration of a motion that is tried", Absent::Follows("9 √(L/g) for links of total length L");
        longest_s: Option<f64>, "s", DURATION,
            "longest duration of a motion that is tried", Absent::Follows("20 √(L/g)");
        force_n: Option<f64>, "N", Rule::POSITIVE,
            "largest force of a plan", Absent::Follows("60 to 90 % of the largest force");
        #[serde(skip_serializing_if = "Option::is_none")]
        acceleration_m_per_s2: Option<f64>, "m/s²", Rule::POSITIVE,
            "with kind = \"acceleration\": largest acceleration of a plan",
            Absent::Follows("60 to 90 % of the drive's limit");
        speed_m_per_s: Option<f64>, "m/s", Rule::POSITIVE,
            "largest speed of the cart in a plan",
            Absent::Follows("90 % of the speeds of [limits] and drive");
        rail_m: Option<f64>, "m", Rule::POSITIVE,
            "largest distance of the cart from the middle in a plan", Absent::Follows("60 to 90 % of travel_m");
        mass_spread_percent: f64, "%", Rule::PERCENT,
            "spread (±) of the masses of the random plants", Absent::Numbers(&[5.0]);
        friction_spread_percent: f64, "%", Rule::PERCENT,
            "spread (±) of the frictions of the random plants", Absent::Numbers(&[30.0]);
        success_percent: f64, "%", Rule::PERCENT,
            "least share of random plants that arrive, as the lower end of its 95 % interval",
            Absent::Numbers(&[93.0]);
    }
}

impl Default for SwingUpRules {
    fn default() -> Self {
        SwingUpRules::when_absent().expect("no key of [swing_up] is required")
    }
}

impl SwingUpRules {
    /// Largest input of a plan (N, or m/s²), where given.
    pub fn input(&self) -> Option<f64> {
        self.force_n.or(self.acceleration_m_per_s2)
    }
}

/// Reads `[swing_up]` of a rig whose drive imposes `input`.
pub(crate) fn swing_up(node: &Node<'_>, input: CartInput) -> Result<SwingUpRules, RigError> {
    let table = node.table(&SWING_UP)?;
    let rules = SwingUpRules::read(&table)?;
    table.refuse_other_input(input, "force_n", "acceleration_m_per_s2")?;
    match (rules.shortest_s, rules.longest_s, table.get("longest_s")) {
        (Some(shortest), Some(longest), Some(node)) if longest < shortest => {
            Err(node.out_of_range(DURATION.accepts, "give a longest_s of at least shortest_s"))
        }
        _ => Ok(rules),
    }
}
