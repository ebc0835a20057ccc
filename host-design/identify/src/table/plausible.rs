//! What the values of a table say against its reading, or against the recording itself.

use core::f64::consts::{PI, TAU};

use super::columns::{RecordingColumns, Scaled};
use super::error::RecordingError;
use super::reading::AngleZero;
use super::text::RecordingTable;

/// Most counts by which a clamped cart may move.
const CLAMPED_COUNTS: f64 = 10.0;
/// Largest distance from hanging of the middle of a free swing, for a unit or a zero to be named (rad).
const HANGS_RAD: f64 = 0.5;
/// A free swing around hanging is within this angle of it (rad) for at least this share of the time.
const LOW: (f64, f64) = (0.35, 0.01);
/// Time over which differences are taken to see whether a value stands still or jumps (s).
const LAG_S: f64 = 0.01;
/// A value that stops within a row has an acceleration of more than so many times the usual one.
const SUDDEN: f64 = 8.0;
/// A value that jumps has one of so many times that.
const JUMP: f64 = 3.0;

const FROZEN: &str = "it is frozen: look for a loose plug, or cut the file there";

/// Checks the values of `table`, whose deviations from hanging are `y`.
///
/// # Errors
/// [`RecordingError::Contradicts`] with the line, the column and the likely cause.
pub(super) fn check(
    columns: &RecordingColumns,
    table: &RecordingTable,
    times: &[f64],
    y: &[f64],
) -> Result<(), RecordingError> {
    hangs(columns, table, y)?;
    stays_clamped(columns, table)?;
    let cart = columns.cart.iter().filter(|_| !columns.is_clamped);
    columns.angles.iter().try_for_each(|&scaled| moves_smoothly(table, times, scaled, TAU))?;
    cart.into_iter().try_for_each(|&scaled| moves_smoothly(table, times, scaled, f64::INFINITY))
}

fn at(table: &RecordingTable, row: usize, index: usize, what: String, remedy: &str) -> RecordingError {
    RecordingError::Contradicts {
        line: table.lines[row],
        column: table.names[index].clone(),
        what,
        remedy: remedy.to_owned(),
    }
}

/// Without a drive, link 1 hangs in the middle of its motion.
fn hangs(columns: &RecordingColumns, table: &RecordingTable, y: &[f64]) -> Result<(), RecordingError> {
    let wrapped = |angle: f64| angle - TAU * (angle / TAU).round();
    let (mut sine, mut cosine, mut count, mut low) = (0.0, 0.0, 0, 0);
    for angle in y.iter().skip(1).step_by(columns.angles.len() + 1) {
        (sine, cosine, count) = (sine + libm::sin(*angle), cosine + libm::cos(*angle), count + 1);
        low += usize::from(wrapped(*angle).abs() < LOW.0);
    }
    // The mean direction alone would refuse large swings, which spend most of their time high up.
    if columns.drive.is_some() || cosine >= 0.0 || low as f64 > LOW.1 * f64::from(count) {
        return Ok(());
    }
    let middle = libm::atan2(sine, cosine);
    let (index, factor) = columns.angles[0];
    let (now, other, zero) = match columns.zero {
        AngleZero::Upright => ("upright", "hanging", PI),
        AngleZero::Hanging => ("hanging", "upright", 0.0),
    };
    let what = format!(
        "with --zero {now}, link 1 would stay {:.0}° from hanging without a drive",
        middle.abs().to_degrees()
    );
    // In another unit it may hang.
    let to_degrees = 180.0 / PI;
    for (unit, factor) in [("deg", factor / to_degrees), ("rad", factor * to_degrees)] {
        let values = || (0..table.lines.len()).map(|row| factor * table.row(row)[index]);
        let most = values().fold(0.0, |most: f64, value| most.max(value.abs()));
        let is_hanging = wrapped(median(values()) - zero).abs() < HANGS_RAD;
        if table.names[index].to_lowercase().contains(if unit == "deg" { "rad" } else { "deg" })
            && is_hanging
            && (0.1..2.0 * TAU).contains(&most)
        {
            let remedy = format!("its values are {unit}: call it so, as in angle_1_{unit}");
            return Err(at(table, 0, index, what, &remedy));
        }
    }
    let remedy = format!("say --zero {other}, or turn its sense with --reversed");
    Err(at(table, 0, index, what, &remedy))
}

/// A clamped cart does not move.
fn stays_clamped(columns: &RecordingColumns, table: &RecordingTable) -> Result<(), RecordingError> {
    let (Some((index, factor)), true) = (columns.cart, columns.is_clamped) else { return Ok(()) };
    let values = || (0..table.lines.len()).map(|row| factor * table.row(row)[index]);
    let moved = values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min);
    if moved <= CLAMPED_COUNTS * columns.cart_step_m {
        return Ok(());
    }
    let what = format!("the cart moves by {:.2} mm, although it is clamped", 1e3 * moved);
    Err(at(table, 0, index, what, "leave --clamped out"))
}

/// A value that stops within a row and starts within a row is not that of a motion: clipped or frozen. One that jumps
/// within a row and goes on as before has lost rows.
fn moves_smoothly(
    table: &RecordingTable,
    times: &[f64],
    (index, factor): Scaled,
    turn: f64,
) -> Result<(), RecordingError> {
    let values = unwrapped((0..table.lines.len()).map(|row| factor * table.row(row)[index]), turn);
    let period_s = median(times.windows(2).map(|pair| pair[1] - pair[0]));
    let lag = ((LAG_S / period_s).round() as usize).max(1);
    if values.len() < 8 * lag {
        return Ok(());
    }
    if let Some((row, rows, is_extreme)) = stands(&values, lag) {
        let what = format!("the value {} stands for {rows} rows in motion", table.row(row)[index]);
        let clipped = "it is clipped: widen the range of the sensor or of the recording";
        return Err(at(table, row, index, what, if is_extreme { clipped } else { FROZEN }));
    }
    // Even rows only: at an uneven time a row is off by itself.
    let is_even = |row: usize| (times[row + 1] - times[row] - period_s).abs() < 0.1 * period_s;
    let Some(row) = jumps(&values, is_even) else { return Ok(()) };
    let [from, to] = [row, row + 1].map(|row| table.row(row)[index]);
    if values[row] == values[row - 1] && values[row] == values[row - 2] {
        return Err(at(table, row, index, format!("the value {from} stands and then jumps to {to}"), FROZEN));
    }
    let what = format!("the value jumps from {from} to {to}");
    let remedy = "rows are missing there, or the sensor slips: cut the file there, or record the time";
    Err(at(table, row + 1, index, what, remedy))
}

/// Second difference at a row, over `lag` rows to each side.
fn bend(values: &[f64], row: usize, lag: usize) -> f64 {
    values[row + lag] - 2.0 * values[row] + values[row - lag]
}

/// Least second difference over `lag` rows that is sudden: far above the usual one and a step of the sensor.
fn sudden(values: &[f64], lag: usize) -> f64 {
    let steps = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0);
    let bends = (lag..values.len() - lag).map(|row| bend(values, row, lag).abs());
    SUDDEN * (1.5 * median(bends) + steps.fold(f64::INFINITY, f64::min))
}

/// Row from which a value stands for so many rows although it moved before and moves after; whether it is the largest
/// or the smallest one.
fn stands(values: &[f64], lag: usize) -> Option<(usize, usize, bool)> {
    let sudden = sudden(values, lag);
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
    let mut first = 0;
    for end in 1..values.len() {
        if values[end] == values[first] {
            continue;
        }
        let (start, last) = (core::mem::replace(&mut first, end), end - 1);
        if last < start + lag.max(2) || start < lag || last + lag >= values.len() {
            continue;
        }
        if [start, last].iter().all(|&row| bend(values, row, lag).abs() > sudden) {
            return Some((start, last + 1 - start, values[start] == low || values[start] == high));
        }
    }
    None
}

/// Row after which the values jump and go on as before: a step, not a single value that is off.
fn jumps(values: &[f64], is_even: impl Fn(usize) -> bool) -> Option<usize> {
    let least = JUMP * sudden(values, 1);
    let is_jump = |row: &usize| {
        let [before, one, other, after] = [row - 1, *row, row + 1, row + 2].map(|row| bend(values, row, 1));
        let is_step = before.abs().max(after.abs()) < 0.3 * one.abs();
        one.abs() > least && other.abs() > least && one * other < 0.0 && is_step && is_even(*row)
    };
    (2..values.len().saturating_sub(3)).find(is_jump)
}

/// The values without the jumps of a sensor that begins anew after a `turn`.
fn unwrapped(values: impl Iterator<Item = f64>, turn: f64) -> Vec<f64> {
    let (mut turns, mut before) = (0.0, f64::NAN);
    let one = |value: f64| {
        let step = value - before;
        before = value;
        if step.abs() > 0.75 * turn && step.abs() < 1.25 * turn {
            turns -= turn.copysign(step);
        }
        value + turns
    };
    values.map(one).collect()
}

/// The median; 0 of nothing.
pub(super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
}
