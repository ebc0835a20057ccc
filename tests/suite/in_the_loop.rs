//! The whole firmware in closed loop gives the same bits three times: in a simulation of the controller alone, with
//! all tasks on the host, and as an image in QEMU.
//!
//! Without a compiler for the image, or without QEMU, the tests that need them say so and pass. If the environment
//! variable `UPRIGHT_REQUIRE_IMAGE` is set, they fail.

use std::fmt::Write;
use std::path::PathBuf;

use crate::equipment::{built, built_for, in_qemu};
use crate::published::{rig, rig_and_table, rig_path, stored_motions, table};
use upright::protocol::message::Request;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright::table::checksum::crc32;
use upright_closed_loop::harness::{Pins, Recording, Session, Target};
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, simulate};
use upright_design::table::TableValues;
use upright_plan::{Route, StoredTransitions, hangs, up_and_down, with_motions};
use upright_tool::image::ImageKind;
use upright_tool::in_the_loop::{PinLink, RunError, RunPlace, run};

/// Upper bound on the instructions in a tick of the image, with telemetry in every tick: 10 % above the count with
/// Rust 1.96.
const MOST_INSTRUCTIONS: u32 = 3850;

fn quadruple() -> (Rig, TableValues) {
    rig_and_table("quadruple-paper").clone()
}

/// A rig and its table with the stored raising and lowering, and with these of its other stored motions.
fn with_stored_motions(name: &'static str, others: &[&str]) -> (Rig, TableValues) {
    let rig = rig(name);
    let mut transitions = if others.is_empty() {
        Vec::new()
    } else {
        StoredTransitions::beside(&rig_path(name)).unwrap().transitions(&rig).unwrap()
    };
    transitions.retain(|(transition, _)| others.contains(&transition.name(rig.links()).as_str()));
    let table = with_motions(&rig, table(&rig), stored_motions(name), &transitions).unwrap();
    (rig, table)
}

/// Step and tilt with each law, with or without disturbances.
pub(crate) fn scenarios(rig: &Rig, disturbed: bool) -> Vec<(String, Scenario)> {
    let mut scenarios = Vec::new();
    for (name, law) in Law::ALL.map(|law| (law.option(), law)) {
        let mut rest = Scenario { duration_s: 1.0, counter_start: 65_000, ..Scenario::at_rest(rig, law) };
        if disturbed {
            rest = Scenario { force_noise_n: 0.1, torque_noise_n_m: 3e-5, seed: 7, ..rest };
        }
        let step = Scenario { step_m: 0.3, step_at_s: 0.1, ..rest.clone() };
        let mut tilt = rest;
        tilt.start[2] = 0.004;
        scenarios.extend([(format!("{name}-step"), step), (format!("{name}-tilt"), tilt)]);
    }
    scenarios
}

/// The image, if its compiler and QEMU are both installed.
fn image(kind: ImageKind) -> Option<PathBuf> {
    in_qemu(built(kind))
}

fn forces_and_estimates(recording: &Recording) -> Vec<(f64, f64, Vec<f64>)> {
    recording.trace.samples().map(|s| (s.requested, s.force, s.estimate.to_vec())).collect()
}

#[test]
fn all_tasks_together_give_the_bits_of_the_controller_alone() {
    let (rig, table) = quadruple();
    for (name, scenario) in scenarios(&rig, true) {
        let (alone, summary) = simulate(&rig, &table, &scenario).unwrap();
        let together = run(&rig, &table, &scenario, RunPlace::Host).unwrap();
        assert_eq!((together.fault, &together.summary), (None, &summary), "{name}");
        let alone = alone.samples().map(|s| (s.requested, s.force, s.estimate.to_vec()));
        assert!(alone.eq(forces_and_estimates(&together)), "{name}");
    }
}

#[test]
fn the_image_in_qemu_gives_the_bits_of_the_host_and_of_its_last_run() {
    let Some(image) = image(ImageKind::InTheLoop) else { return };
    let (rig, table) = quadruple();
    let place = RunPlace::Qemu { image: &image, link: PinLink::Files };
    for (name, scenario) in scenarios(&rig, true) {
        let qemu = run(&rig, &table, &scenario, place).unwrap();
        let host = run(&rig, &table, &scenario, RunPlace::Host).unwrap();
        assert!(qemu.ticks == host.ticks, "{name}");
        assert!(qemu.summary.survives(), "{name}: {:?}", qemu.fault);
        let again = run(&rig, &table, &scenario, place).unwrap();
        assert_eq!((&qemu.ticks, qemu.worst_cycles), (&again.ticks, again.worst_cycles), "{name}");
        // Negative control: the comparison sees another seed.
        let other = Scenario { seed: 8, ..scenario };
        assert!(run(&rig, &table, &other, RunPlace::Host).unwrap().ticks != host.ticks, "{name}");
    }
}

#[test]
fn the_image_in_qemu_raises_and_lowers_the_links_with_the_bits_of_the_host() {
    let (rig, table) = with_stored_motions("single-quanser-ip02", &[]);
    let Some(image) = in_qemu(built_for(ImageKind::InTheLoop, &rig, &table)) else { return };
    let scenario = up_and_down(&rig, &table, 0.5).unwrap();
    let qemu = run(&rig, &table, &scenario, RunPlace::Qemu { image: &image, link: PinLink::Files }).unwrap();
    println!("{} instructions in the longest tick", qemu.worst_cycles);
    assert!(hangs(&qemu), "{:?}", qemu.fault);
    assert!(qemu.ticks == run(&rig, &table, &scenario, RunPlace::Host).unwrap().ticks);
    // Negative control: the comparison sees another seed.
    let other = Scenario { seed: 8, ..scenario };
    assert!(run(&rig, &table, &other, RunPlace::Host).unwrap().ticks != qemu.ticks);
}

#[test]
fn the_image_in_qemu_goes_from_equilibrium_to_equilibrium_with_the_bits_of_the_host() {
    let (rig, table) = with_stored_motions("double-quanser-dbpen", &["uu-ud", "ud-dd"]);
    let Some(image) = in_qemu(built_for(ImageKind::InTheLoop, &rig, &table)) else { return };
    // Up, on to the equilibrium at which the second link hangs, and down.
    let route = Route::of(&rig, &table).unwrap();
    let mut scenario = route.scenario(&rig, 7);
    scenario.goals.truncate(2);
    scenario.duration_s = route.begin_s[3] - 7.0;
    let qemu = run(&rig, &table, &scenario, RunPlace::Qemu { image: &image, link: PinLink::Files }).unwrap();
    let mut states: Vec<State> = qemu.ticks.iter().map(|tick| tick.state).collect();
    states.dedup();
    let [raising, balancing, holding] = [State::Raising, State::Balancing, State::Holding];
    let wanted = [raising, balancing, raising, holding, State::Lowering, State::Calibrated];
    assert_eq!(states, wanted, "{:?}", qemu.fault);
    assert!(qemu.ticks == run(&rig, &table, &scenario, RunPlace::Host).unwrap().ticks);
    // Negative control: the comparison sees another seed.
    scenario.seed = 8;
    assert!(run(&rig, &table, &scenario, RunPlace::Host).unwrap().ticks != qemu.ticks);
}

/// State and encoder counts in all telemetry of a rig whose links swing out about positions that are `off` counts from
/// 0, while homing is requested every 500 ticks.
fn homed_swinging(table: &TableValues, off: f64, place: RunPlace<'_>) -> Vec<(State, Vec<i32>)> {
    let run = |target: &mut dyn Target| -> Result<_, RunError> {
        let (mut session, mut seen) = (Session::new(target), Vec::new());
        for tick in 0..11_000_u32 {
            let t = f64::from(tick) * f64::from(table.tick_s);
            let joint = |rate: f64| (off + 80.0 * (-0.2 * t).exp() * (rate * t).cos()).round() as i32 as u32;
            let counts =
                [0.0, 9.0, 11.0, 17.0, 23.0].map(|rate| if rate == 0.0 { 0 } else { joint(rate) & 0xffff });
            let raw_counts = heapless::Vec::from_slice(&counts).unwrap();
            let contacts = Default::default();
            let received = heapless::Vec::new();
            if tick.is_multiple_of(500) {
                session.send(Request::Home);
            }
            session.tick(&Pins { raw_counts, supply_v: 12.0, contacts, received, injected_fault: None })?;
            seen.extend(
                std::iter::from_fn(|| session.next_telemetry()).map(|at| (at.state, at.counts.to_vec())),
            );
        }
        Ok(seen)
    };
    place.with_target(table, run).unwrap()
}

#[test]
fn swinging_links_are_homed_in_qemu_with_the_bits_of_the_host() {
    let Some(image) = image(ImageKind::InTheLoop) else { return };
    let (_, table) = quadruple();
    let host = homed_swinging(&table, 3.4, RunPlace::Host);
    assert!(homed_swinging(&table, 3.4, RunPlace::Qemu { image: &image, link: PinLink::Files }) == host);
    let homed = |seen: &[(State, Vec<i32>)]| {
        let first = seen.windows(2).find(|pair| pair[1].0 == State::Calibrated)?;
        Some(first[1].1[2] - first[0].1[2])
    };
    // Links 2 to 4 were 3.4 counts off; in between, they move by a count or two.
    assert!(homed(&host).is_some_and(|moved| (-5..=-1).contains(&moved)), "{:?}", homed(&host));
    // Negative control: the comparison notices other counts.
    assert!(homed_swinging(&table, 3.6, RunPlace::Host) != host);
}

/// On the rig with the fewest bytes per second, because QEMU takes long for each byte on these lines: at a load of 20,
/// 0.3 s of balancing took 10 minutes.
#[test]
fn the_image_runs_with_serial_lines_too() {
    let (rig, table) = rig_and_table("single-quanser-ip02").clone();
    let Some(image) = in_qemu(built_for(ImageKind::InTheLoopUsart, &rig, &table)) else { return };
    let (_, scenario) = scenarios(&rig, true).remove(0);
    let scenario = Scenario { duration_s: 0.05, ..scenario };
    let qemu = run(&rig, &table, &scenario, RunPlace::Qemu { image: &image, link: PinLink::Usart }).unwrap();
    assert!(qemu.ticks == run(&rig, &table, &scenario, RunPlace::Host).unwrap().ticks);
}

#[test]
fn a_tick_of_the_image_takes_no_more_instructions_than_it_used_to() {
    let Some(image) = image(ImageKind::InTheLoop) else { return };
    let (rig, table) = quadruple();
    let place = RunPlace::Qemu { image: &image, link: PinLink::Files };
    let (_, scenario) = scenarios(&rig, true).remove(0);
    let worst = run(&rig, &table, &scenario, place).unwrap().worst_cycles;
    println!("{worst} instructions in the longest tick");
    assert!((500..=MOST_INSTRUCTIONS).contains(&worst), "{worst}");
}

/// Per tick: number, applied force (f32 bits), checksum of all bits that the firmware reports.
fn golden(recording: &Recording) -> String {
    let mut text = String::from("tick,force_bits,checksum\n");
    for (number, tick) in recording.ticks.iter().enumerate() {
        let checksum = tick.bits.iter().fold(0, |crc, bits| crc32(crc, &bits.to_le_bytes()));
        let force = tick.bits.last().unwrap();
        writeln!(text, "{number},{force:08x},{checksum:08x}").unwrap();
    }
    text
}

/// The committed traces. With UPRIGHT_BLESS=1 in the environment, this writes them again.
#[test]
fn the_runs_are_those_of_the_committed_traces() {
    let (rig, table) = quadruple();
    let image = image(ImageKind::InTheLoop);
    for (name, scenario) in scenarios(&rig, false) {
        let scenario = Scenario { duration_s: 0.5, ..scenario };
        let path = upright_test_support::repository().join(format!("tests/golden/{name}.csv"));
        let host = golden(&run(&rig, &table, &scenario, RunPlace::Host).unwrap());
        if std::env::var_os("UPRIGHT_BLESS").is_some() {
            std::fs::write(&path, &host).unwrap();
        }
        let committed = std::fs::read_to_string(&path).unwrap();
        assert!(host == committed, "{} differs on the host", path.display());
        if let Some(image) = &image {
            let place = RunPlace::Qemu { image, link: PinLink::Files };
            assert!(golden(&run(&rig, &table, &scenario, place).unwrap()) == committed, "{name} in QEMU");
        }
    }
}
