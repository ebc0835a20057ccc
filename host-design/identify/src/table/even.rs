//! Rows at equal intervals, from rows whose times are uneven or of which some are missing.

use core::f64::consts::TAU;

use super::columns::RecordingColumns;
use super::error::RecordingError;
use super::plausible;
use super::text::RecordingTable;

/// Times are uneven if they are off by more than this share of the period.
const UNEVEN: f64 = 0.02;
/// Uneven steps are at most by this share longer than the period; longer ones are gaps.
const UNEVEN_STEP: f64 = 0.75;
/// How far the period may be from the mean of uneven steps, as a share of it, and from how many rows it is found.
const WIDEST: f64 = 0.05;
const SCANNED: usize = 500;
/// Longest time between two rows that is interpolated, in periods (one missing row, with uneven times), and as a share
/// of the period of the fastest mode. A longer pause begins a new piece.
const BRIDGED: (f64, f64) = (2.75, 0.125);
/// Rows on each side of a time through which the interpolating polynomial goes.
const SIDE: usize = 3;
/// Largest error of a straight line, as a share of the motion, with which it is taken instead: between rows that are
/// unevenly close a polynomial amplifies the steps of an encoder.
const STRAIGHT: f64 = 1e-4;

/// Consecutive rows at equal intervals.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct RecordingRows {
    /// Time from one row to the next (s).
    pub(crate) period_s: f64,
    /// Deviations from hanging (m, rad), one row of cart and joints per sample; 0 for a clamped cart.
    pub(crate) y: Vec<f64>,
    /// Force (N) or voltage (V), one per sample; none without a drive.
    pub(crate) drive: Vec<Option<f64>>,
    /// Number of rows that are missing between the first and the last one.
    pub(crate) missing: u64,
    /// How far the times are from even ones (rms, s); 0 if the rows are as they were recorded.
    pub(crate) uneven_s: f64,
}

impl RecordingColumns {
    /// The measurements of a table, in pieces without a long gap; the fastest mode of the links has the period
    /// `fastest_s`. The values are compared with the reading if `is_checked`.
    ///
    /// # Errors
    /// [`RecordingError`] if times do not increase or the values contradict the reading.
    pub(crate) fn pieces(
        &self,
        table: &RecordingTable,
        fastest_s: f64,
        is_checked: bool,
    ) -> Result<Vec<RecordingRows>, RecordingError> {
        let times = self.times(table)?;
        let period_s = self.period_s.unwrap_or_else(|| period(&times));
        if times.len() < 2 || period_s <= 0.0 {
            return Err(RecordingError::Empty);
        }
        let deviations = self.deviations(table);
        if is_checked {
            plausible::check(self, table, &times, &deviations)?;
        }
        let longest_s = (BRIDGED.0 * period_s).max(BRIDGED.1 * fastest_s);
        let mut pieces = Vec::new();
        let mut from = 0;
        for to in 1..=times.len() {
            if to == times.len() || times[to] - times[to - 1] > longest_s {
                pieces.push(self.piece(table, &times, &deviations, from..to, [period_s, fastest_s]));
                from = to;
            }
        }
        Ok(pieces)
    }

    /// Time of each row (s).
    fn times(&self, table: &RecordingTable) -> Result<Vec<f64>, RecordingError> {
        let rows = 0..table.lines.len();
        let Some((index, factor)) = self.time else {
            return Ok(rows.map(|row| row as f64 * self.period_s.unwrap_or_default()).collect());
        };
        let times: Vec<f64> = rows.map(|row| factor * table.row(row)[index]).collect();
        let Some(row) = times.windows(2).position(|pair| pair[1] <= pair[0]) else { return Ok(times) };
        let (what, remedy) = match table.row(row) == table.row(row + 1) {
            true => ("the row is there twice", "delete one"),
            false if times[row] == times[row + 1] => ("two rows have the same time", "delete one"),
            false => ("the time does not increase", "give each recording as a file of its own"),
        };
        Err(RecordingError::Contradicts {
            line: table.lines[row + 1],
            column: table.names[index].clone(),
            what: what.to_owned(),
            remedy: remedy.to_owned(),
        })
    }

    /// The rows of `range`, at equal intervals.
    fn piece(
        &self,
        table: &RecordingTable,
        times: &[f64],
        y: &[f64],
        range: core::ops::Range<usize>,
        [period_s, fastest_s]: [f64; 2],
    ) -> RecordingRows {
        let (channels, start) = (self.angles.len() + 1, times[range.start]);
        let drive = |row: usize| self.drive.map(|(index, factor)| factor * table.row(row)[index]);
        let is_even = range.clone().all(|row| {
            (times[row] - start - (row - range.start) as f64 * period_s).abs() <= UNEVEN * period_s
        });
        if is_even {
            let y = y[range.start * channels..range.end * channels].to_vec();
            return RecordingRows {
                period_s,
                y,
                drive: range.map(drive).collect(),
                ..RecordingRows::default()
            };
        }
        let (times, y) = (&times[range.clone()], &y[range.start * channels..range.end * channels]);
        let mut even = RecordingRows { period_s, ..RecordingRows::default() };
        (even.missing, even.uneven_s) = unevenness(times, period_s);
        let mut row = 0;
        while row + 1 < times.len() {
            let time = start + even.drive.len() as f64 * period_s;
            while row + 1 < times.len() && times[row + 1] < time {
                row += 1;
            }
            if row + 1 < times.len() {
                // Of a sine with the period of the fastest mode.
                let bend = (TAU * (times[row + 1] - times[row]) / fastest_s).powi(2) / 8.0;
                let side = if bend < STRAIGHT { 1 } else { SIDE };
                let weights = weights(times, row, time, (period_s, side));
                let of = |channel: usize| {
                    weights.iter().map(|(row, weight)| weight * y[row * channels + channel]).sum::<f64>()
                };
                even.y.extend((0..channels).map(of));
                even.drive.push(drive(range.start + row));
            }
        }
        even
    }
}

/// Time from one row to the next (s): the median, or with uneven times that of the grid on which they lie best.
fn period(times: &[f64]) -> f64 {
    let steps = || times.windows(2).map(|pair| pair[1] - pair[0]);
    let median = plausible::median(steps());
    let near: Vec<f64> = steps().filter(|step| step / median < 1.0 + UNEVEN_STEP).collect();
    if near.iter().all(|step| (step / median - 1.0).abs() <= UNEVEN) {
        return median;
    }
    let mean = near.iter().sum::<f64>() / near.len() as f64;
    let count = times.len().min(SCANNED);
    let fineness = 1.0 / (8.0 * count as f64);
    let tried = (-(WIDEST / fineness) as i64..=(WIDEST / fineness) as i64)
        .map(|at| mean * (1.0 + at as f64 * fineness));
    let coherence = |period_s: f64| {
        let [cosine, sine] = direction(&times[..count], period_s);
        cosine.hypot(sine)
    };
    let best =
        tried.map(|period_s| (coherence(period_s), period_s)).max_by(|one, other| one.0.total_cmp(&other.0));
    best.map_or(mean, |(_, period_s)| period_s)
}

/// Sum of the unit vectors of `times` on the circle of one period.
fn direction(times: &[f64], period_s: f64) -> [f64; 2] {
    times.iter().fold([0.0; 2], |[cosine, sine], time| {
        let phase = libm::sincos(TAU * (time - times[0]) / period_s);
        [cosine + phase.1, sine + phase.0]
    })
}

/// Number of missing rows, and how far the times are from those of an even grid (rms, s).
fn unevenness(times: &[f64], period_s: f64) -> (u64, f64) {
    let [cosine, sine] = direction(times, period_s);
    let offset_s = times[0] + period_s * libm::atan2(sine, cosine) / TAU;
    let row = |time: &f64| ((time - offset_s) / period_s).round();
    let squares: f64 = times.iter().map(|time| (time - offset_s - row(time) * period_s).powi(2)).sum();
    let all = row(&times[times.len() - 1]) - row(&times[0]) + 1.0;
    ((all - times.len() as f64).max(0.0) as u64, (squares / times.len() as f64).sqrt())
}

/// Rows and their weights in the value at `time`, between `row` and the next one: the polynomial through `side` rows on
/// either side (Lagrange). Around a gap the rows are as far apart as half of the gap, so that noise is not amplified.
fn weights(times: &[f64], row: usize, time: f64, (period_s, side): (f64, usize)) -> Vec<(usize, f64)> {
    let apart = (((times[row + 1] - times[row]) / (2.0 * period_s)).round() as usize).max(1);
    let low = (0..side).map_while(|step| row.checked_sub(step * apart));
    let high = (0..side).map(|step| row + 1 + step * apart).take_while(|row| *row < times.len());
    let nodes: Vec<usize> = low.chain(high).collect();
    let weight = |&node: &usize| {
        let others = nodes.iter().filter(|other| **other != node);
        let factor = |&other: &usize| (time - times[other]) / (times[node] - times[other]);
        (node, others.map(factor).product())
    };
    nodes.iter().map(weight).collect()
}

#[cfg(test)]
mod tests {
    use core::f64::consts::PI;
    use std::path::Path;

    use upright_design::rig::Rig;

    use super::*;
    use crate::table::reading::{AngleReference, AngleZero, Reading};

    const HEADER: &str = "# measured\ntime_s,angle_1_rad,angle_2_rad\n";

    fn rig() -> Rig {
        Rig::from_path(Path::new("../../rigs/double-quanser-dbpen.toml")).unwrap()
    }

    fn reading() -> Reading {
        Reading {
            angles: Some(AngleReference::Absolute),
            zero: Some(AngleZero::Upright),
            is_clamped: true,
            ..Reading::default()
        }
    }

    fn pieces(text: &str, reading: &Reading) -> Result<Vec<RecordingRows>, RecordingError> {
        let table = RecordingTable::from_text(text, reading, 2)?;
        RecordingColumns::of(&rig(), reading, &table)?.pieces(&table, 0.4, true)
    }

    #[test]
    fn every_convention_gives_the_same_deviations_from_hanging() {
        let wanted = pieces(&format!("{HEADER}0,3.0,3.2\n0.002,3.1,3.1\n"), &reading()).unwrap();
        let near = |rows: &[RecordingRows]| {
            let angles = [0.0, 3.0 - PI, 0.2, 0.0, 3.1 - PI, 0.0];
            assert!(
                rows[0].y.iter().zip(angles).all(|(found, wanted)| (found - wanted).abs() < 1e-9),
                "{rows:?}"
            );
        };
        near(&wanted);
        let relative = Reading { angles: Some(AngleReference::Relative), ..reading() };
        near(&pieces(&format!("{HEADER}0,3.0,0.2\n0.002,3.1,0\n"), &relative).unwrap());
        let hanging = Reading { zero: Some(AngleZero::Hanging), period_s: Some(0.002), ..reading() };
        let [first, second, third] = [3.0 - PI, 3.2 - PI, 3.1 - PI].map(f64::to_degrees);
        let text = format!("th1_deg;th2_deg\n{first};{second}\n{third};{third}\n");
        near(&pieces(&text, &hanging).unwrap());
        let reversed = Reading { reversed: vec!["angle_2_rad".to_owned()], ..relative };
        near(&pieces(&format!("{HEADER}0,3.0,-0.2\n0.002,3.1,0\n"), &reversed).unwrap());
    }

    #[test]
    fn a_pause_begins_a_new_piece_and_uneven_times_are_made_even() {
        let text = format!("{HEADER}0,3,3\n0.002,3,3\n0.004,3,3\n1.0,3,3\n1.002,3,3\n");
        let found = pieces(&text, &reading()).unwrap();
        assert_eq!(found.iter().map(|rows| rows.drive.len()).collect::<Vec<_>>(), [3, 2]);
        let text =
            format!("{HEADER}0,3.0,3.0\n0.002,3.2,3.2\n0.0045,3.45,3.45\n0.006,3.6,3.6\n0.008,3.8,3.8\n");
        let found = pieces(&text, &reading()).unwrap();
        assert!((found[0].y[7] - (3.4 - PI)).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn what_is_open_or_contradicts_is_named_with_its_place() {
        let row = "0,3.0,3.2\n0.002,3.1,3.1\n";
        let refused = |text: &str, reading: &Reading, words: &[&str]| {
            let error = pieces(text, reading).unwrap_err().to_string();
            words.iter().for_each(|word| assert!(error.contains(word), "{error}"));
        };
        let all = format!("{HEADER}{row}");
        refused(&all, &Reading { angles: None, ..reading() }, &["--angles", "angle_1_rad"]);
        refused(&all, &Reading { zero: None, ..reading() }, &["--zero"]);
        refused(&all, &Reading { is_clamped: false, ..reading() }, &["--clamped"]);
        refused(&all, &Reading { period_s: Some(0.002), ..reading() }, &["--period"]);
        let hanging = Reading { zero: Some(AngleZero::Hanging), ..reading() };
        refused(&all, &hanging, &["line 3", "angle_1_rad", "--zero upright"]);
        refused(&all, &Reading { reversed: vec!["angle_3".to_owned()], ..reading() }, &["angle_3"]);
        refused(row, &reading(), &["line 1", "--columns time_s,angle_1_rad,angle_2_rad"]);
        refused(&format!("{HEADER}0,3,x\n"), &reading(), &["line 3", "angle_2_rad", "\"x\""]);
        refused(&format!("{HEADER}0,3\n"), &reading(), &["line 3", "2 fields instead of 3"]);
        refused(&format!("{HEADER}0.002,3,3\n0,3,3\n"), &reading(), &["line 4", "does not increase"]);
        let current = all.replace("angle_2_rad", "current_a");
        refused(&current, &reading(), &["column 3", "current_a", "time_s,angle_1_rad,-"]);
        refused(&all.replace("angle_2_rad", "angle_3_rad"), &reading(), &["column 3", "only 2 links"]);
        refused(&all.replace("angle_2_rad", "theta2"), &reading(), &["column 3", "unit"]);
        let cart = "time_s,angle_1_rad,angle_2_rad,x_mm\n0,3,3,0\n0.002,3,3,5\n";
        refused(cart, &reading(), &["line 2", "x_mm", "5.00 mm"]);
        // The negative control: all is said, and nothing is refused.
        assert!(pieces(&all, &reading()).is_ok());
    }

    #[test]
    fn uneven_rows_are_made_even_to_the_fourth_digit_of_a_swing_of_twelve_rows() {
        // A period of 12 rows; each time is off by up to a third of a row, and one row in fifty is missing.
        let (period_s, rate) = (0.033, core::f64::consts::TAU / (12.0 * 0.033));
        let uneven = |row: usize| (row as f64 + ((row * 7919 % 101) as f64 / 50.0 - 1.0) / 3.0) * period_s;
        let times: Vec<f64> = (0..300).filter(|row| row % 50 != 49).map(uneven).collect();
        let worst = |side: bool| {
            let mut worst = 0.0f64;
            for at in 10..290 {
                let time = at as f64 * period_s;
                let row = times.iter().rposition(|&t| t <= time).unwrap();
                let value: f64 = match side {
                    true => weights(&times, row, time, (period_s, SIDE))
                        .iter()
                        .map(|(row, weight)| weight * (rate * times[*row]).sin())
                        .sum(),
                    false => {
                        let share = (time - times[row]) / (times[row + 1] - times[row]);
                        let [from, to] = [row, row + 1].map(|row| (rate * times[row]).sin());
                        from + share * (to - from)
                    }
                };
                worst = worst.max((value - (rate * time).sin()).abs());
            }
            worst
        };
        assert!(worst(true) < 4e-3, "{}", worst(true));
        assert!(worst(false) > 0.05, "the negative control, a straight line: {}", worst(false));
        let found = unevenness(&times, period_s);
        assert!(found.0 == 5 && (found.1 / period_s - 0.19).abs() < 0.03, "{found:?}");
        assert!((period(&times) / period_s - 1.0).abs() < 0.02, "{}", period(&times));
    }
}
