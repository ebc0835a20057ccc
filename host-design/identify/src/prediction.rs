//! Prediction-error method: an extended Kalman filter predicts each measurement from those before it.

// The indices are those of the equations.
#![allow(clippy::needless_range_loop)]

use upright_design::parallel;

use crate::cart_force::CartForce;
use crate::model::Model;
use crate::normal::Normal;
use crate::parameters::{Layout, Prior, room_below};
use crate::record::Record;
use crate::rows::add_multiple;
use crate::shooting::scaled;
use crate::step::Step;

/// Longest segment of the record (s): segments are filtered in parallel.
const SEGMENT_S: f64 = 10.0;
/// Time from the start of a segment after which its predictions count (s).
const SETTLING_S: f64 = 0.25;
/// Duration of the part of the record on which the process noise is tuned (s).
const TUNING_S: f64 = 6.0;
/// Factors by which an intensity is changed while it is tuned.
const FACTORS: [f64; 3] = [10.0, 4.0, 2.0];
/// A fit ends when no parameter moves by more than this many of its deviations.
const SETTLED: f64 = 0.03;
/// Noise intensity of the bristle (1/s): allows for real friction that differs from the model while the cart sticks.
const BRISTLE_NOISE_PER_S: f64 = 0.3;

/// The filter over a record.
pub(crate) struct Filter<'a> {
    pub(crate) model: &'a Model,
    pub(crate) record: &'a Record,
    pub(crate) priors: &'a [Prior],
}

/// A segment: piece, first sample, number of samples.
type Segment = (usize, usize, usize);

/// Noise intensities on the cart (N²·s) and in each joint ((N·m)²·s) with which the search begins.
pub(crate) fn usual_noise(p: &[f64], layout: Layout, gravity: f64) -> Vec<f64> {
    let of = |weight: f64| 1e-9 * (gravity * weight).powi(2);
    let joints = (0..layout.links).map(|link| of(p[layout.first_moment(link)]));
    [of(p[Layout::TOTAL_MASS])].into_iter().chain(joints).collect()
}

impl Filter<'_> {
    fn segments(&self) -> Vec<Segment> {
        let longest = (SEGMENT_S / self.record.dt_s).round() as usize;
        let mut segments = Vec::new();
        for piece in 0..self.record.pieces.len() {
            let samples = self.record.samples(piece);
            let parts = samples.div_ceil(longest).max(1);
            let length = samples.div_ceil(parts);
            segments.extend(
                (0..samples).step_by(length).map(|first| (piece, first, length.min(samples - first))),
            );
        }
        segments
    }

    /// Normal equations of all predictions with `p` and `noise`; in the parameters if `free`, otherwise only costs and
    /// residuals.
    pub(crate) fn run(&self, p: &[f64], noise: &[f64], free: bool) -> Normal {
        let layout = self.model.layout;
        let inputs: Vec<Vec<CartForce>> =
            (0..self.record.pieces.len()).map(|piece| self.record.inputs(layout, p, piece)).collect();
        let size = if free { layout.count() } else { 0 };
        let one = |segment: (usize, usize, usize)| self.segment(p, noise, &inputs[segment.0], segment, free);
        let each = parallel::map(self.segments(), one);
        let mut sum = each.iter().fold(Normal::new(size, self.record.channels), Normal::merge);
        sum.add_prior(&scaled(self.priors, p));
        sum
    }

    /// Finds the noise intensities under which the measurements are most likely.
    pub(crate) fn tuned(&self, p: &[f64]) -> Vec<f64> {
        let short = self.record.part(1.0, 1.0 + TUNING_S);
        let short = if short.pieces.is_empty() { self.record.clone() } else { short };
        let filter = Filter { record: &short, ..*self };
        let mut noise = usual_noise(p, self.model.layout, self.model.gravity);
        let mut least = filter.run(p, &noise, false).cost;
        for factor in FACTORS {
            for channel in self.record.first_channel()..noise.len() {
                for factor in [factor, 1.0 / factor] {
                    for _ in 0..6 {
                        let mut other = noise.clone();
                        other[channel] *= factor;
                        let cost = filter.run(p, &other, false).cost;
                        // A gain of less than 0.5 is not significant.
                        if cost.is_nan() || cost > least - 0.5 {
                            break;
                        }
                        (noise, least) = (other, cost);
                    }
                }
            }
        }
        noise
    }

    /// Finds the smoothing of the dry friction (m, rad/s) under which the measurements are most likely.
    pub(crate) fn smoothing(&self, p: &[f64], noise: &[f64]) -> [f64; 2] {
        let mut best = (self.run(p, noise, false).cost, self.model.smoothing);
        for contact in 0..2 {
            for factor in [0.4, 2.5] {
                for _ in 0..2 {
                    let mut model = self.model.clone();
                    model.smoothing = best.1;
                    model.smoothing[contact] *= factor;
                    let cost = Filter { model: &model, ..*self }.run(p, noise, false).cost;
                    if cost.is_nan() || cost >= best.0 {
                        break;
                    }
                    best = (cost, model.smoothing);
                }
            }
        }
        best.1
    }

    /// Gauss–Newton from `p`, at most `iterations` steps; returns the parameters and the normal equations there, or
    /// none if these are not positive definite.
    pub(crate) fn fit(&self, p: &[f64], noise: &[f64], iterations: usize) -> Option<(Vec<f64>, Normal)> {
        self.iterate(p, noise, iterations, true)
    }

    /// As [`fit`](Self::fit), but returns the cost instead of the normal equations, which take twice the time.
    pub(crate) fn fit_cost(&self, p: &[f64], noise: &[f64], iterations: usize) -> Option<(Vec<f64>, f64)> {
        self.iterate(p, noise, iterations, false).map(|(p, normal)| (p, normal.cost))
    }

    fn iterate(
        &self,
        p: &[f64],
        noise: &[f64],
        iterations: usize,
        to_end: bool,
    ) -> Option<(Vec<f64>, Normal)> {
        let mut p = p.to_vec();
        let mut normal = self.run(&p, noise, true);
        for iteration in 1..=iterations {
            let step = normal.bounded_step(0.0, &room_below(self.model.layout, self.priors, &p))?;
            let inverse = normal.factor(0.0)?.inverse();
            let deviations = (0..step.len()).map(|i| inverse[i * step.len() + i].sqrt());
            let furthest = step
                .iter()
                .zip(deviations)
                .map(|(step, deviation)| step.abs() / deviation)
                .fold(0.0, f64::max);
            let halves = [1.0, 0.5, 0.25, 0.1];
            let better = halves.iter().find_map(|share| {
                let moved = p.iter().zip(self.priors).zip(&step);
                let trial: Vec<f64> =
                    moved.map(|((p, prior), step)| p + share * prior.deviation * step).collect();
                let other = self.run(&trial, noise, to_end || iteration < iterations);
                (other.cost < normal.cost).then_some((trial, other))
            });
            let Some(better) = better else { break };
            (p, normal) = better;
            if furthest < SETTLED {
                break;
            }
        }
        Some((p, normal))
    }

    fn segment(
        &self,
        p: &[f64],
        noise: &[f64],
        inputs: &[CartForce],
        segment: Segment,
        free: bool,
    ) -> Normal {
        let (piece, first, samples) = segment;
        let (m, s, dt_s) = (self.record.channels, self.model.states(), self.record.dt_s);
        let size = if free { self.model.layout.count() } else { 0 };
        let mut normal = Normal::new(size, m);
        let mut step = Step::new(self.model, free);
        let mut filter = FilterState::new(self.record.state_near(p, self.model, piece, first), size);
        for channel in 0..m {
            let step = self.record.steps[channel].hypot(self.record.noise[channel]);
            // Absolute angles are sums of measured joint angles.
            filter.covariance[channel * s + channel] = step * step * (channel as f64).max(1.0);
            filter.covariance[(m + channel) * s + m + channel] =
                (step / 0.01).powi(2) * (channel as f64).max(1.0);
        }
        filter.covariance[s * s - 1] = 1.0;
        let y = &self.record.pieces[piece].y;
        let settled = first + (SETTLING_S / dt_s) as usize;
        let mut jacobian = vec![0.0; size];
        for sample in first..first + samples {
            for channel in self.record.first_channel()..m {
                let measured = y[sample * m + channel];
                let (error, predicted) = filter.correct(self, p, channel, measured, &mut jacobian);
                if sample >= settled {
                    normal.add(&jacobian, error, 1.0 / predicted);
                    normal.cost += error * error / predicted + libm::log(predicted);
                    normal.squares[channel] += error * error;
                    normal.normalised[channel] += error * error / predicted;
                    if !free {
                        normal.innovations.push(error / predicted.sqrt());
                    }
                }
            }
            normal.count += usize::from(sample >= settled);
            step.take(self.model, p, &filter.at, &inputs[sample], dt_s);
            filter.predict(&step, noise, dt_s);
        }
        normal
    }
}

/// Estimate, its covariance, and its derivatives by the parameters.
struct FilterState {
    at: Vec<f64>,
    /// s×s.
    covariance: Vec<f64>,
    /// s rows of `size`.
    by: Vec<f64>,
    size: usize,
    column: Vec<f64>,
    other: Vec<f64>,
    next_by: Vec<f64>,
}

impl FilterState {
    fn new(at: Vec<f64>, size: usize) -> Self {
        let s = at.len();
        Self {
            at,
            covariance: vec![0.0; s * s],
            by: vec![0.0; s * size],
            size,
            column: vec![0.0; s],
            other: vec![0.0; s * s],
            next_by: vec![0.0; s * size],
        }
    }

    /// Corrects by one measurement; returns the innovation and its variance, and writes the derivatives of the
    /// prediction by the scaled parameters into `jacobian`.
    fn correct(
        &mut self,
        filter: &Filter<'_>,
        p: &[f64],
        channel: usize,
        y: f64,
        jacobian: &mut [f64],
    ) -> (f64, f64) {
        let (s, size) = (self.at.len(), self.size);
        let measured = filter.model.measure(p, &self.at, channel);
        let by = measured.by_angle;
        let below = if channel > 1 { Some(channel - 1) } else { None };
        for (i, column) in self.column.iter_mut().enumerate() {
            let row = &self.covariance[i * s..][..s];
            *column = by * (row[channel] - below.map_or(0.0, |below| row[below]));
        }
        let variance = filter.record.steps[channel].powi(2) / 12.0 + filter.record.noise[channel].powi(2);
        let predicted =
            variance + by * (self.column[channel] - below.map_or(0.0, |below| self.column[below]));
        let error = y - measured.value;
        if size > 0 {
            for (i, entry) in jacobian.iter_mut().enumerate() {
                *entry =
                    by * (self.by[channel * size + i] - below.map_or(0.0, |below| self.by[below * size + i]));
            }
            for (index, by) in filter.model.measured_by(channel, &measured) {
                jacobian[index] += by;
            }
        }
        for i in 0..s {
            let gain = self.column[i] / predicted;
            self.at[i] += gain * error;
            let row = &mut self.covariance[i * s..][..s];
            add_multiple(row, -gain, &self.column);
            let row = &mut self.by[i * size..][..size];
            add_multiple(row, -gain, jacobian);
        }
        for (entry, prior) in jacobian.iter_mut().zip(filter.priors) {
            *entry *= prior.deviation;
        }
        (error, predicted)
    }

    /// Predicts the state at the next sample, with its covariance and its derivatives.
    fn predict(&mut self, step: &Step, noise: &[f64], dt_s: f64) {
        let (s, size, m) = (self.at.len(), self.size, self.at.len() / 2);
        self.at.copy_from_slice(&step.end);
        self.at[s - 1] = self.at[s - 1].clamp(-1.0, 1.0);
        // F P, then (F P) Fᵀ.
        self.other.fill(0.0);
        for (row, local) in self.other.chunks_exact_mut(s).zip(step.by.chunks_exact(step.columns)) {
            for (factor, from) in local[..s].iter().zip(self.covariance.chunks_exact(s)) {
                add_multiple(row, *factor, from);
            }
        }
        for (i, row) in self.other.chunks_exact(s).enumerate() {
            for (j, local) in step.by.chunks_exact(step.columns).enumerate().take(i + 1) {
                let value = row.iter().zip(&local[..s]).map(|(a, b)| a * b).sum();
                self.covariance[i * s + j] = value;
                self.covariance[j * s + i] = value;
            }
        }
        let inputs = step.inputs();
        for i in 0..m {
            for j in 0..m {
                let (row, column) = (&inputs[i * m..][..m], &inputs[j * m..][..m]);
                let sum: f64 = row.iter().zip(column).zip(noise).map(|((a, b), noise)| a * b * noise).sum();
                self.covariance[(m + i) * s + m + j] += sum * dt_s;
            }
        }
        self.covariance[s * s - 1] += BRISTLE_NOISE_PER_S * dt_s;
        if size > 0 {
            for (row, local) in self.next_by.chunks_exact_mut(size).zip(step.by.chunks_exact(step.columns)) {
                let (of_motion, others) = row.split_at_mut(step.columns - s);
                of_motion.copy_from_slice(&local[s..]);
                others.fill(0.0);
                for (factor, from) in local[..s].iter().zip(self.by.chunks_exact(size)) {
                    add_multiple(row, *factor, from);
                }
            }
            core::mem::swap(&mut self.by, &mut self.next_by);
        }
    }
}
