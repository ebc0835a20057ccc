//! The header, compiled and run on this machine.

use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use super::recorded::ControllerTick;
use tempfile::TempDir;
use upright_test_support::equipment::{is_required, not_exercised};
use upright_test_support::limits::{PATIENCE, joined, output, output_of};

/// The program that replays recorded ticks.
pub(crate) const REPLAY: &str = include_str!("replay.c");

/// How the header is compiled.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Dialect<'a> {
    pub(crate) compiler: &'a str,
    pub(crate) flags: &'a [&'a str],
}

/// Whether this compiler can be started. Where compilers are required, a missing one is an error.
///
/// # Panics
/// Without it where compilers are required.
pub(crate) fn is_there(compiler: &str) -> bool {
    match Command::new(compiler).arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status() {
        Ok(_) => true,
        Err(error) if is_required("UPRIGHT_REQUIRE_GCC") => panic!("{compiler}: {error}"),
        Err(_) => {
            not_exercised(&format!("the C header: install {compiler}"));
            false
        }
    }
}

/// The header in a folder of its own, with a program that includes it.
pub(crate) struct Program {
    folder: TempDir,
}

impl Program {
    pub(crate) fn new(header: &str, program: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("controller.h"), header).unwrap();
        std::fs::write(folder.path().join("program.c"), program).unwrap();
        Self { folder }
    }

    /// Adds a file beside the header.
    pub(crate) fn add(&self, name: &str, text: &str) {
        std::fs::write(self.folder.path().join(name), text).unwrap();
    }

    pub(crate) fn path(&self) -> PathBuf {
        self.folder.path().join("program")
    }

    /// Compiles it; the compiler's output.
    pub(crate) fn compiled(&self, Dialect { compiler, flags }: Dialect<'_>) -> Output {
        let source = self.folder.path().join("program.c");
        output(Command::new(compiler).args(flags).arg(source).arg("-o").arg(self.path()))
    }

    /// The program that replays recorded ticks, compiled in this way.
    pub(crate) fn that_replays(header: &str, dialect: Dialect<'_>) -> Self {
        let program = Self::new(header, REPLAY);
        let output = program.compiled(dialect);
        assert!(output.status.success(), "{dialect:?}: {}", String::from_utf8_lossy(&output.stderr));
        program
    }

    /// What it answers to the recorded input.
    pub(crate) fn replayed(&self, input: &[Vec<u32>]) -> Vec<ControllerTick> {
        self.replayed_by(Command::new(self.path()), input)
    }

    /// The same, started by this command.
    pub(crate) fn replayed_by(&self, mut command: Command, input: &[Vec<u32>]) -> Vec<ControllerTick> {
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let bytes: Vec<u8> = input.iter().flatten().flat_map(|word| word.to_ne_bytes()).collect();
        let mut stdin = child.stdin.take().unwrap();
        let writer = std::thread::spawn(move || stdin.write_all(&bytes));
        let output = output_of(child, "the program that replays", PATIENCE);
        joined(writer, "the program reads its input").unwrap();
        let words: Vec<u32> =
            output.stdout.chunks_exact(4).map(|word| u32::from_ne_bytes(word.try_into().unwrap())).collect();
        let ticks = words.chunks_exact(words.len() / input.len());
        ticks.map(ControllerTick::of).collect()
    }
}

/// What a header answers when it is compiled in this way.
pub(crate) fn replayed(header: &str, dialect: Dialect<'_>, input: &[Vec<u32>]) -> Vec<ControllerTick> {
    Program::that_replays(header, dialect).replayed(input)
}
