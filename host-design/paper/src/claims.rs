//! The paper's claims about the two laws, compared with what was measured.

use upright::table::Law;

use super::{Loop, Robustness};
use upright_tool::markdown::markdown_table;
use upright_trust::verify::Margins;

/// The last section of the summary.
pub(crate) fn claims(all: &[Robustness]) -> String {
    let mut text = "## \"Less frequency\" and \"more robust\": what the paper says of the LQR, measured\n\n\
        At rest under the disturbances of figures 7 and 8, the same numbers for every line, 127 s: root mean square and mean\n\
        frequency, weighted by power (Welch: Hann windows of 8.192 s, half overlapping). One run each, so differences of a few\n\
        percent mean nothing.\n\n"
        .to_owned();
    let header = ["law", "loop", "signal", "rms", "mean (Hz)", "half below (Hz)", "95 % below (Hz)"];
    let mut rows = Vec::new();
    for one in all {
        for ripple in &one.ripples {
            let (scale, unit) = match ripple.signal.as_str() {
                "u" => (1.0, "N"),
                "x" => (1e3, "mm"),
                _ => (1e3, "mrad"),
            };
            rows.push(vec![
                one.law.to_string(),
                one.kind.name().to_owned(),
                ripple.signal.clone(),
                format!("{:.3} {unit}", scale * ripple.rms),
                format!("{:.2}", ripple.bandwidth.mean_hz),
                format!("{:.2}", ripple.bandwidth.median_hz),
                format!("{:.2}", ripple.bandwidth.most_hz),
            ]);
        }
    }
    text += &markdown_table(&header, 3, &rows);
    text += "\nMargins at the force, and what the force does in these runs:\n\n";
    let rows: Vec<Vec<String>> = all.iter().map(margin_row).collect();
    let header = [
        "law",
        "loop",
        "gain margin",
        "phase (°)",
        "delay (ms)",
        "peak S",
        "disk margin",
        "peak force (N)",
        "mean u² (N²)",
    ];
    text += &markdown_table(&header, 2, &rows);
    text += "\nLower frequency, rms, force and effort are better, and larger margins.\n\n";
    for kind in Loop::ALL {
        let of = |law: Law| all.iter().find(|one| one.law == law && one.kind == kind);
        if let (Some(lqr), Some(placement)) = (of(Law::Lqr), of(Law::PolePlacement)) {
            text += &comparison(lqr, placement);
        }
    }
    text
}

fn margin_row(one: &Robustness) -> Vec<String> {
    let of = |value: &dyn Fn(&Margins) -> String| one.margins.as_ref().map_or("-".to_owned(), value);
    let number = |value: Option<f64>, decimals: usize| {
        value.map_or("none".to_owned(), |value| format!("{value:.decimals$}"))
    };
    let highest =
        |margins: &Margins| margins.highest_gain.map_or("∞".to_owned(), |gain| format!("{gain:.2}"));
    vec![
        one.law.to_string(),
        one.kind.name().to_owned(),
        of(&|margins| format!("{:.2} to {}", margins.lowest_gain, highest(margins))),
        of(&|margins| number(margins.phase_margin_rad.map(f64::to_degrees), 1)),
        of(&|margins| number(margins.delay_margin_s.map(|delay| 1e3 * delay), 2)),
        of(&|margins| format!("{:.2}", margins.peak_sensitivity)),
        of(&|margins| format!("{:.2}", margins.disk_margin)),
        format!("{:.3}", one.peak_force_n),
        format!("{:.4}", one.effort_n2),
    ]
}

/// Quantities that differ by less than this factor count as equal: runs with different seeds differ as much.
const ALIKE: f64 = 1.1;

/// Lists where the LQR is better than pole placement in this loop, where it is worse, and where they are alike.
fn comparison(lqr: &Robustness, placement: &Robustness) -> String {
    let mut groups: [Vec<String>; 3] = Default::default();
    // `gain`: how many times better the LQR is.
    let mut weigh = |what: &str, gain: f64| {
        let group = if gain > ALIKE {
            0
        } else if gain * ALIKE < 1.0 {
            1
        } else {
            2
        };
        groups[group].push(what.to_owned());
    };
    for (ours, theirs) in lqr.ripples.iter().zip(&placement.ripples) {
        let what = format!("mean frequency of {}", ours.signal);
        weigh(&what, theirs.bandwidth.mean_hz / ours.bandwidth.mean_hz);
    }
    for (ours, theirs) in lqr.ripples.iter().zip(&placement.ripples) {
        weigh(&format!("rms of {}", ours.signal), theirs.rms / ours.rms);
    }
    if let (Some(ours), Some(theirs)) = (&lqr.margins, &placement.margins) {
        weigh("how far the gain may fall", theirs.lowest_gain / ours.lowest_gain);
        let each = |of: fn(&Margins) -> Option<f64>| Some(of(ours)? / of(theirs)?);
        for (what, gain) in [
            ("how far the gain may grow", each(|margins| margins.highest_gain)),
            ("phase margin", each(|margins| margins.phase_margin_rad)),
            ("delay margin", each(|margins| margins.delay_margin_s)),
            ("disk margin", each(|margins| Some(margins.disk_margin))),
        ] {
            if let Some(gain) = gain {
                weigh(what, gain);
            }
        }
    }
    weigh("peak force", placement.peak_force_n / lqr.peak_force_n);
    weigh("mean u²", placement.effort_n2 / lqr.effort_n2);
    let [better, worse, alike] = groups.map(|group| group.join(", "));
    format!(
        "- {}\n  - the LQR does better, by 10 % or more, in: {better}\n  - pole placement does in: {worse}\n  - alike: {alike}\n",
        lqr.kind.name()
    )
}
