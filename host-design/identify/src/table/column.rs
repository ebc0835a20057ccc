//! What a column measures, from its name.

use core::f64::consts::PI;

/// What a column measures, with the factor from its values to SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Column {
    /// Not used.
    Ignored,
    /// Time (s).
    Time(f64),
    /// Position of the cart (m).
    Cart(ColumnScale),
    /// Angle of a link, from 0 (rad); whether the name says that it is the angle of a joint.
    Angle { link: usize, scale: ColumnScale, is_of_joint: bool },
    /// Force on the cart (N).
    Force,
    /// Voltage of the motor (V).
    Voltage,
    /// Duty of the motor, from -1 to 1.
    Duty,
}

/// Factor to SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum ColumnScale {
    Factor(f64),
    /// Counts of the encoder.
    Counts,
}

impl Column {
    /// A number for each quantity, whatever its unit; drives are one quantity.
    pub(super) fn quantity(&self) -> usize {
        match self {
            Column::Ignored => 0,
            Column::Time(_) => 1,
            Column::Cart(_) => 2,
            Column::Force | Column::Voltage | Column::Duty => 3,
            Column::Angle { link, .. } => 4 + link,
        }
    }

    /// The meaning of a name.
    ///
    /// # Errors
    /// What is wrong with the name.
    pub(super) fn of(name: &str) -> Result<Self, String> {
        let name = name.trim().to_lowercase().replace([' ', '.', '[', '(', '/'], "_").replace([']', ')'], "");
        let words: Vec<&str> = name.split('_').filter(|word| !word.is_empty()).collect();
        let name = words.join("_");
        if name == "-" {
            return Ok(Column::Ignored);
        }
        let (stem, unit) = name.rsplit_once('_').unwrap_or((&name, ""));
        let numbered = numbered(&name).filter(|(word, ..)| ANGLES.contains(word) || JOINTS.contains(word));
        match (stem, unit) {
            ("time" | "t", unit) => time(unit),
            ("x" | "cart" | "cart_position" | "position", unit) => length(unit).map(Column::Cart),
            ("force" | "u", "n") => Ok(Column::Force),
            ("voltage" | "u", "v") | ("voltage", "volts") => Ok(Column::Voltage),
            ("duty", "") => Ok(Column::Duty),
            _ => match numbered {
                Some((_, 0, _)) => Err("links are counted from 1".to_owned()),
                Some((word, link, unit)) => angle(unit).map(|scale| Column::Angle {
                    link: link - 1,
                    scale,
                    is_of_joint: JOINTS.contains(&word),
                }),
                None if ["time", "t"].contains(&name.as_str()) => time(""),
                None if ["x", "cart", "position"].contains(&name.as_str()) => length("").map(Column::Cart),
                None => Err("has no known meaning".to_owned()),
            },
        }
    }
}

/// Words before the number of a link, and before that of a joint.
const ANGLES: [&str; 6] = ["angle", "theta", "phi", "link", "q", "th"];
const JOINTS: [&str; 1] = ["joint"];

/// Word, number and unit of a name such as `angle_1_rad` or `theta1_deg`.
fn numbered(name: &str) -> Option<(&str, usize, &str)> {
    let digits = name.find(|c: char| c.is_ascii_digit())?;
    let rest = &name[digits..];
    let end = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    let number = rest[..end].parse().ok()?;
    Some((name[..digits].trim_end_matches('_'), number, rest[end..].trim_start_matches('_')))
}

fn time(unit: &str) -> Result<Column, String> {
    match unit {
        "s" => Ok(Column::Time(1.0)),
        "ms" => Ok(Column::Time(1e-3)),
        "us" | "µs" | "μs" => Ok(Column::Time(1e-6)),
        _ => Err("its unit is open: call it time_s, time_ms or time_us".to_owned()),
    }
}

fn length(unit: &str) -> Result<ColumnScale, String> {
    match unit {
        "m" => Ok(ColumnScale::Factor(1.0)),
        "cm" => Ok(ColumnScale::Factor(1e-2)),
        "mm" => Ok(ColumnScale::Factor(1e-3)),
        "counts" => Ok(ColumnScale::Counts),
        _ => Err("its unit is open: call it x_m, x_cm, x_mm or x_counts".to_owned()),
    }
}

fn angle(unit: &str) -> Result<ColumnScale, String> {
    match unit {
        "rad" => Ok(ColumnScale::Factor(1.0)),
        "deg" | "degrees" => Ok(ColumnScale::Factor(PI / 180.0)),
        "counts" => Ok(ColumnScale::Counts),
        "" => Err("its unit is open: call it angle_1_rad, angle_1_deg or angle_1_counts".to_owned()),
        _ => Err("has no known meaning".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_says_what_a_column_measures_or_is_refused() {
        let angle = |link, scale, is_of_joint| Ok(Column::Angle { link, scale, is_of_joint });
        assert_eq!(Column::of("angle_2_rad"), angle(1, ColumnScale::Factor(1.0), false));
        assert_eq!(Column::of("Theta1 [deg]"), angle(0, ColumnScale::Factor(PI / 180.0), false));
        assert_eq!(Column::of("joint1_counts"), angle(0, ColumnScale::Counts, true));
        assert_eq!(Column::of("t_ms"), Ok(Column::Time(1e-3)));
        for name in ["time_ms", "time [ms]", "Time (ms)", "t [ms]"] {
            assert_eq!(Column::of(name), Ok(Column::Time(1e-3)), "{name}");
        }
        assert_eq!(Column::of("x_mm"), Ok(Column::Cart(ColumnScale::Factor(1e-3))));
        assert_eq!(Column::of("u_v"), Ok(Column::Voltage));
        for name in ["theta1", "time", "x", "angle_0_rad", "angle_1_rad_per_s", "current_a"] {
            assert!(Column::of(name).is_err(), "{name}");
        }
    }
}
