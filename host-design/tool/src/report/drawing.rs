//! The rig, drawn to scale.

use core::fmt::Write;

use super::number::number;
use crate::figure::{CHROMATIC, curve_colour, reference_colour};
use upright_design::rig::Chain;

/// Width of the drawing (px).
const WIDTH: f64 = 480.0;
/// Height of the chain in it (px).
const CHAIN: f64 = 300.0;
/// Height of the ground line (px from the top).
const GROUND: f64 = 400.0;
/// Where the chain stands (px from the left).
const MIDDLE: f64 = 170.0;
/// Height of the cart (px).
const CART: f64 = 34.0;

/// Cart and links upright, with lengths, masses and centres of mass, as an SVG document. Lengths of links and places
/// of centres of mass are to scale; the rig file gives no size of the cart.
pub(super) fn svg(chain: &Chain) -> String {
    let mut out = format!(
        "<svg width=\"{WIDTH}\" height=\"450\" viewBox=\"0 0 {WIDTH} 450\" xmlns=\"http://www.w3.org/2000/svg\" \
         font-family=\"sans-serif\" font-size=\"14\">\n<rect width=\"{WIDTH}\" height=\"450\" fill=\"#FFFFFF\"/>\n"
    );
    // Writing into a String cannot fail.
    let _ = draw(&mut out, chain);
    out.push_str("</svg>\n");
    out
}

fn draw(out: &mut String, chain: &Chain) -> core::fmt::Result {
    let total: f64 = chain.links.iter().map(|link| link.length_m).sum();
    let scale = CHAIN / total;
    let pivot = GROUND - CART - 12.0;
    line(out, [20.0, GROUND], [WIDTH - 20.0, GROUND], "#000000", 2.0)?;
    writeln!(
        out,
        "<rect x=\"{}\" y=\"{}\" width=\"90\" height=\"{CART}\" rx=\"4\" fill=\"{}\" stroke=\"#000000\" stroke-width=\"1.5\"/>",
        MIDDLE - 45.0,
        GROUND - CART - 12.0,
        reference_colour()
    )?;
    let wheels: &[f64] = if chain.base.is_cart() { &[-28.0, 28.0] } else { &[] };
    for wheel in wheels {
        dot(out, [MIDDLE + wheel, GROUND - 6.0], 6.0, "#000000")?;
    }
    let mut bottom = 0.0;
    let mut free = f64::INFINITY;
    let labels = label_heights(chain, pivot - 6.0, scale);
    for (index, (link, label)) in chain.links.iter().zip(labels).enumerate() {
        let (from, to) = (pivot - scale * bottom, pivot - scale * (bottom + link.length_m));
        line(out, [MIDDLE, from], [MIDDLE, to], &curve_colour(index % CHROMATIC), 8.0)?;
        dot(out, [MIDDLE, from], 5.0, "#000000")?;
        let centre = link.centre_m();
        let at = pivot - scale * (bottom + centre);
        writeln!(
            out,
            "<circle cx=\"{MIDDLE}\" cy=\"{at:.1}\" r=\"6\" fill=\"#FFFFFF\" stroke=\"#000000\" stroke-width=\"1.5\"/>"
        )?;
        dot(out, [MIDDLE, at], 2.0, "#000000")?;
        line(out, [MIDDLE + 12.0, 0.5 * (from + to)], [MIDDLE + 60.0, label - 4.0], "#5A5A5A", 1.0)?;
        let name =
            format!("link {}: {} mm, {} kg", index + 1, number(1e3 * link.length_m), number(link.mass_kg));
        text(out, [MIDDLE + 66.0, label], &name)?;
        bottom += link.length_m;
        free = to;
    }
    dot(out, [MIDDLE, free], 3.0, "#000000")?;
    if let Some(mass_kg) = chain.cart.mass_kg {
        text(
            out,
            [MIDDLE + 56.0, GROUND - 20.0],
            &format!("{}: {}", chain.base.noun(), chain.base.mass().of(&number(mass_kg))),
        )?;
    }
    let [left, right] = chain.cart.travel_m;
    let right = chain.base.position().of(&number(right));
    let travel = chain.base.words(&format!("rail from {} to {right}", number(left)));
    text(out, [20.0, GROUND + 20.0], &travel)?;
    let (bar, size) = scale_bar(scale);
    let end = WIDTH - 24.0;
    line(out, [end - size, GROUND + 14.0], [end, GROUND + 14.0], "#000000", 3.0)?;
    text(out, [end - size, GROUND + 34.0], &format!("{} mm", number(1e3 * bar)))
}

/// Base lines of the links' labels, from the first: beside their links, but never closer than two lines' height.
fn label_heights(chain: &Chain, pivot: f64, scale: f64) -> Vec<f64> {
    const APART: f64 = 22.0;
    let mut bottom = 0.0;
    let mut heights: Vec<f64> = Vec::new();
    for link in &chain.links {
        let beside = pivot - scale * (bottom + 0.5 * link.length_m) + 5.0;
        heights.push(heights.last().map_or(beside, |below| beside.min(below - APART)));
        bottom += link.length_m;
    }
    heights
}

/// A round length and its size in the drawing (px).
fn scale_bar(scale: f64) -> (f64, f64) {
    let wanted = 100.0 / scale;
    let power = 10f64.powf(wanted.log10().floor());
    let bar =
        [5.0, 2.0, 1.0].map(|digit| digit * power).into_iter().find(|bar| *bar <= wanted).unwrap_or(power);
    (bar, bar * scale)
}

fn line(out: &mut String, from: [f64; 2], to: [f64; 2], colour: &str, width: f64) -> core::fmt::Result {
    writeln!(
        out,
        "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linecap=\"round\"/>",
        from[0], from[1], to[0], to[1]
    )
}

fn dot(out: &mut String, at: [f64; 2], radius: f64, colour: &str) -> core::fmt::Result {
    writeln!(out, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" fill=\"{colour}\"/>", at[0], at[1])
}

/// `text` holds numbers and fixed words only, so nothing has to be escaped.
fn text(out: &mut String, at: [f64; 2], text: &str) -> core::fmt::Result {
    writeln!(out, "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"#000000\">{text}</text>", at[0], at[1])
}
