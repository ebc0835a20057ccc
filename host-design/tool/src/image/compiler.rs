//! The compiler for another target than this computer: that of rustup if it has the target, otherwise Debian's.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::error::{BuildError, NoCompiler, TARGET};
use upright_command::project::NoCheckout;
use upright_command::project::checkout;

/// Debian's compiler, which can build Rust's core library from `rust-web-src`.
const DEBIAN_CARGO: &str = "/usr/bin/cargo";
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";

/// Targets that are compiled together, and what Debian's compiler needs for them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ForeignTarget<'a> {
    /// Their names.
    pub(crate) names: &'a [&'a str],
    /// Folder for what is built, in the target directory.
    pub(crate) folder: &'static str,
    /// The standard libraries that Debian's compiler builds from source.
    pub(crate) libraries: &'static str,
    /// Their linker.
    pub(crate) linker: &'static str,
}

/// The microcontroller.
const MICROCONTROLLER: ForeignTarget<'static> =
    ForeignTarget { names: &[TARGET], folder: "firmware", libraries: "-Zbuild-std=core", linker: "ld.lld" };

/// A `cargo` that compiles for another target.
#[derive(Debug)]
pub struct Compiler {
    /// Name of the program, for messages.
    pub program: &'static str,
    /// Output of `rustc -vV`.
    pub version: String,
    /// The call, to which the caller adds a subcommand such as `build` and its arguments. Variables of an outer cargo
    /// are removed from its environment.
    pub cargo: Command,
    /// Directory into which it builds; the call sets it.
    pub target_directory: PathBuf,
}

/// The compiler for the microcontroller that is installed.
///
/// # Errors
/// [`BuildError::NoCompiler`] if there is none.
pub fn compiler() -> Result<Compiler, BuildError> {
    compiler_for(MICROCONTROLLER)
}

/// The compiler for all of these microcontrollers that is installed, by the names of their targets.
///
/// # Errors
/// As for [`compiler`].
pub fn compiler_for_chips(names: &[&str]) -> Result<Compiler, BuildError> {
    compiler_for(ForeignTarget { names, ..MICROCONTROLLER })
}

/// The installed compiler for all of these targets.
///
/// # Errors
/// [`NoCompiler`] if there is none; [`NoCheckout`] if there is nothing that it could compile.
pub(crate) fn compiler_for<E>(target: ForeignTarget<'_>) -> Result<Compiler, E>
where
    E: From<NoCompiler> + From<NoCheckout>,
{
    let target_directory = base_directory()?.join(target.folder);
    let mut compiler = if target.names.iter().all(|name| rustup_has(name)) {
        let mut cargo = Command::new("cargo");
        // With it, symbols have other names, and functions another order.
        cargo.env_remove("RUSTC_BOOTSTRAP");
        Compiler { program: "cargo", version: version("rustc"), cargo, target_directory }
    } else if debian_has_a_compiler(target.linker) {
        let mut cargo = Command::new(DEBIAN_CARGO);
        cargo.env("RUSTC_BOOTSTRAP", "1").env("RUSTC", DEBIAN_RUSTC).arg(target.libraries);
        for name in target.names {
            let name = name.replace(['-', '.'], "_").to_uppercase();
            cargo.env(format!("CARGO_TARGET_{name}_LINKER"), target.linker);
        }
        // Two compilers cannot share a directory.
        Compiler {
            program: DEBIAN_CARGO,
            version: version(DEBIAN_RUSTC),
            cargo,
            target_directory: target_directory.join("debian"),
        }
    } else {
        return Err(NoCompiler(target.names.join(" ")).into());
    };
    // Variables set by an outer cargo are for the host.
    for (name, _) in std::env::vars_os() {
        let name_is_cargos =
            name.to_str().is_some_and(|name| name.starts_with("CARGO_PKG_") || name == "CARGO");
        if name_is_cargos || name == "RUSTFLAGS" || name == "CARGO_ENCODED_RUSTFLAGS" {
            compiler.cargo.env_remove(name);
        }
    }
    compiler.cargo.env("CARGO_TARGET_DIR", &compiler.target_directory).stdin(Stdio::null());
    Ok(compiler)
}

/// A separate target directory: the caller may run under cargo, which holds a lock on the usual one.
pub(super) fn target_directory() -> Result<PathBuf, NoCheckout> {
    Ok(base_directory()?.join(MICROCONTROLLER.folder))
}

fn base_directory() -> Result<PathBuf, NoCheckout> {
    Ok(match std::env::var_os("CARGO_TARGET_DIR") {
        Some(directory) => std::path::absolute(directory).unwrap_or_default(),
        None => checkout()?.join("target"),
    })
}

fn version(rustc: &str) -> String {
    let output = Command::new(rustc).arg("-vV").output();
    output.map(|output| String::from_utf8_lossy(&output.stdout).into_owned()).unwrap_or_default()
}

fn rustup_has(target: &str) -> bool {
    let output = Command::new("rustc").args(["--print", "target-libdir", "--target", target]).output();
    output.is_ok_and(|output| {
        output.status.success() && Path::new(String::from_utf8_lossy(&output.stdout).trim()).is_dir()
    })
}

fn debian_has_a_compiler(linker: &str) -> bool {
    let sysroot = Command::new(DEBIAN_RUSTC).args(["--print", "sysroot"]).output();
    let linker = Command::new(linker).arg("--version").output();
    let has_source = sysroot.is_ok_and(|output| {
        let sysroot = String::from_utf8_lossy(&output.stdout).trim().to_owned();
        Path::new(&sysroot).join("lib/rustlib/src/rust/library/core").is_dir()
    });
    has_source && Path::new(DEBIAN_CARGO).exists() && linker.is_ok()
}
