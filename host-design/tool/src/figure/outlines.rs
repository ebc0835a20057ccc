//! The text of an SVG document as outlines of a typeface that comes with the program, so that it looks the same
//! everywhere.
//!
//! An SVG library could set the text itself, but reading and shaping every kind of typeface is most of its build.

use core::fmt::Write;

use resvg::usvg::roxmltree::{Document, Node};
use ttf_parser::{Face, GlyphId, OutlineBuilder};

/// `svg` with a `<path>` for each `<text>`: one line each, without shaping.
pub(super) fn outlined(svg: &str) -> Result<String, String> {
    let document = Document::parse(svg).map_err(|error| error.to_string())?;
    let face = Face::parse(epaint_default_fonts::UBUNTU_LIGHT, 0).map_err(|error| error.to_string())?;
    let mut out = String::with_capacity(4 * svg.len());
    let mut copied = 0;
    for text in document.descendants().filter(|node| node.has_tag_name("text")) {
        let place = text.range();
        out += &svg[copied..place.start];
        out += &path(&face, text);
        copied = place.end;
    }
    out += &svg[copied..];
    Ok(out)
}

fn path(face: &Face, text: Node) -> String {
    let number = |name: &str| inherited(text, name).and_then(|value| value.parse().ok());
    let size = number("font-size").unwrap_or(16.0f32);
    let glyphs: Vec<GlyphId> = text
        .text()
        .unwrap_or_default()
        .trim()
        .chars()
        .map(|character| face.glyph_index(character).unwrap_or_default())
        .collect();
    let scale = size / f32::from(face.units_per_em());
    let advance = |glyph: &GlyphId| scale * f32::from(face.glyph_hor_advance(*glyph).unwrap_or_default());
    let width: f32 = glyphs.iter().map(advance).sum();
    let start = match inherited(text, "text-anchor") {
        Some("middle") => -0.5 * width,
        Some("end") => -width,
        _ => 0.0,
    };
    let below = inherited(text, "dy").and_then(|dy| length(dy, size)).unwrap_or_default();
    let at = [number("x").unwrap_or_default() + start, number("y").unwrap_or_default() + below];
    let mut outline = Outline { data: String::new(), at, scale };
    for glyph in glyphs {
        // A space has no outline.
        let _ = face.outline_glyph(glyph, &mut outline);
        outline.at[0] += advance(&glyph);
    }
    let kept = ["fill", "opacity", "transform"]
        .map(|name| text.attribute(name).map(|value| format!(" {name}=\"{value}\"")).unwrap_or_default());
    format!("<path d=\"{}\"{}/>", outline.data, kept.concat())
}

/// The value of an attribute of the element, or of its nearest ancestor that has it.
fn inherited<'a>(element: Node<'a, '_>, name: &str) -> Option<&'a str> {
    element.ancestors().find_map(|element| element.attribute(name))
}

/// A length in `em` or `ex`; an `ex` is taken as half an `em`.
fn length(value: &str, size: f32) -> Option<f32> {
    let (digits, unit) = match value.strip_suffix("em") {
        Some(digits) => (digits, size),
        None => (value.strip_suffix("ex")?, 0.5 * size),
    };
    digits.parse::<f32>().ok().map(|number| number * unit)
}

/// Outlines as the data of a path. In typefaces, y points up; in documents, it points down.
struct Outline {
    data: String,
    at: [f32; 2],
    scale: f32,
}

impl Outline {
    fn add<const POINTS: usize>(&mut self, command: char, points: [[f32; 2]; POINTS]) {
        self.data.push(command);
        for [x, y] in points {
            // Writing into a string cannot fail.
            let _ =
                write!(self.data, "{:.2} {:.2} ", self.at[0] + self.scale * x, self.at[1] - self.scale * y);
        }
    }
}

impl OutlineBuilder for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        self.add('M', [[x, y]]);
    }
    fn line_to(&mut self, x: f32, y: f32) {
        self.add('L', [[x, y]]);
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.add('Q', [[x1, y1], [x, y]]);
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.add('C', [[x1, y1], [x2, y2], [x, y]]);
    }
    fn close(&mut self) {
        self.data.push('Z');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lowest and highest coordinate of the outlines, to the right and downwards.
    fn extent(attributes: &str, text: &str) -> [[f32; 2]; 2] {
        let svg = outlined(&format!("<svg><rect/><text {attributes}>\n{text}\n</text></svg>")).unwrap();
        assert!(svg.starts_with("<svg><rect/><path ") && svg.ends_with("/></svg>"), "{svg}");
        let data = svg.split("d=\"").nth(1).and_then(|rest| rest.split('"').next()).unwrap();
        let numbers: Vec<f32> = data
            .split(|c: char| c.is_whitespace() || c.is_ascii_alphabetic())
            .filter_map(|number| number.parse().ok())
            .collect();
        [0, 1].map(|axis| {
            let along = || numbers.iter().skip(axis).step_by(2).copied();
            [along().fold(f32::INFINITY, f32::min), along().fold(f32::NEG_INFINITY, f32::max)]
        })
    }

    #[test]
    fn text_is_where_its_anchor_says() {
        let [[left, right], [top, bottom]] = extent("x=\"100\" y=\"50\" font-size=\"20\"", "HIH");
        assert!(left > 100.0 && left < 103.0 && right > left + 20.0, "{left} to {right}");
        // A capital stands on the baseline and is about 0.7 em high.
        assert!(bottom == 50.0 && (34.0..38.0).contains(&top), "{top} to {bottom}");
        let [[left, right], _] = extent("x=\"100\" y=\"50\" font-size=\"20\" text-anchor=\"middle\"", "HIH");
        assert!((left + right - 200.0).abs() < 0.1, "{left} to {right}");
        let [[_, right], _] = extent("x=\"100\" y=\"50\" font-size=\"20\" text-anchor=\"end\"", "HIH");
        assert!(right < 100.0 && right > 97.0, "{right}");
        let [_, [_, bottom]] = extent("x=\"100\" y=\"50\" font-size=\"20\" dy=\"0.5ex\"", "HIH");
        assert_eq!(bottom, 55.0);
    }

    #[test]
    fn every_letter_and_sign_of_the_figures_has_an_outline() {
        let face = Face::parse(epaint_default_fonts::UBUNTU_LIGHT, 0).unwrap();
        let has = |character: char| face.glyph_index(character).is_some();
        assert!("abcxyz0123456789.,()/|·°θτω−±²√₁".chars().all(has));
        assert!(!has('中'), "nothing is missing from it");
    }
}
