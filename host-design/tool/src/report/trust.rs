//! The trust report as a table: one column for each law.

use super::number::number;
use upright_design::rig::Rig;
use upright_design::verify::{LawTrust, TrustReport};

/// One line: what, and its value for each law.
pub(super) struct Row {
    pub(super) name: String,
    pub(super) values: Vec<String>,
}

/// A requirement and what was found.
pub(super) struct CheckRow {
    pub(super) holds: bool,
    pub(super) law: &'static str,
    pub(super) requirement: &'static str,
    pub(super) found: String,
    pub(super) required: String,
}

pub(super) fn checks(report: &TrustReport) -> Vec<CheckRow> {
    let row = |check: &upright_design::verify::Check| CheckRow {
        holds: check.holds,
        law: if check.law == "lqr" { "LQR" } else { "Pole placement" },
        requirement: check.requirement,
        found: check.found.map_or(if check.holds { "no limit" } else { "none" }.to_owned(), number),
        required: number(check.required),
    };
    report.checks.iter().map(row).collect()
}

/// How a value is found, if a law has it.
type Value = Box<dyn Fn(&LawTrust) -> Option<String>>;

pub(super) fn rows(rig: &Rig, report: &TrustReport) -> Vec<Row> {
    let mut lines: Vec<(String, Value)> = Vec::new();
    let mut line = |name: &str, value: Value| lines.push((name.to_owned(), value));
    line("spectral radius", Box::new(|law| Some(format!("{:.6}", law.linear.spectral_radius))));
    line(
        "gain margin",
        Box::new(|law| {
            let margins = law.linear.margins.as_ref()?;
            let highest = margins.highest_gain.map_or("any".to_owned(), number);
            Some(format!("{} to {highest}", number(margins.lowest_gain)))
        }),
    );
    line(
        "phase margin",
        Box::new(|law| {
            let margin = law.linear.margins.as_ref()?.phase_margin_rad;
            Some(margin.map_or("no limit".to_owned(), |phase| format!("{}°", number(phase.to_degrees()))))
        }),
    );
    line(
        "delay margin",
        Box::new(|law| {
            let margins = law.linear.margins.as_ref()?;
            Some(match (margins.delay_margin_s, margins.delay_margin_ticks) {
                (Some(s), Some(ticks)) => format!("{} ms = {} ticks", number(1e3 * s), number(ticks)),
                _ => "no limit".to_owned(),
            })
        }),
    );
    line(
        "peak sensitivity Ms",
        Box::new(|law| {
            let margins = law.linear.margins.as_ref()?;
            Some(format!(
                "{} at {} rad/s",
                number(margins.peak_sensitivity),
                number(margins.peak_sensitivity_rad_per_s)
            ))
        }),
    );
    line("disk margin", Box::new(|law| Some(number(law.linear.margins.as_ref()?.disk_margin))));
    line(
        "longest stable tick",
        Box::new(|law| {
            let longest = law.linear.tick.as_ref()?.longest_stable_s;
            Some(longest.map_or("30 ticks and more".to_owned(), |s| format!("{} ms", number(1e3 * s))))
        }),
    );
    line(
        "tolerated jitter",
        Box::new(|law| Some(format!("{} ms", number(1e3 * law.linear.tick.as_ref()?.jitter_s)))),
    );
    line(
        "largest rounding of a gain to f32",
        Box::new(|law| Some(format!("{} ULP", number(law.linear.rounding.as_ref()?.gain_ulp)))),
    );
    line(
        "f32 against f64, force",
        Box::new(|law| Some(format!("{} N", number(law.linear.rounding.as_ref()?.force_difference_n?)))),
    );
    line(
        "ripple of the force, predicted",
        Box::new(|law| Some(format!("{} N rms", number(law.linear.noise.as_ref()?.last()?.force_n)))),
    );
    line(
        "ripple of the force, simulated",
        Box::new(|law| Some(format!("{} N rms", number(law.noise_run.as_ref()?.force_rms_n)))),
    );
    let output = rig.output();
    line(
        "ripple of the cart, simulated",
        Box::new(move |law| {
            Some(format!("{} mm rms", number(1e3 * law.noise_run.as_ref()?.state_rms[output])))
        }),
    );
    for link in 0..rig.states() / 2 {
        line(
            &format!("largest tilt of link {} alone", link + 1),
            Box::new(move |law| {
                let size = law.attraction.as_ref()?.tilts.get(link)?.edge.size;
                Some(format!("{} rad = {}°", number(size), number(size.to_degrees())))
            }),
        );
    }
    line(
        "largest tilt, worst combination",
        Box::new(|law| {
            let worst = law.attraction.as_ref()?.worst.as_ref()?;
            let sides: String = worst.signs.iter().map(|&sign| if sign > 0 { '+' } else { '−' }).collect();
            Some(format!("{} rad, sides {sides}", number(worst.edge.size)))
        }),
    );
    line(
        "largest step without governor",
        Box::new(|law| {
            let step = law.attraction.as_ref()?.raw_step.as_ref()?;
            Some(format!(
                "{} m{}",
                number(step.size),
                if step.at_largest_tried { " (largest tried)" } else { "" }
            ))
        }),
    );
    line(
        "encoders may be coarser by",
        Box::new(|law| {
            let factor = law.coarsest_encoder.as_ref()?.factor;
            Some(factor.map_or("not even the rig's own".to_owned(), |factor| format!("× {}", number(factor))))
        }),
    );
    line(
        "wrong masses",
        Box::new(|law| {
            let corners = law.corners.as_ref()?;
            Some(format!(
                "±{} %: {} of {} corners stand",
                number(corners.percent),
                corners.stand,
                corners.corners
            ))
        }),
    );
    line(
        "weigh best",
        Box::new(|law| {
            let mass = law.mass_tolerances.first()?;
            Some(format!(
                "{}: −{} % to +{} %",
                mass.mass,
                number(mass.lighter_percent),
                number(mass.heavier_percent)
            ))
        }),
    );
    let spread = rig.verify.spread_percent;
    line(
        "random plants",
        Box::new(move |law| {
            let runs = law.monte_carlo.as_ref()?;
            let [low, high] = runs.interval.map(|share| 100.0 * share);
            Some(format!(
                "±{} %: {} of {} stand (95 % interval {low:.1} to {high:.1} %)",
                number(spread),
                runs.stood,
                runs.runs
            ))
        }),
    );
    let row = |(name, value): &(String, Value)| {
        let found: Vec<Option<String>> = report.laws.iter().map(value).collect();
        let values = found.iter().map(|value| value.clone().unwrap_or_else(|| "—".to_owned())).collect();
        found.iter().any(Option::is_some).then(|| Row { name: name.clone(), values })
    };
    lines.iter().filter_map(row).collect()
}
