//! Signs, swapped encoders, counts per turn and the sign of the motor: which wiring explains the log best.

use super::channel::channel_name;
use super::model::Model;
use super::parameters::Prior;
use super::record::Record;
use super::shooting::{Shooting, WINDOW_S};
use crate::parallel;

/// Begin and end of the part of the log that is used (s).
const TIME_S: [f64; 2] = [0.5, 5.0];
/// Iterations for each wiring.
const ITERATIONS: usize = 4;
/// Wrong counts per turn that are tried.
const FACTORS: [f64; 4] = [0.25, 0.5, 2.0, 4.0];
/// A wiring other than that of the file is believed when the residuals are smaller by this factor.
const MARGIN: f64 = 2.0;

/// A wiring. Channels are cart (0) and joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WiringFault {
    /// As in the file.
    AsInFile,
    /// The motor turns the other way.
    MotorReversed,
    /// An encoder counts the other way.
    Reversed(usize),
    /// Two encoders of joints are exchanged.
    Swapped(usize, usize),
    /// An encoder gives this many times the counts that the file states.
    Counts(usize, f64),
}

/// Result of the wiring check.
#[derive(Debug, Clone, PartialEq)]
pub struct WiringFound {
    /// The wiring that explains the log best.
    pub best: WiringFault,
    /// Factor by which the residuals of the second-best wiring are larger (geometric mean over the channels).
    pub margin: f64,
    /// Factor by which the residuals of the file's wiring are larger; 1 if it is the best.
    pub file_is_worse_by: f64,
}

impl WiringFound {
    /// Whether the wiring is taken to be that of the file: no other explains the log clearly better.
    pub fn is_as_in_file(&self) -> bool {
        self.best == WiringFault::AsInFile || self.file_is_worse_by < MARGIN
    }
}

impl core::fmt::Display for WiringFault {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            WiringFault::AsInFile => write!(f, "as in the file"),
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
            WiringFault::Counts(channel, factor) => write!(
                f,
                "the encoder of {} gives {factor} times the counts of the file: correct its resolution in the file",
                channel_name(channel)
            ),
        }
    }
}

/// The record as it would have been with the wiring of the file, if it was recorded with `wiring`.
fn undone(record: &Record, wiring: WiringFault) -> Record {
    match wiring {
        WiringFault::AsInFile => record.clone(),
        WiringFault::MotorReversed => record.reversed(),
        WiringFault::Reversed(channel) => record.rewired(|row| scaled(row, channel, -1.0)),
        WiringFault::Counts(channel, factor) => record.rewired(|row| scaled(row, channel, 1.0 / factor)),
        WiringFault::Swapped(one, other) => record.rewired(|row| {
            let mut row = row.to_vec();
            row.swap(one, other);
            row
        }),
    }
}

fn scaled(row: &[f64], channel: usize, factor: f64) -> Vec<f64> {
    let mut row = row.to_vec();
    row[channel] *= factor;
    row
}

/// All wirings that are tried, that of the file first.
fn wirings(channels: usize) -> Vec<WiringFault> {
    let mut all = vec![WiringFault::AsInFile, WiringFault::MotorReversed];
    all.extend((0..channels).map(WiringFault::Reversed));
    for one in 1..channels {
        all.extend((one + 1..channels).map(|other| WiringFault::Swapped(one, other)));
    }
    all.extend((0..channels).flat_map(|channel| FACTORS.map(|factor| WiringFault::Counts(channel, factor))));
    all
}

/// Fits a few iterations with each wiring; calls `progress` after each.
pub(super) fn find(
    model: &Model,
    record: &Record,
    priors: &[Prior],
    progress: &(dyn Fn() + Sync),
) -> WiringFound {
    let short = record.part(TIME_S[0], TIME_S[1]);
    let short = if short.pieces.is_empty() { record.clone() } else { short };
    let start: Vec<f64> = priors.iter().map(|prior| prior.value).collect();
    let all = wirings(record.channels);
    let score = |&wiring: &WiringFault| {
        let record = undone(&short, wiring);
        let shooting = Shooting { model, record: &record, priors, free: true };
        let fit = shooting.fit_settled(&start, WINDOW_S, ITERATIONS, 1);
        // Relative to the motion: a factor on the counts must not make residuals small.
        let of = |(channel, rms): (usize, &f64)| {
            libm::log(rms.max(0.2 * record.steps[channel]) / record.extent(channel)[1])
        };
        let score = fit.rms.iter().enumerate().map(of).sum::<f64>() / record.channels as f64;
        progress();
        (if score.is_nan() { f64::INFINITY } else { score }, wiring)
    };
    let mut scores = parallel::map(&all, score);
    let of_file = scores[0].0;
    scores.sort_by(|one, other| one.0.total_cmp(&other.0));
    WiringFound {
        best: scores[0].1,
        margin: libm::exp(scores[1].0 - scores[0].0),
        file_is_worse_by: libm::exp(of_file - scores[0].0),
    }
}

/// Number of wirings that are tried for this many channels.
pub(super) fn count(channels: usize) -> u64 {
    wirings(channels).len() as u64
}
