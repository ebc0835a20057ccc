//! One line of a comparison.

use serde::Serialize;
use upright::table::Law;

use upright_design::rig::{Base, CartInput};
use upright_design::simulate::{Fall, Trace};

/// Results for one law of one candidate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ComparedRow {
    /// Label of the rig.
    pub rig: String,
    /// What its drive imposes on the cart.
    pub input: CartInput,
    /// What carries its links.
    #[serde(skip_serializing_if = "Base::is_cart")]
    pub base: Base,
    /// Value of the swept key; `None` without a sweep.
    pub value: Option<f64>,
    /// The control law that was run.
    pub law: Law,
    /// How the run ended.
    pub fate: Fate,
    /// All figures; none without a design.
    pub figures: Option<LawFigures>,
    /// The run; none without a design.
    #[serde(skip)]
    pub trace: Option<Trace>,
}

/// What the drives of these rows impose on their carts, with its unit, as words.
pub(super) fn input(rows: &[ComparedRow]) -> String {
    let mut inputs: Vec<(Base, CartInput)> = Vec::new();
    for row in rows {
        if !inputs.contains(&(row.base, row.input)) {
            inputs.push((row.base, row.input));
        }
    }
    inputs.sort_by_key(|(_, input)| !input.is_force());
    let titles: Vec<String> = inputs.into_iter().map(|(base, input)| input.quantity(base).title()).collect();
    titles.join(" or ")
}

/// How a run ended, or why there was none.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fate {
    /// It is up, and within the settling band, when the run ends.
    Settled,
    /// It is up, but not within the band.
    Survived,
    /// It falls.
    Fallen(Fall),
    /// There is no design; holds the reason.
    NoDesign(String),
}

/// Figures of one law of one candidate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawFigures {
    /// Time from which the output stays within 2 % of the step, at least 1 mm (s).
    pub settling_time_s: Option<f64>,
    /// Largest excursion beyond the set-point (% of the step).
    pub overshoot_percent: Option<f64>,
    /// Largest angle of any joint (rad); none for a model.
    pub peak_angle_rad: Option<f64>,
    /// Largest force on the cart (N), or acceleration of the cart (m/s²) where the drive imposes that.
    pub peak_force_n: f64,
    /// Smallest factor on the force at which the loop is still stable; none if it is not.
    pub lowest_gain: Option<f64>,
    /// Largest such factor; none: no limit, or not stable.
    pub highest_gain: Option<f64>,
    /// Phase margin (rad); none if the loop is not stable.
    pub phase_margin_rad: Option<f64>,
    /// Delay margin (s); likewise.
    pub delay_margin_s: Option<f64>,
    /// Largest tilt of the worst single link from which it recovers (rad); none for a model or an unstable loop.
    pub tilt_rad: Option<f64>,
    /// Real part of the fastest pole of the continuous design (1/s): negative.
    pub fastest_pole_per_s: f64,
}
