//! Options that say how a table of measurements is to be read.

use clap::{Args, ValueEnum};
use upright_identify::{AngleReference, AngleZero, Reading};

use crate::variation::positive;

/// How tables are read that are not logs of Upright.
#[derive(Args)]
#[command(next_help_heading = "Tables of other programs")]
pub(crate) struct ReadingArgs {
    /// Names of the columns, instead of those in the file: time_s, x_m, angle_1_rad …, force_n, voltage_v, duty, -
    #[arg(long, value_name = "NAMES", value_delimiter = ',', allow_hyphen_values = true)]
    columns: Vec<String>,
    /// Time from one row to the next (s), if no column has the time
    #[arg(long, value_name = "S", value_parser = positive)]
    period: Option<f64>,
    /// Whether angles are measured against the vertical, or against the link below
    #[arg(long, value_name = "AGAINST")]
    angles: Option<Against>,
    /// Where all angles are 0
    #[arg(long, value_name = "WHERE")]
    zero: Option<Zero>,
    /// Columns that count in the other sense
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    reversed: Vec<String>,
    /// Counts per turn of the angles in counts, instead of those in the rig file
    #[arg(long, value_name = "N", value_parser = positive)]
    counts_per_turn: Option<f64>,
    /// The cart cannot move: nothing is identified of it
    #[arg(long)]
    clamped: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Against {
    Absolute,
    Relative,
}

#[derive(Clone, Copy, ValueEnum)]
enum Zero {
    Upright,
    Hanging,
}

impl ReadingArgs {
    /// The options as they were typed.
    pub(crate) fn as_typed(&self) -> String {
        let mut typed = String::new();
        let mut add = |option: &str, value: String| typed.push_str(&format!(" --{option}{value}"));
        let list = |names: &[String]| format!(" {}", names.join(","));
        if !self.columns.is_empty() {
            add("columns", list(&self.columns));
        }
        if let Some(period) = self.period {
            add("period", format!(" {period}"));
        }
        if let Some(angles) = self.angles {
            add(
                "angles",
                format!(" {}", if matches!(angles, Against::Absolute) { "absolute" } else { "relative" }),
            );
        }
        if let Some(zero) = self.zero {
            add("zero", format!(" {}", if matches!(zero, Zero::Upright) { "upright" } else { "hanging" }));
        }
        if !self.reversed.is_empty() {
            add("reversed", list(&self.reversed));
        }
        if let Some(counts) = self.counts_per_turn {
            add("counts-per-turn", format!(" {counts}"));
        }
        if self.clamped {
            add("clamped", String::new());
        }
        typed
    }

    /// As the library wants it.
    pub(crate) fn reading(&self) -> Reading {
        Reading {
            columns: self.columns.clone(),
            period_s: self.period,
            angles: self.angles.map(|against| match against {
                Against::Absolute => AngleReference::Absolute,
                Against::Relative => AngleReference::Relative,
            }),
            zero: self.zero.map(|zero| match zero {
                Zero::Upright => AngleZero::Upright,
                Zero::Hanging => AngleZero::Hanging,
            }),
            reversed: self.reversed.clone(),
            counts_per_turn: self.counts_per_turn,
            is_clamped: self.clamped,
        }
    }
}
