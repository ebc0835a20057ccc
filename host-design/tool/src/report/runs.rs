//! The simulated runs of a report.

use upright::table::Law;

use super::number::number;
use upright_design::design::DesignPoles;
use upright_design::number::rounded;
use upright_design::rig::{CartInput, PlantDescription, Rig};
use upright_design::simulate::{Disturbance, Scenario, Sensing, SimulationError, Summary, Trace, simulate};
use upright_design::table::TableValues;
use upright_plan::Demonstration;
use upright_trust::verify::TrustReport;

/// The same scenario with each law of the table.
pub(super) struct Scene {
    /// For links and file names.
    pub(super) id: &'static str,
    pub(super) name: &'static str,
    /// What happens in it.
    pub(super) text: String,
    pub(super) runs: Vec<LawRun>,
}

pub(super) struct LawRun {
    pub(super) law: Law,
    pub(super) trace: Trace,
    pub(super) summary: Summary,
}

/// The laws of a table.
pub(super) fn laws(table: &TableValues) -> Vec<Law> {
    table.laws.present().map(|(law, _)| law).collect()
}

/// Longest run (ticks).
const MOST_TICKS: f64 = 200_000.0;

/// Runs every scene: a step, a tilt and disturbances with the whole state measured, and a step with disturbances from
/// encoders alone.
pub(super) fn scenes(
    rig: &Rig,
    poles: &DesignPoles,
    table: &TableValues,
    trust: &TrustReport,
    seed: u64,
) -> Result<Vec<Scene>, SimulationError> {
    let base = Scenario {
        sensing: if rig.actuator.held().is_motion() { Sensing::Encoders } else { Sensing::FullState },
        duration_s: duration(rig, poles),
        seed,
        substeps: 4,
        ..Scenario::at_rest(rig, Law::Lqr)
    };
    let can_step = laws(table).iter().all(|law| gain(table, *law) != 0.0);
    let stepped = can_step.then(|| Scenario { step_m: step(rig), ..base.clone() });
    let mut plans = Vec::new();
    plans.extend(stepped.clone().map(|stepped| step_plan(rig, stepped)));
    plans.push(tilt_plan(rig, trust, base.clone()));
    if Disturbance::of(rig) != Disturbance::NONE {
        plans.push(disturbed_plan(rig, &base));
    }
    if table.observer.is_some() {
        plans.push(encoder_plan(rig, &stepped.unwrap_or(base)));
    }
    plans.into_iter().map(|plan| plan.run(rig, table)).collect()
}

/// The run that raises the rig, balances it and lowers it again.
pub(super) fn swing_up(rig: &Rig, run: &Demonstration, seed: u64) -> Scene {
    let does = "The rig raises itself from hanging, and lowers itself again";
    demonstrated(rig, run, ["swing-up", "Swing-up", does], seed)
}

/// The run from equilibrium to equilibrium.
pub(super) fn route(rig: &Rig, run: &Demonstration, seed: u64) -> Scene {
    let does = "The rig goes from equilibrium to equilibrium, each link up (u) or down (d), by all of its stored motions. \
                Where all links hang, the motor is off, and a hand puts the rig back into the middle";
    demonstrated(rig, run, ["route", "From equilibrium to equilibrium", does], seed)
}

/// A run of the whole firmware as a scene with this id and name; `does` says what the rig does.
fn demonstrated(rig: &Rig, run: &Demonstration, [id, name, does]: [&'static str; 3], seed: u64) -> Scene {
    let part = |(at_s, part): &(f64, String)| format!("{part} from {} s", number(rounded(*at_s, 3)));
    let parts: Vec<String> = run.parts.iter().map(part).collect();
    let text = format!(
        "{does}: {}. The controller measures encoder counts only; start off by up to 1° and 1 mm, encoders off by up to \
         0.1°, the rig's noise (seed {seed}).",
        parts.join(", ")
    );
    let scenario = Scenario::at_rest(rig, Law::Lqr);
    let summary = Summary::of(rig, &scenario, &run.trace, None);
    Scene { id, name, text, runs: vec![LawRun { law: Law::Lqr, trace: run.trace.clone(), summary }] }
}

/// A scene before it has run.
struct ScenePlan {
    id: &'static str,
    name: &'static str,
    text: String,
    scenario: Scenario,
}

impl ScenePlan {
    fn run(self, rig: &Rig, table: &TableValues) -> Result<Scene, SimulationError> {
        let run = |law| {
            let (trace, summary) = simulate(rig, table, &Scenario { law, ..self.scenario.clone() })?;
            Ok(LawRun { law, trace, summary })
        };
        let runs = laws(table).into_iter().map(run).collect::<Result<_, SimulationError>>()?;
        Ok(Scene { id: self.id, name: self.name, text: self.text, runs })
    }
}

fn is_chain(rig: &Rig) -> bool {
    rig.chain().is_some()
}

/// How a description ends where the plant is a linear model.
fn of_model(rig: &Rig) -> &'static str {
    if is_chain(rig) { "" } else { ", on the linear model" }
}

/// What the controller measures in the runs that are not as on the bench. A drive with pulses knows only those of the
/// cart.
fn measured(rig: &Rig) -> &'static str {
    match rig.actuator.input() {
        CartInput::Force => "the whole state is measured",
        CartInput::Acceleration => "only the angles of the links are measured",
    }
}

fn step_plan(rig: &Rig, scenario: Scenario) -> ScenePlan {
    let text = format!(
        "Set-point moved by {} at 0 s{}; {}{}.",
        rig.output_quantity().of(&number(scenario.step_m)),
        if is_chain(rig) { ", made into a ramp by the governor" } else { "" },
        measured(rig),
        of_model(rig)
    );
    ScenePlan { id: "step", name: "Step", text, scenario }
}

fn tilt_plan(rig: &Rig, trust: &TrustReport, mut scenario: Scenario) -> ScenePlan {
    if !is_chain(rig) {
        scenario.start[rig.output()] = 0.05;
        let (state, model) = (rig.output(), of_model(rig));
        let text =
            format!("State {state} starts at 0.05, all others at 0; the whole state is measured{model}.");
        return ScenePlan { id: "tilt", name: "Offset", text, scenario };
    }
    let angle = tilt(trust);
    // Angles are relative: with the opposite one at the second joint all other links are vertical.
    scenario.start[2] = angle;
    if let Some(second) = scenario.start.get_mut(4) {
        *second = -angle;
    }
    let text = format!(
        "Link 1 starts at {} rad ({}°) from the vertical, half of what the weaker law recovers from, all others vertical; \
         {}.",
        number(angle),
        number(angle.to_degrees()),
        measured(rig)
    );
    ScenePlan { id: "tilt", name: "Tilt", text, scenario }
}

fn disturbed_plan(rig: &Rig, scenario: &Scenario) -> ScenePlan {
    let (noise, model) = (noise_text(rig, scenario.seed), of_model(rig));
    let text = format!("At rest, disturbed by {noise}; {}{model}.", measured(rig));
    ScenePlan { id: "disturbances", name: "Disturbances", text, scenario: disturbed(rig, scenario) }
}

fn encoder_plan(rig: &Rig, scenario: &Scenario) -> ScenePlan {
    let (step, noise) = (rig.output_quantity().of(&number(scenario.step_m)), noise_text(rig, scenario.seed));
    let text = format!(
        "As on the bench: the controller measures encoder counts only and estimates the state. Set-point moved by {step}; \
         {noise}."
    );
    let scenario = Scenario { sensing: Sensing::Encoders, ..disturbed(rig, scenario) };
    ScenePlan { id: "encoders", name: "Encoders only", text, scenario }
}

fn disturbed(rig: &Rig, scenario: &Scenario) -> Scenario {
    let disturbance = Disturbance::of(rig);
    Scenario {
        force_noise_n: disturbance.force_n,
        torque_noise_n_m: disturbance.torque_n_m,
        ..scenario.clone()
    }
}

fn noise_text(rig: &Rig, seed: u64) -> String {
    let disturbance = Disturbance::of(rig);
    // A drive that imposes the cart's acceleration does not feel a force.
    let force = if disturbance.force_n == 0.0 {
        String::new()
    } else {
        let (force, noun) = (rig.base().force(), rig.base().noun());
        format!("a {} of {} rms on the {noun} and ", force.name, force.of(&number(disturbance.force_n)))
    };
    let torque = number(disturbance.torque_n_m);
    format!("{force}torques of {torque} N·m rms at every joint, drawn again in each tick (seed {seed})")
}

/// Duration of a run (s): 10 s for links on a cart; ten times the slowest time constant for a model, whose time scale
/// may be any.
fn duration(rig: &Rig, poles: &DesignPoles) -> f64 {
    let slowest =
        Law::ALL.into_iter().filter_map(|law| poles.in_table(law)[0]).flatten().map(|pole| -pole[0]);
    let slowest = slowest.filter(|rate| *rate > 0.0).fold(f64::INFINITY, f64::min);
    let wanted = match &rig.plant {
        PlantDescription::Model(_) if slowest.is_finite() => 10.0 / slowest,
        _ => 10.0,
    };
    wanted.clamp(20.0 * rig.tick.period_s, MOST_TICKS * rig.tick.period_s)
}

/// Step of the set-point (m): half of the way to the nearer end of the rail; 1 for a model.
fn step(rig: &Rig) -> f64 {
    match &rig.plant {
        PlantDescription::Chain(chain) => {
            let [left, right] = chain.cart.travel_m;
            0.5 * right.min(-left)
        }
        PlantDescription::Model(_) => 1.0,
    }
}

fn tilt(trust: &TrustReport) -> f64 {
    let edges = trust.laws.iter().filter_map(|law| law.attraction.as_ref()?.tilts.first());
    let weakest = edges.map(|tilt| tilt.edge.size).filter(|size| *size > 0.0).fold(f64::INFINITY, f64::min);
    let half = if weakest.is_finite() { 0.5 * weakest } else { 0.002 };
    // Rounded, so that the run is easy to repeat from the command line.
    rounded(half, 2)
}

fn gain(table: &TableValues, law: Law) -> f32 {
    table.law(law).map_or(0.0, |values| values.n)
}
