//! Multiple shooting: short windows, each with an initial state of its own.

// The indices are those of the equations.
#![allow(clippy::needless_range_loop)]

use upright_design::parallel;

use crate::cart_force::CartForce;
use crate::model::Model;
use crate::normal::{Cholesky, Normal};
use crate::parameters::{Prior, room_below};
use crate::record::Record;
use crate::rows::{add_multiple, set_multiple};
use crate::step::Step;

/// Length of a window (s).
pub(crate) const WINDOW_S: f64 = 0.25;
/// Factors on the damping: after a step that failed, and after one that lowered the cost.
const DAMPING: [f64; 2] = [10.0, 0.2];
/// Fractions of a step that are tried one after the other when only the initial state of a window is fitted.
const STEPS: [f64; 6] = [1.0, 0.5, 0.25, 0.1, 0.03, 0.01];
/// A fit ends when a step lowers the cost by less than this share.
const SETTLED: f64 = 1e-3;

/// A window with its initial state.
#[derive(Debug, Clone)]
pub(crate) struct ShootingWindow {
    piece: usize,
    first: usize,
    samples: usize,
    state: Vec<f64>,
    /// Expected bristle deflections at the start, and their prior deviations.
    bristles: Vec<[f64; 2]>,
}

/// Multiple shooting on a record.
pub(crate) struct Shooting<'a> {
    pub(crate) model: &'a Model,
    pub(crate) record: &'a Record,
    pub(crate) priors: &'a [Prior],
    /// Whether the parameters are fitted, and not only the initial states.
    pub(crate) free: bool,
}

/// Current values of a fit: parameters and initial states.
#[derive(Debug, Clone)]
pub(crate) struct Fit {
    pub(crate) p: Vec<f64>,
    windows: Vec<ShootingWindow>,
    /// Root mean square of the residuals of each channel (m, rad).
    pub(crate) rms: Vec<f64>,
}

/// How well scaled parameters are known. Their deviations are those of the scatter of the windows' gradients `g`,
/// `A⁻¹ Σ g gᵀ A⁻¹` (P. J. Huber, 5th Berkeley Symposium, 1967): residuals within a window may depend on each other.
pub(crate) struct Scatter {
    /// Inverse of the normal matrix A, with the initial states eliminated.
    pub(crate) inverse: Vec<f64>,
    /// Standard deviations, where a parameter at its bound is not free for the others.
    pub(crate) deviations: Vec<f64>,
    /// The same if the bounds are not known: what a parameter at its bound may be is part of the others' deviations.
    pub(crate) open: Vec<f64>,
    pub(crate) normal: Normal,
}

/// Kept from the equations `H_zz δz + H_zp δp = g_z` of one window when δz is eliminated, to compute δz from δp.
struct Reduced {
    states: Cholesky,
    /// H_zp, column by column, and g_z last.
    right: Vec<Vec<f64>>,
}

impl Shooting<'_> {
    /// Consecutive windows over all pieces, with initial states from the measurements.
    fn windows(&self, p: &[f64], seconds: f64) -> Vec<ShootingWindow> {
        let samples = ((seconds / self.record.dt_s).round() as usize).max(4);
        let mut windows = Vec::new();
        for piece in 0..self.record.pieces.len() {
            for first in (0..self.record.samples(piece)).step_by(samples) {
                let samples = samples.min(self.record.samples(piece) - first);
                if 2 * samples as u64 >= (seconds / self.record.dt_s) as u64 {
                    let state = self.record.state_near(p, self.model, piece, first);
                    let bristles = state[2 * self.model.coordinates()..].iter().enumerate();
                    // A joint that turns has bent its bristle.
                    let deviation = |of: usize, at: f64| if of == 0 { 1.0 } else { 1.01 - at * at };
                    let bristles = bristles.map(|(of, &at)| [at, deviation(of, at)]).collect();
                    windows.push(ShootingWindow { piece, first, samples, state, bristles });
                }
            }
        }
        windows
    }

    /// Fits from `p`, with windows of `seconds`: estimates the weights `rounds` times, with at most `iterations`
    /// iterations after each.
    pub(crate) fn fit(&self, p: &[f64], seconds: f64, iterations: usize, rounds: usize) -> Fit {
        self.fit_windows(p, self.windows(p, seconds), iterations, rounds)
    }

    /// As [`fit`](Self::fit), but with initial states that are fitted with `p` first: with few iterations, a bad one
    /// would spoil the whole fit.
    pub(crate) fn fit_settled(&self, p: &[f64], seconds: f64, iterations: usize, rounds: usize) -> Fit {
        let weights: Vec<f64> = self.record.steps.iter().map(|step| step.powi(-2)).collect();
        let alone = Shooting { free: false, ..*self };
        let windows = alone.settled(p, &self.windows(p, seconds), &weights, iterations);
        self.fit_windows(p, windows, iterations, rounds)
    }

    fn fit_windows(&self, p: &[f64], windows: Vec<ShootingWindow>, iterations: usize, rounds: usize) -> Fit {
        let mut fit = Fit { p: p.to_vec(), windows, rms: self.record.steps.clone() };
        for _ in 0..rounds {
            let floor = self.record.steps.iter().map(|step| 0.2 * step);
            let weights: Vec<f64> =
                self.rms(&fit).iter().zip(floor).map(|(rms, floor)| rms.max(floor).powi(-2)).collect();
            if self.free {
                self.descend(&mut fit, &weights, iterations);
            } else {
                fit.windows = self.settled(p, &fit.windows, &weights, iterations);
            }
        }
        fit.rms = self.rms(&fit);
        fit
    }

    /// Root mean square of the residuals of each channel.
    fn rms(&self, fit: &Fit) -> Vec<f64> {
        let count = self.record.channels;
        let predictions = self.predictions(fit);
        let mut squares = vec![0.0; count];
        for (piece, sample, predicted) in &predictions {
            let measured = &self.record.pieces[*piece].y[sample * count..];
            for (sum, (measured, predicted)) in squares.iter_mut().zip(measured.iter().zip(predicted)) {
                *sum += (measured - predicted).powi(2);
            }
        }
        squares.iter().map(|sum| (sum / predictions.len().max(1) as f64).sqrt()).collect()
    }

    /// How well the scaled parameters are known: see [`Scatter`]. None if the normal matrix has no inverse.
    pub(crate) fn scatter(&self, fit: &Fit) -> Option<Scatter> {
        let weights: Vec<f64> =
            fit.rms.iter().zip(&self.record.steps).map(|(rms, step)| rms.max(0.2 * step).powi(-2)).collect();
        let mut windows = Vec::new();
        let (normal, _) = self.linearise_each(&self.inputs(&fit.p), fit, &weights, &mut windows);
        let inverse = normal.factor(0.0)?.inverse();
        let room = room_below(self.model.layout, self.priors, &fit.p);
        let held: Vec<usize> = (0..fit.p.len()).filter(|&i| room[i] > -1e-9).collect();
        let own = |i: usize| inverse[i * fit.p.len() + i].sqrt();
        let mut deviations = normal.scatter(&windows, &held)?;
        held.iter().for_each(|&i| deviations[i] = own(i));
        let mut open = normal.scatter(&windows, &[])?;
        held.iter().for_each(|&i| open[i] = open[i].max(own(i)));
        Some(Scatter { inverse, deviations, open, normal })
    }

    /// Predictions of `fit` in its windows: piece, sample, and the predicted measurements of all channels.
    pub(crate) fn predictions(&self, fit: &Fit) -> Vec<(usize, usize, Vec<f64>)> {
        let (model, inputs) = (self.model, self.inputs(&fit.p));
        let each = parallel::map(&fit.windows, |window| {
            let mut step = Step::new(model, false);
            let mut state = window.state.clone();
            let row = |sample: usize| {
                let measure = |channel| model.measure(&fit.p, &state, channel).value;
                let row = (window.piece, sample, (0..self.record.channels).map(measure).collect());
                step.take(model, &fit.p, &state, &inputs[window.piece][sample], self.record.dt_s);
                state.copy_from_slice(&step.end);
                row
            };
            (window.first..window.first + window.samples).map(row).collect::<Vec<_>>()
        });
        each.into_iter().flatten().collect()
    }

    /// Levenberg–Marquardt iterations from `fit`.
    fn descend(&self, fit: &mut Fit, weights: &[f64], iterations: usize) {
        let mut damping = 1e-3;
        let (mut normal, mut reduced) = self.linearise(fit, weights);
        for _ in 0..iterations {
            let Some(trial) = self.stepped(fit, &normal, &reduced, damping, 1.0) else {
                damping *= DAMPING[0];
                continue;
            };
            let (other, other_reduced) = self.linearise(&trial, weights);
            if other.cost < normal.cost {
                let settled = normal.cost - other.cost < SETTLED * normal.cost;
                (*fit, normal, reduced) = (trial, other, other_reduced);
                damping *= DAMPING[1];
                if settled {
                    return;
                }
            } else {
                damping *= DAMPING[0];
            }
        }
    }

    /// Gauss–Newton on the initial states alone. Each window takes its own steps, so one that cannot improve does not
    /// hold up the others.
    fn settled(
        &self,
        p: &[f64],
        windows: &[ShootingWindow],
        weights: &[f64],
        iterations: usize,
    ) -> Vec<ShootingWindow> {
        let inputs = self.inputs(p);
        parallel::map(windows, |window| {
            let fit = Fit { p: p.to_vec(), windows: vec![window.clone()], rms: Vec::new() };
            self.descend_alone(&inputs, fit, weights, iterations).windows.swap_remove(0)
        })
    }

    fn descend_alone(
        &self,
        inputs: &[Vec<CartForce>],
        mut fit: Fit,
        weights: &[f64],
        iterations: usize,
    ) -> Fit {
        let (mut normal, mut reduced) = self.linearise_with(inputs, &fit, weights);
        for _ in 0..iterations {
            let better = STEPS.iter().find_map(|share| {
                let trial = self.stepped(&fit, &normal, &reduced, 0.0, *share)?;
                let (other, other_reduced) = self.linearise_with(inputs, &trial, weights);
                (other.cost < normal.cost).then_some((trial, other, other_reduced))
            });
            let Some((trial, other, other_reduced)) = better else { break };
            let settled = normal.cost - other.cost < SETTLED * normal.cost;
            (fit, normal, reduced) = (trial, other, other_reduced);
            if settled {
                break;
            }
        }
        fit
    }

    /// One damped step of the parameters, and the fraction `share` of the step of the initial states.
    fn stepped(
        &self,
        fit: &Fit,
        normal: &Normal,
        reduced: &[Reduced],
        damping: f64,
        share: f64,
    ) -> Option<Fit> {
        let mut trial = fit.clone();
        let mut step = Vec::new();
        if self.free {
            step = normal.bounded_step(damping, &room_below(self.model.layout, self.priors, &fit.p))?;
            for ((p, prior), step) in trial.p.iter_mut().zip(self.priors).zip(&step) {
                *p += prior.deviation * step;
            }
        }
        for (window, reduced) in trial.windows.iter_mut().zip(reduced) {
            let (last, columns) = reduced.right.split_last()?;
            let mut move_by = last.clone();
            for (column, step) in columns.iter().zip(&step) {
                move_by.iter_mut().zip(column).for_each(|(to, of)| *to -= of * step);
            }
            reduced.states.solve(&mut move_by);
            window.state.iter_mut().zip(move_by).for_each(|(state, by)| *state += share * by);
            let bristles = &mut window.state[2 * self.model.coordinates()..];
            bristles.iter_mut().for_each(|bristle| *bristle = bristle.clamp(-1.0, 1.0));
        }
        Some(trial)
    }

    /// The reduced normal equations of all windows, with the prior.
    fn linearise(&self, fit: &Fit, weights: &[f64]) -> (Normal, Vec<Reduced>) {
        self.linearise_with(&self.inputs(&fit.p), fit, weights)
    }

    /// The inputs of all pieces.
    fn inputs(&self, p: &[f64]) -> Vec<Vec<CartForce>> {
        let pieces = 0..self.record.pieces.len();
        pieces.map(|piece| self.record.inputs(self.model.layout, p, piece)).collect()
    }

    /// [`Self::linearise`] with `inputs` computed before: they depend only on the parameters.
    fn linearise_with(
        &self,
        inputs: &[Vec<CartForce>],
        fit: &Fit,
        weights: &[f64],
    ) -> (Normal, Vec<Reduced>) {
        self.linearise_each(inputs, fit, weights, &mut Vec::new())
    }

    /// [`Self::linearise_with`]; adds the gradient of each window to `gradients`.
    fn linearise_each(
        &self,
        inputs: &[Vec<CartForce>],
        fit: &Fit,
        weights: &[f64],
        gradients: &mut Vec<Vec<f64>>,
    ) -> (Normal, Vec<Reduced>) {
        let each = parallel::map(&fit.windows, |window| {
            let whole = self.window(&fit.p, &inputs[window.piece], window, weights);
            self.reduce(whole)
        });
        let size = if self.free { self.model.layout.count() } else { 0 };
        let mut sum = Normal::new(size, self.record.channels);
        let mut kept = Vec::with_capacity(each.len());
        for (normal, reduced) in each {
            sum = sum.merge(&normal);
            gradients.push(normal.gradient);
            match reduced {
                Some(reduced) => kept.push(reduced),
                None => sum.cost = f64::NAN,
            }
        }
        if self.free {
            sum.add_prior(&scaled(self.priors, &fit.p));
        }
        (sum, kept)
    }

    /// The normal equations of a window in its initial state and the parameters.
    fn window(&self, p: &[f64], inputs: &[CartForce], window: &ShootingWindow, weights: &[f64]) -> Normal {
        let (model, m, s) = (self.model, self.record.channels, self.model.states());
        let mut step = Step::new(model, self.free);
        let columns = step.columns;
        let size = s + if self.free { model.layout.count() } else { 0 };
        let mut normal = Normal::new(size, m);
        let mut state = window.state.clone();
        let mut by = vec![0.0; s * columns];
        (0..s).for_each(|i| by[i * columns + i] = 1.0);
        let mut next = by.clone();
        let mut row = vec![0.0; size];
        for (index, [expected, deviation]) in (2 * m..).zip(&window.bristles) {
            row[index] = 1.0 / deviation;
            let off = (expected - state[index]) / deviation;
            normal.add(&row, off, 1.0);
            normal.cost += off * off;
            row[index] = 0.0;
        }
        let y = &self.record.pieces[window.piece].y;
        for sample in window.first..window.first + window.samples {
            for channel in 0..m {
                let measured = model.measure(p, &state, channel);
                let error = y[sample * m + channel] - measured.value;
                let own = &by[channel * columns..][..columns];
                row[columns..].fill(0.0);
                set_multiple(&mut row, measured.by_angle, own);
                if channel > 1 {
                    let below = &by[(channel - 1) * columns..][..columns];
                    add_multiple(&mut row, -measured.by_angle, below);
                }
                if self.free {
                    for (index, by) in model.measured_by(channel, &measured) {
                        row[s + index] += by;
                    }
                    for (entry, prior) in row[s..].iter_mut().zip(self.priors) {
                        *entry *= prior.deviation;
                    }
                }
                normal.add(&row, error, weights[channel]);
                normal.cost += weights[channel] * error * error;
                normal.squares[channel] += error * error;
            }
            normal.count += 1;
            step.take(model, p, &state, &inputs[sample], self.record.dt_s);
            step.propagate(&by, &mut next);
            core::mem::swap(&mut by, &mut next);
            state.copy_from_slice(&step.end);
        }
        normal
    }

    /// Eliminates the initial state from the equations of a window.
    fn reduce(&self, whole: Normal) -> (Normal, Option<Reduced>) {
        let s = self.model.states();
        let size = whole.size() - s;
        let mut rest = Normal::new(size, whole.squares.len());
        (rest.cost, rest.count) = (whole.cost, whole.count);
        rest.squares.clone_from(&whole.squares);
        let mut of_states = Normal::new(s, 0);
        for i in 0..s {
            (0..=i).for_each(|j| of_states.subtract(i, j, -whole.entry(i, j)));
        }
        // A little damping, in case the window does not determine a rate.
        let Some(states) = of_states.factor(1e-9) else { return (rest, None) };
        let mut right: Vec<Vec<f64>> =
            (0..size).map(|p| (0..s).map(|i| whole.entry(s + p, i)).collect()).collect();
        right.push(whole.gradient[..s].to_vec());
        let solved: Vec<Vec<f64>> = right
            .iter()
            .map(|column| {
                let mut solved = column.clone();
                states.solve(&mut solved);
                solved
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for i in 0..size {
            for j in 0..=i {
                rest.subtract(i, j, dot(&right[i], &solved[j]) - whole.entry(s + i, s + j));
            }
            rest.gradient[i] = whole.gradient[s + i] - dot(&right[i], &solved[size]);
        }
        (rest, Some(Reduced { states, right }))
    }
}

/// The parameters as multiples of their prior deviations.
pub(crate) fn scaled(priors: &[Prior], p: &[f64]) -> Vec<f64> {
    let one = |(prior, p): (&Prior, &f64)| {
        if prior.deviation > 0.0 { (p - prior.value) / prior.deviation } else { 0.0 }
    };
    priors.iter().zip(p).map(one).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use upright_design::rig::Rig;

    use super::*;
    use crate::channel::chain_of;
    use crate::excite::shake;
    use crate::parameters::priors;

    #[test]
    fn a_window_that_comes_to_no_better_state_holds_up_no_other() {
        let rig = Rig::from_path(Path::new("../../rigs/single-quanser-ip02.toml")).unwrap();
        let chain = chain_of(&rig).unwrap();
        let record = Record::of(&rig, &[shake(&rig, 5.0, 1).unwrap()], 1);
        let (model, priors) = (record.model(chain.gravity_m_per_s2), priors(&rig, chain, false));
        let p: Vec<f64> = priors.iter().map(|prior| prior.value).collect();
        let shooting = Shooting { model: &model, record: &record, priors: &priors, free: false };
        let mut windows = shooting.windows(&p, 0.5);
        windows[2].state.fill(f64::NAN);
        let weights: Vec<f64> = record.steps.iter().map(|step| step.powi(-2)).collect();
        let cost = |window: &ShootingWindow| {
            let fit = Fit { p: p.clone(), windows: vec![window.clone()], rms: Vec::new() };
            shooting.linearise(&fit, &weights).0.cost
        };
        let sum = |windows: &[ShootingWindow]| windows[3..].iter().map(cost).sum::<f64>();
        let alone = shooting.settled(&p, &windows, &weights, 10);
        assert!(sum(&alone) < 0.5 * sum(&windows), "{} {}", sum(&alone), sum(&windows));
        // The negative control: steps of all windows together.
        let mut together = Fit { p: p.clone(), windows: windows.clone(), rms: Vec::new() };
        shooting.descend(&mut together, &weights, 10);
        assert!(sum(&together.windows) == sum(&windows));
    }
}
