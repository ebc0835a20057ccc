//! Whether the measurements of a table are whole counts of the sensors that the file describes.

use crate::channel::channel_name;
use crate::doubt::Doubt;
use crate::record::Record;

/// Differences of so many counts are looked at: in larger ones, rounding of the values adds up.
const MOST_COUNTS: f64 = 30.0;
/// Least number of differences for a verdict.
const LEAST: usize = 40;
/// A difference is between two counts if it is further from both than this. Half of the differences of smooth values
/// are, and none of those of counts.
const BETWEEN: f64 = 0.25;
/// Share of such differences that is doubted.
const DOUBTED: f64 = 0.2;

/// The channels whose measurements are no whole counts; nothing is known of a sensor with noise, and of times that were
/// made even.
pub(crate) fn doubts(record: &Record) -> Vec<Doubt> {
    let one = |channel: usize| {
        let values = record.pieces.iter().map(|piece| piece.y.iter().skip(channel).step_by(record.channels));
        let share = share_between(values, record.steps[channel]);
        (record.noise[channel] == 0.0 && share > DOUBTED)
            .then(|| Doubt::BetweenCounts { channel: channel_name(channel), share })
    };
    (record.first_channel()..record.channels).filter_map(one).collect()
}

/// Share of the small differences between one value and the next that are no multiples of `step`.
fn share_between<'a>(pieces: impl Iterator<Item = impl Iterator<Item = &'a f64>>, step: f64) -> f64 {
    let (mut all, mut between) = (0, 0);
    for values in pieces {
        let mut before = None;
        for value in values {
            let counts = before.map_or(0.0, |before| (value - before) / step);
            before = Some(*value);
            // A value that stands still is on a count in any case.
            if counts.abs() > BETWEEN && counts.abs() < MOST_COUNTS {
                all += 1;
                between += usize::from((counts - counts.round()).abs() > BETWEEN);
            }
        }
    }
    if all < LEAST { 0.0 } else { between as f64 / all as f64 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothed_counts_are_told_from_counts() {
        let step = 0.01;
        let counts: Vec<f64> =
            (0..2000).map(|row| step * (0.02 * f64::from(row)).sin().mul_add(40.0, 0.3).round()).collect();
        let smoothed: Vec<f64> = counts.windows(5).map(|five| five.iter().sum::<f64>() / 5.0).collect();
        let share = |values: &[f64], step: f64| share_between([values.iter()].into_iter(), step);
        assert_eq!(share(&counts, step), 0.0);
        assert_eq!(share(&counts, step / 4.0), 0.0, "counts of every fourth edge");
        assert!(share(&counts, 4.0 * step) > 0.4, "{}", share(&counts, 4.0 * step));
        assert!(share(&smoothed, step) > 0.35, "{}", share(&smoothed, step));
        assert_eq!(share(&smoothed[..30], step), 0.0, "too few");
    }
}
