//! The coarsest encoders with which a law still survives.

use core::f64::consts::TAU;

use serde::Serialize;
use upright::table::Law;

use super::error::{VerifyError, chain, within};
use super::trial::{Horizon, disturbed, edge, trial};
use upright_design::design::{DesignError, Uncertified, design};
use upright_design::parallel;
use upright_design::rig::{LinkEncoder, PlantDescription, Rig, Sensor};
use upright_design::simulate::{Disturbance, SimulationError};
use upright_design::table::TableValues;

/// Settings of the search for the coarsest encoders.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EncoderSettings {
    /// Duration of each run (s).
    pub duration_s: f64,
    /// Disturbances of the runs.
    pub disturbance: Disturbance,
    /// Number of runs, with the seeds from 1; all of them have to survive.
    pub seeds: u64,
    /// Largest factor tried, at least 1.
    pub largest_factor: f64,
    /// Relative precision of the factor.
    pub relative: f64,
}

impl EncoderSettings {
    /// 4 runs of 10 s with the disturbances the rig file expects, up to 1024 times coarser, to a tenth.
    pub fn of(rig: &Rig) -> Self {
        Self {
            duration_s: 10.0,
            disturbance: Disturbance::of(rig),
            seeds: 4,
            largest_factor: 1024.0,
            relative: 0.1,
        }
    }
}

/// The coarsest encoders with which a law still survives.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoarsestEncoder {
    /// The law in the loop.
    pub law: Law,
    /// How many times coarser than in the rig file, cart and links alike; none if not even
    /// the rig's own suffice.
    pub factor: Option<f64>,
    /// Whether the factor is the largest that was tried.
    pub at_largest_tried: bool,
    /// Step of the cart's encoder at that factor (m).
    pub cart_step_m: Option<f64>,
    /// Counts per revolution of each link's encoder at that factor.
    pub counts_per_rev: Vec<f64>,
}

/// The rig with encoders `factor` times coarser. Counts per revolution stay whole, and at least 2. An absolute sensor
/// keeps its bits and has more noise: its whole error is `factor` times as large.
pub fn coarser(rig: &Rig, factor: f64) -> Rig {
    let mut coarse = rig.clone();
    match &mut coarse.plant {
        PlantDescription::Chain(chain) => {
            match chain.cart.sensor_bits {
                Some(_) => chain.cart.sensor_noise_m = more_noise(rig, 0, factor),
                None => chain.cart.encoder_step_m = chain.cart.encoder_step_m.map(|step| step * factor),
            }
            for (number, link) in (1..).zip(&mut chain.links) {
                link.encoder = link.encoder.map(|encoder| match encoder {
                    LinkEncoder::StepRad(step) => LinkEncoder::StepRad(step * factor),
                    LinkEncoder::CountsPerRev(counts) => {
                        LinkEncoder::CountsPerRev((counts / factor).round().max(2.0))
                    }
                    LinkEncoder::Absolute { bits, travel_rad, zero_counts, .. } => {
                        let noise_rad = more_noise(rig, 2 * number, factor);
                        LinkEncoder::Absolute { bits, travel_rad, zero_counts, noise_rad }
                    }
                });
            }
        }
        PlantDescription::Model(model) => {
            model.measured_steps.iter_mut().for_each(|step| *step *= factor);
        }
    }
    coarse
}

/// Noise (m or rad) with which the whole error of the absolute sensor of this state, with its rounding, is `factor`
/// times as large.
fn more_noise(rig: &Rig, state: usize, factor: f64) -> f64 {
    let noise = |sensor: &Sensor| {
        ((factor * factor - 1.0) * sensor.variance() + sensor.noise.powi(2)).max(0.0).sqrt()
    };
    rig.sensors().iter().find(|sensor| sensor.state == state).map_or(0.0, noise)
}

/// `own` with the observer for `rig`, which differs from the rig of `own` in its encoders alone. The observer is not
/// certified, unless it needs more bits than are tried first.
fn with_observer_of(own: &Uncertified, rig: &Rig) -> Result<Uncertified, DesignError> {
    let alone = Rig { lqr: None, pole_placement: None, integral: None, ..rig.clone() };
    let observer = Uncertified::sampled_alone(&alone).or_else(|_| Ok(design(&alone)?.into()))?;
    let mut found = own.clone();
    found.double.kalman = observer.double.kalman;
    found.single.kalman = observer.single.kalman;
    Ok(found)
}

/// Finds the coarsest encoders by doubling and bisection of a common factor. The observer is redesigned for every
/// factor, as a user with such encoders would do: it knows their resolution. The law does not depend on it.
///
/// # Errors
/// [`VerifyError`] for a model or a rig without observer, and if a design or run fails.
pub fn coarsest_encoder(
    rig: &Rig,
    law: Law,
    settings: &EncoderSettings,
) -> Result<CoarsestEncoder, VerifyError> {
    chain(rig, "encoders")?;
    // The gains of the other law, which is not run, would be designed for nothing.
    let rig = &rig.with_law_alone(law);
    let own = design(rig)?.into();
    within("largest_factor", settings.largest_factor, 1.0..=1e6, "a factor from 1 to 1e6")?;
    within("relative", settings.relative, 1e-3..=1.0, "a width from 0.001 to 1")?;
    let found = edge([1.0, settings.largest_factor], settings.relative, |factor| {
        let coarse = coarser(rig, factor);
        let table = TableValues::of_uncertified(&coarse, &with_observer_of(&own, &coarse)?)?;
        if table.observer.is_none() {
            return Err(VerifyError::NoObserver);
        }
        let survives = |seed: u64| {
            let scenario = disturbed(&coarse, law, settings.duration_s, &settings.disturbance, seed);
            Ok(trial(&coarse, &table, &scenario, &Horizon::default())?.survives())
        };
        let all: Vec<bool> = parallel::try_map::<_, _, SimulationError>(1..=settings.seeds, survives)?;
        Ok(all.iter().all(|&survives| survives).then_some(()))
    })?;
    let factor = found.map(|(factor, ())| factor);
    let at_edge = coarser(rig, factor.unwrap_or(1.0));
    let at_edge = chain(&at_edge, "encoders")?;
    Ok(CoarsestEncoder {
        law,
        factor,
        at_largest_tried: factor.is_some_and(|factor| factor >= settings.largest_factor),
        cart_step_m: at_edge.cart.encoder_step_m,
        counts_per_rev: at_edge
            .links
            .iter()
            .filter_map(|link| match link.encoder? {
                LinkEncoder::CountsPerRev(counts) => Some(counts),
                LinkEncoder::StepRad(step) => Some(TAU / step),
                LinkEncoder::Absolute { bits, travel_rad, .. } => {
                    Some(f64::from(bits).exp2() * TAU / travel_rad.unwrap_or(TAU))
                }
            })
            .collect(),
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn the_design_for_coarser_encoders_differs_in_its_observer_alone() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/triple-glueck-eder-kugi.toml");
        let rig = Rig::from_path(&file).unwrap();
        let (own, coarse) = (Uncertified::from(design(&rig).unwrap()), coarser(&rig, 7.0));
        let (whole, found) =
            (Uncertified::from(design(&coarse).unwrap()), with_observer_of(&own, &coarse).unwrap());
        assert!(found == whole && found.double.kalman != own.double.kalman);
    }
}
