//! The sensors of a rig.

use std::f64::consts::{PI, TAU};

use upright::control::encoder::{AbsoluteSensor, is_at_end};

use super::description::Rig;
use super::sections::chain::{Cart, PlantDescription};
use super::sections::link::{LinkEncoder, TurnErrors};
use crate::numerics::{Matrix, Real};

/// A sensor that measures one state in discrete steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Index of the state.
    pub state: usize,
    /// Noise besides rounding, root mean square (unit of the state).
    pub noise: f64,
    /// How it reads, if it is an absolute sensor.
    pub absolute: Option<AbsoluteRange>,
    /// Age of its reading at the tick (s).
    pub delay_s: f64,
    /// Number of the part that it is, in [`PARTS`](upright::boards::parts::PARTS), and its errors per turn.
    pub part: Option<(usize, TurnErrors)>,
    resolution: Resolution,
}

/// How an absolute sensor reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AbsoluteRange {
    /// Bits that are used.
    pub bits: u32,
    /// Reading while the links hang (counts). The cart's is any reading: homing gives the cart its position.
    pub zero: u32,
    /// Counts in a turn. A potentiometer reads only the first 2^bits of them.
    pub turn: u32,
    /// Position while the links hang (counts): the first link hangs half a turn from position 0.
    pub rest: i64,
}

impl AbsoluteRange {
    /// The reading at this position (counts); that of an open wire in the dead band of a potentiometer.
    pub fn reading(&self, position: i64) -> u32 {
        let reading = self.turned(position);
        if reading < 1 << self.bits { reading } else { 0 }
    }

    /// How far it is turned at this position, from where it would read 0 (counts, within a turn).
    pub fn turned(&self, position: i64) -> u32 {
        (i64::from(self.zero) + position - self.rest).rem_euclid(self.turn.into()) as u32
    }

    /// Whether it does not read a whole turn.
    pub fn has_dead_band(&self) -> bool {
        self.turn != 1 << self.bits
    }

    /// The lowest and the highest reading while the links hang with which no reading at these positions (counts) is in
    /// the dead band.
    pub fn zeros_that_read(&self, positions: impl Iterator<Item = i64> + Clone) -> Option<[u32; 2]> {
        let works = |zero: &u32| {
            let other = Self { zero: *zero, ..*self };
            !positions.clone().any(|position| other.is_dead(other.reading(position)))
        };
        let mut zeros = (0..1u32 << self.bits).filter(works);
        let low = zeros.next()?;
        Some([low, zeros.last().unwrap_or(low)])
    }

    /// Whether this reading is in the dead band of a potentiometer, or so near that it is not used.
    pub fn is_dead(&self, reading: u32) -> bool {
        self.has_dead_band() && is_at_end(reading, self.bits)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Resolution {
    Step(f64),
    CountsPerRev(f64),
}

impl Sensor {
    /// A sensor of this state that counts steps of this size.
    const fn of_step(state: usize, step: f64) -> Self {
        Self {
            state,
            noise: 0.0,
            absolute: None,
            delay_s: 0.0,
            part: None,
            resolution: Resolution::Step(step),
        }
    }

    fn of_cart(cart: &Cart, step_m: f64) -> Self {
        let Some(bits) = cart.sensor_bits else { return Self::of_step(0, step_m) };
        let used = bits.min(f64::from(AbsoluteSensor::BITS));
        let range = AbsoluteRange { bits: used as u32, zero: 0, turn: 1 << used as u32, rest: 0 };
        let sensor = Self::of_step(0, step_m * (bits - used).exp2());
        Self { noise: cart.sensor_noise_m, absolute: Some(range), ..sensor }
    }

    fn of_link(state: usize, encoder: LinkEncoder) -> Self {
        match encoder {
            LinkEncoder::StepRad(step) => Self::of_step(state, step),
            LinkEncoder::CountsPerRev(counts) => {
                Self { resolution: Resolution::CountsPerRev(counts), ..Self::of_step(state, 0.0) }
            }
            LinkEncoder::Absolute { bits, travel_rad, zero_counts, noise_rad } => {
                let used = u32::from(bits).min(AbsoluteSensor::BITS);
                let zero = zero_counts >> (u32::from(bits) - used);
                let readings = f64::from(1u32 << used);
                let resolution = match travel_rad {
                    None => Resolution::CountsPerRev(readings),
                    Some(travel_rad) => Resolution::Step(travel_rad / readings),
                };
                let mut sensor = Self { noise: noise_rad, resolution, ..Self::of_step(state, 0.0) };
                let step: f64 = sensor.step();
                let (turn, rest) = ((TAU / step).round() as u32, if state == 2 { PI / step } else { 0.0 });
                sensor.absolute = Some(AbsoluteRange { bits: used, zero, turn, rest: rest.round() as i64 });
                sensor
            }
        }
    }

    /// The middle of a potentiometer's dead band (rad, up to whole turns).
    pub fn dead_rad(&self) -> Option<f64> {
        let range = self.absolute.filter(AbsoluteRange::has_dead_band)?;
        let middle = 0.5 * (f64::from(1u32 << range.bits) + f64::from(range.turn));
        Some(self.step::<f64>() * (middle - f64::from(range.zero) + range.rest as f64))
    }

    /// How far its joint may turn from where it hangs until a potentiometer stops reading (rad).
    pub fn room_rad(&self) -> Option<f64> {
        let range = self.absolute.filter(AbsoluteRange::has_dead_band)?;
        let hangs = range.rest;
        let reads =
            |away: &i64| ![hangs - away, hangs + away].iter().any(|&at| range.is_dead(range.reading(at)));
        let counts = (0..i64::from(range.turn)).take_while(reads).last().unwrap_or_default();
        Some(self.step::<f64>() * counts as f64)
    }

    /// Variance of its error: that of rounding, `step²/12`, and that of its noise.
    pub fn variance(&self) -> f64 {
        self.step::<f64>().powi(2) / 12.0 + self.noise.powi(2)
    }

    /// Travel per count (m, rad, or the unit of the state), in the precision of `R`: 2π over the counts is not exact
    /// in `f64`.
    pub fn step<R: Real>(&self) -> R {
        match self.resolution {
            Resolution::Step(step) => R::from_f64(step),
            Resolution::CountsPerRev(counts) => R::pi().scale_by_power_of_two(1) / &R::from_f64(counts),
        }
    }
}

impl Rig {
    /// C of `y = C x` for [`sensors`](Self::sensors): each measures its state, less the next one, its rate, by the age
    /// of the reading. This is exact to first order in that age.
    pub fn measurement<R: Real>(&self) -> Matrix<R> {
        let sensors = self.sensors();
        Matrix::from_fn(sensors.len(), self.states(), |i, j| match &sensors[i] {
            sensor if sensor.state == j => R::one(),
            sensor if sensor.state + 1 == j => R::from_f64(-sensor.delay_s),
            _ => R::zero(),
        })
    }

    /// The sensors with a resolution in the rig file, in the order of the states: the cart's and the links' encoders,
    /// or the measured states of a model.
    pub fn sensors(&self) -> Vec<Sensor> {
        match &self.plant {
            PlantDescription::Chain(chain) => {
                // A drive that imposes the motion counts its own steps.
                let step_m = self.actuator.pulses().map(|drive| drive.step_m);
                let cart =
                    step_m.or(chain.cart.encoder_step_m).map(|step| Sensor::of_cart(&chain.cart, step));
                let links = chain.links.iter().enumerate().filter_map(|(link, description)| {
                    let sensor = Sensor::of_link(2 + 2 * link, description.encoder?);
                    let part = description.part.map(|number| (number, description.errors));
                    Some(Sensor { delay_s: description.sensor_delay_s, part, ..sensor })
                });
                cart.into_iter().chain(links).collect()
            }
            PlantDescription::Model(model) => model
                .measured
                .iter()
                .zip(&model.measured_steps)
                .map(|(&state, &step)| Sensor::of_step(state, step))
                .collect(),
        }
    }
}
