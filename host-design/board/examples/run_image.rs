//! Runs an image with fixed encoder counts and closed contacts: `run_image FILE SECONDS [NAME[=VALUE]]…`.
//!
//! Names: `strict` or `lost` (early writes are lost); `crystal=HZ` (0: none); `lsi=HZ`; `stop-crystal=SECONDS`;
//! `open=SECONDS` (emergency stop); `no-skip` (execute waiting loops).

use std::time::Instant;

use upright_board::{Conditions, ExternalLevel, Image, Input, Rules, SimulatedBoard, pin, seconds};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let image = Image::from_elf(&std::fs::read(&arguments[1])?)?;
    let value = |name: &str| {
        let options = arguments.iter().skip(3).filter_map(|option| option.split_once('='));
        options.clone().find(|(known, _)| *known == name).and_then(|(_, value)| value.parse::<f64>().ok())
    };
    let has = |name: &str| arguments.iter().any(|option| option == name);
    let rules = match (has("strict"), has("lost")) {
        (true, _) => Rules::STRICT,
        (_, true) => Rules { early_is_lost: true, ..Rules::NOTED },
        _ => Rules::NOTED,
    };
    let mut conditions = Conditions::f405(1);
    conditions.crystal.hz = value("crystal").map_or(8_000_000, |hz| hz as u32);
    conditions.lsi_hz = value("lsi").map_or(32_000, |hz| hz as u32);
    let begin = Instant::now();
    let mut board = SimulatedBoard::power_on(&image, &conditions, rules)?;
    board.skip_waiting(!has("no-skip"));
    if let Some(at) = value("stop-crystal") {
        board.at(seconds(at), Input::StopCrystal);
    }
    if let Some(at) = value("open") {
        board.at(seconds(at), Input::Level(pin('B', 12), ExternalLevel::Open));
    }
    for contact in [pin('B', 12), pin('C', 0), pin('C', 1)] {
        board.apply(Input::Level(contact, ExternalLevel::Low));
    }
    board.apply(Input::Level(pin('B', 13), ExternalLevel::High));
    board.apply(Input::Supply(24.0));
    let ended = board.run_until(seconds(arguments[2].parse()?));
    let wall = begin.elapsed().as_secs_f64();
    let (executed, skipped) = board.instructions();
    println!("{ended:?}");
    println!(
        "{:.6} s at {} Hz: {executed} instructions, {skipped} of them skipped, in {wall:.3} s: {:.1} MIPS executed",
        board.now() as f64 / 25.2e9,
        board.core_hz(),
        (executed - skipped) as f64 / wall / 1e6,
    );
    println!(
        "{} bytes sent, {} resets, pc {:#x}",
        board.sent().len(),
        board.resets(),
        board.program_counter()
    );
    println!("{:?}\n{:?}", board.power_stage(), board.driven());
    for note in board.notes() {
        println!(
            "{:#010x} x{} at {:.6} s: {}",
            note.stopped.program_counter,
            note.count,
            note.stopped.time as f64 / 25.2e9,
            note.stopped.violation
        );
    }
    Ok(())
}
