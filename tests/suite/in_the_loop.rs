//! The whole firmware in closed loop gives the same bits three times: in a simulation of the controller alone, with
//! all tasks on the host, and as the flashed image on the virtual board.
//!
//! Without a compiler for the image, the tests that need it say so and pass. If the environment variable
//! `UPRIGHT_REQUIRE_IMAGE` is set, they fail.

use std::fmt::Write;

use crate::equipment::built_for;
use crate::published::{rig, rig_and_table, rig_path, stored_motions, table};
use upright::boards::DEFAULT_BOARD;
use upright::protocol::message::Request;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright::table::checksum::crc32;
use upright_board::Image;
use upright_closed_loop::harness::{HarnessError, Pins, Recording, Session, Target, with_firmware};
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, simulate};
use upright_design::table::TableValues;
use upright_plan::{Route, StoredTransitions, with_motions};
use upright_tool::image::conditions;
use upright_tool::in_the_loop::{Compared, RunPlace, VirtualBoard, run, run_compared};

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

/// The image with this table, if its compiler is installed.
fn image(rig: &Rig, table: &TableValues) -> Option<Image> {
    let elf = built_for(DEFAULT_BOARD, rig, table)?;
    Some(Image::from_elf(&std::fs::read(elf).unwrap()).unwrap())
}

fn powered_on(image: &Image, table: &TableValues) -> VirtualBoard {
    VirtualBoard::start(image, &conditions(DEFAULT_BOARD, 1).unwrap(), table).unwrap()
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
fn the_flashed_image_gives_the_bits_of_the_host_and_of_its_last_run() {
    let (rig, table) = quadruple();
    let Some(image) = image(&rig, &table) else { return };
    let run = |scenario: &Scenario| {
        run_compared(&rig, &table, scenario, &mut powered_on(&image, &table)).unwrap().0
    };
    for (name, scenario) in scenarios(&rig, true) {
        let on_board = run(&scenario);
        assert!(on_board.summary.survives(), "{name}: {:?}", on_board.fault);
        if name == "lqr-step" {
            let is_same = |other: Recording| {
                (&other.ticks, other.worst_cycles) == (&on_board.ticks, on_board.worst_cycles)
            };
            assert!(is_same(run(&scenario)), "{name}");
            // Negative control: the comparison sees another seed.
            assert!(!is_same(run(&Scenario { seed: 8, ..scenario })), "{name}");
        }
    }
}

#[test]
fn the_flashed_image_goes_from_equilibrium_to_equilibrium_with_the_bits_of_the_host() {
    let (rig, table) = with_stored_motions("double-quanser-dbpen", &["uu-ud", "ud-dd"]);
    let Some(image) = image(&rig, &table) else { return };
    // Up, on to the equilibrium at which the second link hangs, and down.
    let route = Route::of(&rig, &table).unwrap();
    let mut scenario = route.scenario(&rig, 7);
    scenario.goals.truncate(2);
    scenario.duration_s = route.begin_s[3] - 7.0;
    let on_board = run_compared(&rig, &table, &scenario, &mut powered_on(&image, &table)).unwrap().0;
    let mut states: Vec<State> = on_board.ticks.iter().map(|tick| tick.state).collect();
    states.dedup();
    let [raising, balancing, holding] = [State::Raising, State::Balancing, State::Holding];
    let wanted = [raising, balancing, raising, holding, State::Lowering, State::Calibrated];
    assert_eq!(states, wanted, "{:?}", on_board.fault);
}

/// State and encoder counts in all telemetry of a rig whose links swing out about positions that are `off` counts from
/// 0, while homing is requested every 500 ticks.
fn homed_swinging(table: &TableValues, off: f64, target: &mut dyn Target) -> Vec<(State, Vec<i32>)> {
    let run = |target: &mut dyn Target| -> Result<_, HarnessError> {
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
    run(target).unwrap()
}

#[test]
fn swinging_links_are_homed_on_the_board_with_the_bits_of_the_host() {
    let (rig, table) = quadruple();
    let homed = |seen: &[(State, Vec<i32>)]| {
        let first = seen.windows(2).find(|pair| pair[1].0 == State::Calibrated)?;
        Some(first[1].1[2] - first[0].1[2])
    };
    let on_host = |off| with_firmware(&table, |host| homed_swinging(&table, off, host)).unwrap();
    let host = on_host(3.4);
    // Links 2 to 4 were 3.4 counts off; in between, they move by a count or two.
    assert!(homed(&host).is_some_and(|moved| (-5..=-1).contains(&moved)), "{:?}", homed(&host));
    // Negative control: other counts are homed otherwise.
    assert!(on_host(3.6) != host);
    let Some(image) = image(&rig, &table) else { return };
    let mut board = powered_on(&image, &table);
    let on_board =
        with_firmware(&table, |host| homed_swinging(&table, 3.4, &mut Compared::new(&mut board, host)));
    assert!(on_board.unwrap().iter().any(|(state, _)| *state == State::Calibrated));
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
    for (name, scenario) in scenarios(&rig, false) {
        let scenario = Scenario { duration_s: 0.5, ..scenario };
        let path = upright_test_support::repository().join(format!("tests/golden/{name}.csv"));
        let host = golden(&run(&rig, &table, &scenario, RunPlace::Host).unwrap());
        if std::env::var_os("UPRIGHT_BLESS").is_some() {
            std::fs::write(&path, &host).unwrap();
        }
        let committed = std::fs::read_to_string(&path).unwrap();
        assert!(host == committed, "{} differs on the host", path.display());
    }
}
