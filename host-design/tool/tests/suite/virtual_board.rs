//! The image that is flashed, on the virtual board: from power-up to balancing, helped only by the simulated hand, bit
//! for bit like the firmware on the host.

use std::sync::OnceLock;

use crate::gains::RIG_HASH;
use upright::boards::{DEFAULT_BOARD, named};
use upright::protocol::message::Request;
use upright::supervision::fault::Fault;
use upright::table::Law;
use upright_board::{Chip, Conditions, Crystal, Image, Pulse, UNITS_PER_MICROSECOND as US, pin};
use upright_closed_loop::harness::{Pins, Session};
use upright_design::design::design;
use upright_design::rig::{Integral, Rig};
use upright_design::simulate::Scenario;
use upright_design::table::{Gains, TableValues};
use upright_plan::{hangs, up_and_down};
use upright_tool::campaign::{Class, Defect, During, Setup, one};
use upright_tool::image::{build_for, conditions};
use upright_tool::in_the_loop::{RunPlace, VirtualBoard, measure, run_compared};

use crate::equipment::{built, built_for};
use crate::published::{rig_and_table, rig_and_table_with_motions};

#[test]
fn the_flashed_image_balances_from_power_up_with_the_bits_of_the_host() {
    let Some(elf) = built(DEFAULT_BOARD) else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let (rig, table) = rig_and_table("quadruple-paper").clone();
    assert_eq!(rig.hash(), RIG_HASH);
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
    let (rig, table) = rig_and_table_with_motions("quadruple-paper").clone();
    let Some(elf) = built_for(DEFAULT_BOARD, &rig, &table) else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let scenario = up_and_down(&rig, &table, 0.5).unwrap();
    let mut board = VirtualBoard::start(&image, &Conditions::f405(1), &table).unwrap();
    let (recording, [ticks, messages]) = run_compared(&rig, &table, &scenario, &mut board).unwrap();
    assert!(hangs(&recording), "{:?}", recording.fault);
    assert!(ticks > 5_000 && messages > 500, "{ticks} {messages}");

    // The negative control: a host with another last gain on the way up.
    let mut other = table.clone();
    *other.swing_up.as_mut().unwrap().raise.reference.last_mut().unwrap() /= 2;
    let mut board = VirtualBoard::start(&image, &Conditions::f405(1), &table).unwrap();
    let error = run_compared(&rig, &other, &scenario, &mut board).unwrap_err().to_string();
    assert!(error.contains("differ"), "{error}");
}

/// Every tick restarts the PWM's timer for three ticks.
#[test]
fn restarts_of_the_pwm_fall_at_one_place_of_its_period_and_cut_no_pulse() {
    let Some(elf) = built(DEFAULT_BOARD) else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let (rig, table) = rig_and_table("quadruple-paper").clone();
    let mut scenario = Scenario::at_rest(&rig, Law::Lqr);
    scenario.start[2] = 0.002;
    scenario.duration_s = 2.0;
    let mut board = VirtualBoard::start(&image, &Conditions::f405(1), &table).unwrap();
    board.board().record_pulses();
    run_compared(&rig, &table, &scenario, &mut board).unwrap();
    let mut pulses = board.board().pulses();
    assert!(pulses.len() > 40_000, "{}", pulses.len());
    assert_eq!(cuts(&pulses), 0);
    // Balancing: the ends of all pulses are at one place of the period of 50 µs, to the time that a tick varies by.
    let ends =
        pulses[pulses.len() / 2..].iter().filter_map(|pulse| Some((pulse.at + pulse.width?) % (50 * US)));
    let [first, last] = [ends.clone().min().unwrap(), ends.max().unwrap()];
    assert!(last - first < US / 2, "{first} {last}");
    // Negative control: a pulse that is interrupted for 0.12 µs.
    let whole = pulses.iter().rposition(|pulse| pulse.width > Some(US)).unwrap();
    let (at, half) = (pulses[whole].at, pulses[whole].width.unwrap() / 2);
    pulses[whole].width = Some(half);
    pulses.insert(whole + 1, Pulse { at: at + half + 3 * US / 25, ..pulses[whole] });
    assert_eq!(cuts(&pulses), 1);
}

/// How many pulses of a PWM follow one another within half a microsecond, in which no power stage can switch.
fn cuts(pulses: &[Pulse]) -> usize {
    let is_cut =
        |pair: &&[Pulse]| pair[0].width.is_some_and(|width| pair[1].at - pair[0].at - width < US / 2);
    pulses.windows(2).filter(is_cut).count()
}

/// The supply of the chip is too low for the wait states that the image sets.
#[test]
fn a_stopped_run_names_address_and_source_line() {
    let Some(elf) = built(DEFAULT_BOARD) else { return };
    let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
    let (_, table) = rig_and_table("quadruple-paper");
    let conditions = Conditions { chip_v: 2.5, ..Conditions::f405(1) };
    let error = VirtualBoard::start(&image, &conditions, table).err().unwrap().to_string();
    for part in ["at program counter 0x0800", "wait states", "src/image/board/f4/clock.rs:"] {
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
    rig.integral = Some(Integral { position_weight: 100.0, setpoint_weight: 1.0 });
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    assert!(table.drive.supply_v().is_some() && table.sensors() == 2);
    let Some(elf) = built_for(DEFAULT_BOARD, &rig, &table) else { return };
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

/// The image for the Feather, which counts a single link, with its motions; none without a compiler.
fn feather() -> Option<(Rig, TableValues, Image)> {
    static FEATHER: OnceLock<Option<(Rig, TableValues, Image)>> = OnceLock::new();
    FEATHER.get_or_init(built_for_the_feather).clone()
}

fn built_for_the_feather() -> Option<(Rig, TableValues, Image)> {
    let (rig, table) = rig_and_table_with_motions("single-quanser-ip02").clone();
    let elf = built_for(named("feather-f405").unwrap(), &rig, &table)?;
    Some((rig, table, Image::from_elf(&std::fs::read(elf).unwrap()).unwrap()))
}

/// The board with its own pins: PWM at a complementary output, another USART, sixteen-bit counters for the cart.
#[test]
fn the_feather_balances_a_link_with_the_bits_of_the_host_and_refuses_another_chip_or_crystal() {
    let Some((rig, table, image)) = feather() else { return };
    let own = conditions(named("feather-f405").unwrap(), 1).unwrap();
    let scenario = Scenario { duration_s: 1.0, step_m: 0.05, ..Scenario::at_rest(&rig, Law::Lqr) };
    let mut power_on = VirtualBoard::start(&image, &own, &table).unwrap();
    let (recording, [ticks, messages]) = run_compared(&rig, &table, &scenario, &mut power_on).unwrap();
    assert!(recording.summary.fall.is_none() && recording.fault.is_none(), "{recording:?}");
    assert!(ticks > 2_000 && messages > 200, "{ticks} {messages}");
    assert!(power_on.board().output(pin('C', 1)), "the status LED");

    let fault_of = |conditions: &Conditions| {
        let mut board = VirtualBoard::start(&image, conditions, &table).unwrap();
        let mut session = Session::new(&mut board);
        let pins = Pins {
            raw_counts: heapless::Vec::from_slice(&[0; 2]).unwrap(),
            supply_v: table.drive.supply_v().unwrap(),
            contacts: Default::default(),
            received: heapless::Vec::new(),
            injected_fault: None,
        };
        assert!(session.ask(Request::Arm, &pins).is_err());
        session.fault()
    };
    assert_eq!(fault_of(&own), None);
    assert_eq!(fault_of(&Conditions { chip: Chip::F446, ..own }), Some(Fault::Board));
    let crystal = Crystal { hz: 8_000_000, ..own.crystal };
    assert_eq!(fault_of(&Conditions { crystal, ..own }), Some(Fault::Clock));

    // A rig with more encoders than the board counts.
    let (rig, table) = rig_and_table("quadruple-paper");
    let error = build_for(named("feather-f405").unwrap(), rig, table).unwrap_err().to_string();
    assert_eq!(
        error,
        "feather-f405 counts 2 encoders, and this rig has 5: use another board (`upright firmware boards`)"
    );
}

/// With the board's own measurement of the supply, through the divider.
#[test]
fn a_supply_that_a_braking_motor_pumps_up_turns_the_motor_off_and_a_spike_does_not() {
    let Some((rig, table, image)) = feather() else { return };
    let place =
        RunPlace::Board { image: &image, conditions: conditions(named("feather-f405").unwrap(), 1).unwrap() };
    let setup =
        Setup { rig: &rig, table: &table, place, detection: true, guards: true, during: During::Balancing };
    let surge = one(&setup, &[Defect::SupplySurge], 1, 0).unwrap();
    assert_eq!((surge.class, surge.fault), (Class::Detected, Some(Fault::Supply.code())), "{surge:?}");
    // The negative control: one or two ticks of it.
    let spike = one(&setup, &[Defect::SupplySpike], 1, 0).unwrap();
    assert_eq!((spike.class, spike.fault), (Class::Rejected, None), "{spike:?}");
}

/// Raising and lowering included; the negative control of this limit is in `cycles.rs`.
#[test]
fn no_tick_of_raising_and_lowering_takes_longer_than_a_quarter_of_its_period() {
    let Some((rig, table, image)) = feather() else { return };
    let scenario = Scenario { duration_s: 0.2, ..Scenario::at_rest(&rig, Law::Lqr) };
    let conditions = conditions(named("feather-f405").unwrap(), 1).unwrap();
    let cycles = measure(&rig, &table, &scenario, &image, &conditions).unwrap();
    assert_eq!((cycles.ended.as_deref(), cycles.check()), (None, Ok(())));
    let (balancing, moving) = (cycles.balancing.unwrap(), cycles.moving.unwrap());
    assert!(balancing.ticks >= 100 && moving.ticks > 1_000, "{} {}", balancing.ticks, moving.ticks);
    assert!(moving.whole.us > balancing.controller.us && cycles.all.whole.us >= moving.whole.us);
    // Without motions nothing moves.
    let mut table = table;
    table.swing_up = None;
    assert_eq!(measure(&rig, &table, &scenario, &image, &conditions).unwrap().moving, None);
}
