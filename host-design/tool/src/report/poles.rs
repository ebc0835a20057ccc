//! Pole plots.

use crate::figure::{Axis, Curve, Figure, Panel};
use upright_design::design::DesignPoles;
use upright_design::rig::Rig;
use upright_trust::verify::LinearReport;

/// The poles in the z-plane with the unit circle, and in the s-plane.
pub(super) fn figure(rig: &Rig, designed: &DesignPoles, report: &LinearReport) -> Figure {
    let [continuous, sampled] = designed.in_table(report.law);
    let points = |poles: Option<&Vec<[f64; 2]>>| poles.cloned().unwrap_or_default();
    let tick = rig.tick.period_s;
    // s = ln z / T; a pole at z = 0 has no place in the s-plane.
    let to_s = |&[re, im]: &[f64; 2]| [re.hypot(im).ln() / tick, im.atan2(re) / tick];
    let z = Panel::new(Axis::linear("Re z"), Axis::linear("Im z"))
        .high(400)
        .equal()
        .unit_circle()
        .with(Curve::markers("designed", 0, points(sampled)))
        .with(Curve::markers("whole loop in f32, as it runs", 1, report.poles.clone()));
    let s = Panel::new(Axis::linear("Re s (1/s)"), Axis::linear("Im s (1/s)"))
        .high(300)
        .with(Curve::limit("", vec![[0.0, -1e9], [0.0, 1e9]]))
        .with(Curve::markers("designed for continuous time", 0, points(continuous)))
        .with(Curve::markers("whole loop, ln z / T", 1, report.poles.iter().map(to_s).collect()));
    Figure::narrow(format!("{}: poles, {}", rig.name, report.law.title())).with(z).with(s)
}
