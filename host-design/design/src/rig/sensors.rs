//! The sensors of a rig.

use super::description::Rig;
use super::sections::chain::PlantDescription;
use super::sections::link::LinkEncoder;
use crate::numerics::Real;

/// A sensor that measures one state in discrete steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor {
    /// Index of the state.
    pub state: usize,
    resolution: Resolution,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Resolution {
    Step(f64),
    CountsPerRev(f64),
}

impl Sensor {
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
    /// The sensors with a resolution in the rig file, in the order of the states: the cart's and the links' encoders,
    /// or the measured states of a model.
    pub fn sensors(&self) -> Vec<Sensor> {
        match &self.plant {
            PlantDescription::Chain(chain) => {
                // A drive that imposes the motion counts its own steps.
                let step_m = self.actuator.acceleration.as_ref().map(|drive| drive.step_m);
                let cart = step_m
                    .or(chain.cart.encoder_step_m)
                    .map(|step| Sensor { state: 0, resolution: Resolution::Step(step) });
                let links = chain.links.iter().enumerate().filter_map(|(link, description)| {
                    let resolution = match description.encoder? {
                        LinkEncoder::StepRad(step) => Resolution::Step(step),
                        LinkEncoder::CountsPerRev(counts) => Resolution::CountsPerRev(counts),
                    };
                    Some(Sensor { state: 2 + 2 * link, resolution })
                });
                cart.into_iter().chain(links).collect()
            }
            PlantDescription::Model(model) => model
                .measured
                .iter()
                .zip(&model.measured_steps)
                .map(|(&state, &step)| Sensor { state, resolution: Resolution::Step(step) })
                .collect(),
        }
    }
}
