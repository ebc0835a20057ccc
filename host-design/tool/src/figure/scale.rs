//! Axes: ranges, ticks and their labels.

use core::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::coord::types::RangedCoordf64;

use super::{Axis, Curve, FigureError, Panel, Style};

/// An axis with both ends known.
#[derive(Debug, Clone)]
pub(super) struct Scale {
    pub(super) log: bool,
    pub(super) range: [f64; 2],
    /// Number of ticks wanted.
    pub(super) ticks: usize,
}

/// A limit is in view only up to this many times the extent of the curves, measured from their opposite end.
const NEAR: f64 = 1.5;

impl Panel {
    /// Range of the horizontal axis.
    pub(super) fn x_range(&self) -> [f64; 2] {
        let heat = self.heat.as_ref().map(|heat| heat.x_range());
        let has_markers = self.curves.iter().any(|curve| matches!(curve.style, Style::Markers(_)));
        let margin = if has_markers { 0.06 } else { 0.01 };
        self.x.range.or(heat).unwrap_or_else(|| around(&self.x, &self.curves, 0, margin))
    }

    /// Range of the vertical axis.
    pub(super) fn y_range(&self) -> [f64; 2] {
        let heat = self.heat.as_ref().map(|heat| heat.y_range());
        self.y.range.or(heat).unwrap_or_else(|| around(&self.y, &self.curves, 1, 0.06))
    }
}

/// Range that the curves need, including zero on a linear axis, with `margin` times its width added at both ends.
fn around(axis: &Axis, curves: &[Curve], which: usize, margin: f64) -> [f64; 2] {
    let scaled = |value: f64| if axis.log { value.log10() } else { value };
    let extent = |limits: bool, start: [f64; 2]| {
        let of_kind = curves.iter().filter(move |curve| (curve.style == Style::Limit) == limits);
        let values = of_kind.flat_map(|curve| &curve.points).map(|point| scaled(point[which]));
        values.filter(|value| value.is_finite()).fold(start, |[low, high], v| [low.min(v), high.max(v)])
    };
    let nothing = if axis.log { [f64::INFINITY, f64::NEG_INFINITY] } else { [0.0, 0.0] };
    let [mut low, mut high] = extent(false, nothing);
    if low > high || (low == high && curves.iter().all(|curve| curve.style == Style::Limit)) {
        [low, high] = extent(true, nothing);
    }
    if low > high {
        [low, high] = [0.0, 1.0];
    }
    let width = if high > low { high - low } else { 1e-9 };
    let values = curves.iter().filter(|curve| curve.style == Style::Limit).flat_map(|curve| &curve.points);
    for value in values.map(|point| scaled(point[which])).filter(|value| value.is_finite()) {
        if value > low - (NEAR - 1.0) * width && value < high + (NEAR - 1.0) * width {
            (low, high) = (low.min(value), high.max(value));
        }
    }
    let margin = margin * (high - low).max(1e-9);
    [low - margin, high + margin].map(|end| if axis.log { 10f64.powf(end) } else { end })
}

impl Scale {
    pub(super) fn of(axis: &Axis, range: [f64; 2], ticks: usize) -> Result<Self, FigureError> {
        let [from, to] = range;
        let possible = from.is_finite() && to.is_finite() && from < to && (!axis.log || from > 0.0);
        if !possible {
            return Err(FigureError::Range { label: axis.label.clone(), from, to });
        }
        Ok(Self { log: axis.log, range, ticks })
    }

    /// Where `value` is: 0 at the lower end, 1 at the upper.
    pub(super) fn share(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        if self.log { (value / low).ln() / (high / low).ln() } else { (value - low) / (high - low) }
    }
}

impl Ranged for Scale {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        from + (self.share(*value) * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let [low, high] = self.range;
        if !self.log {
            return RangedCoordf64::from(low..high).key_points(hint.max_num_points().min(self.ticks));
        }
        let decades = high.log10() - low.log10();
        let factors: &[f64] = if decades < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let every = (decades / self.ticks as f64).ceil().max(1.0) as usize;
        // 1 is always a tick if it is on the axis.
        let first = (low.log10().floor() as i32).div_euclid(every as i32) * every as i32;
        let powers = (first..=high.log10().ceil() as i32).step_by(every);
        // Read from decimal text: the product of 5 and a millionth is not the number nearest to 5e-6.
        let nearest = |factor: &f64, power: i32| format!("{factor}e{power}").parse().unwrap_or(f64::NAN);
        let points = powers.flat_map(|power| factors.iter().map(move |factor| nearest(factor, power)));
        points.filter(|point| (low..=high).contains(point)).collect()
    }

    fn range(&self) -> Range<f64> {
        self.range[0]..self.range[1]
    }
}

impl ValueFormatter<f64> for Scale {
    /// With as many decimals as the spacing of the ticks needs.
    fn format_ext(&self, value: &f64) -> String {
        let [low, high] = self.range;
        if self.log {
            return if (1e-3..1e5).contains(value) { value.to_string() } else { format!("{value:e}") };
        }
        let largest = low.abs().max(high.abs());
        let spacing = (high - low) / self.ticks as f64;
        if !(1e-4..1e6).contains(&largest) {
            let digits = (largest / spacing).log10().ceil().clamp(0.0, 15.0) as usize;
            return if *value == 0.0 { "0".to_owned() } else { format!("{value:.digits$e}") };
        }
        let decimals = (-spacing.log10().floor()).clamp(0.0, 12.0) as usize;
        let scale = 10f64.powi(decimals as i32);
        // Adding 0 turns a negative zero into a positive one.
        format!("{:.decimals$}", (value * scale).round() / scale + 0.0)
    }
}
