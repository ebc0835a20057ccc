//! A figure within the page.

use super::ReportError;
use crate::figure::{Figure, PlotArea};

/// A figure with its caption.
pub(crate) struct Plot {
    pub(crate) title: String,
    pub(crate) svg: String,
    /// Of a figure over time: left, right, upper and lower end of each panel in its view box, for the script.
    pub(crate) areas: Option<String>,
    /// Of a figure over time: first and last time (s).
    pub(crate) times: String,
}

impl Plot {
    /// With the title in the caption instead of the drawing.
    pub(crate) fn of(figure: &Figure, title: String) -> Result<Self, ReportError> {
        Self::with_areas(figure, title, false)
    }

    /// As [`of`](Self::of), with what the script needs to show a time in it.
    pub(crate) fn over_time(figure: &Figure, title: String) -> Result<Self, ReportError> {
        Self::with_areas(figure, title, true)
    }

    fn with_areas(figure: &Figure, title: String, over_time: bool) -> Result<Self, ReportError> {
        let drawing = Figure { title: String::new(), ..figure.clone() }.draw()?;
        let area = |panel: &PlotArea| {
            let ([left, right], [bottom, top]) = (panel.horizontal, panel.vertical);
            format!("{left} {right} {top} {bottom}")
        };
        let areas: Vec<String> = drawing.panels.iter().map(area).collect();
        let [from, to] = drawing.panels.first().map_or([0.0, 1.0], |panel| panel.x);
        // Without a size: the page decides.
        let svg = match drawing.svg.split_once(" viewBox") {
            Some((_, rest)) => format!("<svg class=\"plot\" viewBox{rest}"),
            None => drawing.svg,
        };
        Ok(Self { title, svg, areas: over_time.then(|| areas.join(";")), times: format!("{from} {to}") })
    }
}
