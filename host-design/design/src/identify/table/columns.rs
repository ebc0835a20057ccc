//! The columns of a table by their meaning, and the measurements in them.

use core::f64::consts::{PI, TAU};

use super::column::{Column, ColumnScale};
use super::error::RecordingError;
use super::reading::{AngleReference, AngleZero, Reading};
use super::text::RecordingTable;
use crate::rig::Rig;

/// A pause of more than this many periods begins a new piece.
const GAP_PERIODS: f64 = 1.5;
/// Uneven times are made even by interpolation if they are off by more than this share of the period.
const JITTER: f64 = 0.02;
/// Longest time from one row to the next (s).
const LONGEST_S: f64 = 0.010_1;
/// Most counts by which a clamped cart may move.
const CLAMPED_COUNTS: f64 = 10.0;

/// Number of a column, and the factor from its values to SI units, with the sign.
type Scaled = (usize, f64);

/// The columns of a table by their meaning.
#[derive(Debug, Clone)]
pub(in crate::identify) struct RecordingColumns {
    time: Option<Scaled>,
    period_s: Option<f64>,
    cart: Option<Scaled>,
    angles: Vec<Scaled>,
    drive: Option<Scaled>,
    /// Whether the drive is a force, and not a voltage.
    pub(in crate::identify) is_force: bool,
    reference: AngleReference,
    zero: AngleZero,
    /// Travel of the cart per count (m); how far it may move when it is clamped.
    cart_step_m: f64,
    is_clamped: bool,
}

/// Consecutive rows at equal intervals.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::identify) struct RecordingRows {
    /// Time from one row to the next (s).
    pub(in crate::identify) period_s: f64,
    /// Deviations from hanging (m, rad), one row of cart and joints per sample; 0 for a clamped cart.
    pub(in crate::identify) y: Vec<f64>,
    /// Force (N) or voltage (V), one per sample; none without a drive.
    pub(in crate::identify) drive: Vec<Option<f64>>,
}

impl RecordingColumns {
    /// The meaning of the columns of `table`, a recording of `rig`.
    ///
    /// # Errors
    /// [`RecordingError`] if a column is unknown, missing or ambiguous, or does not suit the rig.
    pub(in crate::identify) fn of(
        rig: &Rig,
        reading: &Reading,
        table: &RecordingTable,
    ) -> Result<Self, RecordingError> {
        let sensors = rig.sensors();
        let links = sensors.len() - 1;
        let meanings = meanings(table, links)?;
        let supply_v = rig.actuator.motor.as_ref().map(|motor| motor.supply_v);
        let mut columns = Self {
            time: None,
            period_s: reading.period_s,
            cart: None,
            angles: vec![(usize::MAX, 0.0); links],
            drive: None,
            is_force: false,
            reference: reference(reading, table, &meanings)?,
            zero: zero(reading, table, &meanings)?,
            cart_step_m: sensors[0].step(),
            is_clamped: reading.is_clamped,
        };
        for (index, meaning) in meanings.iter().enumerate() {
            let sign = if reading.reversed.contains(&table.names[index]) { -1.0 } else { 1.0 };
            let scaled = |scale: ColumnScale, step: f64| match scale {
                ColumnScale::Factor(factor) => (index, sign * factor),
                ColumnScale::Counts => (index, sign * step),
            };
            match *meaning {
                Column::Ignored => (),
                Column::Time(factor) => columns.time = Some((index, factor)),
                Column::Cart(scale) => columns.cart = Some(scaled(scale, columns.cart_step_m)),
                Column::Angle { link, scale, .. } => {
                    let step =
                        reading.counts_per_turn.map_or(sensors[link + 1].step(), |counts| TAU / counts);
                    columns.angles[link] = scaled(scale, step);
                }
                Column::Force => (columns.drive, columns.is_force) = (Some((index, sign)), true),
                Column::Voltage | Column::Duty => {
                    let supply_v = supply_v.ok_or_else(|| without_motor(table, index))?;
                    let factor = if *meaning == Column::Duty { supply_v } else { 1.0 };
                    columns.drive = Some((index, sign * factor));
                }
            }
        }
        columns.check(reading, table)?;
        Ok(columns)
    }

    /// Whether the drive is measured.
    pub(in crate::identify) fn is_driven(&self) -> bool {
        self.drive.is_some()
    }

    fn check(&self, reading: &Reading, table: &RecordingTable) -> Result<(), RecordingError> {
        let open = |what: String, remedy: &str| Err(RecordingError::Open { what, remedy: remedy.to_owned() });
        if let Some(unknown) = reading.reversed.iter().find(|name| !table.names.contains(name)) {
            return open(format!("--reversed names {unknown}, which is no column"), "correct the name");
        }
        if let Some(link) = self.angles.iter().position(|&(index, _)| index == usize::MAX) {
            let what = format!("no column has the angle of link {}", link + 1);
            return open(what, "name it with --columns, or use the rig file of this machine");
        }
        if self.time.is_some() == self.period_s.is_some() {
            return match self.time {
                Some(_) => open("a column has the time, and --period is given".to_owned(), "leave one out"),
                None => {
                    open("no column has the time".to_owned(), "give the time between two rows with --period")
                }
            };
        }
        if self.cart.is_none() && !self.is_clamped {
            return open(
                "no column has the position of the cart".to_owned(),
                "name it with --columns, or say --clamped if the cart could not move",
            );
        }
        if self.drive.is_some() && self.is_clamped {
            return open(
                "a clamped cart has a drive".to_owned(),
                "leave --clamped out, or call its column -",
            );
        }
        Ok(())
    }

    /// The measurements of a table, in pieces without a gap.
    ///
    /// # Errors
    /// [`RecordingError`] if times do not increase or the values contradict the reading.
    pub(in crate::identify) fn pieces(
        &self,
        table: &RecordingTable,
    ) -> Result<Vec<RecordingRows>, RecordingError> {
        let times = self.times(table)?;
        let period_s =
            self.period_s.unwrap_or_else(|| median(times.windows(2).map(|pair| pair[1] - pair[0])));
        if !(period_s > 0.0 && period_s <= LONGEST_S) {
            return Err(RecordingError::Open {
                what: format!("{:.1} ms lie between two rows", 1e3 * period_s),
                remedy: format!("record every {:.0} ms or more often", 1e3 * LONGEST_S),
            });
        }
        let deviations = self.deviations(table)?;
        let mut pieces = Vec::new();
        let mut from = 0;
        for to in 1..=times.len() {
            if to == times.len() || times[to] - times[to - 1] > GAP_PERIODS * period_s {
                pieces.push(self.piece(table, &times, &deviations, from..to, period_s));
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
        match times.windows(2).position(|pair| pair[1] <= pair[0]) {
            Some(row) => Err(RecordingError::Contradicts {
                line: table.lines[row + 1],
                column: table.names[index].clone(),
                what: "the time does not increase".to_owned(),
                remedy: "give each recording as a file of its own".to_owned(),
            }),
            None => Ok(times),
        }
    }

    /// Deviations from hanging of all rows, cart and joints, continuous across full turns.
    fn deviations(&self, table: &RecordingTable) -> Result<Vec<f64>, RecordingError> {
        let channels = self.angles.len() + 1;
        let mut y = Vec::with_capacity(table.lines.len() * channels);
        for row in 0..table.lines.len() {
            let value = |&(index, factor): &Scaled| factor * table.row(row)[index];
            y.push(if self.is_clamped { 0.0 } else { self.cart.as_ref().map_or(0.0, value) });
            let mut below = if self.zero == AngleZero::Upright { PI } else { 0.0 };
            for (joint, angle) in self.angles.iter().map(value).enumerate() {
                let relative = if joint == 0 || self.reference == AngleReference::Absolute {
                    angle - below
                } else {
                    angle
                };
                below = angle;
                // The angle nearest to the one before, at first the one nearest to hanging.
                let before = if row > 0 { y[(row - 1) * channels + joint + 1] } else { 0.0 };
                y.push(relative - TAU * ((relative - before) / TAU).round());
            }
        }
        self.contradiction(table, &y).map_or(Ok(y), Err)
    }

    /// What the values say against the reading.
    fn contradiction(&self, table: &RecordingTable, y: &[f64]) -> Option<RecordingError> {
        let channels = self.angles.len() + 1;
        let at_first_row = |index: usize, what: String, remedy: &str| RecordingError::Contradicts {
            line: table.lines[0],
            column: table.names[index].clone(),
            what,
            remedy: remedy.to_owned(),
        };
        let first =
            median(y.iter().skip(1).step_by(channels).map(|angle| angle - TAU * (angle / TAU).round()));
        if self.drive.is_none() && first.abs() > PI / 2.0 {
            let (now, other) =
                if self.zero == AngleZero::Upright { ("upright", "hanging") } else { ("hanging", "upright") };
            let what = format!(
                "with --zero {now}, link 1 would stay {:.0}° from hanging without a drive",
                first.abs().to_degrees()
            );
            return Some(at_first_row(
                self.angles[0].0,
                what,
                &format!("say --zero {other}, or turn its sense with --reversed"),
            ));
        }
        if let (Some((index, factor)), true) = (self.cart, self.is_clamped) {
            let values = || (0..table.lines.len()).map(|row| factor * table.row(row)[index]);
            let moved = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
            if moved > CLAMPED_COUNTS * self.cart_step_m {
                let what = format!("the cart moves by {:.2} mm, although it is clamped", 1e3 * moved);
                return Some(at_first_row(index, what, "leave --clamped out"));
            }
        }
        None
    }

    /// The rows of `range`, at equal intervals.
    fn piece(
        &self,
        table: &RecordingTable,
        times: &[f64],
        y: &[f64],
        range: core::ops::Range<usize>,
        period_s: f64,
    ) -> RecordingRows {
        let (channels, start) = (self.angles.len() + 1, times[range.start]);
        let drive = |row: usize| self.drive.map(|(index, factor)| factor * table.row(row)[index]);
        let is_even = range.clone().all(|row| {
            (times[row] - start - (row - range.start) as f64 * period_s).abs() <= JITTER * period_s
        });
        if is_even {
            let y = y[range.start * channels..range.end * channels].to_vec();
            return RecordingRows { period_s, y, drive: range.map(drive).collect() };
        }
        let mut even = RecordingRows { period_s, y: Vec::new(), drive: Vec::new() };
        let (mut row, mut time) = (range.start, start);
        while row + 1 < range.end {
            let share = (time - times[row]) / (times[row + 1] - times[row]);
            let of = |row: usize| &y[row * channels..][..channels];
            even.y.extend(of(row).iter().zip(of(row + 1)).map(|(from, to)| from + share * (to - from)));
            even.drive.push(drive(row));
            time = start + even.drive.len() as f64 * period_s;
            while row + 1 < range.end && times[row + 1] < time {
                row += 1;
            }
        }
        even
    }
}

/// The meaning of each column; angles only of links that the rig has, and nothing twice.
fn meanings(table: &RecordingTable, links: usize) -> Result<Vec<Column>, RecordingError> {
    let refused = |index: usize, problem: String| {
        let names = table.names.iter().enumerate();
        let columns: Vec<&str> = names.map(|(other, name)| if other == index { "-" } else { name }).collect();
        RecordingError::Column {
            column: index + 1,
            name: table.names[index].clone(),
            problem,
            columns: columns.join(","),
        }
    };
    let mut found: Vec<Column> = Vec::new();
    for (index, name) in table.names.iter().enumerate() {
        let column = Column::of(name).map_err(|problem| refused(index, problem))?;
        if let Column::Angle { link, .. } = column
            && link >= links
        {
            return Err(refused(index, format!("the rig has only {links} links")));
        }
        if let Some(twin) =
            found.iter().position(|other| other.quantity() == column.quantity() && *other != Column::Ignored)
        {
            return Err(refused(index, format!("measures the same as column {}", twin + 1)));
        }
        found.push(column);
    }
    Ok(found)
}

fn without_motor(table: &RecordingTable, index: usize) -> RecordingError {
    RecordingError::Contradicts {
        line: table.lines[0],
        column: table.names[index].clone(),
        what: "the rig has no motor".to_owned(),
        remedy: "describe it in [actuator], or give the force on the cart".to_owned(),
    }
}

/// Names of the columns with angles, and whether all are named as angles of joints.
fn angles(table: &RecordingTable, meanings: &[Column]) -> (String, bool) {
    let named = table.names.iter().zip(meanings).filter(|(_, column)| matches!(column, Column::Angle { .. }));
    let is_of_joint = |column: &Column| !matches!(column, Column::Angle { is_of_joint: false, .. });
    (named.map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", "), meanings.iter().all(is_of_joint))
}

/// What the angles are measured against: as `reading` says, or as their names say.
fn reference(
    reading: &Reading,
    table: &RecordingTable,
    meanings: &[Column],
) -> Result<AngleReference, RecordingError> {
    let (names, are_of_joints) = angles(table, meanings);
    let is_one = meanings.iter().filter(|column| matches!(column, Column::Angle { .. })).count() < 2;
    match reading.angles {
        Some(reference) => Ok(reference),
        None if is_one || are_of_joints => Ok(AngleReference::Relative),
        None => Err(RecordingError::Open {
            what: format!("{names} may be measured against the vertical or against the link below"),
            remedy: "say --angles absolute or --angles relative".to_owned(),
        }),
    }
}

/// Where the angles are 0: as `reading` says; the angles of joints of our own tables are 0 when the links hang.
fn zero(reading: &Reading, table: &RecordingTable, meanings: &[Column]) -> Result<AngleZero, RecordingError> {
    let (names, are_of_joints) = angles(table, meanings);
    match reading.zero {
        Some(zero) => Ok(zero),
        None if are_of_joints => Ok(AngleZero::Hanging),
        None => Err(RecordingError::Open {
            what: format!("{names} may be 0 with the links upright or hanging"),
            remedy: "say --zero upright or --zero hanging".to_owned(),
        }),
    }
}

/// The median; 0 of nothing.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

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
        RecordingColumns::of(&rig(), reading, &table)?.pieces(&table)
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
}
