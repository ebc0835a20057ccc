//! A run as a picture.

use plotters::prelude::*;

use super::trace::{Sample, Trace};
use crate::rig::{PlantDescription, Rig};

/// A figure that could not be drawn.
#[derive(Debug, thiserror::Error)]
#[error("the figure cannot be drawn: {0}")]
pub struct PlotError(String);

/// Colours that stay apart for colour-blind readers (Okabe & Ito, 2008).
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

/// What another curve is to be compared with.
const REFERENCE: RGBColor = RGBColor(190, 190, 190);
const FONT: (&str, u32) = ("sans-serif", 17);

type Value<'a> = Box<dyn Fn(&Sample<&[f64]>) -> f64 + 'a>;

struct Curve<'a> {
    name: String,
    style: ShapeStyle,
    value: Value<'a>,
}

impl<'a> Curve<'a> {
    fn new(name: impl Into<String>, colour: usize, value: impl Fn(&Sample<&[f64]>) -> f64 + 'a) -> Self {
        let style = COLOURS[colour % COLOURS.len()].stroke_width(2);
        Self { name: name.into(), style, value: Box::new(value) }
    }

    /// A wide grey line that stays visible below the curve that should lie on it.
    fn reference(name: &str, value: impl Fn(&Sample<&[f64]>) -> f64 + 'a) -> Self {
        Self { name: name.to_owned(), style: REFERENCE.stroke_width(5), value: Box::new(value) }
    }
}

/// Position, angles and force of a run over time, one below the other, as an SVG document.
///
/// # Errors
/// [`PlotError`] from the drawing library.
pub fn svg(rig: &Rig, trace: &Trace, title: &str) -> Result<String, PlotError> {
    let output = rig.output();
    let is_chain = matches!(rig.plant, PlantDescription::Chain(_));
    let (label, name) =
        if is_chain { ("position (m)", "cart".to_owned()) } else { ("output", format!("state {output}")) };
    let setpoint = Curve::reference("set-point", |s| s.target);
    let governed = Curve::new("governed", 1, |s| s.setpoint);
    let mut panels = vec![(label, vec![setpoint, governed, Curve::new(name, 0, move |s| s.state[output])])];
    if let PlantDescription::Chain(chain) = &rig.plant {
        let angles = (0..chain.links.len())
            .map(|link| {
                Curve::new(format!("θ{}", link + 1), link, move |s| s.state[2 + 2 * link].to_degrees())
            })
            .collect();
        panels.push(("angles (°)", angles));
    }
    let label = if is_chain { "force (N)" } else { "input" };
    // A falling pendulum asks for a hundred times what there is: the rest should stay legible.
    let most = 2.0 * trace.samples().fold(0.0f64, |most, s| most.max(s.force.abs()));
    let is_cut_off = trace.samples().any(|s| s.requested.abs() > most);
    let name = if is_cut_off { "asked for (cut off)" } else { "asked for" };
    let asked_for = Curve::reference(name, move |s| s.requested.clamp(-most, most));
    panels.push((label, vec![asked_for, Curve::new("applied", 0, |s| s.force)]));

    let mut document = String::new();
    {
        let root =
            SVGBackend::with_string(&mut document, (900, 230 * panels.len() as u32 + 40)).into_drawing_area();
        let draw = || -> Result<(), Box<dyn std::error::Error>> {
            root.fill(&WHITE)?;
            let root = root.margin(6, 0, 0, 0).titled(title, ("sans-serif", 22))?;
            let areas = root.split_evenly((panels.len(), 1));
            for (index, (area, (label, curves))) in areas.iter().zip(&panels).enumerate() {
                panel(area, trace, label, curves, index + 1 == panels.len())?;
            }
            root.present()?;
            Ok(())
        };
        draw().map_err(|error| PlotError(error.to_string()))?;
    }
    Ok(document)
}

fn panel(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    trace: &Trace,
    label: &str,
    curves: &[Curve<'_>],
    is_last: bool,
) -> Result<(), Box<dyn std::error::Error>> {
    legend(area, curves)?;
    // More points than pixels only make the file large.
    let stride = trace.samples().len().div_ceil(1500).max(1);
    let end = trace.samples().last().map_or(1.0, |sample| sample.t).max(1e-9);
    let values = || trace.samples().flat_map(|sample| curves.iter().map(move |curve| (curve.value)(&sample)));
    let (low, high) = values()
        .filter(|value| value.is_finite())
        .fold((0.0f64, 0.0f64), |(low, high), value| (low.min(value), high.max(value)));
    let margin = 0.06 * (high - low).max(1e-9);
    let (time, value) = (-0.01 * end..end, low - margin..high + margin);
    let (time_label, value_label) = (tick_label(end / 10.0), tick_label((high - low).max(1e-9) / 6.0));
    let mut chart = ChartBuilder::on(area)
        .margin_left(12)
        .margin_right(24)
        .margin_top(28)
        .x_label_area_size(if is_last { 46 } else { 26 })
        .y_label_area_size(76)
        .build_cartesian_2d(time, value)?;
    let mut mesh = chart.configure_mesh();
    mesh.disable_x_mesh()
        .light_line_style(WHITE.mix(0.0))
        .y_desc(label)
        .x_labels(10)
        .y_labels(6)
        .x_label_formatter(&time_label)
        .y_label_formatter(&value_label)
        .label_style(FONT);
    if is_last {
        mesh.x_desc("time (s)");
    }
    mesh.draw()?;
    for curve in curves {
        let points = trace.samples().step_by(stride).map(|sample| (sample.t, (curve.value)(&sample)));
        chart.draw_series(LineSeries::new(points, curve.style))?;
    }
    Ok(())
}

/// Names the curves above the panel, where they hide none of them.
fn legend(
    area: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    curves: &[Curve<'_>],
) -> Result<(), Box<dyn std::error::Error>> {
    let mut left = 96;
    for curve in curves {
        area.draw(&PathElement::new([(left, 15), (left + 24, 15)], curve.style))?;
        area.draw(&Text::new(curve.name.clone(), (left + 32, 8), FONT))?;
        left += 64 + 8 * curve.name.chars().count() as i32;
    }
    Ok(())
}

/// Writes numbers with as many decimals as ticks this far apart need.
fn tick_label(spacing: f64) -> impl Fn(&f64) -> String {
    let decimals = (-spacing.log10().floor()).clamp(0.0, 12.0) as usize;
    // Adding 0 turns a negative zero into a positive one.
    move |value| {
        let scale = 10f64.powi(decimals as i32);
        format!("{:.decimals$}", (value * scale).round() / scale + 0.0)
    }
}
