//! A run as a picture.

use upright_design::rig::{PlantDescription, Rig};
use upright_design::simulate::{Sample, Trace};

use super::{Axis, Curve, Figure, FigureError, Panel};

/// Position, angles and force of a run over time, one below the other, as an SVG document.
///
/// # Errors
/// [`FigureError`] from the drawing library.
pub fn run_svg(rig: &Rig, trace: &Trace, title: &str) -> Result<String, FigureError> {
    let curve = |value: &dyn Fn(&Sample<&[f64]>) -> f64| -> Vec<[f64; 2]> {
        trace.samples().map(|sample| [sample.t, value(&sample)]).collect()
    };
    let end = trace.samples().last().map_or(1.0, |sample| sample.t).max(1e-9);
    let panel =
        |label: &str| Panel::new(Axis::linear("time (s)").range(-0.01 * end, end), Axis::linear(label));
    let output = rig.output();
    let is_chain = matches!(rig.plant, PlantDescription::Chain(_));
    let (label, name) =
        if is_chain { ("position (m)", "cart".to_owned()) } else { ("output", format!("state {output}")) };
    let mut figure = Figure::new(title).with(
        panel(label)
            .with(Curve::reference("set-point", curve(&|s| s.target)))
            .with(Curve::line("governed", 1, curve(&|s| s.setpoint)))
            .with(Curve::line(name, 0, curve(&|s| s.state[output]))),
    );
    if let PlantDescription::Chain(chain) = &rig.plant {
        let angle = |link: usize| {
            let points = curve(&|s| s.state[2 + 2 * link].to_degrees());
            Curve::line(format!("θ{}", link + 1), link, points)
        };
        figure = figure.with((0..chain.links.len()).map(angle).fold(panel("angles (°)"), Panel::with));
    }
    // A falling pendulum asks for a hundred times what there is: the rest should stay legible.
    let most = 2.0 * trace.samples().fold(0.0f64, |most, s| most.max(s.force.abs()));
    let is_cut_off = trace.samples().any(|s| s.requested.abs() > most);
    let name = if is_cut_off { "asked for (cut off)" } else { "asked for" };
    figure
        .with(
            panel(if is_chain { "force (N)" } else { "input" })
                .with(Curve::reference(name, curve(&|s| s.requested.clamp(-most, most))))
                .with(Curve::line("applied", 0, curve(&|s| s.force))),
        )
        .svg()
}
