//! Whether an identification is good enough to be written to a rig file.

use crate::channel::channel_name;
use crate::error::IdentifyError;
use crate::normal::Normal;
use crate::window_errors::{WINDOWS_S, WindowErrors};
use crate::wiring::WiringFound;

/// Largest accepted variance of the innovations, as a multiple of what the filter expects.
const MOST_VARIANCE: f64 = 1.5;
/// Largest accepted prediction error (rms) over a window, as a share of the channel's range.
const MOST_ERROR: f64 = 0.02;
/// The same for windows of free swings of each length.
const MOST_ERRORS: [f64; WINDOWS_S.len()] = [0.003, 0.005, 0.008];
/// What the sensors may add to that, as a multiple of their error.
const OF_SENSOR: f64 = 3.0;

/// How well the model explains a channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelFit {
    /// The cart, or a joint from 1.
    pub name: String,
    /// Number of the channel: 0 for the cart, then the joints.
    pub channel: usize,
    /// Variance of the innovations, divided by what the filter expects: 1 if the model is right.
    pub innovation_variance: f64,
    /// Prediction error (rms) over held-out windows of 0.5 s, with the old file and with the new numbers (m, rad).
    pub held_out: [f64; 2],
    /// Range of the channel's motion from end to end (m, rad).
    pub range: f64,
    /// Held-out measurements and their predictions, sample by sample.
    pub predictions: Vec<Predicted>,
    /// Innovations divided by their expected deviations, every [`sample_s`](crate::Identification::sample_s).
    pub innovations: Vec<f64>,
}

/// A held-out sample, predicted from the beginning of a window of 0.5 s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Predicted {
    /// Time since the first held-out sample (s).
    pub time_s: f64,
    /// Measurement (m, rad).
    pub measured: f64,
    /// Prediction with the old file (m, rad).
    pub by_file: f64,
    /// Prediction with the new numbers (m, rad).
    pub by_found: f64,
}

/// Why no rig file is written.
#[derive(Debug, Clone, PartialEq)]
pub enum Refusal {
    /// The wiring differs from that of the file.
    Wiring(Box<WiringFound>),
    /// The model does not explain the log.
    Misfit(String),
    /// The numbers are not physical: no machine has them.
    NotPhysical(String),
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Refusal::Wiring(found) => {
                write!(
                    f,
                    "{} (residuals {:.1} times smaller than as {}, {:.1} times smaller than with any other fault){}",
                    found.best,
                    found.file_is_worse_by,
                    if found.best.said.is_some() { "described" } else { "wired" },
                    found.margin,
                    if found.best.said.is_some() { "" } else { "; then record again" },
                )?;
                if found.is_ambiguous() {
                    write!(f, "; it may also be this: {}", found.second)?;
                }
                Ok(())
            }
            Refusal::Misfit(reason) | Refusal::NotPhysical(reason) => f.write_str(reason),
        }
    }
}

/// A number with so many decimals; a fit that diverges has none.
fn number(value: f64, decimals: usize) -> String {
    if value.is_finite() { format!("{value:.decimals$}") } else { "countless".to_owned() }
}

/// Largest accepted error of predictions over the windows with this index in [`WINDOWS_S`]: as a share of the channel's
/// range, and what its sensor may add, as a multiple of its error.
pub(crate) fn accepted(is_driven: bool, window: usize) -> (f64, f64) {
    let share = MOST_ERRORS[window];
    if is_driven { (share * MOST_ERROR / MOST_ERRORS[0], 0.0) } else { (share, OF_SENSOR) }
}

/// Checks that the fit of every channel is good enough.
pub(crate) fn judge(channels: &[ChannelFit]) -> Result<(), Refusal> {
    for fit in channels {
        let share = fit.held_out[1] / fit.range;
        // Written so that NaN counts as a misfit.
        let [varies, errs] =
            [fit.innovation_variance <= MOST_VARIANCE, share <= MOST_ERROR].map(|fits| !fits);
        if varies {
            return Err(Refusal::Misfit(format!(
                "{} does not fit: the variance of its innovations is {} times what is expected, at most {MOST_VARIANCE} is \
                 accepted; look for play, a loose encoder or a link that touches something, or record a longer log",
                fit.name,
                number(fit.innovation_variance, 2)
            )));
        }
        if errs {
            return Err(Refusal::Misfit(format!(
                "{} does not fit: predictions over 0.5 s are off by {} % of its motion, at most {:.0} % are accepted; is \
                 this the log of this machine, and does nothing touch the links?",
                fit.name,
                number(100.0 * share, 1),
                100.0 * MOST_ERROR
            )));
        }
    }
    Ok(())
}

/// Checks that parts of a recording are predicted with numbers from its other parts.
pub(crate) fn judge_windows(left_out: &[WindowErrors]) -> Result<(), Refusal> {
    for (windows, most) in left_out.iter().zip(MOST_ERRORS) {
        for channel in &windows.channels {
            let most = most + OF_SENSOR * channel.sensor_error / channel.range;
            let percent = channel.percent()[1];
            // Written so that NaN counts as a misfit.
            let fits = percent <= 100.0 * most;
            if !fits {
                return Err(Refusal::Misfit(format!(
                    "{} does not fit: predictions over {} s are off by {} % of its motion, at most {:.2} % are accepted; \
                     is \
                     this the recording of this machine, with the right --angles, --zero, --reversed and counts? Or was a motor \
                     on, whose column is missing, or is it a hand or a stop that touches a link?",
                    channel.name,
                    windows.window_s,
                    number(percent, 2),
                    100.0 * most
                )));
            }
        }
    }
    Ok(())
}

/// The predictions of a record that was held out: of the old file and of the new numbers.
pub(crate) struct HeldOut {
    /// Error (rms) of each channel, with the old file and with the new numbers.
    pub(crate) rms: [Vec<f64>; 2],
    /// Samples of each channel.
    pub(crate) predictions: Vec<Vec<Predicted>>,
}

/// The channels from `first`, with their names; `over` are the innovations of the whole log, `ranges` how far each
/// channel moved.
pub(crate) fn channels(over: &Normal, held: HeldOut, ranges: &[f64], first: usize) -> Vec<ChannelFit> {
    let count = ranges.len() - first;
    let one = |(channel, predictions): (usize, Vec<Predicted>)| ChannelFit {
        name: channel_name(channel),
        channel,
        innovation_variance: over.normalised[channel] / over.count.max(1) as f64,
        held_out: [held.rms[0][channel], held.rms[1][channel]],
        range: ranges[channel],
        predictions,
        innovations: over.innovations.iter().skip(channel - first).step_by(count).copied().collect(),
    };
    held.predictions.into_iter().enumerate().skip(first).map(one).collect()
}

impl From<IdentifyError> for Refusal {
    fn from(error: IdentifyError) -> Self {
        Refusal::NotPhysical(error.to_string())
    }
}
