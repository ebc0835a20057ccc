//! Rows from runs against the nonlinear plant.

use super::quantity::Values::{Each, One};
use super::quantity::{TrustQuantity, force, input, is_chain, number, signs};
use crate::verify::{LawTrust, Outcome, PushSurvival};
use upright_design::rig::Rig;

pub(super) const QUANTITIES: &[TrustQuantity] = &[
    TrustQuantity {
        name: "largest tilt, ",
        meaning: "largest initial angle from the vertical of this link alone, all others vertical, from which the loop \
                  recovers",
        values: Each(tilts),
    },
    TrustQuantity {
        name: "largest tilt, all links",
        meaning: "the same for all links at once, in the combination of sides with the smallest angle",
        values: One(|_, law| {
            let worst = law.attraction.as_ref()?.worst.as_ref()?;
            let (size, sides) = (number(worst.edge.size), signs(&worst.signs));
            Some(format!("{size} rad, sides {sides}, of {} combinations", worst.tried))
        }),
    },
    TrustQuantity {
        name: "largest ungoverned step",
        meaning: "largest step of the set-point without the governor; 2 m is the largest tried",
        values: One(|rig, law| {
            let step = law.attraction.as_ref()?.raw_step.as_ref()?;
            let largest = if step.at_largest_tried { " (largest tried)" } else { "" };
            let m = if is_chain(rig) { " m" } else { "" };
            let peak = force(rig, step.peak_force_n);
            Some(format!("{}{m}{largest}, peak {} {peak}", number(step.size), input(rig).0))
        }),
    },
    TrustQuantity {
        name: "push, ",
        meaning: "horizontal force at the cart or at the end of a link, for 50 ms and for 0.5 s, from which the controller \
                  alone falls, from which the firmware turns the motor off, and its fault",
        values: Each(|_, law| pushes(law)),
    },
    TrustQuantity {
        name: "coarsest encoders",
        meaning: "how many times coarser all encoders may be, with gains redesigned for them",
        values: One(|_, law| {
            let encoder = law.coarsest_encoder.as_ref()?;
            let factor = encoder.factor.map_or("not even the rig's own".to_owned(), |factor| {
                format!("{} times coarser", number(factor))
            });
            let counts: Vec<String> = encoder.counts_per_rev.iter().map(|&counts| number(counts)).collect();
            Some(format!("{factor} (links: {} counts per turn)", counts.join(" ")))
        }),
    },
    TrustQuantity {
        name: "mass errors",
        meaning: "every combination of too heavy and too light cart and links, 10 s with disturbances, the table unchanged",
        values: One(|_, law| {
            let corners = law.corners.as_ref()?;
            let percent = number(corners.percent);
            Some(format!("±{percent} %: {} of {} combinations survive", corners.survived, corners.corners))
        }),
    },
    TrustQuantity {
        name: "worst mass errors",
        meaning: "the combination that falls first or, if none falls, has the largest angle",
        values: One(|rig, law| {
            let weakest = &law.corners.as_ref()?.weakest;
            let (masses, end) = (signs(&weakest.signs), end(&weakest.outcome));
            let cart = if weakest.signs.len() > rig.links() { "cart, then " } else { "" };
            Some(format!("{masses} ({cart}links: + heavier, - lighter){end}"))
        }),
    },
    TrustQuantity {
        name: "most critical mass",
        meaning: "the mass with the smallest tolerance when it alone is wrong",
        values: One(|_, law| {
            let critical = law.mass_tolerances.first()?;
            let (lighter, heavier) = (number(critical.lighter_percent), number(critical.heavier_percent));
            Some(format!("{}: alone -{lighter} % to +{heavier} %", critical.mass))
        }),
    },
    TrustQuantity {
        name: "random plants",
        meaning: "Monte Carlo: masses, lengths and inertias (by spread_percent) and friction (±20 %) drawn at random, with \
                  the 95 % interval of the share that survives (Wilson): 200 of 200 is not 100 %",
        values: One(|rig, law| {
            let runs = law.monte_carlo.as_ref()?;
            let [low, high] = runs.interval.map(|share| 100.0 * share);
            let spread = number(rig.verify.spread_percent);
            let share = 100.0 * runs.success_rate;
            let (survived, made) = (runs.survived, runs.runs);
            let end = runs.worst.as_ref().map_or(String::new(), |worst| end(&worst.outcome));
            Some(format!(
                "±{spread} %: {survived} of {made} survive ({share:.1} %, 95 % interval {low:.1} to {high:.1} %){end}"
            ))
        }),
    },
];

/// How a run ended that did not survive; empty for one that did.
fn end(outcome: &Outcome) -> String {
    outcome.fall.as_ref().map_or(String::new(), |fall| format!("; {fall}"))
}

/// A row for the cart and for each link, with both durations.
fn pushes(law: &LawTrust) -> Vec<(String, String)> {
    let at =
        |force_n: Option<f64>| force_n.map_or("no force tried".to_owned(), |n| format!("{} N", number(n)));
    let text = |push: &PushSurvival| {
        let (falls, off) = (at(push.falls_at_n), at(push.turned_off_at_n));
        let by = push.ended_by.map_or(String::new(), |kind| format!(" ({kind})"));
        format!("{} s: falls at {falls}, motor off at {off}{by}", number(push.duration_s))
    };
    let of_body = law.pushes.chunk_by(|one, other| one.body == other.body);
    let row = |pushes: &[PushSurvival]| {
        let name = match pushes[0].body {
            0 => "cart".to_owned(),
            link => format!("end of link {link}"),
        };
        (name, pushes.iter().map(text).collect::<Vec<_>>().join("; "))
    };
    of_body.map(row).collect()
}

fn tilts(rig: &Rig, law: &LawTrust) -> Vec<(String, String)> {
    let tilts = law.attraction.iter().flat_map(|attraction| &attraction.tilts);
    let row = |tilt: &crate::verify::Tilt| {
        let (size, degrees) = (number(tilt.edge.size), tilt.edge.size.to_degrees());
        let peak = force(rig, tilt.edge.peak_force_n);
        let value = format!("{size} rad ({degrees:.2}°), peak {} {peak}", input(rig).0);
        (format!("link {}", tilt.link), value)
    };
    tilts.map(row).collect()
}
