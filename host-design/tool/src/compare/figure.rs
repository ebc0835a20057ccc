//! A comparison as a picture.

use super::candidate::ComparedRig;
use super::row::{ComparedRow, Fate, LawFigures, input};
use super::sweep::Sweep;
use crate::figure::{Axis, Curve, Figure, Panel};
use upright_design::rig::Rig;

/// Reads one figure of a row.
type FigureOf = fn(&LawFigures) -> Option<f64>;

/// The figures over the swept key; without a sweep, all runs over time in the same panels.
pub fn figure(rows: &[ComparedRow], candidates: &[ComparedRig], sweep: Option<&Sweep>) -> Figure {
    match sweep {
        Some(sweep) => over_key(rows, sweep),
        None => over_time(rows, candidates),
    }
}

/// Groups the rows by rig and law, in their order.
fn groups(rows: &[ComparedRow]) -> Vec<(String, Vec<&ComparedRow>)> {
    let several = rows.iter().any(|row| row.rig != rows[0].rig);
    let mut groups: Vec<(String, Vec<&ComparedRow>)> = Vec::new();
    for row in rows {
        let law = row.law;
        let name = if several { format!("{}, {law}", row.rig) } else { law.to_string() };
        match groups.iter_mut().find(|(found, _)| *found == name) {
            Some((_, group)) => group.push(row),
            None => groups.push((name, vec![row])),
        }
    }
    groups
}

fn over_key(rows: &[ComparedRow], sweep: &Sweep) -> Figure {
    let ends = sweep
        .values
        .iter()
        .copied()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
    let pad = if sweep.log { 0.0 } else { 0.02 * (ends[1] - ends[0]) };
    let x_axis = || {
        let axis = if sweep.log { Axis::log(sweep.key.as_str()) } else { Axis::linear(sweep.key.as_str()) };
        axis.range(ends[0] - pad, ends[1] + pad)
    };
    let groups = groups(rows);
    let title = if rows.iter().all(|row| row.rig == rows[0].rig) {
        rows.first().map_or("", |row| row.rig.as_str())
    } else {
        ""
    };
    let mut figure = Figure::new(title);
    let peak = format!("peak {}", input(rows));
    let panels: [(&str, FigureOf); 6] = [
        ("settled (s)", |figures| figures.settling_time_s),
        ("overshoot (%)", |figures| figures.overshoot_percent),
        ("peak angle (°)", |figures| figures.peak_angle_rad.map(f64::to_degrees)),
        (&peak, |figures| Some(figures.peak_force_n)),
        ("phase margin (°)", |figures| figures.phase_margin_rad.map(f64::to_degrees)),
        ("tilt (°)", |figures| figures.tilt_rad.map(f64::to_degrees)),
    ];
    for (index, (label, value)) in panels.into_iter().enumerate() {
        let of_run = index < 4;
        let mut panel = Panel::new(x_axis(), Axis::linear(label)).high(165);
        let mut lost: Vec<[f64; 2]> = Vec::new();
        for (number, (name, group)) in groups.iter().enumerate() {
            let points: Vec<[f64; 2]> = group
                .iter()
                .map(|row| {
                    let counts = !(of_run && matches!(row.fate, Fate::Fallen(_)));
                    let y = row.figures.as_ref().filter(|_| counts).and_then(value);
                    [row.value.unwrap_or(f64::NAN), y.unwrap_or(f64::NAN)]
                })
                .collect();
            let name = if index == 0 { name.as_str() } else { "" };
            // Number 0 is for the crosses.
            panel = panel.with(Curve::line(name, 1 + number, points.clone()));
            panel = panel.with(Curve::markers("", 1 + number, points));
            let is_lost = |row: &&&ComparedRow| matches!(row.fate, Fate::Fallen(_) | Fate::NoDesign(_));
            lost.extend(group.iter().filter(is_lost).map(|row| [row.value.unwrap_or(f64::NAN), 0.0]));
        }
        if index == 0 && !lost.is_empty() {
            panel = panel.with(Curve::markers("falls, or no design", 0, lost));
        }
        if panel.curves.iter().any(|curve| curve.points.iter().any(|point| point[1].is_finite())) {
            figure = figure.with(panel);
        }
    }
    figure
}

fn over_time(rows: &[ComparedRow], candidates: &[ComparedRig]) -> Figure {
    let time = || Axis::linear("time (s)");
    let is_chain = |rig: &Rig| rig.chain().is_some();
    let all_chains = candidates.iter().all(|candidate| is_chain(&candidate.rig));
    let label = if all_chains { "position (m)" } else { "position (m), or output" };
    let mut position = Panel::new(time(), Axis::linear(label));
    let mut angle = Panel::new(time(), Axis::linear("largest angle (°)"));
    let mut force = Panel::new(time(), Axis::linear(input(rows)));
    for (number, (name, group)) in groups(rows).into_iter().enumerate() {
        let Some(trace) = group.first().and_then(|row| row.trace.as_ref()) else { continue };
        let Some(candidate) = candidates.iter().find(|candidate| candidate.label == group[0].rig) else {
            continue;
        };
        let output = candidate.rig.output();
        let course = |value: &dyn Fn(&[f64], f64) -> f64| -> Vec<[f64; 2]> {
            trace.samples().map(|sample| [sample.t, value(sample.state, sample.force)]).collect()
        };
        position = position.with(Curve::line(name, number, course(&|state, _| state[output])));
        if is_chain(&candidate.rig) {
            let largest = |state: &[f64]| {
                state[2..].iter().step_by(2).fold(0.0, |largest: f64, angle| largest.max(angle.abs()))
            };
            angle = angle.with(Curve::line("", number, course(&|state, _| largest(state).to_degrees())));
        }
        force = force.with(Curve::line("", number, course(&|_, force| force)));
    }
    let panels = [position, angle, force].into_iter().filter(|panel| !panel.curves.is_empty());
    panels.fold(Figure::new(""), Figure::with)
}
