//! Stored motions, made small for the page: `page/motions.js` has the way back, to the last bit.

use serde_json::{Value, json};

/// Bytes of a packed number: its decimals, and the difference to what the three numbers above it lead to expect.
const BYTES: usize = 9;
/// Added to the decimals of a number that is given as it is.
const AS_IT_IS: u8 = 128;

/// A file of stored motions as its text without the knots, and the bytes of the knots: per motion, column by column,
/// each byte of all numbers together. `None` if it is no such file.
pub(super) fn without_knots(text: &str) -> Option<(String, Vec<u8>)> {
    let mut stored: Value = serde_json::from_str(text).ok()?;
    let mut bytes = Vec::new();
    for name in ["raise", "lower"] {
        let motion = stored.get_mut(name)?;
        let knots: Vec<Vec<f64>> = serde_json::from_value(motion["knots"].take()).ok()?;
        let width = knots.first()?.len();
        motion["knots"] = json!([knots.len(), width]);
        let columns = (0..width).map(|column| knots.iter().map(|row| row[column]).collect::<Vec<_>>());
        let numbers: Vec<[u8; BYTES]> = columns.flat_map(|column| differences(&column)).collect();
        bytes.extend((0..BYTES).flat_map(|byte| numbers.iter().map(move |number| number[byte])));
    }
    Some((stored.to_string(), bytes))
}

fn differences(column: &[f64]) -> Vec<[u8; BYTES]> {
    let of = |row: usize| {
        let before = |back: usize| row.checked_sub(back).map_or(0.0, |row| column[row]);
        let expected = 3.0 * before(1) - 3.0 * before(2) + before(3);
        let (decimals, units) = in_decimals(column[row]);
        let expected = (expected * power_of_ten(decimals) + 0.5).floor();
        let difference = units - expected;
        let (decimals, number) = match difference.abs() < units.abs() {
            true => (decimals, difference),
            false => (decimals + AS_IT_IS, units),
        };
        // The sign is the lowest bit.
        let folded = 2 * number.abs() as u64 + u64::from(number < 0.0);
        let mut bytes = [decimals; BYTES];
        bytes[1..].copy_from_slice(&folded.to_le_bytes());
        bytes
    };
    (0..column.len()).map(of).collect()
}

/// The decimals of a number, and how many units of its last decimal it has.
fn in_decimals(value: f64) -> (u8, f64) {
    let text = format!("{}", value.abs());
    let decimals = text.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    let units: f64 = text.replace('.', "").parse().unwrap_or_default();
    (decimals.min(AS_IT_IS as usize - 1) as u8, units.copysign(value))
}

fn power_of_ten(decimals: u8) -> f64 {
    // Not `powi`, which another machine may round differently.
    format!("1e{decimals}").parse().unwrap_or_default()
}
