//! The tool as a command: what the tests of its output share.

use std::process::{Command, Output};

use upright_test_support::limits::output;

use crate::published::rig_path;

pub(crate) const SINGLE: &str = "single-quanser-ip02";

pub(crate) fn upright(arguments: &[&str]) -> Output {
    output(Command::new(env!("CARGO_BIN_EXE_upright")).args(arguments))
}

pub(crate) fn status(output: &Output) -> i32 {
    output.status.code().unwrap()
}

pub(crate) fn stdout(output: &Output) -> &str {
    std::str::from_utf8(&output.stdout).unwrap()
}

pub(crate) fn stderr(output: &Output) -> &str {
    std::str::from_utf8(&output.stderr).unwrap()
}

pub(crate) fn path_of(name: &str) -> String {
    rig_path(name).to_str().unwrap().to_owned()
}
