//! `upright site`

use std::path::PathBuf;

use clap::Args;
use upright_command::project::checkout;
use upright_design::table::write_atomically;
use upright_tool::site::{examples, labs, module, page};

use upright_command::Failure;
use upright_command::progress::with_spinner;

/// Writes a page that designs rigs in the browser, with nothing to install.
///
/// The page is one file, index.html. It works when it is opened from a disk, without a network, and the folder can be
/// put on any web server that serves files. Exit status 4 without a compiler for WebAssembly.
#[derive(Args)]
#[command(before_help = "\
Examples:
  upright site --out site     writes site/index.html, with the rigs of rigs/ and the labs of lessons/")]
pub(crate) struct SiteCommand {
    /// Folder for the page; it is created if it does not exist
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

impl SiteCommand {
    pub(crate) fn run(self) -> Result<(), Failure> {
        let examples = examples(&checkout()?.join("rigs"))?;
        let labs = labs(&checkout()?.join("lessons"))?;
        let module = with_spinner("compiling the page's module", module)?;
        let page = page(&module, &examples, &labs);
        std::fs::create_dir_all(&self.out)
            .map_err(|error| Failure::argument(format!("{}: {error}", self.out.display())))?;
        let path = self.out.join("index.html");
        write_atomically(&path, page.as_bytes())?;
        eprintln!(
            "wrote {} ({:.2} MB, a module of {:.2} MB in it)",
            path.display(),
            mb(page.len()),
            mb(module.len())
        );
        Ok(())
    }
}

fn mb(bytes: usize) -> f64 {
    bytes as f64 / 1e6
}
