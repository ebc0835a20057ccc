//! What a tick of the flashed image costs, on the virtual board.

use upright::table::Law;
use upright_board::{Conditions, Image, Rules, SimulatedBoard};
use upright_design::rig::Rig;
use upright_design::simulate::Scenario;
use upright_design::table::TableValues;
use upright_tool::image::{BoardName, ImageKind};
use upright_tool::in_the_loop::{Span, TickCycles, measure};

use crate::equipment::built;
use crate::published::rig_and_table;

/// Goals for the median of balancing: from the tick to the output, the whole task and the jitter of the output (µs).
const GOAL_LATENCY_US: f64 = 8.0;
const GOAL_TASK_US: f64 = 15.0;
const GOAL_JITTER_US: f64 = 1.0;
/// The goal for the controller alone.
const GOAL_CONTROLLER_CYCLES: u32 = 900;

/// Limits of the largest values, 10 % above those measured with Rust 1.96: from the tick to the output, the whole task
/// in any state, the difference of the latency between any two ticks (µs), and the controller alone.
const LATENCY_US: f64 = 24.6;
const TASK_US: f64 = 31.5;
const JITTER_US: f64 = 15.8;
const CONTROLLER_CYCLES: u32 = 2_230;

fn measured(rig: &Rig, table: &TableValues, image: &Image) -> TickCycles {
    let scenario =
        Scenario { duration_s: 0.5, force_noise_n: 0.1, substeps: 2, ..Scenario::at_rest(rig, Law::Lqr) };
    let cycles = measure(rig, table, &scenario, image, &Conditions::f405(1)).unwrap();
    assert_eq!(cycles.ended, None);
    cycles
}

/// What is above its goal or its limit.
fn beyond(cycles: &TickCycles) -> Vec<&'static str> {
    let (typical, balancing) = (cycles.typical.unwrap(), cycles.balancing.unwrap());
    let us = |span: Option<Span>| span.unwrap().us;
    let all = [
        ("goal of the latency", us(typical.latency) > GOAL_LATENCY_US),
        ("goal of the jitter", us(typical.jitter) > GOAL_JITTER_US),
        ("goal of the task", typical.whole.us > GOAL_TASK_US),
        ("goal of the controller", typical.controller.cycles > GOAL_CONTROLLER_CYCLES),
        ("latency", us(balancing.latency) > LATENCY_US),
        ("jitter", us(balancing.jitter) > JITTER_US),
        ("task", cycles.all.whole.us > TASK_US),
        ("controller", cycles.all.controller.cycles > CONTROLLER_CYCLES),
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
    image.clone().with_bytes(SYS_TICK, vector).with_bytes(at, code)
}

#[test]
fn the_ticks_of_the_image_stay_within_their_limits_and_those_of_a_slower_one_do_not() {
    let Some(elf) = built(ImageKind::Board(BoardName::WeactF405)) else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let (rig, table) = rig_and_table("quadruple-paper").clone();
    let measured = |image: &Image| measured(&rig, &table, image);
    let cycles = measured(&image);
    println!("{cycles:#?}");
    assert_eq!(beyond(&cycles), [""; 0]);
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
    assert_eq!(beyond(&measured(&slower(&image, 4))), [&goals[..], &["latency", "task"]].concat());
    let error = measured(&slower(&image, 210)).check().unwrap_err().to_string();
    assert!(error.contains("a quarter of its period") && error.contains("period_s"), "{error}");
}
