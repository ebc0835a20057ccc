//! Effect on the loop of rounding the gains to `f32`, and of using a continuous gain at the tick.

use super::{Certified, DesignError, Feedback};
use crate::numerics::{Matrix, spectral_radius};
use crate::rig::Rig;
use upright::table::PerLaw;

/// Spectral radii of one law's loop at the tick (below 1: stable).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Assessment {
    /// With the exact sampled gains.
    pub exact: f64,
    /// With the sampled gains as the table holds them, rounded to `f32`.
    pub rounded: f64,
    /// Largest relative change of a gain caused by rounding to `f32`.
    pub largest_rounding: f64,
    /// With the gains for continuous time, used at the tick (and with the delay) without redesign.
    pub continuous_at_tick: f64,
}

impl Certified {
    /// Assesses each designed law as it goes into the table (LQR with integral action, if there is such a design).
    ///
    /// # Errors
    /// [`DesignError::Poles`] if the eigenvalue iteration fails.
    pub fn assess(&self, rig: &Rig) -> Result<PerLaw<Option<Assessment>>, DesignError> {
        let design = &self.double;
        let radius = |law: &Feedback<f64>| {
            spectral_radius(&design.sampled_loop(rig, law)).map_err(|_| DesignError::Poles)
        };
        let assess = |law| {
            let (exact, single) = (design.sampled.in_table()[law], self.single.sampled.in_table()[law]);
            let (Some(continuous), Some(exact), Some(single)) =
                (design.continuous.in_table()[law], exact, single)
            else {
                return Ok(None);
            };
            let rounded = Feedback { k: single.k.map(|&gain| f64::from(gain)), ..exact.clone() };
            // A continuous gain feeds back no pending force.
            let mut held = Matrix::zeros(1, exact.k.cols());
            for j in 0..continuous.k.cols() {
                held[(0, j)] = continuous.k[(0, j)];
            }
            Ok(Some(Assessment {
                exact: radius(exact)?,
                rounded: radius(&rounded)?,
                largest_rounding: largest_relative_difference(&exact.k, &rounded.k),
                continuous_at_tick: radius(&Feedback { k: held, ..continuous.clone() })?,
            }))
        };
        PerLaw::from_fn(assess).transpose()
    }
}

fn largest_relative_difference(exact: &Matrix<f64>, rounded: &Matrix<f64>) -> f64 {
    let pairs = exact.entries().iter().zip(rounded.entries());
    pairs
        .filter(|(exact, _)| **exact != 0.0)
        .map(|(exact, rounded)| (rounded / exact - 1.0).abs())
        .fold(0.0, f64::max)
}
