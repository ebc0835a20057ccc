//! What would help when there is no motion: the same search with one limit relaxed.

use super::search::{Request, is_solvable};
use super::setting::Setting;
use super::way::Way;
use crate::parallel;

/// Candidates tried with each relaxation.
const TRIED: u64 = 12;
/// Factors by which a limit is relaxed, one after the other, until a candidate is solved.
const FACTORS: [f64; 2] = [1.4, 2.0];

/// A limit of plans.
struct Limit {
    name: &'static str,
    unit: &'static str,
    /// Its largest value in a plan; none if the rig has no such limit.
    value: fn(&Request) -> Option<f64>,
    relax: fn(&mut Request, f64),
}

const LIMITS: [Limit; 4] = [
    Limit {
        name: "rail",
        unit: "m to each side",
        value: |request| Some(request.rail_m[1]),
        relax: |request, factor| request.rail_m = request.rail_m.map(|end| factor * end),
    },
    Limit {
        name: "force",
        unit: "N",
        value: |request| Some(request.force_n[1]),
        relax: |request, factor| {
            request.force_n = request.force_n.map(|force| factor * force);
            request.bounds.motor = request.bounds.motor.map(|[stall, loss]| [factor * stall, loss]);
        },
    },
    Limit {
        name: "speed of the cart",
        unit: "m/s",
        value: |request| request.bounds.speed_m_per_s,
        relax: |request, factor| {
            request.bounds.speed_m_per_s = request.bounds.speed_m_per_s.map(|speed| factor * speed);
        },
    },
    Limit {
        name: "duration",
        unit: "s",
        value: |request| Some(request.duration_s[1]),
        relax: |request, factor| request.duration_s = request.duration_s.map(|duration| factor * duration),
    },
];

/// The limit that binds: that of which the smallest factor helps; and what helps else, with the values that plans then
/// have.
pub(super) fn advice(setting: &Setting<'_>, request: &Request, way: Way) -> String {
    advice_from(setting, request, way, TRIED)
}

fn advice_from(setting: &Setting<'_>, request: &Request, way: Way, tried: u64) -> String {
    let solvable =
        |request: &Request| parallel::any(0..tried, |number| is_solvable(setting, request, way, number));
    let (mut helps, mut no_help): (Vec<(f64, &str, String)>, Vec<String>) = Default::default();
    for Limit { name, unit, value, relax } in LIMITS {
        let Some(value) = value(request) else { continue };
        let relaxed = |factor: f64| {
            let mut request = request.clone();
            relax(&mut request, factor);
            request
        };
        let text = |factor: f64| format!("{factor} times the {name} ({:.3} {unit})", factor * value);
        match FACTORS.into_iter().find(|&factor| solvable(&relaxed(factor))) {
            Some(factor) => helps.push((factor, name, text(factor))),
            None => no_help.push(text(FACTORS[FACTORS.len() - 1])),
        }
    }
    helps.sort_by(|(a, ..), (b, ..)| a.total_cmp(b));
    let texts: Vec<String> = helps.iter().map(|(.., text)| text.clone()).collect();
    let mut advice = match helps.first() {
        Some((_, name, _)) => {
            format!("what binds is the {name}: one of {tried} is solved with {}", texts.join(", or with "))
        }
        None => "no limit binds alone".to_owned(),
    };
    if !no_help.is_empty() {
        advice += &format!("; none of {tried} is solved with {}", no_help.join(", or with "));
    }
    advice
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::Rig;

    #[test]
    fn on_a_short_rail_more_time_helps_and_more_force_does_not() {
        let mut rig = Rig::from_path("../../rigs/single-quanser-ip02.toml".as_ref()).unwrap();
        rig.swing_up.get_or_insert_default().rail_m = Some(0.1);
        let setting = Setting::of(&rig).unwrap();
        let request = Request::of(&setting);
        // Without help, the same candidates are not solved.
        assert!((0..2).all(|number| !is_solvable(&setting, &request, Way::Up, number)));
        let text = advice_from(&setting, &request, Way::Up, 2);
        println!("{text}");
        let time = "what binds is the duration: one of 2 is solved with 2 times the duration (10.227 s)";
        assert!(text.starts_with(time), "{text}");
        assert!(text.contains("none of 2 is solved with 2 times the rail (0.200 m to each side)"), "{text}");
        assert!(text.contains("2 times the force (23.400 N)"), "{text}");
    }
}
