//! A figure as pixels.

use resvg::{tiny_skia, usvg};

use super::outlines::outlined;
use super::{Figure, FigureError};

impl Figure {
    /// The figure as a PNG file, enlarged by `scale`. Text is set in a typeface that comes with the program, so that
    /// the file is the same on every machine.
    ///
    /// # Errors
    /// [`FigureError`] if it cannot be drawn or is too large.
    pub fn png(&self, scale: f32) -> Result<Vec<u8>, FigureError> {
        pixels(&self.svg()?, scale)
    }
}

/// An SVG document as a PNG file, enlarged by `scale`.
pub(crate) fn pixels(svg: &str, scale: f32) -> Result<Vec<u8>, FigureError> {
    let failed = |error: String| FigureError::Png(error);
    let svg = outlined(svg).map_err(failed)?;
    let tree =
        usvg::Tree::from_str(&svg, &usvg::Options::default()).map_err(|error| failed(error.to_string()))?;
    let [width, height] =
        [tree.size().width(), tree.size().height()].map(|size| (size * scale).ceil() as u32);
    let mut pixmap = tiny_skia::Pixmap::new(width, height)
        .ok_or_else(|| failed(format!("{width} × {height} pixels are not possible")))?;
    resvg::render(&tree, tiny_skia::Transform::from_scale(scale, scale), &mut pixmap.as_mut());
    pixmap.encode_png().map_err(|error| failed(error.to_string()))
}
