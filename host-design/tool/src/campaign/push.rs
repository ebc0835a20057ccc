//! Pushes by hand of a campaign: as strong as the loop survives.

use rand::RngExt;
use upright_closed_loop::defects::{Defect, Phase, Trial};
use upright_design::rig::Rig;
use upright_design::simulate::HandPush;
use upright_design::table::TableValues;
use upright_trust::verify::{PushSearch, VerifyError};

/// Shortest and longest push by hand (s), and its smallest and largest force as a share of what balancing survives.
const PUSH_S: [f64; 2] = [0.005, 1.0];
const PUSH_SHARES: [f64; 2] = [0.1, 0.9];
/// Time before a push in the search for that force, and time for which a push is watched after its end (s).
const SETTLED_S: f64 = 0.2;
const AFTER_PUSH_S: f64 = 3.0;

/// The trial with a push whose duration, place and share are drawn at random: the share of the force that balancing
/// from rest survives without the tests of the innovation. Other defects, and a rig without a chain, stay as they are.
///
/// # Errors
/// [`VerifyError`] if a run cannot be started.
pub(super) fn pushed(trial: Trial, rig: &Rig, table: &TableValues) -> Result<Trial, VerifyError> {
    if (trial.kind, trial.phase) != (Defect::Push, Phase::Balancing) || rig.chain().is_none() {
        return Ok(trial);
    }
    let mut random = trial.random();
    let [shortest_s, longest_s] = PUSH_S;
    let duration_s = shortest_s * (longest_s / shortest_s).powf(random.random());
    let along = random.random_range(0.5..1.0);
    let unit = HandPush { body: trial.sensor, along, force_n: trial.sign, from_s: 0.0, duration_s };
    let table = table.clone().without_tests();
    let push = HandPush { from_s: SETTLED_S, ..unit };
    let search = PushSearch { rig, table: &table, law: trial.scenario.law, push, seed: trial.seed };
    let first_n = search.first(true)?.map_or(0.0, |(force_n, _)| force_n);
    let [least, most] = PUSH_SHARES;
    let force_n = trial.sign * (least + (most - least) * trial.size) * first_n / (1.0 + PushSearch::RELATIVE);
    let watched = ((duration_s + AFTER_PUSH_S) / rig.tick.period_s) as usize;
    Ok(Trial { push: Some(HandPush { force_n, ..unit }), watched, ..trial })
}
