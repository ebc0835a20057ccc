//! Margins along the motions of a swing-up, and the candidates of its search.

use upright_design::motion::Transition;
use upright_design::rig::Rig;
use upright_plan::{Margin, RandomRuns, SolvedCandidate};

use super::{Axis, Curve, Figure, Panel};

/// Two panels for each motion, one for pushes against each link's angle and one along it, with a curve for each link.
pub fn margins_figure(title: &str, motions: &[(Transition, Vec<Margin>)]) -> Figure {
    let panel = |transition: &Transition, margins: &[Margin], side: usize| {
        let label = format!("{transition}: push {} (N)", ["against", "along"][side]);
        let links = margins.first().map_or(0, |margin| margin.links_n.len());
        (0..links).fold(Panel::new(Axis::linear("time (s)"), Axis::log(label)), |panel, link| {
            // A margin of 0 cannot be shown on a logarithmic axis.
            let point = |margin: &Margin| {
                let size = margin.links_n[link][side];
                [margin.at_s, if size > 0.0 { size } else { f64::NAN }]
            };
            let points = margins.iter().map(point).collect();
            panel.with(Curve::line(format!("link {}", link + 1), link, points))
        })
    };
    let panels =
        motions.iter().flat_map(|(transition, margins)| [0, 1].map(|side| panel(transition, margins, side)));
    panels.fold(Figure::new(title), Figure::with)
}

/// Largest force or acceleration, use of the rail, random runs that arrive, and fragility over the duration, a point
/// for each candidate.
pub fn trade_figure(title: &str, solved: &[SolvedCandidate], rig: &Rig) -> Figure {
    let durations = solved.iter().map(|one| one.duration_s);
    let (shortest, longest) =
        (durations.clone().fold(f64::INFINITY, f64::min), durations.fold(0.0, f64::max));
    let duration = || {
        let x = Axis::linear("duration (s)");
        if shortest <= longest { x.range(0.98 * shortest, 1.02 * longest) } else { x }
    };
    let arrive = |runs: fn(&SolvedCandidate) -> &RandomRuns| {
        solved.iter().map(|one| [one.duration_s, percent(runs(one))]).collect::<Vec<_>>()
    };
    let panel = |y: Axis, value: fn(&SolvedCandidate) -> f64| {
        let points = |is_robust: bool| -> Vec<[f64; 2]> {
            let of_group = solved.iter().filter(|one| (percent(&one.wider) >= ROBUST_PERCENT) == is_robust);
            of_group.map(|one| [one.duration_s, value(one)]).collect()
        };
        Panel::new(duration(), y)
            .with(Curve::markers(
                format!("at least {ROBUST_PERCENT} % arrive with twice the errors"),
                1,
                points(true),
            ))
            .with(Curve::markers("fewer", 0, points(false)))
    };
    Figure::new(title)
        .with(panel(Axis::linear(format!("largest {}", rig.input_quantity().title())), |one| one.input))
        .with(panel(Axis::linear(format!("farthest ({})", rig.output_quantity().unit)), |one| one.position_m))
        .with(
            Panel::new(duration(), Axis::linear("runs that arrive (%)").range(-5.0, 105.0))
                .with(Curve::markers("with the errors of [swing_up]", 2, arrive(|one| &one.runs)))
                .with(Curve::markers("with twice the errors", 3, arrive(|one| &one.wider))),
        )
        .with(panel(Axis::log("fragility"), |one| one.score))
}

/// A candidate is robust if at least this share of the random runs with twice the errors arrive (%).
const ROBUST_PERCENT: f64 = 90.0;

/// Share of the random runs that arrive (%).
fn percent(runs: &RandomRuns) -> f64 {
    100.0 * runs.arrived as f64 / runs.runs.max(1) as f64
}
