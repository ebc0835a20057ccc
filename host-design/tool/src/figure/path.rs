//! Lines in units of the drawing: clipped to the panel, and with no more points than can be seen.

use super::scale::Scale;
use super::theme::FINE;

/// Maps values to units of the drawing.
pub(super) struct PixelMap<'a> {
    pub(super) x: &'a Scale,
    pub(super) y: &'a Scale,
    /// Left, right.
    pub(super) horizontal: [i32; 2],
    /// Bottom, top.
    pub(super) vertical: [i32; 2],
}

impl PixelMap<'_> {
    /// Where `point` is, from `[0, 0]` bottom left to `[1, 1]` top right.
    fn share(&self, point: [f64; 2]) -> [f64; 2] {
        [self.x.share(point[0]), self.y.share(point[1])]
    }

    fn units(&self, share: [f64; 2]) -> (i32, i32) {
        let between = |[from, to]: [i32; 2], share: f64| from + (share * f64::from(to - from)).round() as i32;
        (between(self.horizontal, share[0]), between(self.vertical, share[1]))
    }

    /// The place of a point in the drawing; `None` if it is outside the panel.
    pub(super) fn place(&self, point: [f64; 2]) -> Option<(i32, i32)> {
        let share = self.share(point);
        share.iter().all(|s| (-1e-9..=1.0 + 1e-9).contains(s)).then(|| self.units(share))
    }

    /// The pieces of a line within the panel.
    pub(super) fn lines(&self, points: &[[f64; 2]]) -> Vec<Vec<(i32, i32)>> {
        let mut lines: Vec<Vec<(i32, i32)>> = Vec::new();
        let mut before = None;
        for point in points {
            let to = self.share(*point);
            let Some(from) = before.replace(to) else { continue };
            let Some([from, to]) = clip(from, to) else { continue };
            let [from, to] = [self.units(from), self.units(to)];
            match lines.last_mut() {
                Some(line) if line.last() == Some(&from) => line.push(to),
                _ => lines.push(vec![from, to]),
            }
        }
        lines.iter().map(|line| thinned(line)).collect()
    }
}

/// The part of a segment within the unit square (Liang and Barsky, 1984).
fn clip(from: [f64; 2], to: [f64; 2]) -> Option<[[f64; 2]; 2]> {
    let is_inside = |[x, y]: [f64; 2]| (0.0..=1.0).contains(&x) && (0.0..=1.0).contains(&y);
    if is_inside(from) && is_inside(to) {
        // The common case, with the same arithmetic as below for both ends.
        return Some([from, [from[0] + (to[0] - from[0]), from[1] + (to[1] - from[1])]]);
    }
    if !from.iter().chain(&to).all(|value| value.is_finite()) {
        return None;
    }
    let (mut enters, mut leaves) = (0.0f64, 1.0f64);
    for axis in 0..2 {
        let step = to[axis] - from[axis];
        for (towards, room) in [(-step, from[axis]), (step, 1.0 - from[axis])] {
            if towards == 0.0 && room < 0.0 {
                return None;
            } else if towards < 0.0 {
                enters = enters.max(room / towards);
            } else if towards > 0.0 {
                leaves = leaves.min(room / towards);
            }
        }
    }
    let at = |t: f64| [from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])];
    (enters <= leaves).then(|| [at(enters), at(leaves)])
}

/// Of successive points in the same column of pixels, keeps only the first, the lowest, the highest and the last.
fn thinned(line: &[(i32, i32)]) -> Vec<(i32, i32)> {
    let mut kept: Vec<(i32, i32)> = Vec::new();
    for column in line.chunk_by(|a, b| a.0.div_euclid(FINE as i32) == b.0.div_euclid(FINE as i32)) {
        let indices = 0..column.len();
        let lowest = indices.clone().min_by_key(|&i| column[i].1).unwrap_or(0);
        let highest = indices.max_by_key(|&i| column[i].1).unwrap_or(0);
        let mut chosen = [0, lowest, highest, column.len() - 1];
        chosen.sort_unstable();
        for index in chosen {
            if kept.last() != Some(&column[index]) {
                kept.push(column[index]);
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_cut_where_it_leaves_the_panel() {
        assert_eq!(clip([0.5, 0.5], [0.5, 2.5]), Some([[0.5, 0.5], [0.5, 1.0]]));
        assert_eq!(clip([-1.0, 0.0], [3.0, 1.0]), Some([[0.0, 0.25], [1.0, 0.5]]));
        assert_eq!(clip([1.5, 0.0], [1.5, 1.0]), None);
        assert_eq!(clip([0.5, f64::NAN], [0.5, 1.0]), None);
    }

    #[test]
    fn a_peak_of_one_point_among_thousands_stays() {
        let mut line: Vec<(i32, i32)> = (0..100_000).map(|i| (i / 100, 50)).collect();
        line[54_321].1 = 999;
        let kept = thinned(&line);
        assert!(kept.len() < 1100, "{}", kept.len());
        assert_eq!(kept.iter().filter(|point| point.1 == 999).count(), 1);
    }
}
