//! Colours, dashes and widths.

use plotters::style::RGBColor;

/// Okabe and Ito, the order changed so that neighbours differ in lightness, too.
pub(super) const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

/// The dash of each colour (px); empty: solid.
pub(super) const DASHES: [&[u32]; 7] =
    [&[], &[9, 3], &[2, 2], &[9, 3, 2, 3], &[5, 3], &[12, 3, 2, 3, 2, 3], &[3, 5]];

pub(super) const REFERENCE: RGBColor = RGBColor(190, 190, 190);
pub(super) const LIMIT: RGBColor = RGBColor(90, 90, 90);
pub(super) const LIMIT_DASH: &[u32] = &[4, 4];

/// Settling times from short to long: lightness falls, so that it reads in grey (ColorBrewer YlGnBu).
pub(super) const HEAT: [RGBColor; 4] =
    [RGBColor(199, 233, 180), RGBColor(127, 205, 187), RGBColor(65, 182, 196), RGBColor(34, 94, 168)];

/// Units of the drawing per pixel: coordinates are integers, and steps of a whole pixel would be visible in a curve.
pub(super) const FINE: u32 = 4;
/// Width of a curve (units of the drawing).
pub(super) const LINE: u32 = 2 * FINE;
/// Width of a reference.
pub(super) const WIDE: u32 = 5 * FINE;
/// Width of a limit. No other line has it: [`finished`] recognises limits by it, and dashes them.
pub(super) const THIN: u32 = FINE + 1;
/// Width of the lines of a marker. No other line has it, so that markers are not dashed.
pub(super) const MARKER: u32 = 2 * FINE - 1;

/// Adds to a document what the drawing library cannot express: dashed lines in one piece (every colour has its dash),
/// and cells of a map without seams between them.
pub(super) fn finished(svg: &str) -> String {
    let mut svg = svg.to_owned();
    let lines = COLOURS.iter().zip(DASHES).map(|(colour, dash)| (colour, LINE, dash));
    for (colour, width, dash) in lines.chain([(&LIMIT, THIN, LIMIT_DASH)]) {
        if dash.is_empty() {
            continue;
        }
        let stroke = format!("stroke=\"{}\" stroke-width=\"{width}\"", hex(*colour));
        let dash: Vec<String> = dash.iter().map(|length| (length * FINE).to_string()).collect();
        svg = svg.replace(&stroke, &format!("{stroke} stroke-dasharray=\"{}\"", dash.join(" ")));
    }
    for colour in &HEAT {
        let fill = format!("fill=\"{}\"", hex(*colour));
        svg = svg.replace(&fill, &format!("{fill} shape-rendering=\"crispEdges\""));
    }
    svg
}

/// The colour of curve `number`, as in a document.
pub(crate) fn curve_colour(number: usize) -> String {
    hex(COLOURS[number % COLOURS.len()])
}

/// The dash of curve `number` (px); empty: solid.
fn curve_dash(number: usize) -> &'static [u32] {
    DASHES[number % DASHES.len()]
}

/// The colour of limits.
fn limit_colour() -> String {
    hex(LIMIT)
}

/// The look of curves for a page that draws them: colours, dashes, and the colours of references and limits.
pub(crate) fn page_theme() -> serde_json::Value {
    serde_json::json!({
        "colours": (0..CHROMATIC).map(curve_colour).collect::<Vec<_>>(),
        "dashes": (0..CHROMATIC).map(curve_dash).collect::<Vec<_>>(),
        "reference": reference_colour(),
        "limit": limit_colour(),
    })
}

/// The colours of pages in the light and the dark scheme.
pub(crate) const COLOURS_CSS: &str = include_str!("colours.css");

/// The colour of references, and of the cart in drawings.
pub(crate) fn reference_colour() -> String {
    hex(REFERENCE)
}

/// Style rules that let a page replace the colours of the figures: each colour becomes a custom property, `--c0` …,
/// `--reference` or `--limit`, whose value here is that colour.
pub(crate) fn style_sheet() -> String {
    let named =
        COLOURS.iter().take(CHROMATIC).enumerate().map(|(i, &colour)| (format!("--c{i}"), hex(colour)));
    let named = named.chain([("--reference".to_owned(), hex(REFERENCE)), ("--limit".to_owned(), hex(LIMIT))]);
    let (mut properties, mut rules) = (String::new(), String::new());
    for (name, colour) in named {
        properties += &format!(" {name}: {colour};");
        for place in ["stroke", "fill"] {
            rules += &format!("svg [{place}=\"{colour}\"] {{ {place}: var({name}); }}\n");
        }
    }
    format!(":root {{{properties} }}\n{rules}")
}

/// Number of colours that are not black; a page draws black in the colour of its text.
pub(crate) const CHROMATIC: usize = 6;

fn hex(RGBColor(r, g, b): RGBColor) -> String {
    format!("#{r:02X}{g:02X}{b:02X}")
}
