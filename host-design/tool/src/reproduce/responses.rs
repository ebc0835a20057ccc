//! The paper's figures 5 to 8: a step of 1 m on the nonlinear plant, with and without disturbances, for both laws.

use serde::Serialize;
use upright::table::Law;

use super::continuous_loop::ContinuousRun;
use super::course::{Course, StepFigures};
use super::{ReproduceError, SEED, chain, published};
use upright_design::design::{Certified, Feedback, design};
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, Sensing, simulate};
use upright_design::table::{Gains, TableValues};

/// Kind of loop that is run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Loop {
    /// The paper's: continuous gains, no tick, no force limit, the whole state known.
    Continuous,
    /// The firmware's controller with gains for the tick and the force limit of the rig file, the whole state known.
    FullState,
    /// The same from encoder counts, with the observer.
    Encoders,
}

impl Loop {
    /// All kinds of loop, the paper's first.
    pub const ALL: [Loop; 3] = [Loop::Continuous, Loop::FullState, Loop::Encoders];

    /// Name in tables and figures.
    pub fn name(self) -> &'static str {
        match self {
            Loop::Continuous => "continuous",
            Loop::FullState => "sampled, full state",
            Loop::Encoders => "sampled, encoders",
        }
    }
}

/// Both laws for one rig, in every loop. The set-point is a step: there is no governor, as in the paper.
#[derive(Debug, Clone, PartialEq)]
pub struct Loops {
    /// The rig.
    pub rig: Rig,
    /// Its design.
    pub certified: Certified,
    /// Table with the gains for the tick, without governor.
    pub table: TableValues,
}

impl Loops {
    /// Designs `rig`.
    ///
    /// # Errors
    /// [`ReproduceError`] if the rig is not a chain, asks for one law only, or has no design.
    pub fn of(rig: &Rig) -> Result<Self, ReproduceError> {
        chain(rig)?;
        Self::with(rig, design(rig)?)
    }

    /// With this design of `rig`, a chain.
    pub(super) fn with(rig: &Rig, certified: Certified) -> Result<Self, ReproduceError> {
        if certified.double.continuous.each().into_array().contains(&None) {
            return Err(ReproduceError::OneLaw(rig.name.clone()));
        }
        let table = TableValues::of(rig, &certified, Gains::Sampled)?.without_governor();
        Ok(Self { rig: rig.clone(), certified, table })
    }

    /// Continuous gains of `law`.
    pub(super) fn continuous(&self, law: Law) -> Result<&Feedback<f64>, ReproduceError> {
        let laws = &self.certified.double.continuous;
        laws.each()[law].ok_or_else(|| ReproduceError::OneLaw(self.rig.name.clone()))
    }

    /// Simulates `law` in this kind of loop, from rest. Sampled loops are recorded at the tick, whatever `run` says.
    pub(super) fn course(&self, law: Law, kind: Loop, run: &ContinuousRun) -> Result<Course, ReproduceError> {
        let sensing = match kind {
            Loop::Continuous => return run.course(chain(&self.rig)?, self.continuous(law)?),
            Loop::FullState => Sensing::FullState,
            Loop::Encoders => Sensing::Encoders,
        };
        let noise = |variance: f64| run.disturbances.map_or(0.0, |_| variance.sqrt());
        let scenario = Scenario {
            sensing,
            step_m: run.step_m,
            duration_s: run.duration_s,
            force_noise_n: noise(published::FORCE_VARIANCE_N2),
            torque_noise_n_m: noise(published::TORQUE_VARIANCE_N2_M2),
            seed: run.disturbances.unwrap_or(SEED),
            ..Scenario::at_rest(&self.rig, law)
        };
        let (trace, summary) = simulate(&self.rig, &self.table, &scenario)?;
        Ok(Course::of_trace(&trace, self.rig.tick.period_s, summary.fall))
    }
}

/// One response.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Response {
    /// Number of the paper's figure.
    pub figure: u8,
    /// LQR or pole placement.
    pub law: Law,
    /// Which loop.
    pub kind: Loop,
    /// Figures of the step response.
    pub figures: StepFigures,
    /// Time history of the run.
    #[serde(skip)]
    pub course: Course,
}

/// All responses, in the order of the paper's figures.
///
/// # Errors
/// [`ReproduceError`] if a run cannot be made.
pub fn responses(loops: &Loops) -> Result<Vec<Response>, ReproduceError> {
    let mut responses = Vec::new();
    for (offset, disturbances) in [(5, None), (7, Some(SEED))] {
        for (figure, law) in (offset..).zip(Law::ALL) {
            for kind in Loop::ALL {
                let course =
                    loops.course(law, kind, &ContinuousRun { disturbances, ..ContinuousRun::STEP })?;
                let figures = course.step_figures(ContinuousRun::STEP.step_m);
                responses.push(Response { figure, law, kind, figures, course });
            }
        }
    }
    Ok(responses)
}
