//! The trust report as tables of the page.

use upright_design::rig::Rig;
use upright_trust::verify::{FoundRow, TrustReport, rows};

/// One quantity with its value for each law.
pub(super) struct TrustRow {
    pub(super) name: String,
    pub(super) values: Vec<String>,
    pub(super) meaning: String,
}

/// A requirement and what was found.
pub(super) struct CheckRow {
    pub(super) holds: bool,
    pub(super) law: &'static str,
    pub(super) requirement: &'static str,
    pub(super) found: String,
    pub(super) required: String,
}

pub(super) fn check_rows(report: &TrustReport) -> Vec<CheckRow> {
    let row = |check: &upright_trust::verify::Check| CheckRow {
        holds: check.holds,
        law: check.law.title(),
        requirement: check.requirement,
        found: [check.found_text()].into_iter().chain(check.remark()).collect::<Vec<_>>().join("; "),
        required: check.required_text(),
    };
    report.checks.iter().map(row).collect()
}

/// The rows of all laws side by side. A law without a row that another has gets a dash.
pub(super) fn trust_rows(rig: &Rig, report: &TrustReport) -> Vec<TrustRow> {
    let laws: Vec<Vec<FoundRow>> = report.laws.iter().map(|law| rows(rig, law)).collect();
    // An unstable law has some of the rows of a stable one, and no others.
    let Some(names) = laws.iter().max_by_key(|rows| rows.len()) else { return Vec::new() };
    let value = |rows: &Vec<FoundRow>, name: &str| {
        let row = rows.iter().find(|row| row.name == name);
        row.map_or("—".to_owned(), |row| row.value.clone())
    };
    let row = |named: &FoundRow| TrustRow {
        name: named.name.clone(),
        values: laws.iter().map(|rows| value(rows, &named.name)).collect(),
        meaning: named.meaning.clone(),
    };
    names.iter().map(row).collect()
}
