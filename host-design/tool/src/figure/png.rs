//! A figure as pixels.

use std::sync::Arc;

use resvg::{tiny_skia, usvg};

use super::{Figure, FigureError};

impl Figure {
    /// The figure as a PNG file, `scale` pixels for each of its own. Text is set in a typeface that comes with the
    /// program, so that the file is the same on every machine.
    ///
    /// # Errors
    /// [`FigureError`] if it cannot be drawn or is too large.
    pub fn png(&self, scale: f32) -> Result<Vec<u8>, FigureError> {
        pixels(&self.svg()?, scale)
    }
}

/// An SVG document as a PNG file.
pub(crate) fn pixels(svg: &str, scale: f32) -> Result<Vec<u8>, FigureError> {
    let failed = |error: String| FigureError::Png(error);
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(epaint_default_fonts::UBUNTU_LIGHT.to_vec());
    let Some(family) = fonts.faces().next().and_then(|face| face.families.first()).map(|name| name.0.clone())
    else {
        return Err(failed("the typeface that comes with the program cannot be read".to_owned()));
    };
    fonts.set_sans_serif_family(family);
    let options = usvg::Options { fontdb: Arc::new(fonts), ..usvg::Options::default() };
    let tree = usvg::Tree::from_str(svg, &options).map_err(|error| failed(error.to_string()))?;
    let [width, height] =
        [tree.size().width(), tree.size().height()].map(|size| (size * scale).ceil() as u32);
    let mut pixmap = tiny_skia::Pixmap::new(width, height)
        .ok_or_else(|| failed(format!("{width} × {height} pixels are not possible")))?;
    resvg::render(&tree, tiny_skia::Transform::from_scale(scale, scale), &mut pixmap.as_mut());
    pixmap.encode_png().map_err(|error| failed(error.to_string()))
}
