//! The runs of a scenario over time.

use super::runs::{LawRun, Scene};
use crate::figure::{Figure, run_figure};
use upright_design::rig::Rig;

/// One figure for each law, all with the same axes.
pub(super) fn figures(rig: &Rig, scene: &Scene) -> Vec<Figure> {
    // A run that falls is shorter; the time axis is that of the longest.
    let ends = scene.runs.iter().filter_map(|run| run.trace.samples().last().map(|sample| sample.t));
    let end_s = ends.fold(1e-9, f64::max);
    let figure = |run: &LawRun| {
        let title = format!("{}: {}, {}", rig.name, scene.name.to_lowercase(), run.law.title());
        run_figure(Figure::narrow(title), rig, &run.trace, end_s)
    };
    let mut figures: Vec<Figure> = scene.runs.iter().map(figure).collect();
    Figure::same_scale(&mut figures);
    figures
}
