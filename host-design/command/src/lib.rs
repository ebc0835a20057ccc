//! What all commands of `upright` share, and the commands that need nothing but `upright-design`. In a checkout,
//! `cargo upright` compiles these first, and the others when one of them is called.
//!
//! | module | what is in it |
//! |---|---|
//! | [`progress`] | what a long computation tells meanwhile |
//! | [`project`] | finds the checkout that images are built from |

#![forbid(unsafe_code)]

mod check;
mod design;
mod failure;
mod output;
pub mod progress;
pub mod project;
mod stilling;

pub use check::CheckCommand;
pub use design::{AddMotions, DesignCommand};
pub use failure::{Failure, exit_status};
pub use output::{print, warn_of_an_arm, warn_of_unusual_values};
pub use stilling::stilling;

use clap::{Arg, Command};

/// Lets every option of a command take a number below 0, so that what refuses it says what is accepted.
pub fn with_negative_numbers(command: Command) -> Command {
    let takes_number = |arg: Arg| {
        let is_option = !arg.is_positional() && arg.get_action().takes_values();
        if is_option { arg.allow_negative_numbers(true) } else { arg }
    };
    command.mut_args(takes_number).mut_subcommands(with_negative_numbers)
}
