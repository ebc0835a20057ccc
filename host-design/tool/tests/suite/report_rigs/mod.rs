//! Reports for the tests, without the slow half of the trust report.

use std::path::Path;
use std::sync::LazyLock;

use upright::table::Law;
use upright_design::design::design;
use upright_design::motion::Transition;
use upright_design::rig::Rig;
use upright_design::table::{Gains, TableValues};
use upright_plan::Margin;
use upright_tool::report::{REGION_POINTS, Report, ReportSource, report};
use upright_trust::verify::{ImperfectionSettings, LawTrust, TrustReport, imperfections, linear};

/// A rig from this repository.
pub(crate) fn rig(name: &str) -> Rig {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs").join(name).with_extension("toml");
    Rig::from_path(&path).unwrap()
}

/// The report on a rig, without the slow half of the trust report.
pub(crate) fn quick_report(rig: &Rig) -> Report {
    made(rig, None, &[], REGION_POINTS)
}

/// Initial states along each axis of a coarse map of the region of attraction.
const COARSE: usize = 7;

/// [`quick_report`] with a coarse map, for what does not depend on it.
pub(crate) fn coarse_report(rig: &Rig) -> Report {
    made(rig, None, &[], COARSE)
}

/// [`coarse_report`] on `single-quanser-ip02`: made once, several tests look at it.
pub(crate) static SINGLE: LazyLock<Report> = LazyLock::new(|| coarse_report(&rig("single-quanser-ip02")));

/// [`quick_report`] on a linear model, `quadruple-paper-printed`.
pub(crate) static LINEAR: LazyLock<Report> = LazyLock::new(|| quick_report(&rig("quadruple-paper-printed")));

/// [`coarse_report`] with how much of each imperfection the LQR survives, from short runs.
pub(crate) fn report_with_imperfections(rig: &Rig) -> Report {
    let settings =
        ImperfectionSettings { duration_s: 2.0, seeds: 1, relative: 0.5, ..ImperfectionSettings::of(rig) };
    made(rig, Some(settings), &[], COARSE)
}

/// [`coarse_report`] with these margins.
pub(crate) fn report_with_margins(rig: &Rig, margins: &[(Transition, Vec<Margin>)]) -> Report {
    made(rig, None, margins, COARSE)
}

fn made(
    rig: &Rig,
    settings: Option<ImperfectionSettings>,
    margins: &[(Transition, Vec<Margin>)],
    region_points: usize,
) -> Report {
    let certified = design(rig).unwrap();
    let table = TableValues::of(rig, &certified, Gains::Sampled).unwrap();
    let laws = linear(rig, &certified, &table).unwrap().into_iter().map(LawTrust::linear_only);
    let trust = TrustReport { laws: laws.collect(), checks: Vec::new() };
    let found = settings.map(|settings| imperfections(rig, &table, Law::Lqr, &settings, &|| ()).unwrap());
    let source = ReportSource {
        rig,
        certified: &certified,
        table: &table,
        trust: &trust,
        imperfections: found.as_slice(),
        seed: 1,
        swing_up: None,
        route: None,
        margins,
        region_points,
        command: "upright report test",
    };
    report(&source, &|_| {}).unwrap()
}
