//! A map of a quantity over two others.

use super::theme::HEAT;

/// A quantity on a grid, in four colours from small to large.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatMap {
    /// What the colours mean, such as "settles within".
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// Centres of the columns, evenly spaced, rising; at least two.
    pub columns: Vec<f64>,
    /// Centres of the rows, evenly spaced, rising; at least two.
    pub rows: Vec<f64>,
    /// One row for each of `rows`; a cell without value is left blank.
    pub values: Vec<Vec<Option<f64>>>,
}

impl HeatMap {
    /// From the left edge of the first column to the right edge of the last.
    pub(super) fn x_range(&self) -> [f64; 2] {
        ends(&self.columns)
    }

    pub(super) fn y_range(&self) -> [f64; 2] {
        ends(&self.rows)
    }

    /// Largest value of each colour.
    pub(super) fn classes(&self) -> [f64; HEAT.len()] {
        let largest = self.values.iter().flatten().flatten().copied().fold(0.0, f64::max);
        let step = round_up(largest / HEAT.len() as f64);
        core::array::from_fn(|class| step * (class + 1) as f64)
    }

    /// Rectangles of one colour: class, `[left, right]`, `[bottom, top]`. Neighbours in a row are joined.
    pub(super) fn rectangles(&self) -> Vec<(usize, [f64; 2], [f64; 2])> {
        let classes = self.classes();
        let class = |value: &f64| classes.iter().position(|end| value <= end).unwrap_or(HEAT.len() - 1);
        let (across, up) = (spacing(&self.columns), spacing(&self.rows));
        let mut rectangles: Vec<(usize, [f64; 2], [f64; 2])> = Vec::new();
        for (y, row) in self.rows.iter().zip(&self.values) {
            let [bottom, top] = [y - 0.5 * up, y + 0.5 * up];
            let mut column = 0;
            for run in row.chunk_by(|a, b| a.as_ref().map(class) == b.as_ref().map(class)) {
                if let Some(value) = &run[0] {
                    let left = self.columns[column] - 0.5 * across;
                    rectangles.push((class(value), [left, left + across * run.len() as f64], [bottom, top]));
                }
                column += run.len();
            }
        }
        rectangles
    }
}

/// Rounds up to one digit, or 1.5 or 2.5, times a power of ten.
fn round_up(x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let power = 10f64.powf(x.log10().floor());
    let digits = [1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
    digits.into_iter().map(|digit| digit * power).find(|round| *round >= x).unwrap_or(10.0 * power)
}

fn spacing(centres: &[f64]) -> f64 {
    match centres {
        [first, .., last] => (last - first) / (centres.len() - 1) as f64,
        _ => 1.0,
    }
}

fn ends(centres: &[f64]) -> [f64; 2] {
    let half = 0.5 * spacing(centres);
    let (first, last) = (centres.first().copied().unwrap_or(0.0), centres.last().copied().unwrap_or(1.0));
    [first - half, last + half]
}
