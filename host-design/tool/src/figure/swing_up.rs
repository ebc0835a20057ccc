//! Margins along the motions of a swing-up, and what candidates of its search are like.

use upright_design::swing_up::{Margin, Solved, Way};

use super::{Axis, Curve, Figure, Panel};

/// A panel for each motion, with a curve for each link.
pub fn margins_figure(title: &str, motions: &[(Way, Vec<Margin>)]) -> Figure {
    let panel = |(way, margins): &(Way, Vec<Margin>)| {
        let (x, y) = (Axis::linear("time (s)"), Axis::linear(format!("{way}: margin (°)")).range(0.0, 21.0));
        let links = margins.first().map_or(0, |margin| margin.links_rad.len());
        (0..links).fold(Panel::new(x, y), |panel, link| {
            let point = |margin: &Margin| [margin.at_s, margin.links_rad[link].to_degrees()];
            let points = margins.iter().map(point).collect();
            panel.with(Curve::line(format!("link {}", link + 1), link, points))
        })
    };
    motions.iter().map(panel).fold(Figure::new(title), Figure::with)
}

/// Largest force and fragility over the duration, a point for each candidate.
pub fn trade_figure(title: &str, solved: &[Solved]) -> Figure {
    let panel =
        |label: &str, value: fn(&Solved) -> f64| {
            let y = if label == FRAGILITY { Axis::log(label) } else { Axis::linear(label) };
            let points = |is_robust: bool| -> Vec<[f64; 2]> {
                let of_group = solved.iter().filter(|one| (one.score <= limit(solved)) == is_robust);
                of_group.map(|one| [one.duration_s, value(one)]).collect()
            };
            let durations = solved.iter().map(|one| one.duration_s);
            let (shortest, longest) =
                (durations.clone().fold(f64::INFINITY, f64::min), durations.fold(0.0, f64::max));
            let x = Axis::linear("duration (s)");
            let x = if shortest <= longest { x.range(0.98 * shortest, 1.02 * longest) } else { x };
            Panel::new(x, y)
                .with(Curve::markers("the more robust half", 1, points(true)))
                .with(Curve::markers("the others", 0, points(false)))
        };
    Figure::new(title)
        .with(panel("largest force (N)", |one| one.force_n))
        .with(panel("farthest (m)", |one| one.position_m))
        .with(panel(FRAGILITY, |one| one.score))
}

const FRAGILITY: &str = "fragility";

/// The median fragility.
fn limit(solved: &[Solved]) -> f64 {
    let mut scores: Vec<f64> = solved.iter().map(|one| one.score).collect();
    scores.sort_by(f64::total_cmp);
    scores.get(scores.len().saturating_sub(1) / 2).copied().unwrap_or(0.0)
}
