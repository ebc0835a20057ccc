//! What rounding to `f32` and holding a continuous gain over the tick do to the loop.

use super::{Certified, DesignError, Feedback};
use crate::numerics::{Matrix, spectral_radius};

/// Spectral radii of one law's loop at the tick (below 1: stable).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Assessment {
    /// With the exact sampled gains.
    pub exact: f64,
    /// With the sampled gains as the table holds them, rounded to `f32`.
    pub rounded: f64,
    /// With the gains for continuous time, used at the tick (and late by the delay) without redesign.
    pub continuous_at_tick: f64,
}

impl Certified {
    /// Assesses [LQR, pole placement], where designed.
    ///
    /// # Errors
    /// [`DesignError::Poles`] if the eigenvalue iteration fails.
    pub fn assess(&self) -> Result<[Option<Assessment>; 2], DesignError> {
        let design = &self.double;
        let radius =
            |k: &Matrix<f64>| spectral_radius(&design.sampled_loop(k)).map_err(|_| DesignError::Poles);
        let assess = |continuous: &Feedback<f64>, sampled: &Feedback<f64>, single: &Feedback<f32>| {
            // A continuous gain knows nothing of a force on its way.
            let mut held = Matrix::zeros(1, sampled.k.cols());
            for j in 0..continuous.k.cols() {
                held[(0, j)] = continuous.k[(0, j)];
            }
            Ok(Assessment {
                exact: radius(&sampled.k)?,
                rounded: radius(&single.k.map(|&gain| f64::from(gain)))?,
                continuous_at_tick: radius(&held)?,
            })
        };
        let (continuous, sampled, single) =
            (design.continuous.each(), design.sampled.each(), self.single.sampled.each());
        let mut assessments = [None, None];
        for (law, assessment) in assessments.iter_mut().enumerate() {
            if let (Some(continuous), Some(sampled), Some(single)) =
                (continuous[law], sampled[law], single[law])
            {
                *assessment = Some(assess(continuous, sampled, single)?);
            }
        }
        Ok(assessments)
    }
}
