//! A figure as an SVG document.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::legend::{LegendEntry, LegendKey, SAMPLE, entries};
use super::path::PixelMap;
use super::scale::Scale;
use super::theme::{COLOURS, FINE, HEAT, LIMIT, LINE, MARKER, REFERENCE, THIN, WIDE, finished};
use super::{Figure, FigureError, Panel, Style};

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type DrawError = Box<dyn std::error::Error>;

/// A drawn figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    /// The SVG document.
    pub svg: String,
    /// Position and range of each panel, from top to bottom.
    pub panels: Vec<PlotArea>,
}

/// The rectangle in which a panel's curves are (units of the view box, from its top left corner), and what it shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlotArea {
    /// Left and right end.
    pub horizontal: [i32; 2],
    /// Lower and upper end; the lower one is the larger number.
    pub vertical: [i32; 2],
    /// Values at the left and the right end.
    pub x: [f64; 2],
    /// Values at the lower and the upper end.
    pub y: [f64; 2],
}

/// Position (px) and contents of a panel.
struct PanelLayout {
    top: f64,
    left: f64,
    right: f64,
    above: f64,
    below: f64,
    entries: Vec<LegendEntry>,
    describes_x: bool,
    x: Scale,
    y: Scale,
}

impl Figure {
    /// Draws the figure.
    ///
    /// # Errors
    /// [`FigureError`] for an impossible range, or from the drawing library.
    pub fn draw(&self) -> Result<Drawing, FigureError> {
        let title_height = if self.title.is_empty() { 0.0 } else { 2.2 * self.text };
        let mut top = title_height;
        let mut layouts = Vec::new();
        for (index, panel) in self.panels.iter().enumerate() {
            let below = self.panels.get(index + 1);
            let describes_x = below.is_none_or(|below| below.x.label != panel.x.label);
            layouts.push(self.layout(panel, top, describes_x)?);
            top += f64::from(panel.height);
        }
        let size = [self.width, top.ceil() as u32];
        let mut svg = String::new();
        let mut panels = Vec::new();
        let drawn = || -> Result<(), DrawError> {
            let root = SVGBackend::with_string(&mut svg, (fine(self.width.into()) as u32, size[1] * FINE))
                .into_drawing_area();
            root.fill(&WHITE)?;
            if !self.title.is_empty() {
                let style = text_style(1.25 * self.text, HPos::Center);
                let middle = (fine(0.5 * f64::from(self.width)), fine(0.55 * title_height));
                root.draw(&Text::new(self.title.clone(), middle, style))?;
            }
            for (panel, layout) in self.panels.iter().zip(&layouts) {
                panels.push(self.panel(&root, panel, layout)?);
            }
            root.present()?;
            Ok(())
        }();
        drawn.map_err(|error| FigureError::Draw(error.to_string()))?;
        // The view box stays in units of the drawing; the size is in pixels.
        let view = size.map(|length| length * FINE);
        let (fine_size, real_size) = (
            format!("width=\"{}\" height=\"{}\"", view[0], view[1]),
            format!("width=\"{}\" height=\"{}\"", size[0], size[1]),
        );
        Ok(Drawing { svg: finished(&svg.replacen(&fine_size, &real_size, 1)), panels })
    }

    fn layout(&self, panel: &Panel, top: f64, describes_x: bool) -> Result<PanelLayout, FigureError> {
        let left = 5.6 * self.text;
        let right = 1.4 * self.text;
        let (entries, above) = entries(self, panel, left);
        let below = if describes_x { 3.1 * self.text } else { 1.8 * self.text };
        let [width, height] = [f64::from(self.width) - left - right, f64::from(panel.height) - above - below]
            .map(|size| size.max(1.0));
        let (mut x, mut y) = (panel.x_range(), panel.y_range());
        if panel.equal {
            let unit = ((x[1] - x[0]) / width).max((y[1] - y[0]) / height);
            for (range, size) in [(&mut x, width), (&mut y, height)] {
                let further = 0.5 * (unit * size - (range[1] - range[0]));
                *range = [range[0] - further, range[1] + further];
            }
        }
        let ticks =
            |size: f64, spacing: f64| (size / (spacing * self.text)).round().clamp(4.0, 10.0) as usize;
        Ok(PanelLayout {
            top,
            left,
            right,
            above,
            below,
            entries,
            describes_x,
            x: Scale::of(&panel.x, x, ticks(width, 3.4))?,
            y: Scale::of(&panel.y, y, ticks(height, 1.35))?,
        })
    }

    fn panel(&self, root: &Area<'_>, panel: &Panel, layout: &PanelLayout) -> Result<PlotArea, DrawError> {
        let area =
            root.clone().shrink((0, fine(layout.top)), (fine(self.width.into()), fine(panel.height.into())));
        for entry in &layout.entries {
            self.legend_entry(&area, entry)?;
        }
        let mut chart = ChartBuilder::on(&area)
            .margin_top(fine(layout.above))
            .margin_right(fine(layout.right))
            .margin_left(fine(0.6 * self.text))
            .x_label_area_size(fine(layout.below))
            .y_label_area_size(fine(layout.left - 0.6 * self.text))
            .build_cartesian_2d(layout.x.clone(), layout.y.clone())?;
        let (columns, rows) = chart.plotting_area().get_pixel_range();
        let above = fine(layout.top);
        let (horizontal, vertical) = ([columns.start, columns.end], [rows.end - above, rows.start - above]);
        let map = PixelMap { x: &layout.x, y: &layout.y, horizontal, vertical };
        for (class, x, y) in panel.heat.iter().flat_map(|heat| heat.rectangles()) {
            let corners = [[x[0], y[0]], [x[1], y[1]]].map(|corner| map.place(corner));
            if let [Some(from), Some(to)] = corners {
                area.draw(&Rectangle::new([from, to], HEAT[class].filled()))?;
            }
        }
        let (label, tick) = (text_style(self.text, HPos::Center), text_style(0.93 * self.text, HPos::Center));
        let mut mesh = chart.configure_mesh();
        mesh.bold_line_style(BLACK.mix(0.16).stroke_width(FINE))
            .light_line_style(TRANSPARENT)
            .axis_style(BLACK.stroke_width(FINE))
            .set_all_tick_mark_size(fine(4.0))
            .x_labels(layout.x.ticks)
            .y_labels(layout.y.ticks)
            .label_style(tick)
            .axis_desc_style(label)
            .y_desc(panel.y.label.clone());
        if layout.describes_x {
            mesh.x_desc(panel.x.label.clone());
        }
        mesh.draw()?;
        for curve in &panel.curves {
            if let Style::Markers(number) = curve.style {
                for place in curve.points.iter().filter_map(|&point| map.place(point)) {
                    marker(&area, number, place)?;
                }
            } else {
                for line in map.lines(&curve.points) {
                    area.draw(&PathElement::new(line, line_style(curve.style)))?;
                }
            }
        }
        Ok(PlotArea { horizontal, vertical: [rows.end, rows.start], x: layout.x.range, y: layout.y.range })
    }

    fn legend_entry(&self, area: &Area<'_>, entry: &LegendEntry) -> Result<(), DrawError> {
        let (left, middle) = (fine(entry.left), fine(entry.middle));
        let text_left = match entry.key {
            LegendKey::Nothing => left,
            LegendKey::Fill(fill) => {
                let half = fine(0.42 * self.text);
                area.draw(&Rectangle::new(
                    [(left, middle - half), (left + 2 * half, middle + half)],
                    fill.filled(),
                ))?;
                left + 2 * half + fine(5.0)
            }
            LegendKey::Curve(Style::Markers(number)) => {
                marker(area, number, (left + fine(0.5 * SAMPLE), middle))?;
                left + fine(SAMPLE + 7.0)
            }
            LegendKey::Curve(style) => {
                area.draw(&PathElement::new(
                    [(left, middle), (left + fine(SAMPLE), middle)],
                    line_style(style),
                ))?;
                left + fine(SAMPLE + 7.0)
            }
        };
        area.draw(&Text::new(entry.text.clone(), (text_left, middle), text_style(self.text, HPos::Left)))?;
        Ok(())
    }
}

/// Pixels as units of the drawing.
fn fine(pixels: f64) -> i32 {
    (pixels * f64::from(FINE)).round() as i32
}

/// Text of this size (px). The library sets text smaller than requested, by the factor `LIBRARY`.
fn text_style(size: f64, horizontal: HPos) -> TextStyle<'static> {
    const LIBRARY: f64 = 1.24;
    ("sans-serif", size * f64::from(FINE) * LIBRARY)
        .into_text_style(&(1, 1))
        .pos(Pos::new(horizontal, VPos::Center))
}

fn line_style(style: Style) -> ShapeStyle {
    match style {
        Style::Line(number) | Style::Markers(number) => COLOURS[number % COLOURS.len()].stroke_width(LINE),
        Style::Reference => REFERENCE.stroke_width(WIDE),
        Style::Limit => LIMIT.stroke_width(THIN),
    }
}

/// Draws a marker: a cross, a circle, a square or a triangle, in turn.
fn marker(area: &Area<'_>, number: usize, (x, y): (i32, i32)) -> Result<(), DrawError> {
    let style = COLOURS[number % COLOURS.len()].stroke_width(MARKER);
    let r = fine(4.5);
    match number % 4 {
        0 => {
            area.draw(&PathElement::new([(x - r, y - r), (x + r, y + r)], style))?;
            area.draw(&PathElement::new([(x - r, y + r), (x + r, y - r)], style))?;
        }
        1 => area.draw(&Circle::new((x, y), r, style))?,
        2 => area.draw(&Rectangle::new([(x - r, y - r), (x + r, y + r)], style.filled()))?,
        _ => area.draw(&Polygon::new([(x - r, y + r), (x + r, y + r), (x, y - r)], style.filled()))?,
    }
    Ok(())
}
