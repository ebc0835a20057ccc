//! The paper's figures 5 to 8: a step of 1 m on the nonlinear plant, with and without disturbances, for both laws.

use serde::Serialize;
use upright::table::Law;

use super::continuous_loop::ContinuousRun;
use super::firmware_loop::{FirmwareRun, trajectories};
use super::rigs::chain;
use super::trajectory::{StepFigures, Trajectory};
use super::{ReproduceError, SEED, published};
use upright_design::design::{Certified, Feedback, design};
use upright_design::parallel;
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, Sensing};
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

/// A law in a kind of loop, and what happens in the run.
pub(crate) type LoopRun = (Law, Loop, ContinuousRun);

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
    pub(crate) fn with(rig: &Rig, certified: Certified) -> Result<Self, ReproduceError> {
        if certified.double.continuous.each().into_array().contains(&None) {
            return Err(ReproduceError::OneLaw(rig.name.clone()));
        }
        let table = TableValues::of(rig, &certified, Gains::Sampled)?.without_governor();
        Ok(Self { rig: rig.clone(), certified, table })
    }

    /// Continuous gains of `law`.
    pub(crate) fn continuous(&self, law: Law) -> Result<&Feedback<f64>, ReproduceError> {
        let laws = &self.certified.double.continuous;
        laws.each()[law].ok_or_else(|| ReproduceError::OneLaw(self.rig.name.clone()))
    }

    /// Simulates each law in its kind of loop, from rest. Sampled loops are recorded at the tick, whatever the run
    /// says.
    pub(crate) fn trajectories(&self, wanted: &[LoopRun]) -> Result<Vec<Trajectory>, ReproduceError> {
        // The runs of the firmware advance together, the others by themselves.
        let (alone, together): (Vec<usize>, Vec<usize>) =
            (0..wanted.len()).partition(|&index| wanted[index].1 == Loop::Continuous);
        let groups: Vec<&[usize]> = [together.as_slice()].into_iter().chain(alone.chunks(1)).collect();
        let trajectories = parallel::try_map(groups.iter().copied(), |group| {
            let of_group: Vec<LoopRun> = group.iter().map(|&index| wanted[index]).collect();
            match of_group[..] {
                [(law, Loop::Continuous, run)] => {
                    Ok(vec![run.trajectory(chain(&self.rig)?, self.continuous(law)?)?])
                }
                _ => trajectories(&of_group.iter().map(|one| self.firmware_run(one)).collect::<Vec<_>>()),
            }
        })?;
        let mut numbered: Vec<(usize, Trajectory)> =
            groups.concat().into_iter().zip(trajectories.into_iter().flatten()).collect();
        numbered.sort_by_key(|(index, _)| *index);
        Ok(numbered.into_iter().map(|(_, trajectory)| trajectory).collect())
    }

    fn firmware_run(&self, &(law, kind, run): &LoopRun) -> FirmwareRun {
        let noise = |variance: f64| run.disturbances.map_or(0.0, |_| variance.sqrt());
        let scenario = Scenario {
            sensing: if kind == Loop::Encoders { Sensing::Encoders } else { Sensing::FullState },
            step_m: run.step_m,
            duration_s: run.duration_s,
            force_noise_n: noise(published::FORCE_VARIANCE_N2),
            torque_noise_n_m: noise(published::TORQUE_VARIANCE_N2_M2),
            seed: run.disturbances.unwrap_or(SEED),
            ..Scenario::at_rest(&self.rig, law)
        };
        FirmwareRun { rig: self.rig.clone(), table: self.table.clone(), scenario }
    }
}

/// One response.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepResponse {
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
    pub trajectory: Trajectory,
}

/// All responses, in the order of the paper's figures.
///
/// # Errors
/// [`ReproduceError`] if a run cannot be made.
pub fn responses(loops: &Loops) -> Result<Vec<StepResponse>, ReproduceError> {
    let mut wanted = Vec::new();
    for disturbances in [None, Some(SEED)] {
        let run = ContinuousRun { disturbances, ..ContinuousRun::STEP };
        wanted.extend(Law::ALL.into_iter().flat_map(|law| Loop::ALL.map(|kind| (law, kind, run))));
    }
    let trajectories = loops.trajectories(&wanted)?;
    let responses =
        trajectories.into_iter().zip(wanted).enumerate().map(|(index, (trajectory, (law, kind, run)))| {
            // Figures 5 and 7 are of the first law, 6 and 8 of the second one.
            let figure = 5 + (index / Loop::ALL.len()) as u8;
            StepResponse { figure, law, kind, figures: trajectory.step_figures(run.step_m), trajectory }
        });
    Ok(responses.collect())
}
