//! `cargo upright` in a checkout: runs the commands of this crate, and has cargo build and run the whole tool for the
//! others. So the first gains are there after a third of the time that the whole tool takes to compile.

use std::process::{Command, ExitCode};

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use upright_command::{CheckCommand, DesignCommand, Failure, exit_status, with_negative_numbers};

#[derive(Parser)]
#[command(name = "upright", bin_name = "upright", version)]
struct Arguments {
    #[command(subcommand)]
    command: FirstCommand,
}

#[derive(Subcommand)]
enum FirstCommand {
    Check(CheckCommand),
    Design(DesignCommand),
}

fn main() -> ExitCode {
    let name = std::env::args().nth(1).unwrap_or_default();
    if !FirstCommand::has_subcommand(&name) {
        return whole_tool();
    }
    let matches = with_negative_numbers(Arguments::command()).get_matches();
    let arguments = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let result = match arguments.command {
        FirstCommand::Design(command) if command.wants_motions() => return whole_tool(),
        FirstCommand::Design(command) => command.run(|_, _, table, _| Ok(table)),
        FirstCommand::Check(command) => command.run(),
    };
    result.map_or_else(|failure| failure.report(exit_status), |()| ExitCode::SUCCESS)
}

/// Builds the whole tool, which takes a moment if it is built already, and runs it with the same arguments.
fn whole_tool() -> ExitCode {
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["run", "--manifest-path", concat!(env!("CARGO_MANIFEST_DIR"), "/../tool/Cargo.toml")]);
    cargo.args(["--bin", "upright", "--"]).args(std::env::args_os().skip(1));
    let error = match ended(&mut cargo) {
        Ok(exit_code) => return exit_code,
        Err(error) => error,
    };
    Failure::no_program(format!("the whole tool cannot be built, because cargo does not start: {error}"))
        .report(exit_status)
}

/// Replaces this process, so that signals reach the tool and nothing waits for it.
#[cfg(unix)]
fn ended(cargo: &mut Command) -> std::io::Result<ExitCode> {
    Err(std::os::unix::process::CommandExt::exec(cargo))
}

#[cfg(not(unix))]
fn ended(cargo: &mut Command) -> std::io::Result<ExitCode> {
    let code = cargo.status()?.code().and_then(|code| u8::try_from(code).ok());
    Ok(code.map_or(ExitCode::FAILURE, ExitCode::from))
}
