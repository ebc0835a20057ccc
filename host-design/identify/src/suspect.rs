//! Doubts from what was found: values that no file would have, and predictions that are worse than they should be.

use crate::channel::channel_name;
use crate::doubt::Doubt;
use crate::estimated::Estimate;
use crate::normal::Normal;
use crate::parameters::{Layout, ParameterKind, Prior, room_below};
use crate::record::Record;
use crate::window_errors::WindowErrors;

/// A friction this many of its deviations below 0 is doubted. If the 11 frictions and drags of three links are all 0,
/// one of them is so in 22 % of sound machines: nothing is refused for it before [`Doubt::needs_trust`].
const NEGATIVE: f64 = 2.0;
/// A value this many prior deviations away from the file is doubted.
const FAR: f64 = 5.0;
/// Least error of the travel per count that is doubted: a share, and in its deviations.
const WRONG_TRAVEL: (f64, f64) = (2e-3, 5.0);
/// Predictions are worse if their error is larger by this factor, and by this share of the sensor's own error.
const WORSE: (f64, f64) = (1.25, 0.5);
/// Difference between the halves of a log, in its deviations, that is doubted.
const CONTRADICTION: f64 = 4.0;

/// Doubts about single estimates; `unbounded` holds the values of all parameters without the bound at 0.
pub(crate) fn values(
    layout: Layout,
    priors: &[Prior],
    estimates: &[Estimate],
    unbounded: &[f64],
) -> Vec<Doubt> {
    let kinds = layout.kinds();
    let one = |estimate: &Estimate| {
        let kind = estimate.kind;
        let index = kinds.iter().position(|of| *of == kind)?;
        let (value, deviation) = (unbounded[index], estimate.deviation);
        let is_friction = layout.is_dissipative(index) || [layout.viscous(0), layout.dry(0)].contains(&index);
        if is_friction && value < -NEGATIVE * deviation {
            return Some(Doubt::Negative { kind, value, deviation });
        }
        let error = (estimate.new - estimate.old).abs();
        if kind == ParameterKind::Travel && error > WRONG_TRAVEL.0 && error > WRONG_TRAVEL.1 * deviation {
            return Some(Doubt::Travel { share: estimate.new, deviation });
        }
        let deviations = error / (kind.of_file() * priors[index].deviation);
        (deviations > FAR).then_some(Doubt::Far { kind, deviations })
    };
    estimates.iter().filter_map(one).collect()
}

/// The parameters `p` after a step from `normal` that no bound holds.
pub(crate) fn unbounded(layout: Layout, priors: &[Prior], normal: &Normal, p: &[f64]) -> Vec<f64> {
    let mut step = normal.gradient.clone();
    let Some(factor) = normal.factor(0.0) else { return p.to_vec() };
    factor.solve(&mut step);
    let room = room_below(layout, priors, p);
    let one = |i: usize| if room[i] > -1e-9 { p[i] + priors[i].deviation * step[i] } else { p[i] };
    (0..p.len()).map(one).collect()
}

/// Whether the halves of a log contradict each other; `scatters` are the deviations of their differences, as of the
/// noise alone. Other causes of a deviation are in those of the estimates.
pub(crate) fn halves(estimates: &[Estimate], scatters: &[f64]) -> Option<Doubt> {
    let differ = |(estimate, scatter): (&Estimate, &f64)| {
        let [first, second] = estimate.halves?;
        let deviations =
            (second - first).abs() / scatter.hypot(core::f64::consts::SQRT_2 * estimate.deviation);
        (deviations > CONTRADICTION).then_some((estimate.kind, deviations))
    };
    let found: Vec<(ParameterKind, f64)> = estimates.iter().zip(scatters).filter_map(differ).collect();
    let deviations = found.iter().map(|(_, deviations)| *deviations).fold(0.0, f64::max);
    let kinds = found.into_iter().map(|(kind, _)| kind).collect();
    (deviations > 0.0).then_some(Doubt::Halves { kinds, deviations })
}

/// Errors of predictions that are worse than `than`.
fn are_worse(errors: f64, than: f64, of_sensor: f64) -> bool {
    // Written so that NaN is worse.
    let is_as_good = errors <= (WORSE.0 * than).max(than + WORSE.1 * of_sensor);
    !is_as_good
}

/// Channels of `record` that `rms`, the errors of the old file, of the numbers found and of the new file, show to be
/// predicted worse than by the old file, or by the numbers found.
pub(crate) fn predictions(record: &Record, ranges: &[f64], rms: [&[f64]; 3]) -> Vec<Doubt> {
    let one = |channel: usize| {
        let of_sensor = record.sensor_error(channel);
        let [old, found, new] = rms.map(|rms| rms[channel]);
        let percent = |error: f64| 100.0 * error / ranges[channel];
        let name = channel_name(channel);
        if are_worse(new, found, of_sensor) {
            return Some(Doubt::Rewritten { channel: name, percent: [percent(found), percent(new)] });
        }
        are_worse(new, old, of_sensor)
            .then(|| Doubt::Worse { channel: name, percent: [percent(old), percent(new)] })
    };
    (record.first_channel()..record.channels).filter_map(one).collect()
}

/// Channels of recordings that were not used that are off by more than `most` (percent of the range and share of the
/// sensor's error that is added), or predicted worse than with the old file.
pub(crate) fn unused(predicted: &[WindowErrors], most: &dyn Fn(usize) -> (f64, f64)) -> Vec<Doubt> {
    let mut doubts: Vec<Doubt> = Vec::new();
    for (index, windows) in predicted.iter().enumerate() {
        for channel in &windows.channels {
            let (share, of_sensor) = most(index);
            let most = 100.0 * (share + of_sensor * channel.sensor_error / channel.range);
            let [old, percent] = channel.percent();
            let name = channel.name.clone();
            let is_known = doubts.iter().any(|doubt| match doubt {
                Doubt::Unpredicted { channel, .. } | Doubt::Worse { channel, .. } => *channel == name,
                _ => false,
            });
            // Written so that NaN is doubted.
            let fits = percent <= most;
            if !fits && !is_known {
                doubts.push(Doubt::Unpredicted { channel: name, window_s: windows.window_s, percent, most });
            } else if are_worse(channel.errors[1], channel.errors[0], channel.sensor_error) && !is_known {
                doubts.push(Doubt::Worse { channel: name, percent: [old, percent] });
            }
        }
    }
    doubts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Doubts about one estimate with a prior of 1 ± 0.5, whose value without a bound is given.
    fn doubted(kind: ParameterKind, new: f64, deviation: f64, unbounded: f64) -> Vec<Doubt> {
        let layout = Layout { links: 1 };
        let priors = vec![Prior { value: 1.0, deviation: 0.5 }; layout.count()];
        let held_by_prior = false;
        let estimate = Estimate { kind, old: 1.0, new, deviation, halves: Some([new, new]), held_by_prior };
        values(layout, &priors, &[estimate], &vec![unbounded; layout.count()])
    }

    #[test]
    fn a_value_is_doubted_if_it_is_negative_or_far_from_the_file() {
        let dry = ParameterKind::JointDry(0);
        let needs_trust = |unbounded: f64| match &doubted(dry, 0.0, 0.1, unbounded)[..] {
            [negative @ Doubt::Negative { .. }] => Some(negative.needs_trust()),
            doubts => {
                assert_eq!(doubts, []);
                None
            }
        };
        assert_eq!(
            [-0.41, -0.39, -0.21, -0.19].map(needs_trust),
            [Some(true), Some(false), Some(false), None]
        );
        let moment = ParameterKind::SecondMoment(0);
        assert!(
            matches!(doubted(moment, 3.6, 0.1, 3.6)[..], [Doubt::Far { deviations, .. }] if deviations > 5.0)
        );
        assert_eq!(doubted(moment, 3.4, 0.1, 3.4), []);
        // Only a friction has a reason not to be negative.
        assert_eq!(doubted(ParameterKind::Tilt, -1.0, 0.1, -1.0), []);
        assert!(matches!(doubted(ParameterKind::Travel, 1.01, 1e-3, 1.01)[..], [Doubt::Travel { .. }]));
        assert_eq!(doubted(ParameterKind::Travel, 1.01, 3e-3, 1.01), []);
    }

    #[test]
    fn halves_are_compared_with_their_scatter_and_with_the_deviation_of_the_whole() {
        let of = |second: f64| Estimate {
            kind: ParameterKind::Zero(0),
            old: 0.0,
            new: 0.0,
            deviation: 1e-3,
            halves: Some([0.0, second]),
            held_by_prior: false,
        };
        let doubted = |second: f64, scatter: f64| halves(&[of(second)], &[scatter]);
        assert!(matches!(doubted(6e-3, 1e-4), Some(Doubt::Halves { kinds, .. }) if kinds.len() == 1));
        assert_eq!(doubted(5e-3, 1e-4), None);
        assert_eq!(doubted(6e-3, 2e-3), None);
    }
}
