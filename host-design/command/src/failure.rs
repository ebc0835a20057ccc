//! Why a command ends without its result, and with which exit status.

use std::error::Error;
use std::fmt::{self, Display};
use std::io::ErrorKind;
use std::process::ExitCode;

use upright_design::design::DesignError;
use upright_design::rig::RigError;
use upright_design::table::NoTable;

/// Why a command ends without its result.
#[derive(Debug)]
pub struct Failure {
    words: String,
    kind: FailureKind,
}

#[derive(Debug)]
enum FailureKind {
    /// An error of a library, by which the exit status is chosen.
    Error(Box<dyn Error>),
    /// The exit status is known.
    ExitStatus(u8),
}

impl<E: Error + 'static> From<E> for Failure {
    fn from(error: E) -> Self {
        let words = match (&error as &dyn Error).is::<std::io::Error>() {
            true => format!("the output cannot be written: {error}"),
            false => error.to_string(),
        };
        Self { words, kind: FailureKind::Error(Box::new(error)) }
    }
}

impl Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words)
    }
}

impl Failure {
    /// An error of the rig with this name, or in this file.
    pub fn of_rig(rig: impl Display, error: impl Error + 'static) -> Self {
        Self { words: format!("{rig}: {error}"), kind: FailureKind::Error(Box::new(error)) }
    }

    /// A check has failed.
    pub fn check(words: impl Into<String>) -> Self {
        Self { words: words.into(), kind: FailureKind::ExitStatus(1) }
    }

    /// An argument cannot be used.
    pub fn argument(words: impl Into<String>) -> Self {
        Self { words: words.into(), kind: FailureKind::ExitStatus(2) }
    }

    /// The problem has no solution.
    pub fn no_solution(words: impl Into<String>) -> Self {
        Self { words: words.into(), kind: FailureKind::ExitStatus(3) }
    }

    /// A program is missing.
    pub fn no_program(words: impl Into<String>) -> Self {
        Self { words: words.into(), kind: FailureKind::ExitStatus(4) }
    }

    /// Prints the error and returns its exit status, for which `of_error` knows those of the errors of the libraries.
    pub fn report(&self, of_error: impl Fn(&(dyn Error + 'static)) -> u8) -> ExitCode {
        let exit_status = match &self.kind {
            FailureKind::Error(error) => of_error(error.as_ref()),
            FailureKind::ExitStatus(known) => *known,
        };
        if exit_status != 0 {
            eprintln!("upright: {self}");
        }
        ExitCode::from(exit_status)
    }
}

/// The exit status of an error of `upright-design`, or of the output: 2, bad input, for all that are not named here.
pub fn exit_status(error: &(dyn Error + 'static)) -> u8 {
    if let Some(error) = error.downcast_ref::<RigError>() {
        error.exit_code()
    } else if error.is::<DesignError>() || error.is::<NoTable>() {
        3
    } else if error.downcast_ref().is_some_and(|error: &std::io::Error| error.kind() == ErrorKind::BrokenPipe)
    {
        // The reader of a pipe has closed it: not an error.
        0
    } else {
        2
    }
}
