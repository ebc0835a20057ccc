//! The samples of a log: measurements in the units of the model, and the drive of the cart.

// The indices are those of the equations.
#![allow(clippy::needless_range_loop)]

use core::f64::consts::PI;

use upright::protocol::tick_log::OFF;
use upright_design::design::{lag_s, shares_of_lag};
use upright_design::rig::{Motor, Rig};

use crate::cart_force::CartForce;
use crate::channel::channel_name;
use crate::error::IdentifyError;
use crate::imposed;
use crate::log::{DriveScale, Log};
use crate::model::Model;
use crate::parameters::Layout;
use crate::table::RecordingRows;

/// Longest time from one sample to the next (s), unless a recording has fewer; of an imposed motion, also the longest
/// integration step.
const LONGEST_S: f64 = 0.0021;
/// Longest integration step (s) with a force.
const LONGEST_STEP_S: f64 = 0.0101;
/// Most of the time constant with which a motor stops the cart in one integration step.
const LARGEST_SHARE: f64 = 0.5;
/// Shortest piece without a lost tick that is used (s).
const SHORTEST_PIECE_S: f64 = 1.0;

/// Consecutive samples: measurements every few ticks, and the drive of every tick.
#[derive(Debug, Clone)]
pub(crate) struct Piece {
    /// Deviations from hanging (m, rad), one row of m channels per sample.
    pub(crate) y: Vec<f64>,
    /// Voltage (V), or force (N) of a rig without a motor, in each tick; none while the motor is off. Of a drive that
    /// imposes the cart's motion, its position at the beginning of the tick (m).
    pub(crate) drive: Vec<Option<f64>>,
}

/// The samples of all logs.
#[derive(Debug, Clone)]
pub(crate) struct Record {
    pub(crate) pieces: Vec<Piece>,
    pub(crate) channels: usize,
    /// Ticks from one sample to the next.
    pub(crate) stride: usize,
    /// Time from one sample to the next (s).
    pub(crate) dt_s: f64,
    /// Travel per count of each channel (m, rad).
    pub(crate) steps: Vec<f64>,
    /// Noise of each channel besides the rounding to steps, root mean square (m, rad).
    pub(crate) noise: Vec<f64>,
    motor: Option<Motor>,
    /// Time constant with which the back-EMF stops the cart alone (s); infinite without a motor.
    stops_within_s: f64,
    /// Whether the force begins a tick after its command.
    is_late: bool,
    /// How it follows from then on: see [`shares_of_lag`].
    shares: [f64; 2],
    /// Whether the cart cannot move; its channel is then 0.
    pub(crate) is_clamped: bool,
    /// Whether the drive imposes the cart's motion: its channel is the input.
    pub(crate) is_moved: bool,
}

impl Record {
    /// The samples of `logs`, every `stride` ticks.
    pub(crate) fn of(rig: &Rig, logs: &[Log], stride: usize) -> Self {
        let mut record = Self::empty(rig, rig.tick.period_s, stride);
        for log in logs {
            record.add(rig, log);
        }
        record
    }

    /// No samples, of recordings with a row every `period_s`.
    pub(crate) fn empty(rig: &Rig, period_s: f64, stride: usize) -> Self {
        let steps: Vec<f64> = rig.sensors().iter().map(|sensor| sensor.step()).collect();
        let channels = steps.len();
        Self {
            pieces: Vec::new(),
            channels,
            stride,
            dt_s: stride as f64 * period_s,
            motor: rig.actuator.motor().cloned(),
            stops_within_s: stops_within_s(rig).unwrap_or(f64::INFINITY),
            is_late: rig.tick.delay_ticks == 1,
            shares: shares_of_lag(lag_s(rig), period_s),
            is_clamped: false,
            is_moved: rig.actuator.held().is_motion(),
            noise: rig.sensors().iter().map(|sensor| sensor.noise).collect(),
            steps,
        }
    }

    /// A record of measurements of other programs: the drive is a force if `is_force`.
    pub(crate) fn of_rows(rig: &Rig, pieces: Vec<RecordingRows>, is_force: bool, is_clamped: bool) -> Self {
        let period_s = pieces.first().map_or(rig.tick.period_s, |rows| rows.period_s);
        let mut record = Self::empty(rig, period_s, Self::usual_stride(period_s));
        record.is_clamped = is_clamped;
        record.is_moved &= !is_clamped;
        if is_force {
            record.motor = None;
        }
        let (stride, channels) = (record.stride, record.channels);
        for rows in pieces.into_iter().filter(|rows| rows.drive.len() as f64 * period_s >= SHORTEST_PIECE_S) {
            let y = rows.y.chunks(channels).step_by(stride).flatten().copied().collect();
            let position = |row: &[f64]| row.first().copied();
            let drive =
                if record.is_moved { rows.y.chunks(channels).map(position).collect() } else { rows.drive };
            record.pieces.push(Piece { y, drive });
        }
        record
    }

    /// The pieces of both.
    pub(crate) fn with(mut self, other: Self) -> Self {
        self.pieces.extend(other.pieces);
        self
    }

    /// The usual stride for a control period (s).
    pub(crate) fn usual_stride(period_s: f64) -> usize {
        ((LONGEST_S / period_s) as usize).max(1)
    }

    fn add(&mut self, rig: &Rig, log: &Log) {
        let deviations = log.deviations();
        let ticks = log.ticks();
        let supply = rig.actuator.motor().map_or(0.0, |motor| motor.supply_v);
        let drive = |index: usize| {
            let tick = &ticks[index];
            let drive = match log.header.drive {
                DriveScale::Steps(_) => deviations[index * self.channels] as f64 * self.steps[0],
                DriveScale::Force(_) => log.drive(tick),
                DriveScale::Duty if tick.supply_mv == 0 => log.drive(tick) * supply,
                DriveScale::Duty => log.drive(tick) * f64::from(tick.supply_mv) * 1e-3,
            };
            (tick.drive != OFF).then_some(drive)
        };
        // An old reading belongs to an earlier tick, or is between two.
        let late: Vec<f64> = rig.sensors().iter().map(|sensor| sensor.delay_s / rig.tick.period_s).collect();
        let most_late = late.iter().fold(0.0f64, |most, late| most.max(late.ceil())) as usize;
        let (mut from, is_moved) = (0, self.is_moved);
        for to in 1..=ticks.len() {
            // A drive that is off lets go of the cart, and its pulses no longer tell where that is.
            let goes_on = |to: usize| {
                ticks[to].number == ticks[to - 1].number + 1
                    && !(is_moved && (ticks[to].drive == OFF || ticks[to - 1].drive == OFF))
            };
            if to < ticks.len() && goes_on(to) {
                continue;
            }
            let read_to = to.saturating_sub(most_late).max(from);
            if (read_to - from) as f64 * rig.tick.period_s >= SHORTEST_PIECE_S {
                let samples = (from..read_to).step_by(self.stride);
                let positions =
                    samples.flat_map(|index| late.iter().enumerate().map(move |late| (index, late)));
                let y = positions.map(|(index, (channel, late))| {
                    let read = |index: usize| deviations[index * self.channels + channel] as f64;
                    let first = index + *late as usize;
                    let further =
                        if late.fract() > 0.0 { late.fract() * (read(first + 1) - read(first)) } else { 0.0 };
                    (read(first) + further) * self.steps[channel]
                });
                self.pieces.push(Piece { y: y.collect(), drive: (from..read_to).map(drive).collect() });
            }
            from = to;
        }
    }

    /// Time from one tick, or row, to the next (s).
    pub(crate) fn period_s(&self) -> f64 {
        self.dt_s / self.stride as f64
    }

    /// Number of samples of a piece.
    pub(crate) fn samples(&self, piece: usize) -> usize {
        self.pieces[piece].y.len() / self.channels
    }

    /// Total duration of all pieces (s).
    pub(crate) fn seconds(&self) -> f64 {
        (0..self.pieces.len()).map(|piece| self.samples(piece)).sum::<usize>() as f64 * self.dt_s
    }

    /// The samples from `from_s` to `to_s`, where time is counted across the pieces without the gaps.
    pub(crate) fn part(&self, from_s: f64, to_s: f64) -> Self {
        let mut part = Self {
            pieces: Vec::new(),
            steps: self.steps.clone(),
            noise: self.noise.clone(),
            motor: self.motor.clone(),
            ..*self
        };
        let mut passed = 0;
        let [from, to] = [from_s, to_s].map(|at_s| (at_s / self.dt_s).round() as usize);
        for piece in &self.pieces {
            let samples = piece.y.len() / self.channels;
            let [low, high] = [from, to].map(|at| at.saturating_sub(passed).min(samples));
            passed += samples;
            if (high - low) as f64 * self.dt_s >= SHORTEST_PIECE_S {
                let last = (high * self.stride).min(piece.drive.len());
                part.pieces.push(Piece {
                    y: piece.y[low * self.channels..high * self.channels].to_vec(),
                    drive: piece.drive[low * self.stride..last].to_vec(),
                });
            }
        }
        part
    }

    /// The first channel whose measurements the model has to explain: not the cart's, if its motion is known.
    pub(crate) fn first_channel(&self) -> usize {
        usize::from(self.is_clamped || self.is_moved)
    }

    /// Force of each interval between two samples of a piece, with the delay and the dead zone of `p`:
    /// `u = (1 - δ) u_k + δ u_{k-1}`, averaged over the interval.
    pub(crate) fn inputs(&self, layout: Layout, p: &[f64], piece: usize) -> Vec<CartForce> {
        if self.is_moved {
            return imposed::inputs(&self.pieces[piece].drive, self.stride, self.dt_s, p[layout.travel()]);
        }
        let (delay, dead_zone) = (p[layout.delay()], p[layout.dead_zone()]);
        let drive = &self.pieces[piece].drive;
        let commanded = |value: f64| {
            let Some(motor) = &self.motor else { return [value, 0.0] };
            let per_volt = motor.newtons_per_volt();
            let left = value.abs() - dead_zone;
            if left > 0.0 { [per_volt * left.copysign(value), -per_volt.copysign(value)] } else { [0.0; 2] }
        };
        let [pending, left] = self.shares;
        let (mut before, mut previous) = ([0.0; 2], [0.0; 2]);
        let mean = |drive: &Option<f64>| {
            let now = commanded(drive.unwrap_or_default());
            let command = if self.is_late { std::mem::replace(&mut previous, now) } else { now };
            let mix = |share: f64| [0, 1].map(|i| share * before[i] + (1.0 - share) * command[i]);
            let mean = mix(pending);
            before = mix(left);
            mean
        };
        // Force in each tick, and its derivative by the dead zone.
        let forces: Vec<[f64; 2]> = drive.iter().map(mean).collect();
        let back_emf = self.back_emf();
        let mut inputs = Vec::with_capacity(self.samples(piece));
        for first in (0..drive.len()).step_by(self.stride) {
            let ticks = first..(first + self.stride).min(drive.len());
            let share = 1.0 / ticks.len() as f64;
            let mut input = CartForce::default();
            for tick in ticks {
                let [new, new_by] = forces[tick];
                let [old, old_by] = tick.checked_sub(1).map_or([0.0; 2], |before| forces[before]);
                if drive[tick].is_some() {
                    input.back_emf += share * back_emf;
                }
                input.force += share * (new + delay * (old - new));
                input.by_delay += share * (old - new);
                input.by_dead_zone += share * (new_by + delay * (old_by - new_by));
            }
            inputs.push(input);
        }
        inputs
    }

    /// The state at a sample, from a parabola through the measurements around it.
    pub(crate) fn state_near(&self, p: &[f64], model: &Model, piece: usize, sample: usize) -> Vec<f64> {
        let (m, layout) = (self.channels, model.layout);
        let half = ((0.016 / self.dt_s).ceil() as usize).max(2);
        let last = self.samples(piece) - 1;
        let (low, high) = (sample.saturating_sub(half), (sample + half).min(last));
        let mut state = vec![0.0; model.states()];
        for channel in 0..m {
            let points = (low..=high).map(|at| {
                let time = (at as f64 - sample as f64) * self.dt_s;
                (time, self.pieces[piece].y[at * m + channel])
            });
            let [value, rate] = parabola(points);
            (state[channel], state[m + channel]) = (value, rate);
        }
        // What moves by a count in a few samples bends its bristle.
        for contact in 0..model.contacts() {
            state[2 * m + contact] = libm::tanh(state[m + contact] / (self.steps[contact] / 0.016));
        }
        [0, m].iter().for_each(|&of_cart| state[of_cart] *= p[layout.travel()]);
        for joint in 0..m - 1 {
            state[joint + 1] -= p[layout.zero(joint)];
        }
        state[1] += PI - p[layout.tilt()];
        for joint in 1..m - 1 {
            state[joint + 1] += state[joint];
            state[m + joint + 1] += state[m + joint];
        }
        state
    }

    /// Error (rms; m, rad) that the sensor of a channel alone makes: quantisation, or more if the measurements are
    /// noisier, as fourth differences show, in which smooth motion vanishes.
    pub(crate) fn sensor_error(&self, channel: usize) -> f64 {
        let (mut squares, mut count) = (0.0, 0usize);
        for piece in &self.pieces {
            let y = |sample: usize| piece.y[sample * self.channels + channel];
            for at in 2..(piece.y.len() / self.channels).saturating_sub(2) {
                let fourth = y(at - 2) - 4.0 * y(at - 1) + 6.0 * y(at) - 4.0 * y(at + 1) + y(at + 2);
                squares += fourth * fourth;
                count += 1;
            }
        }
        // 1 + 16 + 36 + 16 + 1.
        let noise = (squares / (70.0 * count.max(1) as f64)).sqrt();
        noise.max(self.steps[channel] / 12f64.sqrt())
    }

    /// Largest deviation of a channel from hanging, and its range from end to end (m, rad).
    pub(crate) fn extent(&self, channel: usize) -> [f64; 2] {
        let values =
            || self.pieces.iter().flat_map(|piece| piece.y.iter().skip(channel).step_by(self.channels));
        let low = values().copied().fold(f64::INFINITY, f64::min);
        let high = values().copied().fold(f64::NEG_INFINITY, f64::max);
        [low.abs().max(high.abs()), high - low]
    }

    /// Largest angle of any link from hanging (rad).
    pub(crate) fn largest_angle(&self) -> f64 {
        let rows = self.pieces.iter().flat_map(|piece| piece.y.chunks(self.channels));
        rows.flat_map(|row| {
            row[1..].iter().scan(0.0, |angle: &mut f64, &joint| {
                *angle += joint;
                Some(angle.abs())
            })
        })
        .fold(0.0, f64::max)
    }

    /// Checks that every channel moves.
    ///
    /// # Errors
    /// [`IdentifyError::NothingMoves`], or [`IdentifyError::Still`] for the first channel that moves by less than ten
    /// counts.
    pub(crate) fn moves(&self) -> Result<(), IdentifyError> {
        let is_still = |channel: usize| self.extent(channel)[1] < 10.0 * self.steps[channel];
        let first = usize::from(self.is_clamped);
        match (first..self.channels).find(|&channel| is_still(channel)) {
            Some(_) if (first..self.channels).all(is_still) => Err(IdentifyError::NothingMoves),
            Some(channel) => Err(IdentifyError::Still(channel_name(channel))),
            None => Ok(()),
        }
    }

    /// Checks that the record is long enough.
    ///
    /// # Errors
    /// [`IdentifyError::TooShort`] with less than `least` seconds.
    pub(crate) fn at_least(&self, least: f64) -> Result<(), IdentifyError> {
        let seconds = self.seconds();
        if seconds < least { Err(IdentifyError::TooShort { seconds, least }) } else { Ok(()) }
    }

    /// Integration steps between two samples: pulses may come in slow ticks, which are smooth steps only for a force,
    /// and a motor with a large gear ratio stops the cart within a tick.
    fn substeps(&self) -> usize {
        let longest_s =
            if self.is_moved { LONGEST_S } else { (LARGEST_SHARE * self.stops_within_s).min(LONGEST_STEP_S) };
        (self.dt_s / longest_s).ceil().max(1.0) as usize
    }

    /// Back-EMF as damping (N·s/m).
    fn back_emf(&self) -> f64 {
        self.motor.as_ref().map_or(0.0, Motor::braking_n_s_per_m)
    }

    /// The model of the recorded chain with the usual smoothing of dry friction; `gravity` in m/s².
    pub(crate) fn model(&self, gravity: f64) -> Model {
        Model {
            layout: Layout { links: self.channels - 1 },
            gravity,
            smoothing: crate::parameters::SMOOTHING,
            creeping: None,
            excess: [0.0; 2],
            joints_excess_at_most: 0.0,
            half_at: crate::stribeck::HALF_AT,
            is_imposed: self.is_clamped || self.is_moved,
            substeps: self.substeps(),
            has_bristles: false,
        }
    }
}

/// Time constant with which the back-EMF of a rig's motor stops its cart alone (s).
fn stops_within_s(rig: &Rig) -> Option<f64> {
    Some(rig.chain()?.cart.mass_kg? / rig.actuator.motor()?.braking_n_s_per_m())
}

/// Value and slope at 0 of the parabola through `points` by least squares.
fn parabola(points: impl Iterator<Item = (f64, f64)>) -> [f64; 2] {
    let (mut t, mut y) = ([0.0; 5], [0.0; 3]);
    for (time, value) in points {
        let mut power = 1.0;
        for k in 0..5 {
            t[k] += power;
            if k < 3 {
                y[k] += power * value;
            }
            power *= time;
        }
    }
    // Cramer's rule for [t0 t1 t2; t1 t2 t3; t2 t3 t4] c = y.
    let minor = |a: usize, b: usize, c: usize, d: usize| t[a] * t[d] - t[b] * t[c];
    let determinant = t[0] * minor(2, 3, 3, 4) - t[1] * minor(1, 3, 2, 4) + t[2] * minor(1, 2, 2, 3);
    let value =
        y[0] * minor(2, 3, 3, 4) - t[1] * (y[1] * t[4] - t[3] * y[2]) + t[2] * (y[1] * t[3] - t[2] * y[2]);
    let slope =
        t[0] * (y[1] * t[4] - t[3] * y[2]) - y[0] * minor(1, 3, 2, 4) + t[2] * (t[1] * y[2] - y[1] * t[2]);
    [value / determinant, slope / determinant]
}

#[cfg(test)]
mod tests {
    use super::parabola;

    #[test]
    fn a_parabola_is_found() {
        let [value, slope] = parabola((-3..6).map(f64::from).map(|t| (t, 2.0 - 0.5 * t + 0.25 * t * t)));
        assert!((value - 2.0).abs() < 1e-12 && (slope + 0.5).abs() < 1e-12, "{value} {slope}");
    }
}
