//! Signs, swapped encoders, counts per turn and the sign of the motor: which wiring explains the log best.

use upright_design::number::significant;

use crate::channel::channel_name;
use crate::record::Record;
use crate::table::{FACTORS, Misreading, SaidOfTable};

/// A wiring other than that of the file is believed when the residuals are smaller by this factor.
const MARGIN: f64 = 2.0;
/// Another reading of a table is believed only if its residuals are at most this share of the motion: of hundreds of
/// readings, one or the other fits better than that which was described even if none is right.
const MOST_RESIDUAL: f64 = 0.005;

/// A fault of the wiring. Channels are cart (0) and joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WiringFault {
    /// The motor turns the other way.
    MotorReversed,
    /// An encoder counts the other way.
    Reversed(usize),
    /// Two encoders of joints are exchanged.
    Swapped(usize, usize),
    /// An encoder gives this many times the counts that the file states.
    Counts(usize, f64),
    /// A drive that imposes the cart's motion moves it against its pulses.
    DriveReversed,
    /// Such a drive moves the cart by this many times the travel per pulse that the file states.
    Step(f64),
    /// A table was described wrongly.
    Misread(Misreading),
}

/// A wiring: its faults, none if it is that of the file.
///
/// A machine seen from behind is the same machine: with all encoders and the motor reversed it moves as before. So
/// a set of reversed encoders cannot be told from the others and the motor. Here the motor is reversed only where all
/// encoders would have to be. Where the drive imposes the cart's motion, a set is the same as all others.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Wiring {
    /// What is wrong.
    pub faults: Vec<WiringFault>,
    /// Number of channels.
    pub channels: usize,
    /// Whether the drive imposes the cart's motion.
    pub is_moved: bool,
    /// What a table was said to be; none of a log.
    pub said: Option<SaidOfTable>,
}

/// Result of the wiring check.
#[derive(Debug, Clone, PartialEq)]
pub struct WiringFound {
    /// The wiring that explains the log best.
    pub best: Wiring,
    /// The one that explains it second best.
    pub second: Wiring,
    /// Factor by which the residuals of the second-best wiring are larger (geometric mean over the channels).
    pub margin: f64,
    /// Factor by which the residuals of the file's wiring are larger; 1 if it is the best.
    pub file_is_worse_by: f64,
    /// Residuals of the best one as a share of the motion (geometric mean over the channels).
    pub residual: f64,
}

impl WiringFound {
    /// Whether the wiring is taken to be that of the file: no other explains the log clearly better.
    pub fn is_as_in_file(&self) -> bool {
        let is_explained = self.best.said.is_none() || self.residual < MOST_RESIDUAL;
        self.best.faults.is_empty() || self.file_is_worse_by < MARGIN || !is_explained
    }

    /// Whether the second-best wiring may be the right one, too.
    pub fn is_ambiguous(&self) -> bool {
        self.margin < MARGIN
    }
}

impl core::fmt::Display for WiringFault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            WiringFault::MotorReversed => write!(f, "the motor is reversed: exchange its two wires"),
            WiringFault::Reversed(channel) => {
                write!(
                    f,
                    "the encoder of {} counts backwards: exchange its channels A and B",
                    channel_name(channel)
                )
            }
            WiringFault::Swapped(one, other) => {
                write!(f, "the encoders of joint {one} and joint {other} are exchanged: exchange their plugs")
            }
            WiringFault::DriveReversed => write!(
                f,
                "the cart moves against its pulses: exchange the wires of one coil of the motor, or invert the direction signal"
            ),
            WiringFault::Step(factor) => write!(
                f,
                "a pulse moves the cart by {} times step_m: correct step_m in the file, or the driver's microsteps",
                significant(factor, 3)
            ),
            WiringFault::Misread(misreading) => {
                write!(f, "the table is not as it was described: {misreading:?}")
            }
            WiringFault::Counts(channel, factor) => write!(
                f,
                "the encoder of {} gives {} times the counts of the file: correct its resolution in the file",
                channel_name(channel),
                significant(factor, 3)
            ),
        }
    }
}

impl core::fmt::Display for Wiring {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        if self.faults.is_empty() {
            return f.write_str("as in the file");
        }
        let text = |fault: &WiringFault| match (fault, &self.said) {
            (WiringFault::Misread(misreading), Some(said)) => said.explain(*misreading),
            _ => fault.to_string(),
        };
        let faults: Vec<String> = self.faults.iter().map(text).collect();
        f.write_str(&faults.join("; "))?;
        let reversed = self.reversed();
        if let (Some(said), false) = (&self.said, reversed.is_empty()) {
            return write!(f, " (or else reverse all others: {})", said.names_without(&reversed).join(", "));
        }
        if reversed.len() > 1 || (self.is_moved && 2 * reversed.len() == self.channels) {
            let name = |channel: usize| match channel {
                0 if self.is_moved => "the drive".to_owned(),
                channel => channel_name(channel),
            };
            let others = (0..self.channels).filter(|channel| !reversed.contains(channel)).map(name);
            let motor = (!self.is_moved).then(|| "the motor".to_owned());
            let others: Vec<String> = others.chain(motor).collect();
            write!(f, " (or else reverse all others: {})", others.join(", "))?;
        }
        Ok(())
    }
}

impl Wiring {
    fn with(&self, fault: WiringFault) -> Self {
        let faults = self.faults.iter().copied().chain([fault]).collect();
        Self { faults, ..self.clone() }
    }

    /// How a table was misread.
    pub(crate) fn misread(&self) -> Vec<Misreading> {
        let of = |fault: &WiringFault| match *fault {
            WiringFault::Misread(misreading) => Some(misreading),
            _ => None,
        };
        self.faults.iter().filter_map(of).collect()
    }

    /// The channels whose encoders are reversed.
    fn reversed(&self) -> Vec<usize> {
        let channel = |fault: &WiringFault| match *fault {
            WiringFault::Reversed(channel) | WiringFault::Misread(Misreading::Reversed(channel)) => {
                Some(channel)
            }
            WiringFault::DriveReversed => Some(0),
            _ => None,
        };
        self.faults.iter().filter_map(channel).collect()
    }

    /// The record as it would have been with the wiring of the file, if it was recorded with this one.
    pub(crate) fn undone(&self, record: &Record) -> Record {
        self.faults.iter().rev().fold(record.clone(), |record, &fault| match fault {
            // Undone where the table is read.
            WiringFault::Misread(_) => record,
            WiringFault::MotorReversed => record.reversed(),
            WiringFault::Reversed(channel) => record.rewired(|row| scaled(row, channel, -1.0)),
            WiringFault::DriveReversed => record.rewired(|row| scaled(row, 0, -1.0)),
            WiringFault::Step(factor) => record.rewired(|row| scaled(row, 0, factor)),
            WiringFault::Counts(channel, factor) => record.rewired(|row| scaled(row, channel, 1.0 / factor)),
            WiringFault::Swapped(one, other) => record.rewired(|row| {
                let mut row = row.to_vec();
                row.swap(one, other);
                row
            }),
        })
    }

    /// Every combination of reversed encoders and motor, as in the file first.
    fn signs(channels: usize, is_moved: bool) -> Vec<Self> {
        let of = |set: usize| {
            let reversed = (0..channels).filter(|channel| set >> channel & 1 == 1);
            let fault = |channel: usize| match channel {
                0 if is_moved => WiringFault::DriveReversed,
                channel => WiringFault::Reversed(channel),
            };
            let faults = match set.count_ones() as usize == channels {
                true => vec![WiringFault::MotorReversed],
                false => reversed.map(fault).collect(),
            };
            Self { faults, channels, is_moved, said: None }
        };
        // Of a set and all others, the smaller one; of two that are equally large, that with the drive.
        let is_smaller = |set: &usize| {
            let twice = 2 * set.count_ones() as usize;
            twice < channels || (twice == channels && set & 1 == 1)
        };
        (0..1 << channels).filter(|set| !is_moved || is_smaller(set)).map(of).collect()
    }

    /// This wiring with one more fault that is no sign: another pair, or an encoder whose counts are not yet wrong.
    pub(crate) fn with_another(&self) -> Vec<Self> {
        if let Some(said) = &self.said {
            let is_new =
                |misreading: &Misreading| self.misread().iter().all(|other| !other.is_like(misreading));
            let others = said.others().into_iter().filter(is_new);
            return others.map(|misreading| self.with(WiringFault::Misread(misreading))).collect();
        }
        let pairs = (1..self.channels)
            .flat_map(|one| (one + 1..self.channels).map(move |other| WiringFault::Swapped(one, other)));
        let fault = |channel: usize, factor: f64| match channel {
            0 if self.is_moved => WiringFault::Step(factor),
            channel => WiringFault::Counts(channel, factor),
        };
        let counts = (0..self.channels).flat_map(|channel| FACTORS.map(|factor| fault(channel, factor)));
        let is_of =
            |channel, fault: &WiringFault| matches!(*fault, WiringFault::Counts(of, _) if of == channel);
        let is_new = |fault: &WiringFault| match *fault {
            WiringFault::Counts(channel, _) => !self.faults.iter().any(|other| is_of(channel, other)),
            WiringFault::Step(_) => !self.faults.iter().any(|other| matches!(other, WiringFault::Step(_))),
            _ => !self.faults.contains(fault),
        };
        pairs.chain(counts).filter(is_new).map(|fault| self.with(fault)).collect()
    }

    /// Whether both have the same faults and undo them in the same way: the order matters only for exchanged encoders.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let exchanges = self.faults.iter().any(|fault| {
            matches!(fault, WiringFault::Swapped(..) | WiringFault::Misread(Misreading::Exchanged(..)))
        });
        let same_set = self.faults.len() == other.faults.len()
            && self.faults.iter().all(|fault| other.faults.contains(fault));
        if exchanges { self.faults == other.faults } else { same_set }
    }
}

fn scaled(row: &[f64], channel: usize, factor: f64) -> Vec<f64> {
    let mut row = row.to_vec();
    row[channel] *= factor;
    row
}

/// The wiring of the file, or a table as it was `said` to be, and the others that are tried first.
pub(crate) fn wirings(channels: usize, is_moved: bool, said: Option<SaidOfTable>) -> (Wiring, Vec<Wiring>) {
    let file = Wiring { faults: Vec::new(), channels, is_moved, said };
    let misread = |set: Vec<Misreading>| Wiring {
        faults: set.into_iter().map(WiringFault::Misread).collect(),
        ..file.clone()
    };
    let signs = match &file.said {
        Some(said) => said.senses().into_iter().map(misread).collect(),
        None => Wiring::signs(channels, is_moved).split_off(1),
    };
    let others = signs.into_iter().chain(file.with_another()).collect();
    (file, others)
}
