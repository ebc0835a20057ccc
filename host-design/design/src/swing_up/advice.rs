//! What would help when there is no motion: the same search with one limit relaxed.

use super::search::{Request, solvable};
use super::setting::Setting;
use super::way::Way;

/// Candidates tried with each relaxation, and the factor of it.
const TRIED: u64 = 12;
const FACTOR: f64 = 1.5;

/// How many candidates are solved with the rig as it is, and with each limit relaxed; the limit that helps most first.
pub(super) fn advice(setting: &Setting<'_>, request: &Request, way: Way) -> String {
    let relaxed = |change: &dyn Fn(&mut Request)| {
        let mut request = request.clone();
        change(&mut request);
        solvable(setting, &request, way, 0..TRIED)
    };
    let mut all = [
        ("the rail", relaxed(&|r| r.rail_m = r.rail_m.map(|end| FACTOR * end))),
        (
            "the force",
            relaxed(&|r| {
                r.force_n = r.force_n.map(|force| FACTOR * force);
                r.bounds.motor = r.bounds.motor.map(|[stall, loss]| [FACTOR * stall, loss]);
            }),
        ),
        (
            "the cart's speed",
            relaxed(&|r| {
                r.bounds.speed_m_per_s = r.bounds.speed_m_per_s.map(|speed| FACTOR * speed);
            }),
        ),
        ("the duration", relaxed(&|r| r.duration_s = r.duration_s.map(|duration| FACTOR * duration))),
    ];
    all.sort_by_key(|(_, solved)| core::cmp::Reverse(*solved));
    let as_it_is = relaxed(&|_| {});
    let numbers: Vec<String> =
        all.iter().map(|(limit, solved)| format!("{FACTOR} times {limit}: {solved}")).collect();
    let binding = match all.first() {
        Some((limit, solved)) if *solved > as_it_is => format!("what binds is {limit}"),
        _ => "none of the limits binds alone".to_owned(),
    };
    format!(
        "{binding}. Of {TRIED} candidates are solved as it is {as_it_is}, with {}",
        numbers.join(", with ")
    )
}
