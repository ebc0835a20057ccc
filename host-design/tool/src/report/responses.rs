//! Runs over time.

use super::number::number;
use super::runs::{LawRun, Scene, law_name};
use crate::figure::{Axis, Curve, Figure, Panel};
use upright_design::rig::{PlantDescription, Rig};
use upright_design::simulate::Sample;

/// One figure for each law, all on the same scale.
pub(super) fn figures(rig: &Rig, scene: &Scene) -> Vec<Figure> {
    let mut figures: Vec<Figure> = scene.runs.iter().map(|run| figure(rig, scene, run)).collect();
    Figure::same_scale(&mut figures);
    figures
}

/// Position, angles, rates and force, one below the other, with their limits.
fn figure(rig: &Rig, scene: &Scene, run: &LawRun) -> Figure {
    let curve = |value: &dyn Fn(&Sample<&[f64]>) -> f64| -> Vec<[f64; 2]> {
        run.trace.samples().map(|sample| [sample.t, value(&sample)]).collect()
    };
    // A run that falls is shorter; the axis is that of the scene.
    let ends = scene.runs.iter().filter_map(|run| run.trace.samples().last().map(|sample| sample.t));
    let end = ends.fold(1e-9, f64::max);
    let panel =
        |label: &str| Panel::new(Axis::linear("time (s)").range(0.0, end), Axis::linear(label)).high(178);
    let limits = |name: &str, limits: [f64; 2]| {
        let ends = limits.map(|limit| [[0.0, limit], [end, limit]]);
        let points = [ends[0].as_slice(), &[[f64::NAN; 2]], &ends[1]].concat();
        Curve::limit(name, points)
    };
    let title = format!("{}: {}, {}", rig.name, scene.name.to_lowercase(), law_name(run.law));
    let output = rig.output();
    let PlantDescription::Chain(chain) = &rig.plant else {
        let position = panel("output")
            .with(Curve::reference("set-point", curve(&|s| s.target)))
            .with(Curve::line(format!("state {output}"), 0, curve(&|s| s.state[output])));
        let others = (0..rig.states()).filter(|&state| state != output);
        let others = others.enumerate().fold(panel("other states"), |panel, (number, state)| {
            panel.with(Curve::line(format!("{state}"), number, curve(&|s| s.state[state])))
        });
        let input = panel("input").with(Curve::line("u", 0, curve(&|s| s.force)));
        return Figure::narrow(title).with(position).with(others).with(input);
    };
    let rail = chain.cart.travel_m;
    let mut position = panel("position (m)").with(Curve::reference("set-point", curve(&|s| s.target)));
    if run.trace.samples().any(|sample| sample.setpoint != sample.target) {
        position = position.with(Curve::line("governed", 1, curve(&|s| s.setpoint)));
    }
    let position = position
        .with(Curve::line("x", 0, curve(&|s| s.state[0])))
        .with(limits(&format!("rail {} to {} m", number(rail[0]), number(rail[1])), rail));
    let joints = 0..chain.links.len();
    let angles = joints.clone().fold(panel("angles (°)"), |panel, joint| {
        let points = curve(&|s| s.state[2 + 2 * joint].to_degrees());
        panel.with(Curve::line(format!("θ{}", joint + 1), joint, points))
    });
    let angles = match rig.limits.angle_rad {
        Some(limit) => {
            let limit = limit.to_degrees();
            angles.with(limits(&format!("limit ±{}°", number(limit)), [-limit, limit]))
        }
        None => angles,
    };
    let rates = joints.fold(panel("rates (°/s)"), |panel, joint| {
        let points = curve(&|s| s.state[3 + 2 * joint].to_degrees());
        panel.with(Curve::line(format!("θ{}'", joint + 1), joint, points))
    });
    // A falling pendulum asks for a hundred times what there is: the rest should stay legible.
    let most = 2.0 * run.trace.samples().fold(0.0f64, |most, s| most.max(s.force.abs()));
    let force = panel("force (N)")
        .with(Curve::reference("asked for", curve(&|s| s.requested.clamp(-most, most))))
        .with(Curve::line("u", 0, curve(&|s| s.force)));
    let force = match rig.force_limit_n() {
        Some(limit) => force.with(limits(&format!("limit ±{} N", number(limit)), [-limit, limit])),
        None => force,
    };
    Figure::narrow(title).with(position).with(angles).with(rates).with(force)
}
