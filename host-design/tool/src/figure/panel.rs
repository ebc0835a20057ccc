//! What a figure consists of: panels with axes and curves.

use super::heat::HeatMap;

/// A figure that could not be made.
#[derive(Debug, thiserror::Error)]
pub enum FigureError {
    /// The drawing library failed.
    #[error("the figure cannot be drawn: {0}")]
    Draw(String),
    /// The SVG could not be rendered as pixels.
    #[error("the figure cannot be rendered as PNG: {0}")]
    Png(String),
    /// An empty range, or one that is impossible on a logarithmic axis.
    #[error("the axis \"{label}\" cannot go from {from} to {to}")]
    Range {
        /// Label of the axis.
        label: String,
        /// Lower end of the range.
        from: f64,
        /// Upper end of the range.
        to: f64,
    },
}

/// Panels one below the other under a title.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Title above the panels; may be empty.
    pub title: String,
    /// Panels from top to bottom.
    pub panels: Vec<Panel>,
    /// Width of the figure (px).
    pub width: u32,
    /// Size of all text but the title (px).
    pub text: f64,
}

/// One system of axes with its curves.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Height with labels and legend (px).
    pub height: u32,
    /// Whether both axes have the same scale.
    pub equal: bool,
    /// Map drawn underneath the curves.
    pub heat: Option<HeatMap>,
    /// Curves in the order in which they are drawn.
    pub curves: Vec<Curve>,
}

/// An axis of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Quantity and unit, as in `time (s)`.
    pub label: String,
    /// Whether the axis is logarithmic instead of linear.
    pub log: bool,
    /// `[low, high]`; `None`: fitted to the curves.
    pub range: Option<[f64; 2]>,
}

/// A curve, or points that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name in the legend; empty: no entry.
    pub name: String,
    /// `[x, y]` each. A point that is not finite interrupts the line.
    pub points: Vec<[f64; 2]>,
    /// Line or markers, with their colour.
    pub style: Style,
}

/// How a curve looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// A line with colour and dash of this number; 0 is solid.
    Line(usize),
    /// Single points with colour and shape of this number; 0 is a cross.
    Markers(usize),
    /// A wide grey line, visible below the curve that should lie on it.
    Reference,
    /// A thin line at a limit. It widens an automatic range only where the curves come near it.
    Limit,
}

impl Figure {
    /// A figure for a page of text: 900 px wide.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), panels: Vec::new(), width: 900, text: 14.0 }
    }

    /// A figure that stays legible on a telephone: 480 px wide, with larger text.
    pub fn narrow(title: impl Into<String>) -> Self {
        Self { width: 480, text: 15.0, ..Self::new(title) }
    }

    /// Adds a panel at the bottom.
    pub fn with(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// Gives the panels of the same number in all `figures` the same ranges, so that their curves can be compared.
    pub fn same_scale(figures: &mut [Figure]) {
        let panels = figures.iter().map(|figure| figure.panels.len()).max().unwrap_or(0);
        for index in 0..panels {
            let common = |range: fn(&Panel) -> [f64; 2]| {
                let ranges = figures.iter().filter_map(|figure| figure.panels.get(index)).map(range);
                ranges.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
            };
            let (x, y) = (common(Panel::x_range), common(Panel::y_range));
            for panel in figures.iter_mut().filter_map(|figure| figure.panels.get_mut(index)) {
                (panel.x.range, panel.y.range) = (x, y);
            }
        }
    }

    /// The figure as an SVG document.
    ///
    /// # Errors
    /// [`FigureError`] for an impossible range, or from the drawing library.
    pub fn svg(&self) -> Result<String, FigureError> {
        self.draw().map(|drawing| drawing.svg)
    }
}

impl Panel {
    /// A panel without curves, 230 px high.
    pub fn new(x: Axis, y: Axis) -> Self {
        Self { x, y, height: 230, equal: false, heat: None, curves: Vec::new() }
    }

    /// Adds a curve on top of the others.
    pub fn with(mut self, curve: Curve) -> Self {
        self.curves.push(curve);
        self
    }

    /// With this height (px).
    pub fn high(self, height: u32) -> Self {
        Self { height, ..self }
    }

    /// With the same scale on both axes.
    pub fn equal(self) -> Self {
        Self { equal: true, ..self }
    }

    /// With the unit circle as a thin line.
    pub fn unit_circle(self) -> Self {
        let circle = (0..=360).map(|degree| f64::from(degree).to_radians()).map(|t| [t.cos(), t.sin()]);
        let points = circle.collect();
        self.with(Curve { name: "unit circle".to_owned(), points, style: Style::Limit })
    }
}

impl Axis {
    /// A linear axis, fitted to the curves.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), log: false, range: None }
    }

    /// A logarithmic axis, fitted to the curves.
    pub fn log(label: impl Into<String>) -> Self {
        Self { log: true, ..Self::linear(label) }
    }

    /// With a fixed range from `low` to `high`.
    pub fn range(self, low: f64, high: f64) -> Self {
        Self { range: Some([low, high]), ..self }
    }
}

impl Curve {
    /// A line; `number` chooses colour and dash.
    pub fn line(name: impl Into<String>, number: usize, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), points, style: Style::Line(number) }
    }

    /// Single points; `number` chooses colour and shape.
    pub fn markers(name: impl Into<String>, number: usize, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), points, style: Style::Markers(number) }
    }

    /// A wide grey reference line, drawn with [`Style::Reference`].
    pub fn reference(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), points, style: Style::Reference }
    }

    /// A thin line at a limit, drawn with [`Style::Limit`].
    pub fn limit(name: impl Into<String>, points: Vec<[f64; 2]>) -> Self {
        Self { name: name.into(), points, style: Style::Limit }
    }
}
