//! What the page shows, filled into its template.

use askama::Template;
use upright::table::{Law, TABLE_FORMAT};

use super::animation::Animation;
use super::cost::LawCost;
use super::imperfections::SurvivalTable;
use super::number::{number, poles, significant};
use super::plot::Plot;
use super::runs::{LawRun, Scene, laws};
use super::trust::{CheckRow, TrustRow, check_rows, trust_rows};
use super::{ReportError, ReportSource};
use crate::figure::{COLOURS_CSS, style_sheet};
use crate::policy;
use upright_design::design::{DesignPoles, Feedback};
use upright_design::rig::{PlantDescription, Rig};
use upright_design::simulate::Disturbance;
use upright_trust::verify::Certificate;

/// Digits of A and B.
const DIGITS: usize = 6;

#[derive(Template)]
#[template(path = "page.html")]
pub(super) struct ReportPage<'a> {
    name: &'a str,
    hash: String,
    states: usize,
    tick_ms: String,
    delay_ticks: u8,
    is_chain: bool,
    carrier: &'static str,
    state_units: &'static str,
    is_disturbed: bool,
    /// Name, symbol and unit of the plant's input.
    input: String,
    failed: usize,
    checks: Vec<CheckRow>,
    description: String,
    pub(super) drawing: Option<String>,
    pub(super) scenes: Vec<SceneEntry>,
    state_names: Vec<String>,
    a: Vec<Vec<String>>,
    b: Vec<String>,
    pub(super) poles: Vec<Plot>,
    laws: Vec<LawEntry>,
    observer: Option<Vec<Vec<String>>>,
    sensor_names: Vec<String>,
    bits: [usize; 2],
    pub(super) bode: Vec<Plot>,
    pub(super) nyquist: Vec<Plot>,
    pub(super) regions: Vec<Plot>,
    pub(super) pushes: Vec<Plot>,
    survivals: Vec<SurvivalTable>,
    pub(super) imperfect: Vec<Plot>,
    trust: Vec<TrustRow>,
    seed: u64,
    table_format: u32,
    table_crc: String,
    version: &'static str,
    command: &'a str,
    animation: String,
    /// Content security policy: only the style and the script of the page.
    policy: String,
    style: String,
    script: &'static str,
}

/// What plays the runs.
const SCRIPT: &str = include_str!("page.js");

/// A scenario with its plots.
pub(super) struct SceneEntry {
    id: &'static str,
    name: &'static str,
    text: String,
    outcomes: Vec<RunOutcome>,
    pub(super) plots: Vec<Plot>,
}

struct RunOutcome {
    law: &'static str,
    survives: bool,
    text: String,
}

/// A law with its gains.
struct LawEntry {
    name: &'static str,
    gains: Vec<GainRow>,
    poles: [String; 2],
    certificates: Vec<CertificateRow>,
    cost: LawCost,
}

struct GainRow {
    name: String,
    continuous: String,
    sampled: String,
}

struct CertificateRow {
    gain: String,
    bits: [usize; 2],
    residual: String,
    condition: String,
}

impl<'a> ReportPage<'a> {
    /// The page without its pictures.
    pub(super) fn new(
        source: &ReportSource<'a>,
        designed_poles: &DesignPoles,
        scenes: &[Scene],
    ) -> Result<Self, ReportError> {
        let ReportSource { rig, certified, table, trust, .. } = *source;
        let design = &certified.double;
        let short = |entry: &f64| significant(*entry, DIGITS);
        let names = state_names(rig);
        let observer = design.kalman.as_ref().filter(|_| table.observer.is_some());
        let checks = check_rows(trust);
        let input = rig.input_quantity();
        let style = format!("{}{COLOURS_CSS}{}", style_sheet(), include_str!("page.css"));
        Ok(Self {
            name: &rig.name,
            hash: format!("{:016x}", rig.hash()),
            states: rig.states(),
            tick_ms: significant(1e3 * rig.tick.period_s, DIGITS),
            delay_ticks: rig.tick.delay_ticks,
            is_chain: rig.chain().is_some(),
            carrier: if rig.base().is_cart() { "a cart" } else { "an arm" },
            state_units: if rig.base().is_cart() { "m, m/s, rad and rad/s" } else { "rad and rad/s" },
            is_disturbed: Disturbance::of(rig) != Disturbance::NONE,
            input: format!("{} u ({})", input.name, input.unit),
            failed: checks.iter().filter(|check| !check.holds).count(),
            checks,
            description: rig.describe(),
            drawing: None,
            scenes: scenes.iter().map(SceneEntry::of).collect(),
            a: design.a.row_slices().map(|row| row.iter().map(short).collect()).collect(),
            b: design.b.entries().iter().map(short).collect(),
            poles: Vec::new(),
            laws: laws(table)
                .into_iter()
                .filter_map(|law| LawEntry::of(source, designed_poles, &names, law))
                .collect(),
            observer: observer.map(|kalman| {
                kalman.l_filter.row_slices().map(|row| row.iter().map(short).collect()).collect()
            }),
            sensor_names: rig.sensors().iter().map(|sensor| names[sensor.state].clone()).collect(),
            state_names: names,
            bits: certified.bits,
            bode: Vec::new(),
            nyquist: Vec::new(),
            regions: Vec::new(),
            pushes: Vec::new(),
            survivals: SurvivalTable::of_all(source),
            imperfect: Vec::new(),
            trust: trust_rows(rig, trust),
            seed: source.seed,
            table_format: TABLE_FORMAT,
            table_crc: format!("{:08x}", table.crc()),
            version: env!("CARGO_PKG_VERSION"),
            command: source.command,
            animation: Animation::of(rig, scenes).json()?,
            policy: policy::of_document(Some(SCRIPT), &style),
            style,
            script: SCRIPT,
        })
    }

    /// The page as a file.
    pub(super) fn html(&self) -> Result<String, ReportError> {
        Ok(self.render()?)
    }
}

impl SceneEntry {
    fn of(scene: &Scene) -> Self {
        let outcomes = scene.runs.iter().map(RunOutcome::of).collect();
        Self { id: scene.id, name: scene.name, text: scene.text.clone(), outcomes, plots: Vec::new() }
    }
}

impl RunOutcome {
    fn of(run: &LawRun) -> Self {
        let summary = &run.summary;
        let mut parts = vec![match (&summary.fall, summary.settling_time_s) {
            (Some(fall), _) => format!("falls: {fall}"),
            (None, Some(time)) => format!("survives, settled after {} s", number(time)),
            (None, None) => "survives, not settled to within 2 % (at least 1 mm) at the end".to_owned(),
        }];
        parts.extend(summary.overshoot_percent.map(|over| format!("overshoot {} %", number(over))));
        let degrees = summary.peak_angles_rad.iter().copied().fold(0.0, f64::max).to_degrees();
        if !summary.peak_angles_rad.is_empty() {
            parts.push(format!("largest angle {}°", number(degrees)));
        }
        let input = summary.input_quantity();
        parts.push(format!("largest {} {}", input.name, input.of(&number(summary.peak_force_n))));
        Self { law: run.law.title(), survives: summary.survives(), text: parts.join(", ") }
    }
}

impl LawEntry {
    fn of(
        source: &ReportSource<'_>,
        designed_poles: &DesignPoles,
        names: &[String],
        law: Law,
    ) -> Option<Self> {
        let ReportSource { rig, certified, table, trust, .. } = *source;
        let design = &certified.double;
        let (continuous, sampled) = (design.continuous.in_table()[law]?, design.sampled.in_table()[law]?);
        let values = table.law(law)?;
        let mut names: Vec<String> = names.iter().map(|name| format!("K, {name}")).collect();
        if sampled.integral {
            names.push("K, integral".to_owned());
        }
        if rig.tick.delay_ticks == 1 {
            names.push("K, pending force".to_owned());
        }
        let entry = |law: &Feedback<f64>, index: usize| {
            law.k.entries().get(index).map_or("—".to_owned(), |gain| significant(*gain, 9))
        };
        let row = |(index, name): (usize, String)| GainRow {
            name,
            continuous: entry(continuous, index),
            sampled: entry(sampled, index),
        };
        let n = |law: &Feedback<f64>| law.n.map_or("none".to_owned(), |n| significant(n, 9));
        let mut gains: Vec<GainRow> = names.into_iter().enumerate().map(row).collect();
        gains.push(GainRow { name: "N".to_owned(), continuous: n(continuous), sampled: n(sampled) });
        let listed = |found: Option<&Vec<[f64; 2]>>| {
            found.map_or(String::new(), |found| poles(found, DIGITS).join(",  "))
        };
        let part = trust.laws.iter().find(|part| part.linear.law == law)?;
        Some(Self {
            name: law.title(),
            gains,
            poles: designed_poles.in_table(law).map(listed),
            certificates: part.linear.certificates.iter().map(CertificateRow::of).collect(),
            cost: LawCost::of(table, values),
        })
    }
}

impl CertificateRow {
    fn of(certificate: &Certificate) -> Self {
        Self {
            gain: certificate.gain.clone(),
            bits: certificate.bits,
            residual: number(certificate.residual),
            condition: number(certificate.condition),
        }
    }
}

/// x, x', θ1, θ1' …; the states of a model have numbers.
fn state_names(rig: &Rig) -> Vec<String> {
    match &rig.plant {
        PlantDescription::Chain(chain) => {
            let joints =
                (1..=chain.links.len()).flat_map(|joint| [format!("θ{joint}"), format!("θ{joint}'")]);
            ["x".to_owned(), "x'".to_owned()].into_iter().chain(joints).collect()
        }
        PlantDescription::Model(model) => (0..model.b.len()).map(|state| format!("state {state}")).collect(),
    }
}
