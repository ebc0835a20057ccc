//! How much a closed loop stands, in two numbers that a person can picture.

use serde_json::{Value, json};
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

/// The largest lean of a single link, whichever leans (rad), from which the controller comes back, and the hardest touch
/// at the end of the last link (N, for 50 ms) after which the whole firmware still balances.
pub(crate) fn survival(rig: &Rig, table: &TableValues, law: Law) -> Result<Value, VerifyError> {
    let settings = AttractionSettings { relative: RELATIVE, ..AttractionSettings::default() };
    let tilts = largest_tilts(rig, table, law, &settings)?;
    let links = tilts.len();
    let tilt_rad = tilts.iter().map(|tilt| tilt.edge.size).fold(f64::INFINITY, f64::min);
    let push = HandPush { body: links, along: 1.0, force_n: 1.0, from_s: FROM_S, duration_s: TOUCH_S };
    let ended = PushSearch { rig, table, law, push, seed: 1 }.first(true)?;
    let touch_n = ended.map(|(force_n, _)| force_n / (1.0 + PushSearch::RELATIVE));
    Ok(json!({ "tilt_rad": tilt_rad, "touch_n": touch_n }))
}
