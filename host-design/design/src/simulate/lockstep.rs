//! Many runs in lockstep, with several plants in one SIMD vector.

use core::ops::ControlFlow;

use super::any_controller::with_controllers_of;
use super::bench::Bench;
use super::closed_loop::{ClosedLoopRun, alone};
use super::error::SimulationError;
use super::scenario::Scenario;
use super::summary::Fall;
use super::trace::Sample;
use crate::plant::{ChainLanes, LANES, chain_lanes};
use crate::rig::{Chain, Rig};
use crate::table::TableValues;

/// One of many runs.
pub struct Job<'a> {
    /// Table of the controller.
    pub table: &'a TableValues,
    /// Rig whose plant is simulated.
    pub rig: &'a Rig,
    /// Start, set-point, disturbances and sensors of the run.
    pub scenario: &'a Scenario,
    /// Called in every tick.
    pub observe: &'a mut dyn FnMut(&Sample<&[f64]>),
}

/// Runs all jobs, each with the same bits as [`run`](super::run), and returns how each ended.
///
/// [`LANES`] plants advance together; a run that ends makes room for the next one. The jobs run one after the other
/// if there is only one, if a rig's `[reality]` changes motion, driver or timing, if a rig has a motor or does not
/// have 3 to 5 links, or if the jobs differ in number of links, tick or integration steps.
///
/// # Errors
/// As for [`run`](super::run), if any of the jobs fails.
pub fn run_all(jobs: &mut [Job<'_>]) -> Result<Vec<Option<Fall>>, SimulationError> {
    let chains: Option<Vec<Chain>> = jobs.iter().map(|job| Bench::lockstep_chain(job.rig)).collect();
    let lanes = chains.as_ref().filter(|_| are_alike(jobs)).and_then(|chains| {
        let links = chains.first()?.links.len();
        chain_lanes(links).filter(|_| chains.len() > 1 && chains.iter().all(|one| one.links.len() == links))
    });
    let (mut lanes, chains) = (lanes, chains.unwrap_or_default());
    // Each table is checked once for all of its consecutive jobs.
    let same_table = jobs.chunk_by(|a, b| core::ptr::eq(a.table, b.table));
    let tables: Vec<(&TableValues, usize)> = same_table.map(|of| (of[0].table, of.len())).collect();
    with_controllers_of(&tables, Vec::new(), &mut |mut controllers| {
        let runs = jobs.iter().zip(&mut controllers);
        let runs: Vec<ClosedLoopRun<'_>> = runs
            .map(|(job, controller)| {
                ClosedLoopRun::start(job.rig, controller.as_mut(), job.table.sensors(), job.scenario)
            })
            .collect::<Result<_, _>>()?;
        match &mut lanes {
            Some(lanes) => Lockstep { lanes: lanes.as_mut(), chains: &chains, runs, jobs, next: 0 }.run(),
            None => runs.into_iter().zip(jobs.iter_mut()).map(|(run, job)| alone(run, job.observe)).collect(),
        }
    })
}

/// Whether all jobs have the same tick and integration steps.
fn are_alike(jobs: &[Job<'_>]) -> bool {
    let steps = |job: &Job<'_>| (job.rig.tick.period_s, job.scenario.substeps);
    jobs.windows(2).all(|pair| steps(&pair[0]) == steps(&pair[1]))
}

struct Lockstep<'a, 'j> {
    lanes: &'a mut dyn ChainLanes,
    chains: &'a [Chain],
    runs: Vec<ClosedLoopRun<'a>>,
    jobs: &'a mut [Job<'j>],
    /// The first job that has not begun.
    next: usize,
}

impl Lockstep<'_, '_> {
    fn run(mut self) -> Result<Vec<Option<Fall>>, SimulationError> {
        let mut falls = vec![None; self.runs.len()];
        let mut of_lane: [Option<usize>; LANES] = [None; LANES];
        for (lane, job) in of_lane.iter_mut().enumerate() {
            *job = self.place_next(lane)?;
        }
        let (period_s, substeps) = (self.jobs[0].rig.tick.period_s, self.jobs[0].scenario.substeps);
        while of_lane.iter().any(Option::is_some) {
            let mut commands = [None; LANES];
            for (lane, job) in of_lane.iter().enumerate() {
                if let Some(job) = *job {
                    let command = self.runs[job].control()?;
                    let force = self.runs[job].bench.push_lane(command.drive, self.lanes, lane);
                    commands[lane] = Some((command, force));
                }
            }
            self.lanes.advance(period_s, substeps);
            for lane in 0..LANES {
                let (Some(job), Some((command, force))) = (of_lane[lane], commands[lane]) else { continue };
                let run = &mut self.runs[job];
                run.bench.read_lane(self.lanes, lane);
                if let ControlFlow::Break(fall) = run.finish(&command, force, self.jobs[job].observe) {
                    falls[job] = fall;
                    of_lane[lane] = self.place_next(lane)?;
                }
            }
        }
        Ok(falls)
    }

    /// Starts the next job in this lane, or clears the lane if there is none.
    fn place_next(&mut self, lane: usize) -> Result<Option<usize>, SimulationError> {
        let job = self.next;
        let Some(chain) = self.chains.get(job) else {
            self.lanes.clear(lane);
            return Ok(None);
        };
        self.lanes.place(lane, chain, self.runs[job].bench.state())?;
        self.next += 1;
        Ok(Some(job))
    }
}
