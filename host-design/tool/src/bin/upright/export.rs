//! `upright export`

use std::path::PathBuf;

use clap::Args;
use upright_design::export::c_header;
use upright_design::rig::{CartOnly, Rig};
use upright_design::table::{Gains, write_atomically};
use upright_tool::simulator_model::{mjcf, urdf};

use crate::variation::with_table;
use upright_command::Failure;

/// Writes the controller for programs that are not written in Rust, or the machine for a simulator.
///
/// The C header contains table and controller, for Arduino, Teensy, ESP32 or a PC. Its results are those of the
/// firmware's balancing, bit for bit. Its first lines say how to use it, and what it does not protect against.
///
/// MJCF, for MuJoCo, has masses, inertias, viscous and dry friction, motor and ends of the rail of the simulated
/// machine with its [reality]; a URDF has no motor. Comments say what the format has no word for. Exit status 2 for a
/// rig that cannot be written.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright export rigs/single-quanser-ip02.toml --c controller.h   table and controller as one C99 header
  upright export rigs/single-quanser-ip02.toml --mjcf model.xml   the machine for MuJoCo
  upright export rigs/single-quanser-ip02.toml --urdf model.urdf  the machine for other simulators")]
pub(crate) struct ExportCommand {
    /// Rig file
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    #[command(flatten)]
    files: Files,
}

/// What is written, at least one.
#[derive(Args)]
#[group(required = true, multiple = true)]
struct Files {
    /// Write a C99 header
    #[arg(long, value_name = "FILE")]
    c: Option<PathBuf>,
    /// Write an MJCF model
    #[arg(long, value_name = "FILE")]
    mjcf: Option<PathBuf>,
    /// Write a URDF
    #[arg(long, value_name = "FILE")]
    urdf: Option<PathBuf>,
}

impl ExportCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let rig = Rig::from_path(&self.rig)?;
        if self.files.mjcf.is_some() || self.files.urdf.is_some() {
            rig.needs_cart(CartOnly::OtherSimulators, &self.rig)?;
        }
        let failed = self.rig.display();
        let mut written = Vec::new();
        if let Some(file) = self.files.c {
            let (_, table) = with_table(&rig, &self.rig, Gains::Sampled)?;
            written.push((file, c_header(&rig, &table).map_err(|error| Failure::of_rig(&failed, error))?));
        }
        if let Some(file) = self.files.mjcf {
            written.push((file, mjcf(&rig).map_err(|error| Failure::of_rig(&failed, error))?));
        }
        if let Some(file) = self.files.urdf {
            written.push((file, urdf(&rig).map_err(|error| Failure::of_rig(&failed, error))?));
        }
        for (file, text) in written {
            write_atomically(&file, text.as_bytes())?;
        }
        Ok(())
    }
}
