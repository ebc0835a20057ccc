//! A motion as a stroboscopic picture: the machine at equal times, later ones darker, and the path of the tip.

use core::fmt::Write;

use super::theme::{CHROMATIC, curve_colour};
use upright_design::plant::absolute_angles;
use upright_design::rig::Chain;
use upright_design::simulate::Trace;

/// Width of the picture and its margins (px).
const WIDTH: f64 = 760.0;
const MARGIN: f64 = 24.0;
/// Poses in the picture, and points of the path of the tip.
const POSES: usize = 28;
const PATH: usize = 600;

/// The machine from `from_s` to `to_s` (s), as an SVG document. Everything is to scale; the way of an arm is unrolled.
pub fn stroboscope_svg(chain: &Chain, trace: &Trace, from_s: f64, to_s: f64) -> String {
    let shown: Vec<(f64, Vec<[f64; 2]>)> = trace
        .samples()
        .filter(|sample| (from_s..=to_s).contains(&sample.t))
        .map(|sample| (chain.arc_m() * sample.state[0], joints(chain, sample.state)))
        .collect();
    let length: f64 = chain.links.iter().map(|link| link.length_m).sum();
    let farthest = shown.iter().fold(0.0, |most: f64, (x, _)| most.max(x.abs()));
    let half_width = farthest + 1.05 * length;
    let scale = (WIDTH - 2.0 * MARGIN) / (2.0 * half_width);
    let middle = MARGIN + 1.05 * length * scale;
    let height = 2.0 * middle;
    let place = |[x, y]: [f64; 2]| [0.5 * WIDTH + scale * x, middle - scale * y];
    let mut out = format!(
        "<svg width=\"{WIDTH}\" height=\"{height:.0}\" viewBox=\"0 0 {WIDTH} {height:.0}\" \
         xmlns=\"http://www.w3.org/2000/svg\">\n<rect width=\"{WIDTH}\" height=\"{height:.0}\" fill=\"#FFFFFF\"/>\n\
         <line x1=\"{MARGIN}\" y1=\"{middle:.1}\" x2=\"{:.1}\" y2=\"{middle:.1}\" stroke=\"#5A5A5A\" stroke-width=\"1.5\"/>\n",
        WIDTH - MARGIN
    );
    let every = |count: usize| (shown.len() / count).max(1);
    let tips = shown.iter().step_by(every(PATH)).filter_map(|(_, joints)| joints.last());
    let path: Vec<String> = tips.map(|&tip| place(tip)).map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
    // Writing into a String cannot fail.
    let _ = writeln!(
        out,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"#5A5A5A\" stroke-width=\"1\" stroke-dasharray=\"2 2\"/>",
        path.join(" ")
    );
    // Counted from the last pose, which is the clearest.
    let poses: Vec<_> = shown.iter().rev().step_by(every(POSES)).collect();
    for (age, (x, joints)) in poses.iter().enumerate().rev() {
        let opacity = if age == 0 { 1.0 } else { 0.15 + 0.45 * (1.0 - age as f64 / poses.len() as f64) };
        let [cart, _] = place([*x, 0.0]);
        let _ = writeln!(
            out,
            "<g opacity=\"{opacity:.2}\" stroke-linecap=\"round\"><rect x=\"{:.1}\" y=\"{:.1}\" width=\"28\" height=\"12\" rx=\"2\" fill=\"#BEBEBE\" stroke=\"#000000\"/>",
            cart - 14.0,
            middle - 6.0
        );
        for (index, ends) in joints.windows(2).enumerate() {
            let ([x1, y1], [x2, y2]) = (place(ends[0]), place(ends[1]));
            let colour = curve_colour(index % CHROMATIC);
            let _ = writeln!(
                out,
                "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{colour}\" stroke-width=\"4\"/>"
            );
        }
        out.push_str("</g>\n");
    }
    out.push_str("</svg>\n");
    out
}

/// Joints and tip of a state (m), from the cart on; y is up.
fn joints(chain: &Chain, state: &[f64]) -> Vec<[f64; 2]> {
    let mut at = [chain.arc_m() * state[0], 0.0];
    let mut all = vec![at];
    for (link, angle) in chain.links.iter().zip(absolute_angles(state)) {
        // Angles count counter-clockwise from upright.
        at = [at[0] - link.length_m * angle.sin(), at[1] + link.length_m * angle.cos()];
        all.push(at);
    }
    all
}
