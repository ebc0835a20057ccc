//! The WebAssembly module of the page.

use super::error::{SiteError, TARGET};
use crate::image::{Compiler, ForeignTarget, compiler_for};
use upright_command::project::checkout;

const BROWSER: ForeignTarget<'static> = ForeignTarget {
    names: &[TARGET],
    folder: "page",
    libraries: "-Zbuild-std=std,panic_abort",
    linker: "wasm-ld",
};

/// Name of the module's crate, and the cargo profile that it is compiled with.
const PACKAGE: &str = "upright-page";
const PROFILE: &str = "page";

/// Compiles the module, if it has changed, and reads it.
///
/// # Errors
/// [`SiteError`] if there is no compiler or no source, or if the compiler fails.
pub fn module() -> Result<Vec<u8>, SiteError> {
    let Compiler { program, mut cargo, target_directory, .. } = compiler_for::<SiteError>(BROWSER)?;
    cargo
        .current_dir(checkout()?)
        .args(["rustc", "--quiet", "--locked", "--package", PACKAGE, "--lib", "--crate-type", "cdylib"])
        .args(["--profile", PROFILE, "--target", TARGET]);
    let output = cargo.output().map_err(|source| SiteError::Start(program, source))?;
    if !output.status.success() {
        return Err(SiteError::Compiler(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    let path = target_directory.join(TARGET).join(PROFILE).join("upright_page.wasm");
    std::fs::read(&path).map_err(|source| SiteError::File { path, source })
}
