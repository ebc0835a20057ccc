//! The least ripple over multiples of the tolerances.

use upright::table::Law;
use upright_design::rig::Quantity;
use upright_trust::robust::{Front, FrontPoint};

use super::{Axis, Curve, Figure, Panel};

/// One curve for each law. A multiple that no choice survives interrupts the lines.
pub fn front_figure(front: &Front, input: Quantity, title: &str) -> Figure {
    let ends = front.0.iter().map(|point| point.scale);
    let largest = ends.fold(0.0, f64::max);
    let x = Axis::linear("multiple of the tolerances").range(0.0, 1.05 * largest);
    let y = Axis::linear(format!("predicted ripple of the {} ({} rms)", input.name, input.unit));
    let mut panel = Panel::new(x, y);
    for (number, law) in Law::ALL.into_iter().enumerate() {
        let ripple = |point: &FrontPoint| {
            let mut laws = point.best.iter().flat_map(|best| &best.laws);
            laws.find(|one| one.law == law).map_or(f64::NAN, |one| one.ripple_n)
        };
        let points: Vec<[f64; 2]> = front.0.iter().map(|point| [point.scale, ripple(point)]).collect();
        if points.iter().any(|point| point[1].is_finite()) {
            // Number 0 is for the crosses.
            panel = panel.with(Curve::line(law.to_string(), 1 + number, points.clone()));
            panel = panel.with(Curve::markers("", 1 + number, points));
        }
    }
    Figure::new(title).with(panel)
}
