//! The whole firmware as a static library, in the program of `boards/c-library/example/`: on a Cortex-M4 in QEMU it
//! homes, checks signs, arms and balances with the outputs and the telemetry of the host.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::c_header::can_run_on_cortex_m;
use crate::equipment::{build_crate, if_possible};
use crate::pico::recorded::{Recorded, recorded};
use crate::published::rig_and_table;
use upright::protocol::simulated_pins::BAD_SAMPLE;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_closed_loop::harness::Pins;
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;
use upright_test_support::limits::output;
use upright_test_support::repository;

fn folder() -> PathBuf {
    repository().join("boards/c-library")
}

/// Compiles the example for this number of sensors, and links it with the library.
fn link(library: &Path, sensors: usize, tick_s: f64, program: &Path) {
    let tests = repository().join("tests/suite");
    let mut gcc = Command::new("arm-none-eabi-gcc");
    gcc.args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-Os", "-mthumb", "-mcpu=cortex-m4"]);
    gcc.args(["-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "--specs=rdimon.specs"]);
    gcc.args([format!("-DUPRIGHT_SENSORS={sensors}"), format!("-DTICK_S={tick_s:e}f")]);
    gcc.arg("-I").arg(folder().join("include")).arg(folder().join("example/main.c"));
    gcc.arg(tests.join("c_header/cortex_m.c")).arg("-T").arg(tests.join("c_library/memory.ld"));
    // The library has more of Rust's functions than the program needs.
    gcc.arg(library).arg("-Wl,--gc-sections").arg("-o").arg(program);
    let output = output(&mut gcc);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// A recorded run as the example reads it.
fn wires(run: &Recorded) -> Vec<u8> {
    let (mut wires, mut counts, mut last) = (Vec::new(), Vec::new(), Vec::new());
    for pins in &run.pins {
        if last.is_empty() {
            (counts, last) = (pins.raw_counts.to_vec(), pins.raw_counts.to_vec());
        }
        for (place, (&now, before)) in pins.raw_counts.iter().zip(&mut last).enumerate() {
            // The host's counters of links have 16 bits, the program's have 32.
            let moved = now.wrapping_sub(*before);
            let moved = if place == 0 { moved } else { i32::from(moved as u16 as i16) as u32 };
            counts[place] = counts[place].wrapping_add(moved);
            *before = now;
            wires.extend(counts[place].to_le_bytes());
        }
        wires.extend(pins.supply_v.to_le_bytes());
        let contacts = pins.contacts;
        let flags = [contacts.limit_low, contacts.limit_high, contacts.emergency_stop, contacts.driver_fault];
        wires.extend(flags.map(u8::from));
        wires.extend([contacts.overrun, contacts.clock_fault, contacts.board_fault].map(u8::from));
        let bad = pins
            .raw_counts
            .iter()
            .zip(0..)
            .map(|(count, sensor)| u8::from(count & BAD_SAMPLE != 0) << sensor);
        // The cart's counter has 32 bits.
        wires.push(bad.skip(1).sum());
        wires.push(pins.received.len() as u8);
        wires.extend(&pins.received);
    }
    wires
}

/// What the example writes after a tick.
struct Answer {
    duty: f32,
    enable: bool,
    sent: Vec<u8>,
}

/// Runs the program in QEMU; its exit status, and what it has written.
fn run(program: &Path, wires: &[u8]) -> (Option<i32>, Vec<Answer>) {
    let folder = program.parent().unwrap();
    std::fs::write(folder.join("wires.in"), wires).unwrap();
    let mut qemu = Command::new("qemu-system-arm");
    qemu.args(["-M", "mps2-an386", "-nographic", "-monitor", "none", "-serial", "none", "-kernel"]);
    qemu.arg(program).args(["-semihosting-config", "enable=on,target=native"]);
    let status = output(qemu.current_dir(folder)).status.code();
    let bytes = std::fs::read(folder.join("wires.out")).unwrap_or_default();
    let (mut rest, mut answers) = (bytes.as_slice(), Vec::new());
    while let Some((head, after)) = rest.split_at_checked(14) {
        let word = |at: usize| <[u8; 4]>::try_from(&head[at..at + 4]).unwrap();
        let length = u16::from_le_bytes([head[12], head[13]]).into();
        let (sent, next) = after.split_at(length);
        answers.push(Answer { duty: f32::from_le_bytes(word(0)), enable: head[8] != 0, sent: sent.to_vec() });
        rest = next;
    }
    (status, answers)
}

/// The first tick in which the program does something else than the host; `None` if it never does.
fn first_difference(run: &Recorded, answers: &[Answer]) -> Option<usize> {
    let outputs = run.outputs.iter().zip(answers).position(|(output, answer)| {
        (output.duty.to_bits(), output.enable) != (answer.duty.to_bits(), answer.enable)
    });
    let sent: Vec<u8> = answers.iter().flat_map(|answer| answer.sent.iter().copied()).collect();
    // The host collects what the last tick sends in the next one.
    let is_equal = sent.starts_with(&run.sent.concat()) && answers.len() == run.outputs.len();
    outputs.or((!is_equal).then_some(run.outputs.len()))
}

/// A run whose link has bad samples from its 100th tick of balancing on.
fn recorded_with(rig: &Rig, table: &TableValues, scenario: &Scenario) -> Recorded {
    recorded(
        rig,
        table,
        scenario,
        Some((State::Balancing, 100, |pins: &mut Pins| pins.raw_counts[1] ^= BAD_SAMPLE)),
    )
}

#[test]
#[ignore = "builds the library for a microcontroller"]
fn a_program_in_c_homes_checks_signs_arms_and_balances_as_the_host_does() {
    let (rig, table) = rig_and_table("single-quanser-ip02");
    let temporary = tempfile::tempdir().unwrap();
    let file = |name: &str| temporary.path().join(name);
    if !can_run_on_cortex_m() {
        return;
    }
    let what = "the firmware as a library for C";
    let Some(built) = if_possible(build_crate("c-library", rig, table), what) else { return };
    let library = built.join("libupright_c.a");
    let scenario = Scenario { duration_s: 0.5, ..Scenario::at_rest(rig, Law::Lqr) };
    let run_of_host = recorded(rig, table, &scenario, None::<(State, usize, fn(&mut Pins))>);
    let balances = |pins: usize| run_of_host.outputs[pins].enable;
    assert!((0..run_of_host.pins.len()).filter(|&tick| balances(tick)).count() > 250);
    link(&library, table.sensors(), rig.tick.period_s, &file("program"));
    let recorded = wires(&run_of_host);
    let (status, answers) = run(&file("program"), &recorded);
    assert_eq!(status, Some(0));
    assert_eq!(first_difference(&run_of_host, &answers), None, "first different tick");
    println!("{} ticks in C, {} bytes sent", answers.len(), run_of_host.sent.concat().len());

    // Bad samples of the link are the fault of its encoder, on both.
    let bad = recorded_with(rig, table, &scenario);
    let (_, answers) = run(&file("program"), &wires(&bad));
    assert_eq!(first_difference(&bad, &answers), None, "first different tick with bad samples");
    assert!(!answers.last().unwrap().enable && run_of_host.outputs.last().unwrap().enable);

    // Negative controls: another count is noticed; another number of encoders, and another tick, are refused.
    let mut changed = recorded;
    let middle = changed.len() / 2;
    changed[middle..].iter_mut().for_each(|byte| *byte ^= 1);
    let (_, answers) = run(&file("program"), &changed);
    assert!(first_difference(&run_of_host, &answers).is_some());
    link(&library, table.sensors() + 1, rig.tick.period_s, &file("program"));
    assert_eq!(run(&file("program"), &wires(&run_of_host)).0, Some(1));
    link(&library, table.sensors(), 2.0 * rig.tick.period_s, &file("program"));
    let (_, answers) = run(&file("program"), &wires(&run_of_host));
    assert!(answers.iter().all(|answer| !answer.enable));
}
