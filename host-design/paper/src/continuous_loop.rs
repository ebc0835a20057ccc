//! The loop that the paper simulates: the nonlinear chain under `u = N r - K x` in continuous time, the whole state
//! known, without tick, force limit or ends of the rail.
//!
//! The firmware's controller has no such mode: this law is what the paper studies, not something that runs on a rig.

use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;

use super::ReproduceError;
use super::published;
use super::trajectory::{Trajectory, fall_of};
use upright_design::design::Feedback;
use upright_design::plant::chain_plant;
use upright_design::plant::reference::{Tolerance, integrate};
use upright_design::rig::Chain;

/// A run of the continuous loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContinuousRun {
    /// Set-point from 0 s on (m).
    pub step_m: f64,
    /// Duration (s).
    pub duration_s: f64,
    /// Time between samples (s).
    pub sample_s: f64,
    /// With the paper's disturbances, drawn from this seed at each sample and held until the next: the same numbers
    /// that a simulation of the firmware with this tick and seed draws.
    pub disturbances: Option<u64>,
    /// Local error tolerance of the integrator.
    pub tolerance: Tolerance,
}

impl ContinuousRun {
    /// The paper's step of 1 m: 10 s, sampled every millisecond, to a relative tolerance of 1e-10.
    pub const STEP: Self = Self {
        step_m: 1.0,
        duration_s: 10.0,
        sample_s: 1e-3,
        disturbances: None,
        tolerance: Tolerance { relative: 1e-10, absolute: 1e-12 },
    };

    /// Simulates the run from rest at 0, and returns its time history.
    ///
    /// # Errors
    /// [`ReproduceError`] if the integrator gives up or the plant cannot be built.
    pub fn trajectory(&self, chain: &Chain, law: &Feedback<f64>) -> Result<Trajectory, ReproduceError> {
        let plant = chain_plant(chain)?;
        let force_n = |state: &[f64]| law.force_n(self.step_m, state);
        let mut disturbances = LoopDisturbances::of(self.disturbances, plant.disturbances())?;
        let samples = (self.duration_s / self.sample_s).round() as usize;
        let mut state = vec![0.0; plant.states()];
        let mut trajectory = Trajectory::with_room(self.sample_s, samples + 1);
        for sample in 0..=samples {
            trajectory.push(&state, force_n(&state));
            trajectory.fall = fall_of(&state, sample as f64 * self.sample_s);
            if trajectory.fall.is_some() {
                break;
            }
            let push = disturbances.next_force();
            let pushed = |_: f64, state: &[f64]| force_n(state) + push;
            let torques = &disturbances.torques;
            state = integrate(&*plant, &state, pushed, torques, self.sample_s, self.tolerance)?;
        }
        Ok(trajectory)
    }
}

/// Held disturbances, in the order in which the simulated bench draws them.
struct LoopDisturbances {
    source: Option<(Pcg64, Normal<f64>, Normal<f64>)>,
    torques: Vec<f64>,
}

impl LoopDisturbances {
    fn of(seed: Option<u64>, joints: usize) -> Result<Self, ReproduceError> {
        let normal =
            |variance: f64| Normal::new(0.0, variance.sqrt()).map_err(|_| ReproduceError::Variance(variance));
        let force = normal(published::FORCE_VARIANCE_N2)?;
        let torque = normal(published::TORQUE_VARIANCE_N2_M2)?;
        Ok(Self {
            source: seed.map(|seed| (Pcg64::seed_from_u64(seed), force, torque)),
            torques: vec![0.0; joints],
        })
    }

    /// Draws the next force and torques; returns the force (N).
    fn next_force(&mut self) -> f64 {
        let Some((random, force, torque)) = &mut self.source else { return 0.0 };
        let push = force.sample(random);
        self.torques.fill_with(|| torque.sample(random));
        push
    }
}
