//! The command-line tool: from a rig file to gains, gain table and closed loop.

mod building;
mod commission;
mod compare;
mod exit_status;
mod export;
mod faults;
mod firmware;
mod identify;
mod import;
mod mark;
mod reading;
mod report;
mod robust;
mod shake;
mod simulate;
mod site;
mod split;
mod swing_up;
mod target;
mod transitions;
mod twin;
mod variation;
mod verify;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use exit_status::exit_status;
use upright_command::{CheckCommand, DesignCommand, Failure, with_negative_numbers};
use variation::add_motions;

const EXAMPLES: &str = "\
Examples:
  upright check rigs/quadruple-paper.toml       read a rig file and print its values with defaults filled in
  upright design rigs/quadruple-paper.toml      design the gains, prove them, write src/gains.rs
  upright design my.toml --json --no-write      the same as JSON, without writing files
  upright simulate rigs/quadruple-paper.toml --step 1 --svg step.svg
  upright twin rigs/quadruple-paper.toml        a page on which the rig moves: pull it, break it, watch it
  upright verify rigs/quadruple-paper.toml      margins, region of attraction, noise, model errors
  upright swing-up rigs/quadruple-paper.toml    plan how the rig raises itself, and lowers itself again
  upright robust rigs/quadruple-robust.toml     gains that survive wrong masses, friction, wrong zeros
  upright identify my.toml run.log --write new.toml   the real machine's parameters, from a log
  upright export my.toml --c controller.h       table and controller as one C header, for Arduino and others
  upright report rigs/quadruple-paper.toml      all of it on one page, with an animation
  upright site --out site                       a page that designs rigs in the browser, nothing to install
  upright compare rigs/quadruple-paper.toml --sweep tick.period_s=0.0005..0.01

Exit status:
  0  done
  1  a check failed: pendulum falls, requirement not met, fault missed, tick too long, file differs
  2  bad input: a rig file, an argument, a file that cannot be written
  3  the design problem has no solution; a log does not fit any machine; a machine must not be run
  4  a needed program is missing";

/// Designs and verifies the gains that balance an n-link inverted pendulum on a cart, and writes them as a table.
#[derive(Parser)]
#[command(name = "upright", version, before_help = EXAMPLES, arg_required_else_help = true)]
struct Arguments {
    #[command(subcommand)]
    command: UprightCommand,
}

#[derive(Subcommand)]
enum UprightCommand {
    Check(CheckCommand),
    Commission(commission::CommissionCommand),
    Design(DesignCommand),
    Export(export::ExportCommand),
    Faults(faults::FaultsCommand),
    Firmware(firmware::FirmwareCommand),
    Report(report::ReportCommand),
    Compare(compare::CompareCommand),
    Robust(robust::RobustCommand),
    Shake(shake::ShakeCommand),
    Identify(identify::IdentifyCommand),
    Import(import::ImportCommand),
    Mark(mark::MarkCommand),
    Simulate(simulate::SimulateCommand),
    Site(site::SiteCommand),
    Twin(twin::TwinCommand),
    SwingUp(swing_up::SwingUpCommand),
    Transitions(transitions::TransitionsCommand),
    Verify(verify::VerifyCommand),
}

/// What is an option of another command, and not a command.
const OPTIONS: [(&str, &str); 2] =
    [("false-alarms", "faults --healthy"), ("coverage", "identify --coverage")];

fn main() -> ExitCode {
    let typed = std::env::args().nth(1);
    if let Some((name, option)) = OPTIONS.into_iter().find(|(name, _)| typed.as_deref() == Some(name)) {
        return Failure::argument(format!("there is no command `{name}`: use `upright {option}`"))
            .report(exit_status);
    }
    let matches = with_negative_numbers(Arguments::command()).get_matches();
    let arguments = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let result = match arguments.command {
        UprightCommand::Check(command) => command.run(),
        UprightCommand::Commission(command) => command.run(),
        UprightCommand::Design(command) => command.run(add_motions),
        UprightCommand::Export(command) => command.run(),
        UprightCommand::Faults(command) => command.run(),
        UprightCommand::Firmware(command) => command.run(),
        UprightCommand::Report(command) => command.run(),
        UprightCommand::Compare(command) => command.run(),
        UprightCommand::Robust(command) => command.run(),
        UprightCommand::Shake(command) => command.run(),
        UprightCommand::Identify(command) => command.run(),
        UprightCommand::Import(command) => command.run(),
        UprightCommand::Mark(command) => command.run(),
        UprightCommand::Simulate(command) => command.run(),
        UprightCommand::Site(command) => command.run(),
        UprightCommand::Twin(command) => command.run(),
        UprightCommand::SwingUp(command) => command.run(),
        UprightCommand::Transitions(command) => command.run(),
        UprightCommand::Verify(command) => command.run(),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(exit_status),
    }
}
