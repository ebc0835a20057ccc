//! The legend: names of the curves above the panel, where they hide nothing.

use plotters::style::ShapeStyle;
use upright_design::number::rounded;

use super::theme::HEAT;
use super::{Figure, Panel, Style};

/// One entry of a legend (px from the top left corner of the panel).
pub(super) struct LegendEntry {
    pub(super) key: LegendKey,
    pub(super) text: String,
    pub(super) left: f64,
    pub(super) middle: f64,
}

/// Sample before the text.
pub(super) enum LegendKey {
    Curve(Style),
    Fill(ShapeStyle),
    Nothing,
}

/// Length of the piece of line before a name (px).
pub(super) const SAMPLE: f64 = 26.0;

/// All entries of a panel, and the height they take (px).
///
/// A limit outside the panel has an entry, too.
pub(super) fn entries(figure: &Figure, panel: &Panel, from: f64) -> (Vec<LegendEntry>, f64) {
    let mut keys: Vec<(LegendKey, String)> = Vec::new();
    if let Some(heat) = &panel.heat {
        keys.push((LegendKey::Nothing, heat.name.clone()));
        for (end, colour) in heat.classes().into_iter().zip(HEAT) {
            // Without the rounding error of a multiple of a decimal.
            let end = rounded(end, 4);
            keys.push((LegendKey::Fill(colour.into()), format!("{end} {}", heat.unit)));
        }
        keys.push((LegendKey::Nothing, "blank: not at all".to_owned()));
    }
    let named = panel.curves.iter().filter(|curve| !curve.name.is_empty());
    let [low, high] = panel.y_range();
    keys.extend(named.map(|curve| {
        let seen = curve.points.iter().any(|point| (low..=high).contains(&point[1]));
        if curve.style == Style::Limit && !seen {
            (LegendKey::Nothing, format!("{} (not in view)", curve.name))
        } else {
            (LegendKey::Curve(curve.style), curve.name.clone())
        }
    }));

    let line = 1.45 * figure.text;
    let (mut left, mut middle) = (from, 0.5 * line + 2.0);
    let mut entries = Vec::new();
    for (key, text) in keys {
        let before = match key {
            LegendKey::Nothing => 0.0,
            LegendKey::Fill(_) => figure.text + 5.0,
            LegendKey::Curve(_) => SAMPLE + 7.0,
        };
        let width = before + 0.56 * figure.text * text.chars().count() as f64 + 14.0;
        if left > from && left + width > f64::from(figure.width) {
            (left, middle) = (from, middle + line);
        }
        entries.push(LegendEntry { key, text, left, middle });
        left += width;
    }
    let height = if entries.is_empty() { 6.0 } else { middle + 0.5 * line + 2.0 };
    (entries, height)
}
