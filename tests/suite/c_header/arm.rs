//! The header on four Cortex-M processors, in QEMU.

use std::process::{Command, Stdio};

use super::program::{Dialect, Program, REPLAY, is_there};
use super::recorded::{FirmwareRun, recorded, scenario};
use super::{differing, first_difference};
use crate::published::rig_and_table;
use upright::table::Law;
use upright_design::export::c_header;
use upright_test_support::equipment::{is_required, not_exercised};
use upright_test_support::limits::output;

/// A machine of QEMU, and the compiler's flags for its processor. With the last one, gcc fuses products into sums
/// wherever a header does not forbid it.
struct Machine {
    name: &'static str,
    flags: &'static [&'static str],
}

const M4: Machine = Machine {
    name: "mps2-an386",
    flags: &["-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-O3", "-ffp-contract=fast"],
};
/// The same, with the floating-point unit set to take small numbers as 0.
const FLUSHING: Machine = Machine {
    name: "mps2-an386",
    flags: &["-mcpu=cortex-m4", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-O2", "-DFLUSH_SUBNORMALS"],
};
const MACHINES: [Machine; 4] = [
    Machine { name: "microbit", flags: &["-mcpu=cortex-m0", "-Os"] },
    Machine { name: "mps2-an385", flags: &["-mcpu=cortex-m3", "-O2"] },
    M4,
    Machine {
        name: "mps2-an500",
        flags: &["-mcpu=cortex-m7", "-mfpu=fpv5-sp-d16", "-mfloat-abi=hard", "-O3", "-ffp-contract=fast"],
    },
];

/// Whether compiler and emulator can be started.
pub(crate) fn can_run() -> bool {
    let has_library = || {
        let file = output(Command::new("arm-none-eabi-gcc").arg("-print-file-name=rdimon.specs"));
        let is_there = String::from_utf8_lossy(&file.stdout).contains('/');
        assert!(is_there || !is_required("UPRIGHT_REQUIRE_GCC"), "install libnewlib-arm-none-eabi");
        if !is_there {
            not_exercised("the C header on a Cortex-M: install libnewlib-arm-none-eabi");
        }
        is_there
    };
    is_there("arm-none-eabi-gcc") && has_library() && is_there("qemu-system-arm")
}

/// Number of ticks in which the header differs from the firmware on this machine, and the first of them.
fn differing_on(machine: &Machine, header: &str, run: &FirmwareRun) -> (usize, String) {
    let program = Program::new(header, REPLAY);
    program.add("startup.c", include_str!("cortex_m.c"));
    program.add("memory.ld", include_str!("cortex_m.ld"));
    let path = |name: &str| program.path().with_file_name(name).to_str().unwrap().to_owned();
    let mut flags: Vec<&str> = machine.flags.to_vec();
    let (startup, memory) = (path("startup.c"), path("memory.ld"));
    flags.extend(["-mthumb", "--specs=rdimon.specs", "-T", &memory, &startup]);
    let output = program.compiled(Dialect { compiler: "arm-none-eabi-gcc", flags: &flags });
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut qemu = Command::new("qemu-system-arm");
    qemu.args(["-M", machine.name, "-nographic", "-monitor", "none", "-serial", "none", "-kernel"]);
    qemu.arg(program.path()).args(["-semihosting-config", "enable=on,target=native"]).stderr(Stdio::null());
    let answers = program.replayed_by(qemu, &run.input);
    (differing(run, &answers), first_difference(run, &answers))
}

#[test]
fn four_cortex_m_have_the_bits_of_the_firmware_although_two_of_them_may_fuse() {
    if !can_run() {
        return;
    }
    for (name, ticks) in [("single-quanser-ip02", 10_000), ("quadruple-paper", 2000)] {
        let (rig, table) = rig_and_table(name);
        let header = c_header(rig, table).unwrap();
        let run = recorded(rig, table, &scenario(rig, Law::Lqr, ticks), None);
        for machine in &MACHINES {
            let (different, first) = differing_on(machine, &header, &run);
            assert_eq!(different, 0, "{name} {} {first}", machine.name);
        }
    }
}

#[test]
fn fused_products_and_flushed_subnormals_on_a_cortex_m4_are_noticed() {
    if !can_run() {
        return;
    }
    let (rig, table) = rig_and_table("quadruple-paper");
    let run = recorded(rig, table, &scenario(rig, Law::Lqr, 1000), None);
    let header = c_header(rig, table).unwrap();
    let undefended = header.replace("#pragma GCC optimize", "//");
    // Refused from the first tick on.
    assert_eq!(differing_on(&M4, &undefended, &run).0, run.wanted.len());
    assert_eq!(differing_on(&FLUSHING, &header, &run).0, run.wanted.len());
    let unchecked = undefended.replace("!upright_arithmetic_is_exact()", "false");
    assert!(differing_on(&M4, &unchecked, &run).0 > 900);
}
