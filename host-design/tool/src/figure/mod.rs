//! Figures: panels of curves with axes and units, as SVG, PNG and CSV.
//!
//! Drawn by `plotters`. Colours are those of Okabe and Ito (*Color Universal Design*, 2008), which colour-blind
//! readers can distinguish; every curve also has its own dash or marker, so that nothing depends on colour.

mod csv;
mod draw;
mod front;
mod heat;
mod legend;
mod outlines;
mod panel;
mod path;
mod png;
mod run;
mod scale;
mod stroboscope;
mod swing_up;
mod theme;

pub(crate) use png::pixels;
pub(crate) use theme::{CHROMATIC, COLOURS_CSS, curve_colour, page_theme, reference_colour, style_sheet};

pub use draw::{Drawing, PlotArea};
pub use front::front_figure;
pub use heat::HeatMap;
pub use panel::{Axis, Curve, Figure, FigureError, Panel, Style};
pub(crate) use run::run_figure;
pub use run::run_svg;
pub use stroboscope::stroboscope_svg;
pub use swing_up::{margins_figure, trade_figure};
