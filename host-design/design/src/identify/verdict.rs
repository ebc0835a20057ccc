//! Whether an identification may be written.

use super::error::IdentifyError;
use super::normal::Normal;
use super::wiring::{WiringFound, channel_name};

/// Largest variance of the innovations, as a multiple of what the filter expects.
const MOST_VARIANCE: f64 = 1.5;
/// Largest error of a window's prediction, as a share of the channel's motion.
const MOST_ERROR: f64 = 0.02;

/// How well a channel is explained.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelFit {
    /// The cart, or a joint from 1.
    pub name: String,
    /// Variance of the innovations over what the filter expects: 1 if the model is right.
    pub innovation_variance: f64,
    /// Error (rms) over windows of 0.5 s that were not used, with the old file and with the new numbers (m, rad).
    pub held_out: [f64; 2],
    /// How far the channel moved from end to end (m, rad).
    pub range: f64,
    /// What was held out and how it was predicted, sample by sample.
    pub predictions: Vec<Predicted>,
    /// Innovations over their expected deviations, every [`sample_s`](super::Identification::sample_s).
    pub innovations: Vec<f64>,
}

/// A sample that was not used, predicted from the beginning of a window of 0.5 s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Predicted {
    /// Time from the first of these samples on (s).
    pub time_s: f64,
    /// What was measured (m, rad).
    pub measured: f64,
    /// What the old file predicts.
    pub by_file: f64,
    /// What the new numbers predict.
    pub by_found: f64,
}

/// Why nothing is written.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// Another wiring than that of the file.
    Wiring(WiringFound),
    /// The log is not explained.
    Misfit(String),
    /// The numbers belong to no machine.
    NotPhysical(String),
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Refusal::Wiring(found) => write!(
                f,
                "{} (residuals {:.1} times smaller than as wired, {:.1} times smaller than with any other fault); then record \
                 again",
                found.best, found.file_is_worse_by, found.margin
            ),
            Refusal::Misfit(reason) | Refusal::NotPhysical(reason) => f.write_str(reason),
        }
    }
}

/// Whether the fit of all channels is good enough.
pub(super) fn judge(channels: &[ChannelFit]) -> Result<(), Refusal> {
    for fit in channels {
        let share = fit.held_out[1] / fit.range;
        // NaN is no fit.
        let [varies, errs] =
            [fit.innovation_variance <= MOST_VARIANCE, share <= MOST_ERROR].map(|fits| !fits);
        if varies {
            return Err(Refusal::Misfit(format!(
                "{} does not fit: the variance of its innovations is {:.2} times what is expected, at most {MOST_VARIANCE} is \
                 accepted; look for play, a loose encoder or a link that touches something, or record a longer log",
                fit.name, fit.innovation_variance
            )));
        }
        if errs {
            return Err(Refusal::Misfit(format!(
                "{} does not fit: predictions over 0.5 s are off by {:.1} % of its motion, at most {:.0} % are accepted; is \
                 this the log of this machine, and does nothing touch the links?",
                fit.name,
                100.0 * share,
                100.0 * MOST_ERROR
            )));
        }
    }
    Ok(())
}

/// The predictions of a record that was held out: of the old file and of the new numbers.
pub(super) struct HeldOut {
    /// Error (rms) of each channel, with each.
    pub(super) rms: [Vec<f64>; 2],
    /// Of each channel.
    pub(super) predictions: Vec<Vec<Predicted>>,
}

/// The channels, with their names; `over` are the innovations of the whole log, `ranges` how far each channel moved.
pub(super) fn channels(over: &Normal, held: HeldOut, ranges: &[f64]) -> Vec<ChannelFit> {
    let count = ranges.len();
    let one = |(channel, predictions): (usize, Vec<Predicted>)| ChannelFit {
        name: channel_name(channel),
        innovation_variance: over.normalised[channel] / over.count.max(1) as f64,
        held_out: [held.rms[0][channel], held.rms[1][channel]],
        range: ranges[channel],
        predictions,
        innovations: over.innovations.iter().skip(channel).step_by(count).copied().collect(),
    };
    held.predictions.into_iter().enumerate().map(one).collect()
}

impl From<IdentifyError> for Refusal {
    fn from(error: IdentifyError) -> Self {
        Refusal::NotPhysical(error.to_string())
    }
}
