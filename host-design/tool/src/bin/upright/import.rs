//! `upright import`

use std::io::Write;
use std::path::PathBuf;

use clap::Args;
use upright_design::table::write_atomically;
use upright_tool::import::rig_file;

use upright_command::Failure;

/// Writes a rig file for the machine in a URDF: a cart on a rail and a chain of hinges.
///
/// Masses, lengths, inertias, friction and limits are taken from the file; a comment marks what a URDF does not have.
/// Links that are fixed to each other become one. Exit status 2 for another machine; the message names the joint.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright import cart-pole.urdf                   print the rig file
  upright import cart-pole.urdf --out my.toml     write it")]
pub(crate) struct ImportCommand {
    /// URDF file; macros (xacro) have to be expanded
    urdf: PathBuf,
    /// Write the rig file here instead of printing it
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl ImportCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let name = self.urdf.display().to_string();
        let text = std::fs::read_to_string(&self.urdf)
            .map_err(|error| Failure::argument(format!("{name}: cannot be read: {error}")))?;
        let file = self.urdf.file_name().unwrap_or_default().to_string_lossy();
        let rig = rig_file(&text, &file).map_err(|error| Failure::of_rig(&name, error))?;
        match self.out {
            None => Ok(std::io::stdout().write_all(rig.as_bytes())?),
            Some(path) => {
                write_atomically(&path, rig.as_bytes())?;
                eprintln!("wrote {}", path.display());
                Ok(())
            }
        }
    }
}
