//! The paper's Table 2: for which settling times asked of the pole placement the response is stabilised.
//!
//! The paper says neither how long its runs are nor what counts as stabilised. Here it means: no link is beyond the
//! horizontal and the cart is within 2 % of the set-point when the run ends. Everything about the horizon is a fit.

use serde::Serialize;
use upright::table::Law;

use super::continuous_loop::ContinuousRun;
use super::firmware_loop::{FirmwareRun, trajectories};
use super::rigs::chain;
use super::trajectory::Trajectory;
use super::{PaperRigs, ReproduceError, SEED, published};
use upright_design::design::{Certified, DesignError, Feedback, design};
use upright_design::parallel;
use upright_design::plant::reference::Tolerance;
use upright_design::rig::{Actuator, ForceDrive, PolePlacement, Rig, Tick};
use upright_design::simulate::{Fall, Scenario, Sensing};
use upright_design::table::{Gains, TableValues};

/// Table 2, what decides it, and what does not.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Settling {
    /// One per settling time, with the far poles at -40 … -47.
    pub rows: Vec<SettlingRow>,
    /// Horizons (s) and our verdicts there.
    pub by_horizon: Vec<(f64, [bool; 7])>,
    /// First and last horizon (s), in steps of 10 ms, with all seven verdicts of the paper; no other horizon has them.
    pub horizons_s: Option<[f64; 2]>,
    /// What else was tried.
    pub sensitivity: Vec<Sensitivity>,
}

/// One row of Table 2.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SettlingRow {
    /// Settling time asked for (s).
    pub settling_time_s: f64,
    /// The paper's verdict.
    pub printed: bool,
    /// How it falls, if it does within [`LONGEST_S`].
    pub fall: Option<Fall>,
    /// Time after which it stays within 2 % (s).
    pub settled_after_s: Option<f64>,
    /// Largest angle of any joint (°); of a run that falls, up to then.
    pub peak_angle_deg: f64,
    /// Largest force (N).
    pub peak_force_n: f64,
    /// Time history of the run.
    #[serde(skip)]
    pub trajectory: Trajectory,
}

/// One change of the runs and what it does to the verdicts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sensitivity {
    /// What is different.
    pub changed: &'static str,
    /// Verdicts at [`HORIZON_S`].
    pub at_horizon: [bool; 7],
    /// Verdicts at [`LONGEST_S`]. `false`: it falls or never settles.
    pub in_the_end: [bool; 7],
    /// Which of the runs fall.
    pub falls: [bool; 7],
    /// Horizons with all seven verdicts of the paper (s), as in [`Settling::horizons_s`].
    pub horizons_s: Option<[f64; 2]>,
}

/// Duration of the runs (s).
pub const LONGEST_S: f64 = 20.0;
/// A horizon within those that give the paper's verdicts (s).
pub const HORIZON_S: f64 = 6.5;
/// Resolution of the horizon (s).
const STEP_S: f64 = 0.01;

const RUN: ContinuousRun = ContinuousRun { duration_s: LONGEST_S, sample_s: STEP_S, ..ContinuousRun::STEP };

/// The paper's verdicts.
pub fn printed() -> [bool; 7] {
    published::TABLE_2.map(|(_, verdict)| verdict)
}

/// Runs Table 2 and all variations that were tried.
///
/// # Errors
/// [`ReproduceError`] if a design or a run fails.
pub fn settling(rigs: &PaperRigs) -> Result<Settling, ReproduceError> {
    let changes = Change::all();
    let exact = ExactDesigns::of(&rigs.exact, &changes)?;
    let times_s = published::TABLE_2.map(|row| row.0);
    let jobs: Vec<(usize, &[f64])> = changes
        .iter()
        .enumerate()
        .flat_map(|(index, (_, change))| {
            times_s.chunks(change.together()).map(move |times_s| (index, times_s))
        })
        .collect();
    let trajectories: Vec<Trajectory> =
        parallel::try_map(jobs, |(change, times_s)| changes[change].1.trajectories(rigs, times_s, &exact))?
            .into_iter()
            .flatten()
            .collect();
    let mut groups = trajectories.chunks_exact(published::TABLE_2.len()).zip(&changes);
    let sensitivity = groups
        .clone()
        .skip(1)
        .map(|(trajectories, (changed, change))| Sensitivity {
            changed,
            at_horizon: verdicts(trajectories, change.step_m(), HORIZON_S),
            in_the_end: verdicts(trajectories, change.step_m(), LONGEST_S),
            falls: core::array::from_fn(|i| trajectories[i].fall.is_some()),
            horizons_s: agreeing(trajectories, change.step_m()),
        })
        .collect();
    let as_stated = groups.next().map_or(&[][..], |(trajectories, _)| trajectories);
    let rows = published::TABLE_2.iter().zip(as_stated).map(|(&(settling_time_s, printed), trajectory)| {
        let figures = trajectory.step_figures(RUN.step_m);
        SettlingRow {
            settling_time_s,
            printed,
            fall: figures.fall,
            settled_after_s: figures.settling_time_s,
            peak_angle_deg: figures.peak_angles_deg.iter().copied().fold(0.0, f64::max),
            peak_force_n: figures.peak_force_n,
            trajectory: trajectory.clone(),
        }
    });
    let horizons = [4.0, 5.0, 5.5, 6.0, HORIZON_S, 7.0, 7.5, 8.0, 10.0, LONGEST_S];
    Ok(Settling {
        rows: rows.collect(),
        by_horizon: horizons.map(|horizon| (horizon, verdicts(as_stated, RUN.step_m, horizon))).to_vec(),
        horizons_s: agreeing(as_stated, RUN.step_m),
        sensitivity,
    })
}

fn verdicts(trajectories: &[Trajectory], step_m: f64, horizon_s: f64) -> [bool; 7] {
    core::array::from_fn(|i| {
        trajectories.get(i).is_some_and(|trajectory| trajectory.stabilised(step_m, horizon_s))
    })
}

/// First and last horizon (s) with the paper's verdicts, if there are any and all between them have these verdicts,
/// too.
fn agreeing(trajectories: &[Trajectory], step_m: f64) -> Option<[f64; 2]> {
    let steps = (LONGEST_S / STEP_S).round() as usize;
    let agrees = |step: &usize| verdicts(trajectories, step_m, *step as f64 * STEP_S) == printed();
    let first = (0..=steps).find(agrees)?;
    let last = (first..=steps).rev().find(agrees)?;
    (first..=last).all(|step| agrees(&step)).then_some([first as f64 * STEP_S, last as f64 * STEP_S])
}

/// The designs of the exact model for every settling time and tick, each made once: several changes share them.
struct ExactDesigns(Vec<(Tick, f64, Certified)>);

impl ExactDesigns {
    fn of(exact: &Rig, changes: &[(&'static str, Change)]) -> Result<Self, ReproduceError> {
        let mut ticks = vec![&exact.tick];
        for (_, change) in changes {
            if let Change::Firmware { tick, .. } = change
                && !ticks.contains(&tick)
            {
                ticks.push(tick);
            }
        }
        let asked: Vec<(&Tick, f64)> = ticks
            .iter()
            .flat_map(|&tick| published::TABLE_2.map(|(settling_time_s, _)| (tick, settling_time_s)))
            .collect();
        let designed = parallel::try_map(asked, |(tick, settling_time_s)| {
            let rig = Rig { tick: tick.clone(), ..asking_for(exact, settling_time_s) };
            Ok::<_, DesignError>((tick.clone(), settling_time_s, design(&rig)?))
        })?;
        Ok(Self(designed))
    }

    /// The design of `rig`, the exact model at any tick for this settling time.
    fn at(&self, rig: &Rig, settling_time_s: f64) -> Result<Certified, DesignError> {
        let found = self.0.iter().find(|(tick, time, _)| (tick, *time) == (&rig.tick, settling_time_s));
        found.map_or_else(|| design(rig), |(.., found)| Ok(found.clone()))
    }
}

/// What is changed.
enum Change {
    /// Gains and run of the continuous loop.
    Continuous { gains: GainsFrom, run: ContinuousRun },
    /// The firmware's controller, the whole state known.
    Firmware { tick: Tick, gains: Gains, force_limit_n: Option<f64> },
}

/// Where the gains come from.
enum GainsFrom {
    /// The exact model, far poles from -40 to -47.
    Exact,
    /// As printed: two decimals of K, four of N.
    Rounded,
    /// The printed matrices.
    PrintedMatrices,
    /// The exact model, each far pole times `6 / ts`.
    FarPolesMoved,
    /// The exact model, all far poles ten times as far left as the dominant pair.
    TenTimesDominant,
}

impl Change {
    /// The stated criterion first, then everything that was tried.
    fn all() -> Vec<(&'static str, Self)> {
        let gains = |gains| Change::Continuous { gains, run: RUN };
        let run = |run| Change::Continuous { gains: GainsFrom::Exact, run };
        let tick = |period_s, delay_ticks| Tick { period_s, delay_ticks };
        let held = |tick, gains, force_limit_n| Change::Firmware { tick, gains, force_limit_n };
        let loose = Tolerance { relative: 1e-3, absolute: 1e-6 };
        vec![
            ("nothing", gains(GainsFrom::Exact)),
            ("gains rounded as printed", gains(GainsFrom::Rounded)),
            ("gains from the printed A and B", gains(GainsFrom::PrintedMatrices)),
            ("far poles moved with ts (times 6/ts)", gains(GainsFrom::FarPolesMoved)),
            ("far poles ten times the dominant real part", gains(GainsFrom::TenTimesDominant)),
            ("solver tolerance 1e-3", run(ContinuousRun { tolerance: loose, ..RUN })),
            (
                "the paper's disturbances",
                run(ContinuousRun { disturbances: Some(SEED), sample_s: 1e-3, ..RUN }),
            ),
            ("step of 0.5 m", run(ContinuousRun { step_m: 0.5, ..RUN })),
            ("step of 2 m", run(ContinuousRun { step_m: 2.0, ..RUN })),
            ("held for a tick of 1 ms", held(tick(0.001, 0), Gains::Continuous, None)),
            ("1 ms, a tick late", held(tick(0.001, 1), Gains::Continuous, None)),
            ("gains for a tick of 5 ms", held(tick(0.005, 0), Gains::Sampled, None)),
            ("1 ms, force limited to 20 N", held(tick(0.001, 0), Gains::Continuous, Some(20.0))),
            ("1 ms, force limited to 10 N", held(tick(0.001, 0), Gains::Continuous, Some(10.0))),
        ]
    }

    fn step_m(&self) -> f64 {
        match self {
            Change::Continuous { run, .. } => run.step_m,
            Change::Firmware { .. } => RUN.step_m,
        }
    }

    /// How many runs are made together.
    fn together(&self) -> usize {
        match self {
            Change::Continuous { .. } => 1,
            Change::Firmware { .. } => published::TABLE_2.len(),
        }
    }

    /// The runs for these settling times.
    fn trajectories(
        &self,
        rigs: &PaperRigs,
        settling_times_s: &[f64],
        exact: &ExactDesigns,
    ) -> Result<Vec<Trajectory>, ReproduceError> {
        let times_s = settling_times_s.iter();
        match self {
            Change::Continuous { gains, run } => times_s
                .map(|&time_s| run.trajectory(chain(&rigs.exact)?, &gains.law(rigs, time_s, exact)?))
                .collect(),
            Change::Firmware { tick, gains, force_limit_n } => {
                let run = |&time_s| {
                    let mut rig = Rig { tick: tick.clone(), ..asking_for(&rigs.exact, time_s) };
                    let force = ForceDrive { limit_n: *force_limit_n, lag_s: None };
                    rig.actuator = Actuator::Force(force);
                    if let Some(chain) = rig.chain_mut() {
                        chain.cart.travel_m = [-1e3, 1e3]; // the paper has no rail
                    }
                    let table = TableValues::of(&rig, &exact.at(&rig, time_s)?, *gains)?.without_governor();
                    let scenario = Scenario {
                        sensing: Sensing::FullState,
                        step_m: RUN.step_m,
                        duration_s: RUN.duration_s,
                        ..Scenario::at_rest(&rig, Law::PolePlacement)
                    };
                    Ok::<_, ReproduceError>(FirmwareRun { rig, table, scenario })
                };
                trajectories(&times_s.map(run).collect::<Result<Vec<_>, _>>()?)
            }
        }
    }
}

/// `rig` with nothing but a pole placement for this settling time.
fn asking_for(rig: &Rig, wanted_s: f64) -> Rig {
    let mut rig = Rig { lqr: None, kalman: None, ..rig.clone() };
    if let Some(PolePlacement::Response { settling_time_s, .. }) = &mut rig.pole_placement {
        *settling_time_s = wanted_s;
    }
    rig
}

impl GainsFrom {
    /// The gains for this settling time.
    fn law(
        &self,
        rigs: &PaperRigs,
        settling_time_s: f64,
        exact: &ExactDesigns,
    ) -> Result<Feedback<f64>, ReproduceError> {
        let of_file = || {
            let rig = asking_for(&rigs.exact, settling_time_s);
            placed(&rig, exact.at(&rig, settling_time_s)?)
        };
        let moved = |to: &dyn Fn(f64) -> f64| {
            let mut rig = asking_for(&rigs.exact, settling_time_s);
            if let Some(PolePlacement::Response { far_poles, .. }) = &mut rig.pole_placement {
                for pole in far_poles {
                    *pole = to(*pole);
                }
            }
            placement(&rig)
        };
        match self {
            GainsFrom::Exact => of_file(),
            GainsFrom::Rounded => of_file().map(|exact| Feedback {
                k: exact.k.map(|gain| (gain * 1e2).round() / 1e2),
                n: exact.n.map(|n| (n * 1e4).round() / 1e4),
                integral: false,
            }),
            GainsFrom::PrintedMatrices => placement(&asking_for(&rigs.printed, settling_time_s)),
            GainsFrom::FarPolesMoved => moved(&|pole| pole * published::SETTLING_TIME_S / settling_time_s),
            GainsFrom::TenTimesDominant => moved(&|_| -40.0 / settling_time_s),
        }
    }
}

/// Continuous gains of the pole placement that `rig` asks for.
fn placement(rig: &Rig) -> Result<Feedback<f64>, ReproduceError> {
    placed(rig, design(rig)?)
}

/// Continuous gains of the pole placement in this design of `rig`.
fn placed(rig: &Rig, designed: Certified) -> Result<Feedback<f64>, ReproduceError> {
    let law = designed.double.continuous.pole_placement;
    law.ok_or_else(|| ReproduceError::OneLaw(rig.name.clone()))
}
