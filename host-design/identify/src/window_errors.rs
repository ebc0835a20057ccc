//! Errors of predictions over windows, each from an initial state that is fitted in it.

use crate::channel::channel_name;
use crate::model::Model;
use crate::parameters::Prior;
use crate::record::Record;
use crate::shooting::Shooting;

/// Lengths of the windows (s).
pub(crate) const WINDOWS_S: [f64; 3] = [0.5, 1.0, 2.0];
/// Iterations and rounds of the fit of an initial state.
const ITERATIONS: (usize, usize) = (10, 3);

/// Errors of predictions over windows of one length. A shorter piece is one window if it has half of the length.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowErrors {
    /// Length of the windows (s).
    pub window_s: f64,
    /// The channels that move: the cart, unless its motion is known, and the joints.
    pub channels: Vec<ChannelError>,
}

/// Errors of the predictions of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelError {
    /// The cart, or a joint from 1.
    pub name: String,
    /// Range of the measured motion from end to end (m, rad).
    pub range: f64,
    /// Error (rms) that quantisation and noise of the sensor alone make (m, rad).
    pub sensor_error: f64,
    /// Error (rms) with the old file and with the new numbers (m, rad).
    pub errors: [f64; 2],
}

impl ChannelError {
    /// Errors in percent of the range, with the old file and with the new numbers.
    pub fn percent(&self) -> [f64; 2] {
        self.errors.map(|error| 100.0 * error / self.range)
    }
}

/// A record, with the values of the old file and those that predict it.
pub(crate) type Predicting<'a> = (&'a Record, [&'a [f64]; 2]);

/// Errors over windows of each length in all `records` together.
pub(crate) fn window_errors(
    model: &Model,
    priors: &[Prior],
    records: &[Predicting<'_>],
) -> Vec<WindowErrors> {
    WINDOWS_S.into_iter().map(|window_s| over(model, priors, records, window_s)).collect()
}

fn over(model: &Model, priors: &[Prior], records: &[Predicting<'_>], window_s: f64) -> WindowErrors {
    let channels = model.coordinates();
    let (mut squares, mut count) = (vec![[0.0; 2]; channels], 0usize);
    let mut extent = vec![[f64::INFINITY, f64::NEG_INFINITY]; channels];
    for (record, values) in records {
        let shooting = Shooting { model, record, priors, free: false };
        for (which, p) in values.iter().enumerate() {
            let fit = shooting.fit(p, window_s, ITERATIONS.0, ITERATIONS.1);
            for (piece, sample, predicted) in shooting.predictions(&fit) {
                count += which;
                for (channel, predicted) in predicted.iter().enumerate() {
                    let measured = record.pieces[piece].y[sample * channels + channel];
                    squares[channel][which] += (measured - predicted).powi(2);
                    extent[channel] = [extent[channel][0].min(measured), extent[channel][1].max(measured)];
                }
            }
        }
    }
    let error = |channel: usize| ChannelError {
        name: channel_name(channel),
        range: extent[channel][1] - extent[channel][0],
        sensor_error: records.iter().map(|(record, _)| record.sensor_error(channel)).fold(0.0, f64::max),
        errors: squares[channel].map(|sum| (sum / count.max(1) as f64).sqrt()),
    };
    let first = records.iter().map(|(record, _)| record.first_channel()).max().unwrap_or_default();
    WindowErrors { window_s, channels: (first..channels).map(error).collect() }
}
