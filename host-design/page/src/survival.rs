//! How much a closed loop stands, in two numbers that a person can picture.

use serde::Serialize;
use upright::table::Law;
use upright_design::rig::Rig;
use upright_design::simulate::HandPush;
use upright_design::table::TableValues;
use upright_trust::verify::{AttractionSettings, PushSearch, VerifyError, largest_tilts};

/// Duration of the touch (s), and when it begins.
const TOUCH_S: f64 = 0.05;
const FROM_S: f64 = 0.2;
/// Relative precision of the tilt: a sentence has two digits.
const RELATIVE: f64 = 0.02;

/// How much a loop stands.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct LoopSurvival {
    /// The largest lean of a single link, whichever leans, from which the controller comes back (rad).
    pub(crate) tilt_rad: f64,
    /// The hardest touch at the end of the last link (for 50 ms) after which the whole firmware still balances (N);
    /// none if it survives the hardest one that is tried.
    pub(crate) touch_n: Option<f64>,
}

/// Finds how much the loop of `law` stands.
pub(crate) fn survival(rig: &Rig, table: &TableValues, law: Law) -> Result<LoopSurvival, VerifyError> {
    let settings = AttractionSettings { relative: RELATIVE, ..AttractionSettings::default() };
    let tilts = largest_tilts(rig, table, law, &settings)?;
    let links = tilts.len();
    let tilt_rad = tilts.iter().map(|tilt| tilt.edge.size).fold(f64::INFINITY, f64::min);
    let push = HandPush { body: links, along: 1.0, force_n: 1.0, from_s: FROM_S, duration_s: TOUCH_S };
    let ended = PushSearch { rig, table, law, push, seed: 1 }.first(true)?;
    let touch_n = ended.map(|(force_n, _)| force_n / (1.0 + PushSearch::RELATIVE));
    Ok(LoopSurvival { tilt_rad, touch_n })
}
