//! The pushes by hand from which a law falls, and those from which the firmware turns the motor off.

use serde::Serialize;
use upright::table::Law;

use super::error::{VerifyError, chain};
use super::imperfections::first;
use super::trial::{Horizon, disturbed, trial};
use upright_design::parallel;
use upright_design::reality::StepMotor;
use upright_design::rig::{CartInput, Rig};
use upright_design::simulate::{Disturbance, FallKind, HandPush, Scenario, SimulationError};
use upright_design::table::TableValues;

/// Durations of the pushes in the trust report (s).
const DURATIONS_S: [f64; 2] = [0.05, 0.5];
/// A push begins at this time (s), and the run ends this long after it.
const FROM_S: f64 = 0.2;
const AFTER_S: f64 = 3.0;
/// Forces that are tried, as shares of the weight on the rail, and the share tried first, for a push of 50 ms.
const RANGE: [f64; 2] = [1e-6, 1e3];
const START: f64 = 0.1;

/// How hard a push a law survives: horizontal, along +x, at the cart or at the end of a link.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PushSurvival {
    /// What is pushed: 0: the cart, 1: the first link …
    pub body: usize,
    /// Duration of the push (s).
    pub duration_s: f64,
    /// Force from which the controller alone falls (N); none: it survives the largest one tried.
    pub falls_at_n: Option<f64>,
    /// Force from which the whole firmware turns the motor off (N), likewise.
    pub turned_off_at_n: Option<f64>,
    /// What ends the run of the whole firmware with that force.
    pub ended_by: Option<FallKind>,
}

/// A law on the rig, and what it is pushed with.
#[derive(Debug, Clone, Copy)]
pub struct PushSearch<'a> {
    /// The rig.
    pub rig: &'a Rig,
    /// Its gain table.
    pub table: &'a TableValues,
    /// The law in the loop.
    pub law: Law,
    /// The push whose force is searched for; it may begin at any time.
    pub push: HandPush,
    /// Seed of the disturbances, which are those that the rig file expects.
    pub seed: u64,
}

/// Searches for the forces at the cart and at the end of each link.
///
/// # Errors
/// [`VerifyError`] for a model, and if a run cannot be started.
pub fn pushes(rig: &Rig, table: &TableValues, law: Law) -> Result<Vec<PushSurvival>, VerifyError> {
    // A cart that goes where its pulses say does not feel a push.
    let is_unmoved = rig.actuator.input() == CartInput::Acceleration && StepMotor::of(rig).is_none();
    let bodies = usize::from(is_unmoved)..=chain(rig, "pushes")?.links.len();
    let all: Vec<(usize, f64)> =
        bodies.flat_map(|body| DURATIONS_S.map(|duration_s| (body, duration_s))).collect();
    let one = |(body, duration_s)| {
        let push = HandPush { body, along: 1.0, force_n: 1.0, from_s: FROM_S, duration_s };
        let search = PushSearch { rig, table, law, push, seed: 1 };
        let alone = search.first(false)?;
        let by_firmware = search.first(true)?;
        Ok::<_, VerifyError>(PushSurvival {
            body,
            duration_s,
            falls_at_n: alone.map(|(force_n, _)| force_n),
            turned_off_at_n: by_firmware.map(|(force_n, _)| force_n),
            ended_by: by_firmware.map(|(_, kind)| kind),
        })
    };
    parallel::try_map(&all, |&one_of| one(one_of))
}

impl PushSearch<'_> {
    /// Relative precision of a force.
    pub const RELATIVE: f64 = 0.1;

    /// The smallest force of this push's sign that ends the run (N, positive), to a tenth, and how: of the controller
    /// alone, or of the whole firmware (`is_supervised`). None if the largest one tried does not.
    ///
    /// # Errors
    /// [`VerifyError`] for a model, and if a run cannot be started.
    pub fn first(&self, is_supervised: bool) -> Result<Option<(f64, FallKind)>, VerifyError> {
        let chain = chain(self.rig, "pushes")?;
        // A force at the end of an arm moves its inertia by the square of the lever.
        let lever = chain.arc_m();
        let weight_n = chain.gravity_m_per_s2 * chain.total_mass_kg() / lever.powi(2);
        let start = START * (DURATIONS_S[0] / self.push.duration_s).min(1.0);
        let mut ended = None;
        let found =
            first(RANGE.map(|share| share * weight_n), start * weight_n, Self::RELATIVE, |force_n| {
                let end = self.end(force_n, is_supervised)?;
                // The smallest one so far is the last that is tried and ends a run.
                ended = end.or(ended);
                Ok::<_, SimulationError>(end.is_none())
            })?;
        Ok(found.zip(ended))
    }

    /// How a run with this force ends, if it does.
    fn end(&self, force_n: f64, is_supervised: bool) -> Result<Option<FallKind>, SimulationError> {
        let push = HandPush { force_n: force_n.copysign(self.push.force_n), ..self.push };
        let duration_s = push.from_s + push.duration_s + AFTER_S;
        let disturbance = Disturbance::of(self.rig);
        let scenario = Scenario {
            push: Some(push),
            is_supervised,
            ..disturbed(self.rig, self.law, duration_s, &disturbance, self.seed)
        };
        let outcome = trial(self.rig, self.table, &scenario, &Horizon::default())?;
        Ok(outcome.fall.map(|fall| fall.kind))
    }
}
