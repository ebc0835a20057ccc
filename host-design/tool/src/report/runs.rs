//! The simulated runs of a report.

use upright::table::Law;

use super::number::number;
use upright_design::design::Certified;
use upright_design::number::rounded;
use upright_design::rig::{PlantDescription, Rig};
use upright_design::simulate::{Scenario, Sensing, SimulationError, Summary, Trace, simulate};
use upright_design::table::TableValues;
use upright_design::verify::{Disturbance, TrustReport};

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
    let all = [(Law::Lqr, table.lqr.is_some()), (Law::PolePlacement, table.pole_placement.is_some())];
    all.into_iter().filter(|(_, there)| *there).map(|(law, _)| law).collect()
}

pub(super) fn law_name(law: Law) -> &'static str {
    match law {
        Law::Lqr => "LQR",
        Law::PolePlacement => "Pole placement",
    }
}

/// Longest run (ticks).
const MOST_TICKS: f64 = 200_000.0;

/// Runs everything: a step, a tilt, disturbances with the whole state measured, and all but the tilt from encoders alone.
pub(super) fn scenes(
    rig: &Rig,
    certified: &Certified,
    table: &TableValues,
    trust: &TrustReport,
    seed: u64,
) -> Result<Vec<Scene>, SimulationError> {
    let duration_s = duration(rig, certified);
    let base = Scenario {
        sensing: Sensing::FullState,
        duration_s,
        seed,
        substeps: 4,
        ..Scenario::at_rest(rig, Law::Lqr)
    };
    let step_m = step(rig);
    let steps = laws(table).iter().all(|law| gain(table, *law) != 0.0);
    let disturbance = Disturbance::of(rig);
    let is_chain = matches!(rig.plant, PlantDescription::Chain(_));
    let of_model = if is_chain { "" } else { ", on the linear model" };
    let mut scenes = Vec::new();
    let mut add = |id, name, text: String, scenario: &Scenario| -> Result<(), SimulationError> {
        let mut runs = Vec::new();
        for law in laws(table) {
            let (trace, summary) = simulate(rig, table, &Scenario { law, ..scenario.clone() })?;
            runs.push(LawRun { law, trace, summary });
        }
        scenes.push(Scene { id, name, text, runs });
        Ok(())
    };
    let unit = if is_chain { " m" } else { "" };
    let stepped = Scenario { step_m, ..base.clone() };
    if steps {
        let text = format!(
            "Set-point moved by {}{unit} at 0 s{}; the whole state is measured{of_model}.",
            number(step_m),
            if is_chain { ", made into a ramp by the governor" } else { "" }
        );
        add("step", "Step", text, &stepped)?;
    }
    let mut tilted = base.clone();
    let text = if is_chain {
        let angle = tilt(trust);
        // The other links stand upright: the second one bends back.
        tilted.start[2] = angle;
        if let Some(second) = tilted.start.get_mut(4) {
            *second = -angle;
        }
        format!(
            "Link 1 leans by {} rad ({}°) at the start, all others are vertical: half of what the weaker law recovers from; \
             the whole state is measured.",
            number(angle),
            number(angle.to_degrees())
        )
    } else {
        tilted.start[rig.output()] = 0.05;
        format!(
            "State {} is 0.05 at the start, all others 0; the whole state is measured{of_model}.",
            rig.output()
        )
    };
    add("tilt", if is_chain { "Tilt" } else { "Offset" }, text, &tilted)?;
    let noisy = |scenario: &Scenario| Scenario {
        force_noise_n: disturbance.force_n,
        torque_noise_n_m: disturbance.torque_n_m,
        ..scenario.clone()
    };
    let what = format!(
        "a force of {} N rms on the cart and torques of {} N·m rms at every joint, drawn anew each tick (seed {seed})",
        number(disturbance.force_n),
        number(disturbance.torque_n_m)
    );
    if disturbance != Disturbance::NONE {
        let text = format!("At rest, disturbed by {what}; the whole state is measured{of_model}.");
        add("disturbances", "Disturbances", text, &noisy(&base))?;
    }
    if table.observer.is_some() {
        let moved = if steps { stepped } else { base };
        let text = format!(
            "As on the bench: the controller sees encoder counts only and estimates the rest. Set-point moved by {}{unit}; {what}.",
            number(moved.step_m)
        );
        add("encoders", "Encoders only", text, &noisy(&Scenario { sensing: Sensing::Encoders, ..moved }))?;
    }
    Ok(scenes)
}

/// Ten seconds for links on a cart; ten of the slowest time constants for a model, whose clock may be any.
fn duration(rig: &Rig, certified: &Certified) -> f64 {
    let slowest = (0..2).filter_map(|law| certified.poles.in_table(law)[0]).flatten().map(|pole| -pole[0]);
    let slowest = slowest.filter(|rate| *rate > 0.0).fold(f64::INFINITY, f64::min);
    let wanted = match &rig.plant {
        PlantDescription::Model(_) if slowest.is_finite() => 10.0 / slowest,
        _ => 10.0,
    };
    wanted.clamp(20.0 * rig.tick.period_s, MOST_TICKS * rig.tick.period_s)
}

/// Half of the way to the nearer end of the rail; 1 for a model.
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
    // Two digits are enough to be repeated by hand.
    rounded(half, 2)
}

fn gain(table: &TableValues, law: Law) -> f32 {
    let values = match law {
        Law::Lqr => &table.lqr,
        Law::PolePlacement => &table.pole_placement,
    };
    values.as_ref().map_or(0.0, |values| values.n)
}
