//! The image that is flashed, on the virtual board: from power-up to balancing with no one's help but the simulated hand,
//! with the bits of the firmware on the host.

use std::path::Path;

use upright::gains::RIG_HASH;
use upright::table::Law;
use upright_board::{Conditions, Image};
use upright_design::design::design;
use upright_design::rig::{Integral, Rig};
use upright_design::simulate::Scenario;
use upright_design::swing_up::{Stored, hangs, motions, up_and_down, with_motions};
use upright_design::table::{Gains, TableValues};
use upright_tool::image::{Board, Kind, build_for, build_if_possible, if_possible};
use upright_tool::in_the_loop::{VirtualBoard, run_compared};

#[test]
fn the_flashed_image_balances_from_power_up_with_the_bits_of_the_host() {
    let Some(elf) = build_if_possible(Kind::Board(Board::WeactF405)).unwrap() else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let rig = Rig::from_path("../../rigs/quadruple-paper.toml".as_ref()).unwrap();
    assert_eq!(rig.hash(), RIG_HASH);
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    let mut scenario = Scenario::at_rest(&rig, Law::Lqr);
    scenario.start[2] = 0.002;
    scenario.duration_s = 5.0;
    let power_on = || VirtualBoard::start(&image, &Conditions::f405(1), &table).unwrap();
    let (recording, [ticks, messages]) = run_compared(&rig, &table, &scenario, &mut power_on()).unwrap();
    assert!(recording.summary.fall.is_none() && recording.fault.is_none(), "{:?}", recording.summary);
    assert!(ticks > 10_000 && messages > 1_000, "{ticks} {messages}");
    // The steps of the encoders keep it moving: `upright verify` gives 14.5 mm and 14.3 mrad RMS for a force without
    // PWM and with further disturbances.
    let (mut samples, mut squares) = (0.0, [0.0; 2]);
    for sample in recording.trace.samples().filter(|sample| sample.t >= 1.0) {
        samples += 1.0;
        squares = [0, 1].map(|i| squares[i] + sample.state[2 * i].powi(2));
        assert!(sample.state[2].abs() < 0.1);
    }
    let [position_rms, angle_rms] = squares.map(|sum: f64| (sum / samples).sqrt());
    assert!(position_rms < 0.05 && angle_rms < 0.03, "{position_rms} {angle_rms}");

    // The negative control: a host with another table. Without the governor, a step reaches the law at once.
    let other = table.clone().without_governor();
    scenario.step_m = 0.05;
    let error = run_compared(&rig, &other, &scenario, &mut power_on()).unwrap_err().to_string();
    assert!(error.contains("differ"), "{error}");
}

#[test]
fn the_flashed_image_raises_and_lowers_the_links_with_the_bits_of_the_host() {
    let file = Path::new("../../rigs/quadruple-paper.toml");
    let rig = Rig::from_path(file).unwrap();
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    let motions = motions(&rig, &Stored::beside(file).unwrap()).unwrap();
    let table = with_motions(&rig, table, &motions).unwrap();
    let built = build_for(Kind::Board(Board::WeactF405), &rig, &table);
    let Some(elf) = if_possible(built).unwrap() else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let scenario = up_and_down(&rig, &table, 0.5).unwrap();
    let mut board = VirtualBoard::start(&image, &Conditions::f405(1), &table).unwrap();
    let (recording, [ticks, messages]) = run_compared(&rig, &table, &scenario, &mut board).unwrap();
    assert!(hangs(&recording), "{:?}", recording.fault);
    assert!(ticks > 5_000 && messages > 500, "{ticks} {messages}");

    // The negative control: a host with another last gain on the way up.
    let mut other = table.clone();
    *other.swing_up.as_mut().unwrap().raise.course.last_mut().unwrap() *= 1.5;
    let mut board = VirtualBoard::start(&image, &Conditions::f405(1), &table).unwrap();
    let error = run_compared(&rig, &other, &scenario, &mut board).unwrap_err().to_string();
    assert!(error.contains("differ"), "{error}");
}

/// The supply of the chip is too low for the wait states that the image sets.
#[test]
fn a_stopped_run_names_address_and_source_line() {
    let Some(elf) = build_if_possible(Kind::Board(Board::WeactF405)).unwrap() else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let rig = Rig::from_path("../../rigs/quadruple-paper.toml".as_ref()).unwrap();
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    let conditions = Conditions { chip_v: 2.5, ..Conditions::f405(1) };
    let error = VirtualBoard::start(&image, &conditions, &table).err().unwrap().to_string();
    for part in ["at program counter 0x0800", "wait states", "src/board/f4/clock.rs:"] {
        assert!(error.contains(part), "{part}: {error}");
    }
    // Negative control: without debug information there is no line.
    let stripped = Image::from_flash(vec![0; 64]);
    assert!(stripped.source_line(0x0800_0010).is_none() && image.source_line(0x0800_0000).is_none());
}

/// Motor data, a delay of a tick, and integral action, with both laws.
#[test]
fn motor_delay_and_integral_action_give_the_bits_of_the_host() {
    let mut rig = Rig::from_path("../../rigs/single-quanser-ip02.toml".as_ref()).unwrap();
    rig.tick.delay_ticks = 1;
    rig.integral = Some(Integral { position_weight: 100.0 });
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    assert!(table.motor.is_some() && table.sensors() == 2);
    let built = build_for(Kind::Board(Board::WeactF405), &rig, &table);
    let Some(elf) = if_possible(built).unwrap() else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    for law in Law::ALL {
        let scenario =
            Scenario { duration_s: 1.0, step_m: 0.05, force_noise_n: 0.05, ..Scenario::at_rest(&rig, law) };
        let mut board = VirtualBoard::start(&image, &Conditions::f405(2), &table).unwrap();
        let (recording, [ticks, messages]) = run_compared(&rig, &table, &scenario, &mut board).unwrap();
        assert!(recording.summary.fall.is_none() && recording.fault.is_none(), "{law:?}: {recording:?}");
        assert!(ticks > 2_000 && messages > 200, "{law:?}: {ticks} {messages}");
    }
}
