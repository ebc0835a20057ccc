//! The sensors of a rig.

use upright::control::encoder::AbsoluteSensor;

use super::description::Rig;
use super::sections::chain::PlantDescription;
use super::sections::link::LinkEncoder;
use crate::numerics::{Matrix, Real};

/// A sensor that measures one state in discrete steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Index of the state.
    pub state: usize,
    /// Noise besides rounding, root mean square (unit of the state).
    pub noise: f64,
    /// If it is an absolute sensor of an angle, bits per turn and reading while the links hang (counts), of those that
    /// are used.
    pub absolute: Option<[u32; 2]>,
    /// Age of its reading at the tick (s).
    pub delay_s: f64,
    resolution: Resolution,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Resolution {
    Step(f64),
    CountsPerRev(f64),
}

impl Sensor {
    /// A sensor of this state that counts steps of this size.
    const fn of_step(state: usize, step: f64) -> Self {
        Self { state, noise: 0.0, absolute: None, delay_s: 0.0, resolution: Resolution::Step(step) }
    }

    fn of_link(state: usize, encoder: LinkEncoder) -> Self {
        match encoder {
            LinkEncoder::StepRad(step) => Self::of_step(state, step),
            LinkEncoder::CountsPerRev(counts) => {
                Self { resolution: Resolution::CountsPerRev(counts), ..Self::of_step(state, 0.0) }
            }
            LinkEncoder::Absolute { bits, zero_counts, noise_rad } => {
                let used = u32::from(bits).min(AbsoluteSensor::BITS);
                let zero = zero_counts >> (u32::from(bits) - used);
                let resolution = Resolution::CountsPerRev(f64::from(1u32 << used));
                Self {
                    noise: noise_rad,
                    absolute: Some([used, zero]),
                    resolution,
                    ..Self::of_step(state, 0.0)
                }
            }
        }
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
                let step_m = self.actuator.acceleration.as_ref().map(|drive| drive.step_m);
                let cart = step_m.or(chain.cart.encoder_step_m).map(|step| Sensor::of_step(0, step));
                let links = chain.links.iter().enumerate().filter_map(|(link, description)| {
                    let sensor = Sensor::of_link(2 + 2 * link, description.encoder?);
                    Some(Sensor { delay_s: description.sensor_delay_s, ..sensor })
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
