//! `upright export`

use std::path::PathBuf;

use clap::Args;
use upright_design::export::c_header;
use upright_design::rig::Rig;
use upright_design::table::{Gains, write_atomically};

use crate::failure::Failure;
use crate::variation::with_table;

/// Writes the controller for programs that are not written in Rust.
///
/// The C header contains table and controller, for Arduino, Teensy, ESP32 or a PC. Its results are those of the
/// firmware's balancing, bit for bit. Its first lines say how to use it, and what it does not protect against. Exit
/// status 2 for a rig that it cannot serve.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright export rigs/single-quanser-ip02.toml --c controller.h   table and controller as one C99 header")]
pub(crate) struct ExportCommand {
    /// Rig file
    #[arg(value_name = "RIG")]
    rig: PathBuf,
    /// Write a C99 header
    #[arg(long, value_name = "FILE")]
    c: PathBuf,
}

impl ExportCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let rig = Rig::from_path(&self.rig)?;
        let (_, table) = with_table(&rig, &self.rig, Gains::Sampled)?;
        let header = c_header(&rig, &table).map_err(|error| Failure::of_rig(self.rig.display(), error))?;
        Ok(write_atomically(&self.c, header.as_bytes())?)
    }
}
