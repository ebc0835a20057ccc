//! The replaying image on each instruction set, and the machine of QEMU on which it runs.

use std::path::{Path, PathBuf};
use std::process::Command;

use super::recorded::Replay;
use crate::published::rig_and_table_with_motions;
use upright_design::table::gains_source;
use upright_test_support::limits::output;
use upright_test_support::repository;
use upright_tool::image::{BuildError, Compiler, PROFILE, compiler_for_chips};

/// An instruction set, and a machine of QEMU that has it.
pub(super) struct Machine {
    pub(super) target: &'static str,
    /// The machine.
    pub(super) name: &'static str,
    options: &'static [&'static str],
    /// It has no atomic instructions: the image has the feature `single-core`.
    is_without_atomics: bool,
    /// Nanoseconds per count of the image's clock. An instruction takes [`INSTRUCTION_NS`].
    clock_ns: f64,
}

/// One instruction takes 2⁶ ns of the emulator's time.
const INSTRUCTION_NS: f64 = 64.0;

const fn arm(target: &'static str, name: &'static str, clock_ns: f64) -> Machine {
    Machine { target, name, options: &[], is_without_atomics: false, clock_ns }
}

impl Machine {
    /// The program that emulates it.
    pub(super) fn emulator(&self) -> &'static str {
        if self.name == "virt" { "qemu-system-riscv32" } else { "qemu-system-arm" }
    }
}

pub(super) static MACHINES: [Machine; 6] = [
    arm("thumbv6m-none-eabi", "microbit", 62.5),
    arm("thumbv7m-none-eabi", "mps2-an385", 40.0),
    arm("thumbv7em-none-eabihf", "mps2-an386", 40.0),
    arm("thumbv8m.main-none-eabihf", "mps2-an505", 50.0),
    Machine {
        target: "riscv32imac-unknown-none-elf",
        name: "virt",
        options: &["-bios", "none", "-cpu", "rv32,f=off,d=off"],
        is_without_atomics: false,
        clock_ns: 1.0,
    },
    Machine {
        target: "riscv32imc-unknown-none-elf",
        name: "virt",
        options: &["-bios", "none", "-cpu", "rv32,a=off,f=off,d=off"],
        is_without_atomics: true,
        clock_ns: 1.0,
    },
];

/// The rig with one link, not the one with four: a bit of the first byte that the image reads.
pub(super) const SINGLE: u8 = 1;
/// Subnormals become 0: another bit of it.
pub(super) const FLUSHED: u8 = 2;

/// A built image.
pub(super) struct Image {
    pub(super) machine: &'static Machine,
    path: PathBuf,
    _folder: tempfile::TempDir,
}

/// What an image has done.
pub(super) struct Replayed {
    /// Its outputs, and all that it has sent.
    pub(super) sent: Vec<u8>,
    /// Mean and largest number of instructions in a tick with the motor on.
    pub(super) mean: f64,
    pub(super) most: f64,
}

/// The images for these machines. One call of cargo builds those with the same features.
pub(super) fn images(machines: &'static [Machine]) -> Result<Vec<Image>, BuildError> {
    let (without_atomics, others): (Vec<_>, Vec<_>) =
        machines.iter().partition(|machine| machine.is_without_atomics);
    let mut images = Vec::new();
    for (machines, features) in [(others, &[][..]), (without_atomics, &["--features", "single-core"])] {
        if !machines.is_empty() {
            let target_directory = compile("build", &machines, features)?;
            images.extend(machines.iter().map(|machine| Image::copied(machine, &target_directory)));
        }
    }
    Ok(images)
}

/// Calls cargo; returns the directory into which it builds.
fn compile(subcommand: &str, machines: &[&Machine], arguments: &[&str]) -> Result<PathBuf, BuildError> {
    let targets: Vec<&str> = machines.iter().map(|machine| machine.target).collect();
    let Compiler { mut cargo, target_directory, .. } = compiler_for_chips(&targets)?;
    for (variable, rig) in
        [("UPRIGHT_QUADRUPLE", "quadruple-paper"), ("UPRIGHT_SINGLE", "single-quanser-ip02")]
    {
        let (rig, table) = rig_and_table_with_motions(rig);
        let source = gains_source(rig, table);
        let path = target_directory.join(variable).with_extension("rs");
        if std::fs::read_to_string(&path).ok().as_ref() != Some(&source) {
            std::fs::create_dir_all(&target_directory).unwrap();
            std::fs::write(&path, source).unwrap();
        }
        cargo.env(variable, path);
    }
    // Outside the repository: its settings are for the images of boards.
    cargo.current_dir(std::env::temp_dir()).args([subcommand, "--quiet", "--locked", "--profile", PROFILE]);
    cargo.arg("--manifest-path").arg(repository().join("boards/replay/Cargo.toml"));
    cargo.args(targets.iter().flat_map(|target| ["--target", target])).args(arguments);
    let output = output(&mut cargo);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Ok(target_directory)
}

impl Image {
    /// A copy of what was built for a machine.
    fn copied(machine: &'static Machine, target_directory: &Path) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("image");
        let built = target_directory.join(machine.target).join(PROFILE).join("upright-replay");
        std::fs::copy(&built, &path).unwrap_or_else(|error| panic!("{}: {error}", built.display()));
        Self { machine, path, _folder: folder }
    }

    /// The image in which the compiler may fuse products and sums. It does so when it generates code, which is with the
    /// last crate.
    pub(super) fn fused(machine: &'static Machine) -> Result<Self, BuildError> {
        let fuse = ["--", "-C", "llvm-args=-fp-contract=fast"];
        let target_directory = compile("rustc", &[machine], &fuse)?;
        Ok(Self::copied(machine, &target_directory))
    }

    /// Runs the image with the recorded pins; `selection` adds bits to the first byte.
    pub(super) fn replay(&self, replay: &Replay, selection: u8) -> Replayed {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        let input = [&[replay.selection | selection], replay.input.as_slice()].concat();
        std::fs::write(file("replay.in"), input).unwrap();
        let mut qemu = Command::new(self.machine.emulator());
        qemu.args(["-M", self.machine.name, "-nographic", "-monitor", "none", "-serial", "none"]);
        qemu.args(self.machine.options).args(["-icount", "shift=6,sleep=off"]);
        qemu.args(["-semihosting-config", "enable=on,target=native", "-kernel"]).arg(&self.path);
        let output = output(qemu.current_dir(folder.path()));
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{} on {}: {said}", replay.name, self.machine.target);
        self.replayed(std::fs::read(file("replay.out")).unwrap())
    }

    /// Takes what the image spent from the end of its bytes.
    fn replayed(&self, mut sent: Vec<u8>) -> Replayed {
        let spent = sent.split_off(sent.len() - 16);
        let word = |at: usize| u32::from_le_bytes(spent[at..at + 4].try_into().unwrap());
        let sum = u64::from_le_bytes(spent[4..12].try_into().unwrap()) as f64;
        let instructions = |clocks: f64| clocks * self.machine.clock_ns / INSTRUCTION_NS;
        let (mean, most) = (instructions(sum / f64::from(word(0))), instructions(word(12).into()));
        Replayed { sent, mean, most }
    }
}
