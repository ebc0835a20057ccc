//! What a tick of the flashed image costs, on the virtual board.

use std::collections::BTreeMap;

use upright::boards::DEFAULT_BOARD;
use upright::table::Law;
use upright_board::{Conditions, CoreTiming, Image, Rules, SimulatedBoard};
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::{TableValues, class_source};
use upright_test_support::repository;
use upright_tool::image::{SPREAD, compiler};
use upright_tool::in_the_loop::{Span, TickCycles, measure};
use upright_trust::verify::at_rest_disturbed;

use crate::equipment::{built, built_for};
use crate::powered::sealed;
use crate::published::{rig_and_table, rig_and_table_with_motions, rig_of, rig_path, table};

/// Goals for the median of balancing: from the tick to the output, the whole task and the jitter of the output (µs).
const GOAL_LATENCY_US: f64 = 8.0;
const GOAL_TASK_US: f64 = 15.0;
const GOAL_JITTER_US: f64 = 1.0;
/// The goal for the controller alone.
const GOAL_CONTROLLER_CYCLES: u32 = 900;

/// Largest values: from the tick to the output, the whole task in any state, the difference of the latency between any
/// two ticks (µs), and the controller alone (cycles).
#[derive(Debug, Clone, Copy)]
struct Largest {
    latency_us: f64,
    task_us: f64,
    jitter_us: f64,
    controller_cycles: f64,
}

/// The largest values as measured, by the compiler: it decides what is inlined into the part of the tick that is
/// compiled for size. The longest task is that of a tick that obeys a command with the motor off. A change that makes
/// one of them a tenth larger has to say so here.
const MEASURED: [(&str, Largest); 2] = [
    (
        "rustc 1.95",
        Largest { latency_us: 20.39, task_us: 38.51, jitter_us: 13.52, controller_cycles: 1667.0 },
    ),
    (
        "rustc 1.96",
        Largest { latency_us: 20.51, task_us: 40.10, jitter_us: 13.63, controller_cycles: 1655.0 },
    ),
];

/// What was measured with the compiler of the image; with another one, only the quarter of the period counts.
fn largest() -> Option<Largest> {
    let version = compiler().unwrap().version;
    MEASURED.into_iter().find(|(begin, _)| version.starts_with(begin)).map(|(_, largest)| largest)
}

fn measured(rig: &Rig, table: &TableValues, image: &Image, timing: CoreTiming) -> TickCycles {
    let scenario =
        Scenario { duration_s: 0.5, force_noise_n: 0.1, substeps: 2, ..Scenario::at_rest(rig, Law::Lqr) };
    let conditions = Conditions { timing, ..Conditions::f405(1) };
    let cycles = measure(rig, table, &scenario, image, &conditions).unwrap();
    assert_eq!(cycles.ended, None);
    cycles
}

/// What is above its goal, or more than a tenth above `measured`.
fn beyond(cycles: &TickCycles, measured: Option<Largest>) -> Vec<&'static str> {
    let (typical, balancing) = (cycles.typical.unwrap(), cycles.balancing.unwrap());
    let is_beyond = |value: f64, of: fn(Largest) -> f64| measured.is_some_and(|most| value > 1.1 * of(most));
    let us = |span: Option<Span>| span.unwrap().us;
    let all = [
        ("goal of the latency", us(typical.latency) > GOAL_LATENCY_US),
        ("goal of the jitter", us(typical.jitter) > GOAL_JITTER_US),
        ("goal of the task", typical.whole.us > GOAL_TASK_US),
        ("goal of the controller", typical.controller.cycles > GOAL_CONTROLLER_CYCLES),
        ("latency", is_beyond(us(balancing.latency), |most| most.latency_us)),
        ("jitter", is_beyond(us(balancing.jitter), |most| most.jitter_us)),
        ("task", is_beyond(cycles.all.whole.us, |most| most.task_us)),
        ("controller", is_beyond(cycles.all.controller.cycles.into(), |most| most.controller_cycles)),
        ("quarter", cycles.check().is_err()),
    ];
    all.into_iter().filter(|(_, is_beyond)| *is_beyond).map(|(name, _)| name).collect()
}

/// The image with a delay before each tick, about 400 cycles for each of `turns`: SysTick's vector points to a loop
/// placed after the image. The loop divides, which takes many cycles but costs the host little time.
fn slower(image: &Image, turns: u8) -> Image {
    const SYS_TICK: u32 = 0x0800_0000 + 4 * 15;
    const DIVIDE: [u16; 2] = [0xfbb1, 0xf3f2]; // udiv r3, r1, r2
    let board = SimulatedBoard::power_on(image, &Conditions::f405(1), Rules::STRICT).unwrap();
    let handler = board.word(SYS_TICK).unwrap();
    let at = (0x0800_0000 + image.end() as u32).next_multiple_of(16);
    let mut half_words = vec![
        0x2000 | u16::from(turns), // movs r0, #turns
        0x2201,                    // movs r2, #1
        0xf04f,                    // mov.w r1, #0xffff_ffff
        0x31ff,
    ];
    half_words.extend(DIVIDE.repeat(32));
    half_words.extend([
        0x3801, // subs r0, #1
        0xd1bd, // bne to the first division
        0x4900, // ldr r1, the word below
        0x4708, // bx r1
    ]);
    let mut code: Vec<u8> = half_words.into_iter().flat_map(u16::to_le_bytes).collect();
    code.extend(handler.to_le_bytes());
    let vector = (at | 1).to_le_bytes().to_vec();
    sealed(image.clone().with_bytes(SYS_TICK, vector).with_bytes(at, code), image.end())
}

#[test]
fn the_ticks_of_the_image_stay_within_their_limits_and_those_of_a_slower_one_do_not() {
    let Some(elf) = built(DEFAULT_BOARD) else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let (rig, table) = rig_and_table("quadruple-paper").clone();
    let measured = |image: &Image, timing| measured(&rig, &table, image, timing);
    let (cycles, largest) = (measured(&image, CoreTiming::Quick), largest());
    println!("{cycles:#?}");
    assert_eq!(beyond(&cycles, largest), [""; 0]);
    let (off, balancing) = (cycles.off.unwrap(), cycles.balancing.unwrap());
    assert!(off.ticks > 1000 && balancing.ticks >= 500 && cycles.all.ticks == off.ticks + balancing.ticks);
    // All parts are found in the code, and make up the whole.
    let parts = |worst: upright_tool::in_the_loop::TickFigures| {
        [worst.entry, worst.inputs, worst.control, worst.output, worst.rest].map(|part| part.cycles)
    };
    assert!(parts(balancing).into_iter().all(|cycles| cycles > 10), "{balancing:?}");
    let sum: u32 = parts(balancing).into_iter().sum();
    assert!(sum >= balancing.whole.cycles && sum < 2 * balancing.whole.cycles, "{balancing:?}");
    assert!(balancing.controller.cycles > 300, "{balancing:?}");

    // Negative controls: 10 µs more, and half a period more.
    let goals = ["goal of the latency", "goal of the task"];
    let with_delay = measured(&slower(&image, 4), CoreTiming::Quick);
    assert_eq!(
        beyond(&with_delay, MEASURED.map(|(_, largest)| largest).first().copied()),
        [&goals[..], &["latency", "task"]].concat()
    );
    let error = measured(&slower(&image, 210), CoreTiming::Quick).check().unwrap_err().to_string();
    assert!(error.contains("a quarter of its period") && error.contains("period_s"), "{error}");
}

/// docs/results/board.md says so.
#[test]
fn by_the_slow_model_the_image_misses_the_goals_of_task_and_controller_and_no_other() {
    let Some(elf) = built(DEFAULT_BOARD) else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let (rig, table) = rig_and_table("quadruple-paper").clone();
    let cycles = measured(&rig, &table, &image, CoreTiming::Slow);
    println!("{cycles:#?}");
    assert_eq!(beyond(&cycles, None), ["goal of the task", "goal of the controller"]);
    // No more than a tenth above what that page says.
    let (controller, task) = (cycles.typical.unwrap().controller.cycles, cycles.typical.unwrap().whole.us);
    assert!(controller < 1130 && task < 17.0, "{controller} {task}");
}

/// The longest tick of the image for a rig (µs), as `firmware build` measures it; `None` without a compiler, and for a
/// rig that never balances.
fn longest_us(rig: &Rig, table: &TableValues, turns: Option<u8>) -> Option<f64> {
    let elf = built_for(DEFAULT_BOARD, rig, table)?;
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let image = turns.map_or_else(|| image.clone(), |turns| slower(&image, turns));
    let (law, _) = table.laws.present().next().unwrap();
    let scenario = Scenario { duration_s: 0.5, ..at_rest_disturbed(rig, law, 1) };
    let cycles = measure(rig, table, &scenario, &image, &Conditions::f405(1)).unwrap();
    assert_eq!(cycles.check(), Ok(()), "{}", rig.name);
    assert_eq!(cycles.ended.is_some(), table.observer.is_none(), "{}: {:?}", rig.name, cycles.ended);
    println!("{:40} {:7.2} µs of {:8.1} µs", rig.name, cycles.all.whole.us, cycles.period.us);
    table.observer.as_ref().map(|_| cycles.all.whole.us)
}

/// The rigs in `rigs/`, with the motions that are stored there, and rigs with what makes the tick of the first one
/// longer.
fn many_rigs() -> Vec<(Rig, TableValues)> {
    let files = std::fs::read_dir(repository().join("rigs")).unwrap().map(|file| file.unwrap().path());
    let names = files.filter(|path| path.extension().is_some_and(|end| end == "toml"));
    let mut rigs: Vec<_> = names
        .map(|path| {
            let name: &'static str = path.file_stem().unwrap().to_str().unwrap().to_owned().leak();
            let has_motions = path.with_extension("swing-up.json").exists();
            if has_motions { rig_and_table_with_motions(name).clone() } else { rig_and_table(name).clone() }
        })
        .collect();
    let file = std::fs::read_to_string(rig_path("single-quanser-ip02")).unwrap();
    let is_of_motor = |line: &&str| {
        ["torque_c", "resistance", "gear", "pulley", "supply", "dead"].iter().any(|key| line.starts_with(key))
    };
    let without_motor: String =
        file.lines().filter(|line| !is_of_motor(line)).map(|line| format!("{line}\n")).collect();
    let friction = "\n[friction]\njoint_n_m = 1e-5\ncart_n = 0.1\n";
    for (text, friction, period_s) in [
        (&file, "", "0.002"),
        (&file, friction, "0.002"),
        (&without_motor, friction, "0.002"),
        (&without_motor, friction, "0.005"),
        (&file, "", "0.001"),
    ] {
        let text = text.replace("period_s = 0.002", &format!("period_s = {period_s}"));
        let rig = rig_of(&(text + friction));
        rigs.push((rig.clone(), table(&rig)));
    }
    rigs
}

#[test]
#[ignore = "measures the ticks of every rig: minutes"]
fn ticks_of_all_rigs_with_the_same_code_are_within_the_spread_that_is_assumed() {
    let mut classes: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let is_beyond = |longest: &[f64]| {
        let [least, most] = [f64::min, f64::max].map(|of| longest.iter().copied().reduce(of).unwrap());
        println!("{} rigs share code: at most {:.3} times the shortest", longest.len(), most / least);
        most > SPREAD * least
    };
    for (rig, table) in many_rigs() {
        let Some(us) = longest_us(&rig, &table, None) else { continue };
        classes.entry(class_source(&table)).or_default().push(us);
    }
    let (single, table) = rig_and_table("single-quanser-ip02");
    let same = classes.get_mut(&class_source(table)).unwrap();
    assert!(same.len() >= 6, "{same:?}");
    same.iter().for_each(|us| assert!((20.0..40.0).contains(us), "{us}"));
    // Negative control: a rig whose ticks are 10 µs longer.
    let longer = longest_us(single, table, Some(4)).unwrap();
    assert!(is_beyond(&[same.as_slice(), &[longer]].concat()));
    classes.values().for_each(|longest| assert!(!is_beyond(longest), "{longest:?}"));
}
