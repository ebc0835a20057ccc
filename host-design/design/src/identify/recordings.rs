//! The recordings of one machine: logs of Upright, or tables of measurements.

use std::io::Read;
use std::path::PathBuf;

use super::channel::chain_of;
use super::error::IdentifyError;
use super::imposed;
use super::log::Log;
use super::of_rig::is_of;
use super::record::Record;
use super::table::{Reading, RecordingColumns, RecordingError, RecordingRows, RecordingTable};
use crate::rig::Rig;

/// Periods of the tables of one machine agree to this share.
const SAME_PERIOD: f64 = 1e-3;

/// Recordings of one machine, each with the path of its file and with an unknown start.
#[derive(Debug, Clone, PartialEq)]
pub enum Recordings {
    /// Logs of Upright.
    Logs(Vec<(PathBuf, Log)>),
    /// Tables of other programs, and how they are to be read.
    Tables(Vec<(PathBuf, RecordingTable)>, Reading),
}

/// The samples of recordings.
pub(super) struct Recorded {
    pub(super) record: Record,
    /// The same, sampled more often, if the recording allows it.
    pub(super) finer: Option<Record>,
    pub(super) lost_ticks: u64,
    /// Whether the drive is known.
    pub(super) is_driven: bool,
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
    pub(super) fn recorded(&self, rig: &Rig) -> Result<Recorded, IdentifyError> {
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
                Ok(Recorded { record, finer, lost_ticks, is_driven: true })
            }
            Recordings::Tables(tables, reading) => of_tables(rig, tables, reading),
        }
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
) -> Result<Recorded, IdentifyError> {
    let (mut rows, mut is_driven, mut is_force) = (Vec::<RecordingRows>::new(), false, false);
    for (file, table) in tables {
        let at_file = |source: RecordingError| IdentifyError::Table { file: file.clone(), source };
        let columns = RecordingColumns::of(rig, reading, table).map_err(at_file)?;
        let pieces = columns.pieces(table).map_err(at_file)?;
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
        let is_moved = rig.actuator.acceleration.is_some() && !reading.is_clamped;
        (is_driven, is_force) = (columns.is_driven() || is_moved, columns.is_force);
        rows.extend(pieces);
    }
    let record = Record::of_rows(rig, rows, is_force, reading.is_clamped);
    Ok(Recorded { record, finer: None, lost_ticks: 0, is_driven })
}
