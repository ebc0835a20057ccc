//! An identification as an HTML page: the numbers, how well they predict, and the residuals.

use askama::Template;

use super::text::{DIVERGES, notes, row_texts, variance_text, window_rows, windows};
use crate::figure::{Axis, COLOURS_CSS, Curve, Figure, Panel, style_sheet};
use crate::policy;
use crate::report::{Plot, ReportError};
use upright_design::number::significant;
use upright_design::numerics::Spectrum;
use upright_identify::{ChannelFit, Identification, Predicted, Settings};

/// Correlations of at least this size are printed bold.
const STRONG: f64 = 0.9;

#[derive(Template)]
#[template(path = "identified.html")]
struct Page<'a> {
    name: &'a str,
    command: &'a str,
    seconds: String,
    refusal: Option<String>,
    estimates: Vec<[String; 7]>,
    fits: Vec<[String; 4]>,
    windows: Vec<(&'static str, Vec<[String; 4]>)>,
    held_out: Option<Plot>,
    residuals: Option<Plot>,
    spectra: Option<Plot>,
    correlations: Vec<CorrelationRow>,
    notes: Vec<String>,
    version: &'static str,
    policy: String,
    style: String,
}

/// A parameter with its correlations to those before it.
struct CorrelationRow {
    name: String,
    /// Each correlation as text, and whether it is at least [`STRONG`].
    cells: Vec<(String, bool)>,
}

/// The page of an identification of the rig `name`; `command` is the command line that made it.
///
/// # Errors
/// [`ReportError`] if a figure cannot be drawn.
pub fn page(
    name: &str,
    found: &Identification,
    settings: &Settings,
    command: &str,
) -> Result<String, ReportError> {
    let has_fit = !found.channels.is_empty();
    let plot = |figure: Figure, title: &str| Plot::of(&figure, title.to_owned());
    let style = format!("{}{COLOURS_CSS}{}", style_sheet(), include_str!("../report/page.css"));
    let page = Page {
        name,
        command,
        seconds: significant(found.seconds, 3),
        refusal: found
            .refusal
            .as_ref()
            .map(ToString::to_string)
            .or_else(|| found.doubted().filter(|_| !settings.trust_numbers).map(ToString::to_string)),
        estimates: found.estimates.iter().map(|estimate| row_texts(found, estimate)).collect(),
        fits: found.channels.iter().enumerate().map(fit_texts).collect(),
        windows: windows(found)
            .into_iter()
            .map(|(what, errors)| (what, errors.iter().flat_map(window_rows).collect()))
            .collect(),
        held_out: has_fit
            .then(|| plot(held_out(&found.channels), "Held-out log, measured and predicted"))
            .transpose()?,
        residuals: has_fit
            .then(|| plot(residuals(&found.channels), "Measured minus predicted by the new numbers"))
            .transpose()?,
        spectra: spectra(found)
            .map(|figure| {
                plot(figure, "Spectra of the innovations, relative to white noise of the expected size")
            })
            .transpose()?,
        correlations: correlations(found),
        notes: if has_fit || !found.is_driven { notes(found, settings) } else { Vec::new() },
        version: env!("CARGO_PKG_VERSION"),
        policy: policy::of_document(None, &style),
        style,
    };
    Ok(page.render()?)
}

/// Name, variance of the innovations, and errors over 0.5 s.
fn fit_texts((index, fit): (usize, &ChannelFit)) -> [String; 4] {
    let (factor, unit) = unit_of(index);
    let error = |error: f64| match error.is_finite() {
        true => format!("{} {unit}", significant(factor * error, 3)),
        false => DIVERGES.to_owned(),
    };
    let [file, found] = fit.held_out.map(error);
    [fit.name.clone(), variance_text(fit), file, found]
}

/// Factor from the SI unit of a channel to the unit in which it is drawn, and the name of that unit.
fn unit_of(channel: usize) -> (f64, &'static str) {
    if channel == 0 { (1e3, "mm") } else { (1f64.to_degrees(), "°") }
}

/// A panel for each channel.
fn panels(channels: &[ChannelFit], curves: impl Fn(usize, &ChannelFit, f64) -> Vec<Curve>) -> Figure {
    let mut figure = Figure::new("");
    for (index, fit) in channels.iter().enumerate() {
        let (factor, unit) = unit_of(index);
        let axes = (Axis::linear("time (s)"), Axis::linear(format!("{} ({unit})", fit.name)));
        let panel =
            curves(index, fit, factor).into_iter().fold(Panel::new(axes.0, axes.1).high(200), Panel::with);
        figure = figure.with(panel);
    }
    figure
}

fn points(fit: &ChannelFit, factor: f64, value: impl Fn(&Predicted) -> f64) -> Vec<[f64; 2]> {
    fit.predictions.iter().map(|sample| [sample.time_s, factor * value(sample)]).collect()
}

fn held_out(channels: &[ChannelFit]) -> Figure {
    panels(channels, |index, fit, factor| {
        let name = |name: &str| if index == 0 { name.to_owned() } else { String::new() };
        vec![
            Curve::reference(name("measured"), points(fit, factor, |sample| sample.measured)),
            Curve::line(name("by the old file"), 1, points(fit, factor, |sample| sample.by_file)),
            Curve::line(name("by the new numbers"), 0, points(fit, factor, |sample| sample.by_found)),
        ]
    })
}

fn residuals(channels: &[ChannelFit]) -> Figure {
    panels(channels, |_, fit, factor| {
        vec![Curve::line("", 0, points(fit, factor, |sample| sample.measured - sample.by_found))]
    })
}

/// Spectral densities of the innovations, relative to white noise of variance 1; `None` if the log is too short.
fn spectra(found: &Identification) -> Option<Figure> {
    let mut panel = Panel::new(Axis::log("frequency (Hz)"), Axis::log("density / expected")).high(300);
    let white = 2.0 * found.sample_s;
    let mut ends = [f64::INFINITY, 0.0f64];
    for (index, fit) in found.channels.iter().enumerate() {
        let spectrum = Spectrum::welch(&fit.innovations, found.sample_s)?;
        let points: Vec<[f64; 2]> = spectrum
            .amplitudes()
            .into_iter()
            .map(|[at, amplitude]| [at, amplitude * amplitude / white])
            .collect();
        for [at, _] in &points {
            ends = [ends[0].min(*at), ends[1].max(*at)];
        }
        panel = panel.with(Curve::line(fit.name.clone(), index, points));
    }
    let level = Curve::limit("expected", ends.map(|at| [at, 1.0]).to_vec());
    (ends[1] > 0.0).then(|| Figure::new("").with(panel.with(level)))
}

fn correlations(found: &Identification) -> Vec<CorrelationRow> {
    let size = found.estimates.len();
    let row = |(index, estimate): (usize, &upright_identify::Estimate)| {
        let values = found.correlations.iter().skip(index * size).take(index);
        let cell =
            |value: &f64| (format!("{:.2}", (100.0 * value).round() / 100.0 + 0.0), value.abs() >= STRONG);
        CorrelationRow { name: estimate.kind.name_and_unit().0, cells: values.map(cell).collect() }
    };
    found.estimates.iter().enumerate().map(row).collect()
}
