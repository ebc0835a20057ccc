//! The columns of a table by their meaning, and the measurements in them.

use core::f64::consts::{PI, TAU};

use upright_design::rig::Rig;

use super::column::{Column, ColumnScale};
use super::error::RecordingError;
use super::reading::{AngleReference, AngleZero, Reading};
use super::text::RecordingTable;

/// Number of a column, and the factor from its values to SI units, with the sign.
pub(super) type Scaled = (usize, f64);

/// The columns of a table by their meaning.
#[derive(Debug, Clone)]
pub(crate) struct RecordingColumns {
    pub(super) time: Option<Scaled>,
    pub(super) period_s: Option<f64>,
    pub(super) cart: Option<Scaled>,
    pub(super) angles: Vec<Scaled>,
    /// Factors by which the deviations from hanging of the angles are too large.
    pub(super) stretch: Vec<f64>,
    /// The same of the angles of joints that were added up to angles against the vertical.
    pub(super) joints: Vec<f64>,
    pub(super) drive: Option<Scaled>,
    /// Whether the drive is a force, and not a voltage.
    pub(crate) is_force: bool,
    pub(super) reference: AngleReference,
    pub(super) zero: AngleZero,
    /// Travel of the cart per count (m); how far it may move when it is clamped.
    pub(super) cart_step_m: f64,
    pub(super) is_clamped: bool,
}

impl RecordingColumns {
    /// The meaning of the columns of `table`, a recording of `rig`.
    ///
    /// # Errors
    /// [`RecordingError`] if a column is unknown, missing or ambiguous, or does not suit the rig.
    pub(crate) fn of(rig: &Rig, reading: &Reading, table: &RecordingTable) -> Result<Self, RecordingError> {
        let sensors = rig.sensors();
        let links = sensors.len() - 1;
        let meanings = meanings(table, links)?;
        let supply_v = rig.actuator.motor().map(|motor| motor.supply_v);
        let mut columns = Self {
            time: None,
            period_s: reading.period_s,
            cart: None,
            angles: vec![(usize::MAX, 0.0); links],
            stretch: vec![1.0; links],
            joints: vec![1.0; links],
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
    pub(crate) fn is_driven(&self) -> bool {
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

    /// Deviations from hanging of all rows, cart and joints, continuous across full turns.
    pub(super) fn deviations(&self, table: &RecordingTable) -> Vec<f64> {
        let channels = self.angles.len() + 1;
        let mut y = Vec::with_capacity(table.lines.len() * channels);
        for row in 0..table.lines.len() {
            let value = |&(index, factor): &Scaled| factor * table.row(row)[index];
            y.push(if self.is_clamped { 0.0 } else { self.cart.as_ref().map_or(0.0, value) });
            let hanging = if self.zero == AngleZero::Upright { PI } else { 0.0 };
            let mut below = hanging;
            for (joint, angle) in self.angles.iter().map(value).enumerate() {
                let is_absolute = joint == 0 || self.reference == AngleReference::Absolute;
                let rest = if is_absolute { hanging } else { 0.0 };
                let angle = match self.stretch[joint] {
                    1.0 => angle,
                    stretch => rest + (angle - rest) / stretch,
                };
                let relative = if is_absolute { (angle - below) / self.joints[joint] } else { angle };
                below = angle;
                // The angle nearest to the one before, at first the one nearest to hanging.
                let before = if row > 0 { y[(row - 1) * channels + joint + 1] } else { 0.0 };
                y.push(relative - TAU * ((relative - before) / TAU).round());
            }
        }
        y
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
