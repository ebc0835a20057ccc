//! A comparison as text and as CSV.

use super::row::{ComparedRow, Fate, LawFigures, input};
use crate::markdown::markdown_table;

/// All rows as a Markdown table with aligned columns; `key` is the swept key. The column of rigs is left out if all
/// rows have the same rig.
pub fn table(rows: &[ComparedRow], key: Option<&str>) -> String {
    let several = rows.iter().any(|row| row.rig != rows[0].rig);
    let mut header = if several { vec!["rig", "law", "run"] } else { vec!["law", "run"] };
    let left = header.len();
    header.extend(key);
    let peak = format!("peak {}", input(rows));
    header.extend([
        "settled (s)",
        "overshoot (%)",
        "peak angle (°)",
        &peak,
        "gain margin",
        "phase (°)",
        "delay (ms)",
        "tilt (°)",
        "fastest pole (1/s)",
    ]);
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            let mut cells = if several { vec![row.rig.clone()] } else { Vec::new() };
            cells.extend([row.law.to_string(), fate(&row.fate)]);
            cells.extend(key.map(|_| row.value.map_or(String::new(), |value| value.to_string())));
            cells.extend(figures(row));
            cells
        })
        .collect();
    markdown_table(&header, left, &cells)
}

fn fate(fate: &Fate) -> String {
    match fate {
        Fate::Settled => "settles".to_owned(),
        Fate::Survived => "survives".to_owned(),
        Fate::Fallen(fall) => format!("{fall}"),
        Fate::NoDesign(_) => "no design".to_owned(),
    }
}

fn figures(row: &ComparedRow) -> [String; 9] {
    let Some(figures) = &row.figures else { return core::array::from_fn(|_| "-".to_owned()) };
    let fallen = matches!(row.fate, Fate::Fallen(_));
    let number = |value: Option<f64>, decimals: usize| {
        value.map_or("-".to_owned(), |value| format!("{value:.decimals$}"))
    };
    // Force and angle of a falling pendulum mean nothing.
    let of_run = |value: Option<f64>, decimals: usize| number(value.filter(|_| !fallen), decimals);
    [
        number(figures.settling_time_s, 3),
        of_run(figures.overshoot_percent, 2),
        of_run(figures.peak_angle_rad.map(f64::to_degrees), 2),
        of_run(Some(figures.peak_force_n), 2),
        gain_margin(figures),
        number(figures.phase_margin_rad.map(f64::to_degrees), 1),
        number(figures.delay_margin_s.map(|delay| 1e3 * delay), 2),
        number(figures.tilt_rad.map(f64::to_degrees), 2),
        number(Some(figures.fastest_pole_per_s), 1),
    ]
}

fn gain_margin(figures: &LawFigures) -> String {
    match (figures.lowest_gain, figures.highest_gain) {
        (None, _) => "unstable".to_owned(),
        (Some(lowest), None) => format!("{lowest:.2} to ∞"),
        (Some(lowest), Some(highest)) => format!("{lowest:.2} to {highest:.2}"),
    }
}

/// Why some rows have no design, one line each.
pub fn notes(rows: &[ComparedRow], key: Option<&str>) -> Vec<String> {
    let note = |row: &ComparedRow| match &row.fate {
        Fate::NoDesign(reason) => {
            let value =
                row.value.map_or(String::new(), |value| format!(", {} = {value}", key.unwrap_or("value")));
            Some(format!("{}{value}: {reason}", row.rig))
        }
        Fate::Settled | Fate::Survived | Fate::Fallen(_) => None,
    };
    rows.iter().filter_map(note).collect()
}

/// All rows as CSV, in SI units; missing values are left empty.
///
/// # Errors
/// Errors of the CSV writer; writing to memory causes none.
pub fn csv(rows: &[ComparedRow], key: Option<&str>) -> std::io::Result<Vec<u8>> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    csv.write_record([
        "rig",
        "law",
        key.unwrap_or("value"),
        "run",
        "settling_time_s",
        "overshoot_percent",
        "peak_angle_rad",
        "peak_force_n",
        "lowest_gain",
        "highest_gain",
        "phase_margin_rad",
        "delay_margin_s",
        "tilt_rad",
        "fastest_pole_per_s",
        "reason",
    ])?;
    let number = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
    for row in rows {
        let reason = match &row.fate {
            Fate::NoDesign(reason) => reason.as_str(),
            Fate::Settled | Fate::Survived | Fate::Fallen(_) => "",
        };
        let of = |value: fn(&LawFigures) -> Option<f64>| number(row.figures.as_ref().and_then(value));
        csv.write_record([
            row.rig.as_str(),
            row.law.key(),
            &number(row.value),
            &fate(&row.fate),
            &of(|figures| figures.settling_time_s),
            &of(|figures| figures.overshoot_percent),
            &of(|figures| figures.peak_angle_rad),
            &of(|figures| Some(figures.peak_force_n)),
            &of(|figures| figures.lowest_gain),
            &of(|figures| figures.highest_gain),
            &of(|figures| figures.phase_margin_rad),
            &of(|figures| figures.delay_margin_s),
            &of(|figures| figures.tilt_rad),
            &of(|figures| Some(figures.fastest_pole_per_s)),
            reason,
        ])?;
    }
    csv.into_inner().map_err(|error| std::io::Error::other(error.to_string()))
}
