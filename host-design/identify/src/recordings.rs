//! The recordings of one machine: logs of Upright, or tables of measurements.

use std::io::Read;
use std::path::PathBuf;

use upright_design::rig::Rig;

use crate::channel::chain_of;
use crate::error::IdentifyError;
use crate::imposed;
use crate::log::Log;
use crate::modes::fastest_period_s;
use crate::of_rig::is_of;
use crate::record::Record;
use crate::table::{
    Misreading, Reading, RecordingColumns, RecordingError, RecordingRows, RecordingTable, SaidOfTable,
};

/// Periods of the tables of one machine agree to this share.
const SAME_PERIOD: f64 = 1e-3;

/// Least number of rows in a period of the fastest mode: half of them show its frequency, these its decay, too.
const ROWS_PER_PERIOD: f64 = 4.0;

/// The times of the rows of tables.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowTimes {
    /// Time from one row that is used to the next (s).
    pub period_s: f64,
    /// How far the recorded times are from even ones (rms, s); 0 if they are even.
    pub uneven_s: f64,
    /// Period of the fastest mode of the hanging links, by the rig file (s).
    pub fastest_s: f64,
}

impl RowTimes {
    /// Factor on the deviations that fewer rows than one every 2 ms cost: by the Cramér–Rao bound, independent errors
    /// of so many fewer measurements of the same motion determine the parameters so much worse.
    pub fn costs(&self) -> f64 {
        (self.period_s / 2e-3).sqrt()
    }
}

/// Recordings of one machine, each with the path of its file and with an unknown start.
#[derive(Debug, Clone, PartialEq)]
pub enum Recordings {
    /// Logs of Upright.
    Logs(Vec<(PathBuf, Log)>),
    /// Tables of other programs, and how they are to be read.
    Tables(Vec<(PathBuf, RecordingTable)>, Reading),
}

/// The samples of recordings.
pub(crate) struct Recorded {
    pub(crate) record: Record,
    /// The same, sampled more often, if the recording allows it.
    pub(crate) finer: Option<Record>,
    pub(crate) lost_ticks: u64,
    /// Whether the drive is known.
    pub(crate) is_driven: bool,
    /// The times of the rows of tables.
    pub(crate) rows: Option<RowTimes>,
}

impl Recordings {
    /// Reads the files of one machine, all logs or all tables.
    ///
    /// # Errors
    /// [`IdentifyError`] if a file cannot be read, or logs and tables are mixed.
    pub fn from_paths(rig: &Rig, files: &[PathBuf], reading: &Reading) -> Result<Self, IdentifyError> {
        let links = chain_of(rig)?.links.len();
        if files.iter().all(is_log) {
            let read = |file: &PathBuf| match Log::from_path(file) {
                Ok(log) => Ok((file.clone(), log)),
                Err(source) => Err(IdentifyError::Log { file: file.clone(), source }),
            };
            return Ok(Recordings::Logs(files.iter().map(read).collect::<Result<_, _>>()?));
        }
        let read = |file: &PathBuf| match RecordingTable::from_path(file, reading, links) {
            Ok(table) => Ok((file.clone(), table)),
            Err(source) => Err(IdentifyError::Table { file: file.clone(), source }),
        };
        Ok(Recordings::Tables(files.iter().map(read).collect::<Result<_, _>>()?, reading.clone()))
    }

    /// The samples.
    ///
    /// # Errors
    /// [`IdentifyError`] if a recording is not of the rig, or contradicts what is said about it.
    pub(crate) fn recorded(&self, rig: &Rig) -> Result<Recorded, IdentifyError> {
        chain_of(rig)?;
        match self {
            Recordings::Logs(logs) => {
                logs.iter().try_for_each(|(file, log)| is_of(rig, log, file))?;
                logs.iter().try_for_each(|(file, log)| imposed::counts_its_pulses(log, file))?;
                let lost_ticks = logs.iter().map(|(_, log)| log.lost()).sum();
                let logs: Vec<Log> = logs.iter().map(|(_, log)| log.clone()).collect();
                let stride = Record::usual_stride(rig.tick.period_s);
                let finer = (stride > 1).then(|| Record::of(rig, &logs, (stride / 2).max(1)));
                let record = Record::of(rig, &logs, stride);
                Ok(Recorded { record, finer, lost_ticks, is_driven: true, rows: None })
            }
            Recordings::Tables(tables, reading) => of_tables(rig, tables, reading, None),
        }
    }

    /// The samples of tables that were described wrongly, whatever their values say against it.
    ///
    /// # Errors
    /// [`IdentifyError`] if they cannot be of this rig.
    pub(crate) fn reread(&self, rig: &Rig, misread: &[Misreading]) -> Result<Recorded, IdentifyError> {
        match self {
            Recordings::Logs(_) => self.recorded(rig),
            Recordings::Tables(tables, reading) => of_tables(rig, tables, reading, Some(misread)),
        }
    }

    /// What tables were said to be; none of logs.
    ///
    /// # Errors
    /// [`IdentifyError`] if a column is unknown, missing or ambiguous.
    pub(crate) fn said(&self, rig: &Rig) -> Result<Option<SaidOfTable>, IdentifyError> {
        let Recordings::Tables(tables, reading) = self else { return Ok(None) };
        let said = |(file, table): &(PathBuf, RecordingTable)| match RecordingColumns::of(rig, reading, table)
        {
            Ok(columns) => Ok(columns.said(table)),
            Err(source) => Err(IdentifyError::Table { file: file.clone(), source }),
        };
        tables.first().map(said).transpose()
    }

    /// The first `seconds` of tables, and all of logs.
    ///
    /// # Errors
    /// [`IdentifyError`] if a table cannot be read.
    pub(crate) fn beginning(&self, rig: &Rig, seconds: f64) -> Result<Self, IdentifyError> {
        let Recordings::Tables(tables, reading) = self else { return Ok(self.clone()) };
        let (mut begun, mut left) = (Vec::new(), seconds);
        for (file, table) in tables {
            let one = [(file.clone(), table.clone())];
            let period_s = of_tables(rig, &one, reading, Some(&[]))?.record.period_s();
            let part = table.beginning((left / period_s).ceil() as usize);
            left -= part.rows() as f64 * period_s;
            begun.push((file.clone(), part));
            if left < 1.0 {
                break;
            }
        }
        Ok(Recordings::Tables(begun, reading.clone()))
    }
}

/// Whether a file begins as a log does, or cannot be read at all.
fn is_log(file: &PathBuf) -> bool {
    let mut first = Vec::new();
    let read =
        std::fs::File::open(file).and_then(|open| open.take(Log::MARK.len() as u64).read_to_end(&mut first));
    read.is_err() || first == Log::MARK
}

fn of_tables(
    rig: &Rig,
    tables: &[(PathBuf, RecordingTable)],
    reading: &Reading,
    misread: Option<&[Misreading]>,
) -> Result<Recorded, IdentifyError> {
    let (mut rows, mut is_driven, mut is_force) = (Vec::<RecordingRows>::new(), false, false);
    let fastest_s = fastest_period_s(chain_of(rig)?, reading.is_clamped)?;
    for (file, table) in tables {
        let at_file = |source: RecordingError| IdentifyError::Table { file: file.clone(), source };
        let columns =
            RecordingColumns::of(rig, reading, table).map_err(at_file)?.reread(misread.unwrap_or_default());
        let pieces = columns.pieces(table, fastest_s, misread.is_none()).map_err(at_file)?;
        let period_s = pieces.first().map_or(0.0, |piece| piece.period_s);
        if let Some(first) = rows.first()
            && (period_s / first.period_s - 1.0).abs() > SAME_PERIOD
        {
            return Err(at_file(RecordingError::Open {
                what: format!(
                    "a row every {:.4} ms, the files before every {:.4} ms",
                    1e3 * period_s,
                    1e3 * first.period_s
                ),
                remedy: "identify recordings with different periods one by one".to_owned(),
            }));
        }
        within_reach(period_s, fastest_s).map_err(at_file)?;
        let is_moved = rig.actuator.held().is_motion() && !reading.is_clamped;
        (is_driven, is_force) = (columns.is_driven() || is_moved, columns.is_force);
        rows.extend(pieces);
    }
    let lost_ticks = rows.iter().map(|piece| piece.missing).sum();
    let uneven_s = rows.iter().map(|piece| piece.uneven_s).fold(0.0, f64::max);
    let record = Record::of_rows(rig, rows, is_force, reading.is_clamped);
    let rows = Some(RowTimes { period_s: record.dt_s, uneven_s, fastest_s });
    Ok(Recorded { record, finer: None, lost_ticks, is_driven, rows })
}

/// Checks that rows every `period_s` show the fastest mode, with the period `fastest_s`.
fn within_reach(period_s: f64, fastest_s: f64) -> Result<(), RecordingError> {
    if fastest_s >= ROWS_PER_PERIOD * period_s {
        return Ok(());
    }
    Err(RecordingError::Open {
        what: format!(
            "a row every {:.1} ms does not show the fastest mode of the hanging links, whose period is {:.0} ms",
            1e3 * period_s,
            1e3 * fastest_s
        ),
        remedy: format!("record every {:.1} ms or more often", 1e3 * fastest_s / ROWS_PER_PERIOD),
    })
}
