//! Bode and Nyquist plots of the sampled loop, broken at the force.

use core::f64::consts::PI;

use super::number::number;
use crate::figure::{Axis, Curve, Figure, Panel};
use upright_design::design::Certified;
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_trust::verify::{LinearReport, LoopModel, Margins};

/// The loop gain L at one frequency.
struct Point {
    /// Frequency (rad/s).
    omega: f64,
    /// Re L, Im L.
    l: [f64; 2],
    /// Phase, unwrapped: without jumps of 360° (°).
    phase: f64,
}

impl Point {
    fn gain(&self) -> f64 {
        self.l[0].hypot(self.l[1])
    }
}

/// Bode plots and Nyquist plots of all stable loops, with their margins marked.
pub(super) fn figures(
    rig: &Rig,
    certified: &Certified,
    table: &TableValues,
    reports: &[&LinearReport],
) -> [Vec<Figure>; 2] {
    let (mut bodes, mut nyquists) = (Vec::new(), Vec::new());
    for &report in reports {
        let model = LoopModel::<f64>::as_it_runs(certified, table, report.law);
        let (Some(margins), Some(model)) = (&report.margins, model) else { continue };
        let points = sweep(&model, report, rig.tick.period_s);
        let title = |what: &str| format!("{}: {what}, {}", rig.name, report.law.title());
        bodes.push(bode(&points, margins, title("Bode plot")));
        nyquists.push(nyquist(&points, margins, title("Nyquist plot")));
    }
    [bodes, nyquists]
}

/// L(e^jωT) from a hundredth of the slowest pole to just below half the sampling rate, where |L| of many loops is 0.
fn sweep(model: &LoopModel<f64>, report: &LinearReport, tick: f64) -> Vec<Point> {
    const POINTS: usize = 3000;
    let distance = |pole: &[f64; 2]| (pole[0].hypot(pole[1]).ln()).hypot(pole[1].atan2(pole[0]));
    let slowest = report.poles.iter().map(distance).filter(|d| *d > 0.0).fold(PI, f64::min);
    let low = (1e-2 * slowest).max(1e-9);
    let mut points: Vec<Point> = Vec::new();
    for index in 0..=POINTS {
        let omega = low * (0.99 * PI / low).powf(index as f64 / POINTS as f64);
        let Some(response) = model.response(omega) else { continue };
        let l = response.l();
        let wrapped = l.im.atan2(l.re).to_degrees();
        let phase = match points.last() {
            Some(before) => wrapped + 360.0 * ((before.phase - wrapped) / 360.0).round(),
            None => wrapped,
        };
        points.push(Point { omega: omega / tick, l: [l.re, l.im], phase });
    }
    points
}

/// L = -1/g: the points at which a factor g on the force makes the loop unstable.
fn gain_margins(margins: &Margins) -> Vec<(String, f64)> {
    let lower = (margins.lowest_gain > 0.0)
        .then(|| ("× ".to_owned() + &number(margins.lowest_gain), margins.lowest_gain));
    let upper = margins.highest_gain.map(|gain| ("× ".to_owned() + &number(gain), gain));
    let named = |(text, gain): (String, f64)| (format!("gain margin {text}"), gain);
    lower.into_iter().chain(upper).map(named).collect()
}

fn nearest(points: &[Point], distance: impl Fn(&Point) -> f64) -> Option<&Point> {
    points.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// The crossover |L| = 1 with the smallest phase margin.
fn critical_crossover<'a>(points: &'a [Point], margins: &Margins) -> Option<&'a Point> {
    let at = |omega: &f64| nearest(points, |point| (point.omega / omega).ln().abs());
    let spare = |point: &&Point| {
        let from_critical = (point.phase - 180.0).rem_euclid(360.0);
        from_critical.min(360.0 - from_critical)
    };
    margins.crossovers_rad_per_s.iter().filter_map(at).min_by(|a, b| spare(a).total_cmp(&spare(b)))
}

fn phase_margin(margins: &Margins) -> String {
    margins
        .phase_margin_rad
        .map_or("phase margin".to_owned(), |phase| format!("phase margin {}°", number(phase.to_degrees())))
}

fn bode(points: &[Point], margins: &Margins, title: String) -> Figure {
    let curve =
        |value: &dyn Fn(&Point) -> f64| points.iter().map(|p| [p.omega, value(p)]).collect::<Vec<_>>();
    let ends = [points.first(), points.last()].map(|point| point.map_or(1.0, |point| point.omega));
    let frequency = || Axis::log("frequency (rad/s)").range(ends[0], ends[1]);
    let level = |name: &str, at: f64| Curve::limit(name, vec![[ends[0], at], [ends[1], at]]);
    let mut gain = Panel::new(frequency(), Axis::log("|L|"))
        .high(230)
        .with(level("|L| = 1", 1.0))
        .with(Curve::line("|L|", 0, curve(&Point::gain)));
    // Phase is known modulo 360°: the critical phase of every turn near the curve is marked.
    let (low, high) = points
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p.phase), high.max(p.phase)));
    let criticals = ((low + 180.0) / 360.0).floor() as i32..=((high + 180.0) / 360.0).ceil() as i32;
    let mut phase =
        Panel::new(frequency(), Axis::linear("phase of L (°)").range(low - 20.0, high + 20.0)).high(220);
    for turn in criticals {
        phase = phase.with(level("", 360.0 * f64::from(turn) - 180.0));
    }
    phase = phase.with(Curve::line("phase", 0, curve(&|point| point.phase)));
    for (number, (name, factor)) in gain_margins(margins).into_iter().enumerate() {
        let at = nearest(points, |point| (point.l[0] + 1.0 / factor).hypot(point.l[1]));
        if let Some(at) = at {
            gain = gain.with(Curve::markers(name, number + 1, vec![[at.omega, at.gain()]]));
            phase = phase.with(Curve::markers("", number + 1, vec![[at.omega, at.phase]]));
        }
    }
    if let Some(at) = critical_crossover(points, margins) {
        gain = gain.with(Curve::markers("", 3, vec![[at.omega, at.gain()]]));
        phase = phase.with(Curve::markers(phase_margin(margins), 3, vec![[at.omega, at.phase]]));
    }
    Figure::narrow(title).with(gain).with(phase)
}

fn nyquist(points: &[Point], margins: &Margins, title: String) -> Figure {
    let line = |sign: f64| points.iter().map(|point| [point.l[0], sign * point.l[1]]).collect::<Vec<_>>();
    let most = margins.lowest_gain.max(0.2).recip().clamp(1.0, 5.0) + 0.6;
    let mut panel = Panel::new(Axis::linear("Re L").range(-most, 1.2), Axis::linear("Im L").range(-1.6, 1.6))
        .high(430)
        .equal()
        .unit_circle()
        .with(around_critical(margins))
        .with(Curve::line("L, ω > 0", 0, line(1.0)))
        .with(Curve::line("ω < 0", 1, line(-1.0)))
        .with(Curve::markers("−1", 0, vec![[-1.0, 0.0]]));
    for (number, (name, factor)) in gain_margins(margins).into_iter().enumerate() {
        panel = panel.with(Curve::markers(name, number + 1, vec![[-1.0 / factor, 0.0]]));
    }
    if let Some(at) = critical_crossover(points, margins) {
        let both = [1.0, -1.0].map(|sign| [at.l[0], sign * at.l[1]]);
        panel = panel.with(Curve::markers(phase_margin(margins), 3, both.to_vec()));
    }
    Figure::narrow(title).with(panel)
}

/// The curve stays out of this circle about -1, of radius 1/Ms.
fn around_critical(margins: &Margins) -> Curve {
    let radius = 1.0 / margins.peak_sensitivity;
    let circle = (0..=180).map(|step| f64::from(2 * step).to_radians());
    let points = circle.map(|t| [radius * t.cos() - 1.0, radius * t.sin()]).collect();
    Curve::limit(format!("distance 1/Ms = {}", number(radius)), points)
}
