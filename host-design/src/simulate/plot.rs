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

type Value<'a> = Box<dyn Fn(&Sample<&[f64]>) -> f64 + 'a>;

struct Curve<'a> {
    name: String,
    value: Value<'a>,
}

impl<'a> Curve<'a> {
    fn new(name: impl Into<String>, value: impl Fn(&Sample<&[f64]>) -> f64 + 'a) -> Self {
        Self { name: name.into(), value: Box::new(value) }
    }
}

/// Position, angles and force of a run over time, one below the other, as an SVG document.
///
/// # Errors
/// [`PlotError`] from the drawing library.
pub fn svg(rig: &Rig, trace: &Trace, title: &str) -> Result<String, PlotError> {
    let output = rig.output();
    let mut panels = vec![(
        if matches!(rig.plant, PlantDescription::Chain(_)) { "position (m)" } else { "output" },
        vec![
            Curve::new("set-point", |s| s.target),
            Curve::new("governed", |s| s.setpoint),
            Curve::new(if output == 0 { "x".to_owned() } else { format!("state {output}") }, move |s| {
                s.state[output]
            }),
        ],
    )];
    if let PlantDescription::Chain(chain) = &rig.plant {
        let angles = (0..chain.links.len())
            .map(|link| Curve::new(format!("θ{}", link + 1), move |s| s.state[2 + 2 * link].to_degrees()))
            .collect();
        panels.push(("angles (°)", angles));
    }
    panels.push((
        "force (N)",
        vec![Curve::new("asked for", |s| s.requested), Curve::new("applied", |s| s.force)],
    ));

    let mut document = String::new();
    {
        let root =
            SVGBackend::with_string(&mut document, (900, 230 * panels.len() as u32 + 40)).into_drawing_area();
        let draw = || -> Result<(), Box<dyn std::error::Error>> {
            root.fill(&WHITE)?;
            let root = root.titled(title, ("sans-serif", 20))?;
            let areas = root.split_evenly((panels.len(), 1));
            for (area, (label, curves)) in areas.iter().zip(&panels) {
                panel(area, trace, label, curves)?;
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
) -> Result<(), Box<dyn std::error::Error>> {
    // More points than pixels only make the file large.
    let stride = trace.samples().len().div_ceil(1500).max(1);
    let end = trace.samples().last().map_or(1.0, |sample| sample.t).max(1e-9);
    let values = || trace.samples().flat_map(|sample| curves.iter().map(move |curve| (curve.value)(&sample)));
    let (low, high) = values()
        .filter(|value| value.is_finite())
        .fold((0.0f64, 0.0f64), |(low, high), value| (low.min(value), high.max(value)));
    let margin = 0.06 * (high - low).max(1e-9);
    let mut chart = ChartBuilder::on(area)
        .margin_right(24)
        .x_label_area_size(34)
        .y_label_area_size(70)
        .build_cartesian_2d(0.0..end, low - margin..high + margin)?;
    chart
        .configure_mesh()
        .light_line_style(WHITE.mix(0.0))
        .x_desc("time (s)")
        .y_desc(label)
        .x_labels(10)
        .y_labels(6)
        .label_style(("sans-serif", 13))
        .draw()?;
    for (curve, colour) in curves.iter().zip(COLOURS.iter().cycle()) {
        let points = trace.samples().step_by(stride).map(|sample| (sample.t, (curve.value)(&sample)));
        chart
            .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
            .label(curve.name.clone())
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .label_font(("sans-serif", 13))
        .draw()?;
    Ok(())
}
