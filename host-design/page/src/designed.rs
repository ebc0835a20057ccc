//! A design, with what a page shows of it.

use serde::Deserialize;
use serde_json::{Value, json};
use upright::table::Law;
use upright_design::design::{Certified, Feedback, design};
use upright_design::rig::{PlantDescription, Rig};
use upright_design::simulate::{Scenario, Summary, Trace, simulate};
use upright_design::table::{Gains, NoTable, TableValues};
use upright_plan::{Stored, motions, with_motions};

use crate::refusal::PageRefusal;
use crate::survival::survival;
use crate::trust::ShortTrust;

/// Most points of a curve that a page draws.
const POINTS: usize = 600;
/// Duration of the run that a page shows (s).
const RUN_S: f64 = 8.0;

/// How the closed loop is disturbed in the run that a page shows.
#[derive(Debug, Deserialize)]
pub(crate) struct ShownRun {
    /// Lean of the first link at the start (rad), or offset of a model's output.
    lean_rad: f64,
    /// Step of the set-point at the start (m).
    step_m: f64,
}

/// A certified design and its table.
#[derive(Debug)]
pub(crate) struct DeskDesign {
    certified: Certified,
    table: Result<TableValues, NoTable>,
    trust: ShortTrust,
}

impl DeskDesign {
    /// Designs what `rig` asks for.
    pub(crate) fn design(rig: &Rig) -> Result<Self, PageRefusal> {
        let certified = design(rig)?;
        let table = TableValues::of(rig, &certified, Gains::Sampled);
        Ok(Self { certified, table, trust: ShortTrust::default() })
    }

    /// The same with a person's own gains in the table.
    pub(crate) fn with_own(mut self, rig: &Rig, own: Option<&[f64]>) -> Result<Self, PageRefusal> {
        if let (Some(k), Ok(table)) = (own, &self.table) {
            self.table = Ok(with_gains(rig, table, k)?);
        }
        Ok(self)
    }

    /// The gain table.
    pub(crate) fn table(&self) -> Result<&TableValues, PageRefusal> {
        Ok(self.table.as_ref().map_err(Clone::clone)?)
    }

    /// The gain table, with the motions `stored` if they were planned for the values of this rig.
    pub(crate) fn table_with(&self, rig: &Rig, stored: Option<&str>) -> Result<TableValues, PageRefusal> {
        let table = self.table()?.clone();
        let stored: Option<Stored> = stored.map(serde_json::from_str).transpose()?;
        match stored.filter(|stored| stored.is_of(rig)) {
            Some(stored) => Ok(with_motions(rig, table, &motions(rig, &stored)?, &[])?),
            None => Ok(table),
        }
    }

    /// The gains of all laws with their certificate, and a run of the firmware's controller with each.
    pub(crate) fn gains_and_run(&self, rig: &Rig, run: &ShownRun) -> Result<Value, PageRefusal> {
        let Certified { double, bits, .. } = &self.certified;
        let assessments = self.certified.assess(rig)?;
        let mut laws = Vec::new();
        for (law, assessment) in assessments.present() {
            let shown = match &self.table {
                Ok(table) => Some(shown(rig, table, law, run)?),
                Err(_) => None,
            };
            laws.push(json!({
                "law": law.option(),
                "title": law.title(),
                "continuous": double.continuous.in_table()[law].map(gains),
                "sampled": double.sampled.in_table()[law].map(gains),
                "radius": assessment.rounded,
                "rounding": assessment.largest_rounding,
                "run": shown,
            }));
        }
        Ok(json!({
            "rig": rig.name,
            "hash": format!("{:016x}", rig.hash()),
            "states": rig.states(),
            "tick_s": rig.tick.period_s,
            "bits": bits,
            "crc": self.table.as_ref().ok().map(|table| format!("{:08x}", table.crc())),
            "no_table": self.table.as_ref().err().map(ToString::to_string),
            "laws": laws,
        }))
    }

    /// Every tick of the run that is shown for the law with the name `law`, as `upright simulate --csv` writes it.
    pub(crate) fn csv(&self, rig: &Rig, law: &str, run: &ShownRun) -> Result<String, PageRefusal> {
        let table = self.table()?;
        let (trace, _) = ran(rig, table, named(table, law)?, run)?;
        let mut bytes = Vec::new();
        trace.write_csv(&mut bytes)?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }

    /// How much the loop of the law with this name stands.
    pub(crate) fn survival(&self, rig: &Rig, law: &str) -> Result<Value, PageRefusal> {
        let table = self.table()?;
        Ok(json!(survival(rig, table, named(table, law)?)?))
    }

    /// The gain of the first law on the angle of the first link, in continuous time (N/rad); none without a law.
    pub(crate) fn angle_gain(&self) -> Option<f64> {
        let laws = self.certified.double.continuous.in_table();
        laws.present().next().and_then(|(_, law)| law.k.entries().get(2).copied())
    }

    /// The rightmost pole of the first law's loop in continuous time (1/s); none without a law.
    pub(crate) fn rightmost_pole(&self, rig: &Rig) -> Result<Option<f64>, PageRefusal> {
        let poles = self.certified.poles(rig)?;
        let rightmost = |law: Law| {
            let [continuous, _] = poles.in_table(law);
            let real = continuous?.iter().map(|pole| pole[0]).fold(f64::NEG_INFINITY, f64::max);
            Some(real)
        };
        Ok(Law::ALL.into_iter().find_map(rightmost))
    }

    /// The trust report after the step of this number.
    pub(crate) fn verify(&mut self, rig: &Rig, step: usize) -> Result<Value, PageRefusal> {
        let table = self.table.as_ref().map_err(Clone::clone)?;
        self.trust.step(rig, &self.certified, table, step)
    }

    /// The poles of the loops of all laws, in continuous time and at the tick.
    pub(crate) fn poles(&self, rig: &Rig) -> Result<Value, PageRefusal> {
        let poles = self.certified.poles(rig)?;
        let of = |law: Law| {
            let [continuous, sampled] = poles.in_table(law);
            json!({ "law": law.option(), "continuous": continuous, "sampled": sampled })
        };
        Ok(json!({ "laws": Law::ALL.map(of) }))
    }
}

/// The table of `rig` with the gains K, one per state, in place of those of its laws, and a set-point that the cart
/// comes to. A gain on a force that is still to come stays.
pub(crate) fn with_gains(rig: &Rig, table: &TableValues, k: &[f64]) -> Result<TableValues, PageRefusal> {
    if k.len() != rig.states() {
        return Err(PageRefusal::Answer(rig.states()));
    }
    let mut table = table.clone();
    for law in Law::ALL {
        if let Some(gains) = &mut table.laws[law] {
            gains.k.iter_mut().zip(k).for_each(|(gain, &k)| *gain = k as f32);
            gains.n = gains.k[0];
        }
    }
    Ok(table)
}

/// The law of the table with this name.
fn named(table: &TableValues, law: &str) -> Result<Law, PageRefusal> {
    let mut laws = table.laws.present().map(|(law, _)| law);
    laws.find(|present| present.option() == law).ok_or(PageRefusal::Law)
}

fn gains(law: &Feedback<f64>) -> Value {
    json!({ "k": law.k.entries(), "n": law.n })
}

/// A run of the firmware's controller against the nonlinear rig.
fn ran(rig: &Rig, table: &TableValues, law: Law, run: &ShownRun) -> Result<(Trace, Summary), PageRefusal> {
    let mut scenario = Scenario { duration_s: RUN_S, step_m: run.step_m, ..Scenario::at_rest(rig, law) };
    match &rig.plant {
        PlantDescription::Chain(_) => scenario.start[2] = run.lean_rad,
        PlantDescription::Model(model) => scenario.start[model.output] = run.lean_rad,
    }
    Ok(simulate(rig, table, &scenario)?)
}

/// The same, with the points that a page draws.
fn shown(rig: &Rig, table: &TableValues, law: Law, run: &ShownRun) -> Result<Value, PageRefusal> {
    let (trace, summary) = ran(rig, table, law, run)?;
    let samples = trace.samples();
    let every = samples.len().div_ceil(POINTS).max(1);
    let rows: Vec<Value> = samples
        .step_by(every)
        .map(|sample| json!([sample.t, sample.setpoint, sample.force, sample.state]))
        .collect();
    Ok(json!({ "summary": summary.to_string(), "fell": summary.fall.is_some(), "rows": rows }))
}
