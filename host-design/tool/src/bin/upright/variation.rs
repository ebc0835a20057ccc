//! A rig file with some of its values changed on the command line.

use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use upright::table::Law;
use upright_design::design::{Certified, design};
use upright_design::rig::Rig;
use upright_design::table::{Gains, TableValues};
use upright_plan::{Stored, StoredTransitions, SwingUpError, motions, with_motions};

use upright_command::Failure;
use upright_command::progress::with_spinner;

#[derive(Args)]
pub(crate) struct Variation {
    /// Rig file (TOML)
    pub(crate) rig: PathBuf,
    /// Which gains: those designed for the tick, or those for continuous time
    #[arg(long, value_enum, default_value_t = GainsName::Sampled)]
    gains: GainsName,
    /// Control period instead of the rig's (s); the gains are redesigned
    #[arg(long, value_name = "S", value_parser = period)]
    tick: Option<f64>,
    /// Delay instead of the rig's (ticks); the gains are redesigned
    #[arg(long, value_name = "TICKS", value_parser = clap::value_parser!(u8).range(0..=1))]
    delay: Option<u8>,
    /// Force limit instead of the rig's (N)
    #[arg(long, value_name = "N", value_parser = positive)]
    force_limit: Option<f64>,
}

#[derive(Clone, Copy, ValueEnum)]
enum GainsName {
    Sampled,
    Continuous,
}

/// Parses a control law by its name on the command line.
pub(crate) fn law_option() -> impl TypedValueParser<Value = Law> {
    // All other names have been rejected by now.
    PossibleValuesParser::new(Law::ALL.map(Law::option))
        .map(|name| Law::from_option(&name).unwrap_or(Law::Lqr))
}

impl Variation {
    /// The rig file and all changes as command-line arguments.
    pub(crate) fn as_typed(&self) -> String {
        self.rig.display().to_string() + &self.changes()
    }

    /// The changes as command-line arguments.
    pub(crate) fn changes(&self) -> String {
        let mut typed = String::new();
        if let GainsName::Continuous = self.gains {
            typed.push_str(" --gains continuous");
        }
        let mut option = |name: &str, value: Option<String>| {
            if let Some(value) = value {
                typed.push_str(&format!(" --{name} {value}"));
            }
        };
        option("tick", self.tick.map(|tick| tick.to_string()));
        option("delay", self.delay.map(|delay| delay.to_string()));
        option("force-limit", self.force_limit.map(|limit| limit.to_string()));
        typed
    }

    /// The rig with its changes, its design, and the table with the gains asked for.
    pub(crate) fn designed(&self) -> Result<(Rig, Certified, TableValues), Failure> {
        let mut rig = Rig::from_path(&self.rig)?;
        if rig.actuator.held().is_motion() && (self.delay == Some(1) || self.force_limit.is_some()) {
            return Err(Failure::argument(
                "--delay 1 and --force-limit: not with kind = \"acceleration\" in [actuator]; leave them out",
            ));
        }
        rig.tick.period_s = self.tick.unwrap_or(rig.tick.period_s);
        rig.tick.delay_ticks = self.delay.unwrap_or(rig.tick.delay_ticks);
        if let Some(force) = rig.actuator.force_mut() {
            force.limit_n = self.force_limit.or(force.limit_n);
        }
        let gains = match self.gains {
            GainsName::Sampled => Gains::Sampled,
            GainsName::Continuous => Gains::Continuous,
        };
        let (certified, table) = with_table(&rig, &self.rig, gains)?;
        Ok((rig, certified, table))
    }
}

/// Designs the rig of this file, and makes the table with these gains.
pub(crate) fn with_table(rig: &Rig, file: &Path, gains: Gains) -> Result<(Certified, TableValues), Failure> {
    let name = || file.display().to_string();
    let certified =
        with_spinner("designing", || design(rig)).map_err(|source| Failure::of_rig(name(), source))?;
    let table = TableValues::of(rig, &certified, gains).map_err(|source| Failure::of_rig(name(), source))?;
    Ok((certified, table))
}

/// Which of the motions stored beside a rig file are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Wanted {
    /// Raising and lowering, if they are stored and were made for these values of the rig file.
    SwingUp,
    /// None, even if they are stored.
    Nothing,
    /// Also those between other equilibria, which must be stored.
    Transitions,
}

impl Wanted {
    /// What the option `--transitions` asks for.
    pub(crate) fn from_option(transitions: bool) -> Self {
        if transitions { Self::Transitions } else { Self::SwingUp }
    }
}

/// The table of `upright design` with the motions that are stored beside the rig file, which have to be there.
pub(crate) fn add_motions(
    rig_file: &Path,
    rig: &Rig,
    table: TableValues,
    transitions: bool,
) -> Result<TableValues, Failure> {
    let table = with_stored_motions(rig_file, rig, table, Wanted::from_option(transitions))?;
    if table.swing_up.is_none() {
        let source = Stored::beside(rig_file).err().unwrap_or(SwingUpError::Outdated);
        return Err(Failure::of_rig(rig_file.display(), source));
    }
    Ok(table)
}

/// The table with the motions that are stored beside the rig file.
pub(crate) fn with_stored_motions(
    rig_file: &Path,
    rig: &Rig,
    table: TableValues,
    wanted: Wanted,
) -> Result<TableValues, Failure> {
    if wanted == Wanted::Nothing {
        return Ok(table);
    }
    let failed = |source| Failure::of_rig(&rig.name, source);
    let stored = match Stored::beside(rig_file) {
        Ok(stored) => stored,
        Err(SwingUpError::NoFile { .. }) if wanted == Wanted::SwingUp => return Ok(table),
        Err(error) => return Err(failed(error)),
    };
    let others = match wanted {
        Wanted::Nothing | Wanted::SwingUp => Vec::new(),
        Wanted::Transitions => {
            StoredTransitions::beside(rig_file).and_then(|stored| stored.transitions(rig)).map_err(failed)?
        }
    };
    if !stored.is_of(rig) {
        eprintln!("warning: without swing-up: {}", SwingUpError::Outdated);
        return Ok(table);
    }
    with_spinner("the motions", || with_motions(rig, table, &motions(rig, &stored)?, &others)).map_err(failed)
}

pub(crate) fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("give a finite number".to_owned()),
    }
}

pub(crate) fn positive(text: &str) -> Result<f64, String> {
    finite(text)
        .and_then(|value| if value > 0.0 { Ok(value) } else { Err("give a number above 0".to_owned()) })
}

pub(crate) fn not_negative(text: &str) -> Result<f64, String> {
    finite(text).and_then(|value| {
        if value >= 0.0 { Ok(value) } else { Err("give a number of at least 0".to_owned()) }
    })
}

fn period(text: &str) -> Result<f64, String> {
    finite(text).and_then(|value| {
        if (1e-6..=10.0).contains(&value) {
            Ok(value)
        } else {
            Err("give a period from 1e-6 to 10 s".to_owned())
        }
    })
}
