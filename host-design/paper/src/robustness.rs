//! What the paper says about the two laws without numbers, measured: that the response under LQR "has less frequency"
//! and that it is "more robust".

use serde::Serialize;
use upright::table::Law;

use super::continuous_loop::ContinuousRun;
use super::designs::open_loop_poles;
use super::responses::{Loop, LoopRun, Loops};
use super::trajectory::Trajectory;
use super::{ReproduceError, SEED};
use upright_design::numerics::{Bandwidth, SEGMENT, Spectrum};
use upright_design::parallel;
use upright_design::plant::reference::Tolerance;
use upright_design::rig::Rig;
use upright_design::table::{Gains, TableValues};
use upright_trust::verify::{LinearReport, Margins, continuous_margins, linear};

/// Time at the start of each run that is left out (s): the initial state no longer matters after it.
const FORGOTTEN_S: f64 = 10.0;

/// 30 segments that overlap by half, after the part left out.
const RUN: ContinuousRun = ContinuousRun {
    step_m: 0.0,
    duration_s: FORGOTTEN_S + 15.5 * SEGMENT as f64 * 1e-3,
    sample_s: 1e-3,
    disturbances: Some(SEED),
    tolerance: Tolerance { relative: 1e-8, absolute: 1e-10 },
};

/// One law in one loop.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Robustness {
    /// The law.
    pub law: Law,
    /// Which loop.
    pub kind: Loop,
    /// Margins of the linear loop, broken at the force.
    pub margins: Option<Margins>,
    /// Cart, joints and force at rest under the paper's disturbances, the same for every law and loop.
    pub ripples: Vec<Ripple>,
    /// Largest force in this run (N).
    pub peak_force_n: f64,
    /// Mean squared force (N²): control energy per second.
    pub effort_n2: f64,
}

/// One signal of a run at rest under disturbances.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Ripple {
    /// `x`, `theta1` … or `u`.
    pub signal: String,
    /// Root mean square (m, rad or N).
    pub rms: f64,
    /// Its bandwidth.
    pub bandwidth: Bandwidth,
    /// Its spectrum.
    #[serde(skip)]
    pub spectrum: Spectrum,
}

/// Measures both laws in every loop.
///
/// # Errors
/// [`ReproduceError`] if a run or the margins fail.
pub fn robustness(loops: &Loops) -> Result<Vec<Robustness>, ReproduceError> {
    let open = open_loop_poles(&loops.rig)?;
    let full_state = {
        let rig = Rig { kalman: None, ..loops.rig.clone() };
        let certified = upright_design::design::design(&rig)?;
        linear(&rig, &certified, &TableValues::of(&rig, &certified, Gains::Sampled)?)?
    };
    let encoders = linear(&loops.rig, &loops.certified, &loops.table)?;
    let of_law = |reports: &[LinearReport], law: Law| {
        reports.iter().find(|report| report.law == law).and_then(|report| report.margins.clone())
    };
    let poles = loops.certified.poles(&loops.rig)?;
    let margins = |law: Law, kind: Loop| match kind {
        Loop::Continuous => poles.continuous[law].as_ref().map(|closed| continuous_margins(&open, closed)),
        Loop::FullState => of_law(&full_state, law),
        Loop::Encoders => of_law(&encoders, law),
    };
    let wanted: Vec<LoopRun> =
        Law::ALL.into_iter().flat_map(|law| Loop::ALL.map(|kind| (law, kind, RUN))).collect();
    let trajectories = loops.trajectories(&wanted)?;
    parallel::try_map(wanted.iter().zip(&trajectories), |(&(law, kind, _), trajectory)| {
        let forces = &trajectory.forces_n[after(trajectory)..];
        Ok(Robustness {
            law,
            kind,
            margins: margins(law, kind),
            ripples: ripples(trajectory),
            peak_force_n: forces.iter().map(|force| force.abs()).fold(0.0, f64::max),
            effort_n2: forces.iter().map(|force| force * force).sum::<f64>() / forces.len() as f64,
        })
    })
}

/// Index of the first sample that counts.
fn after(trajectory: &Trajectory) -> usize {
    ((FORGOTTEN_S / trajectory.sample_s).round() as usize).min(trajectory.forces_n.len())
}

fn ripples(trajectory: &Trajectory) -> Vec<Ripple> {
    let joints = trajectory.states.first().map_or(0, |state| state.len() / 2 - 1);
    let angles = (1..=joints).map(|joint| (format!("theta{joint}"), trajectory.state(2 * joint)));
    let signals = [("x".to_owned(), trajectory.state(0))].into_iter().chain(angles);
    let force = ("u".to_owned(), trajectory.forces_n.clone());
    let ripple = |(signal, values): (String, Vec<f64>)| {
        let values = &values[after(trajectory)..];
        let spectrum = Spectrum::welch(values, trajectory.sample_s)?;
        let rms = (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt();
        Some(Ripple { signal, rms, bandwidth: spectrum.bandwidth(), spectrum })
    };
    signals.chain([force]).filter_map(ripple).collect()
}
