//! How the flashed image reacts to hardware that is not as it should be, on the virtual board.

use crate::gains::{TABLE, TICK_S};
use upright::board::Contacts;
use upright::boards::{DEFAULT_BOARD, named};
use upright::protocol::message::{Answer, CrashRecord, Info, Reply, Request, Reset};
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::supervisor::State;
use upright_board::{
    Chip, Conditions, Crystal, ExternalLevel, Image, Input, Rules, SimulatedBoard, pin, seconds,
};
use upright_tool::image::{conditions, flash_checksum};
use upright_tool::monitor::Monitor;

use crate::equipment::built;
use crate::powered::{BAUD, Powered, image, sealed};

const TIM1: u32 = 0x4001_0000;
const RCC_CR: u32 = 0x4002_3800;

fn with_crystal(hz: u32, hsi_hz: u32) -> Conditions {
    let mut conditions = Conditions { hsi_hz, ..Conditions::f405(3) };
    conditions.crystal.hz = hz;
    conditions
}

#[test]
fn nothing_in_the_image_breaks_a_rule_of_the_manuals() {
    let Some(image) = image() else { return };
    for seed in 1..4 {
        let mut run = Powered::strict(&image, &Conditions::f405(seed));
        run.run(0.1);
        assert_eq!(run.last(), (State::Disarmed, None));
        assert!(run.telemetry.len() >= 8 && run.board.notes().is_empty());
    }
}

/// A register write that follows too soon on enabling the clock is lost; here, each write to the motor's timer in
/// turn.
#[test]
fn a_lost_write_to_the_motors_timer_keeps_the_motor_off() {
    let Some(image) = image() else { return };
    for (offset, name) in [(0x2c, "ARR"), (0x30, "RCR"), (0x18, "CCMR1"), (0x20, "CCER"), (0x44, "BDTR")] {
        let mut run = Powered::strict(&image, &Conditions::f405(1));
        run.board.apply(Input::LoseWrite(TIM1 + offset));
        run.run(0.05);
        assert_eq!(run.last(), (State::Fault, Some(Fault::Board)), "{name}");
        assert!(!run.board.power_stage().main_output, "{name}");
    }
    // Another register's write may be lost: the compare value is written again in every tick.
    let mut run = Powered::strict(&image, &Conditions::f405(1));
    run.board.apply(Input::LoseWrite(TIM1 + 0x34));
    run.run(0.05);
    assert_eq!(run.last(), (State::Disarmed, None));
}

#[test]
fn the_image_for_the_board_ends_a_wait_for_the_clock_with_its_fault() {
    let Some(image) = image() else { return };
    let mut run = Powered::strict(&image, &with_crystal(0, 16_000_000));
    run.run(1.0);
    assert!(run.telemetry.len() > 5, "{}", run.telemetry.len());
    for telemetry in run.telemetry {
        assert_eq!((telemetry.state, telemetry.fault), (State::Fault, Some(Fault::Clock)));
        assert_eq!(telemetry.drive, 0.0);
    }
}

#[test]
fn the_first_tick_comes_within_a_tenth_of_a_second_even_without_a_crystal() {
    let Some(image) = image() else { return };
    let first_tick_s = |crystal_hz: u32| {
        let mut run = Powered::strict(&image, &with_crystal(crystal_hz, 16_000_000));
        (1..500).map(|step| 1e-3 * f64::from(step)).find(|&time_s| {
            run.run(time_s);
            run.board.next_tick().is_some()
        })
    };
    let [with, without] = [8_000_000, 0].map(|hz| first_tick_s(hz).unwrap());
    assert!(with < 0.01 && without < 0.1, "{with} s, {without} s without a crystal");
}

#[test]
fn another_crystal_is_noticed_and_reported_at_the_right_baud_rate() {
    let Some(image) = image() else { return };
    let fault = (State::Fault, Some(Fault::Clock));
    for (hz, hsi_hz, expected) in [
        (8_000_000, 16_160_000, (State::Disarmed, None)),
        (8_000_000, 15_840_000, (State::Disarmed, None)),
        (12_000_000, 16_000_000, fault),
        (25_000_000, 16_000_000, fault),
        (16_000_000, 16_000_000, fault),
        (4_000_000, 16_000_000, fault),
        (8_400_000, 16_000_000, fault),
        (7_600_000, 16_000_000, fault),
        (0, 16_000_000, fault),
    ] {
        let mut run = Powered::strict(&image, &with_crystal(hz, hsi_hz));
        run.run(0.5);
        assert_eq!(run.last(), expected, "{hz} Hz against {hsi_hz} Hz");
        assert_eq!(run.board.resets(), 0, "the watchdog is fed on the slow clock, too");
    }
}

/// The write that switches the PLL on is lost: the next one to this register after the crystal has been measured.
#[test]
fn a_pll_that_does_not_start_is_reported_at_the_right_baud_rate() {
    let Some(image) = image() else { return };
    let mut run = Powered::strict(&image, &Conditions::f405(1));
    run.board.at(seconds(0.002_2), Input::LoseWrite(RCC_CR));
    run.run(0.5);
    assert_eq!(run.last(), (State::Fault, Some(Fault::Clock)));
    assert_eq!(run.board.core_hz(), 16_000_000);
}

#[test]
fn another_chip_is_noticed() {
    let Some(image) = image() else { return };
    let conditions = Conditions { chip: Chip::F446, ..Conditions::f405(1) };
    let mut run = Powered::strict(&image, &conditions);
    run.run(0.05);
    assert_eq!(run.last(), (State::Fault, Some(Fault::Board)));
}

/// Address of the table's first gain in flash, among the initial values of variables.
fn first_gain(board: &SimulatedBoard) -> u32 {
    let gains: Vec<u32> =
        TABLE.laws.lqr.as_ref().unwrap().k.iter().take(3).map(|gain| gain.to_bits()).collect();
    let here = |at: &u32| (0..3).all(|i| board.word(at + 4 * i) == Some(gains[i as usize]));
    (0x0800_0000..0x0801_0000).step_by(4).find(here).expect("the table is there")
}

/// A bit of the first gain was wrong already when the image was linked.
#[test]
fn a_damaged_table_is_reported_and_cannot_be_cleared() {
    let Some(image) = image() else { return };
    let address = first_gain(&SimulatedBoard::power_on(&image, &Conditions::f405(1), Rules::STRICT).unwrap());
    let (end, byte) = (image.end(), image.flash()[address as usize & 0xff_ffff]);
    let mut run =
        Powered::strict(&sealed(image.with_bytes(address, vec![byte ^ 1 << 5]), end), &Conditions::f405(1));
    run.run(0.05);
    assert_eq!(run.last(), (State::Fault, Some(Fault::Table)));
    run.ask(1, Request::Clear);
    run.run(0.1);
    assert_eq!(run.last(), (State::Fault, Some(Fault::Table)));
    assert_eq!(run.replies, [Reply { id: 1, answer: Answer::NotNow(Inhibits::TABLE) }]);
    stop_the_crystal(&mut run);
}

/// The crystal stops: the handler stops the program, and the watchdog resets within six ticks.
fn stop_the_crystal(run: &mut Powered) {
    run.board.apply(Input::StopCrystal);
    let end = run.board.now() + 6 * seconds(f64::from(TICK_S));
    run.board.run_until(end).unwrap();
    assert_eq!(run.board.resets(), 1);
}

/// The crystal stops at the earliest moment: the watchdog's settings must be in effect before the first tick.
#[test]
fn the_watchdog_resets_in_time_from_the_first_tick_on() {
    let Some(image) = image() else { return };
    for lsi_hz in [17_000, 32_000, 47_000] {
        let mut run = Powered::strict(&image, &Conditions { lsi_hz, ..Conditions::f405(1) });
        while run.board.exception() != 15 {
            run.board.run_until(run.board.now() + 1).unwrap();
        }
        stop_the_crystal(&mut run);
    }
}

#[test]
fn a_low_supply_of_the_chip_is_noticed_however_short_it_is() {
    let Some(image) = image() else { return };
    let mut run = Powered::strict(&image, &Conditions::f405(1));
    run.run(0.05);
    assert_eq!(run.last(), (State::Disarmed, None));
    run.board.apply(Input::ChipSupply(2.6));
    run.run(0.050_01);
    run.board.apply(Input::ChipSupply(3.3));
    run.run(0.1);
    assert_eq!(run.last(), (State::Fault, Some(Fault::Board)));
}

/// A debugger resets the chip twice: neither reset is reported as a crash.
#[test]
fn a_debuggers_reset_is_no_crash() {
    let Some(image) = image() else { return };
    let mut run = Powered::strict(&image, &Conditions::f405(1));
    // Between two frames.
    run.run(0.055);
    for time_s in [0.1, 0.15] {
        let before = run.telemetry.len();
        run.board.apply(Input::DebuggerReset);
        run.run(time_s);
        assert!(run.telemetry.len() > before);
        assert_eq!(run.last(), (State::Disarmed, None));
    }
    assert_eq!(run.board.resets(), 2);
    run.ask(1, Request::Info);
    run.run(0.2);
    let Some(Reply { answer: Answer::Info(info), .. }) = run.replies.last() else {
        panic!("{:?}", run.replies)
    };
    assert_eq!(info.reset, Reset::Power);
}

/// The board's reading of the motor's supply of 24 V (V), under these conditions.
fn supply_read(image: &Image, conditions: &Conditions) -> f32 {
    let mut run = Powered::strict(image, conditions);
    run.run(0.05);
    run.telemetry.last().unwrap().supply_v
}

/// Some boards run from 3.0 V: without the correction by the chip's reference, the reading would be 10 % high there.
#[test]
fn the_reading_of_the_supply_does_not_depend_on_the_chips_own() {
    let Some(image) = image() else { return };
    for chip_v in [2.9, 3.0, 3.3, 3.5] {
        let read = supply_read(&image, &Conditions { chip_v, ..Conditions::f405(1) });
        assert!((read - 24.0).abs() < 0.15, "{read} V from {chip_v} V");
    }
    // Negative control: a chip without the factory's calibration is taken for one that runs from the board's 3.3 V.
    let uncalibrated = Conditions { is_calibrated: false, chip_v: 3.0, ..Conditions::f405(1) };
    let read = supply_read(&image, &uncalibrated);
    assert!((read - 24.0 * 1.1).abs() < 0.15, "{read} V");
}

/// The pin is high while a tick runs, and only then: 5 to 50 µs of each millisecond.
#[test]
fn a_pin_shows_the_tick() {
    let Some(image) = image() else { return };
    let mut run = Powered::strict(&image, &Conditions::f405(1));
    run.run(0.05);
    let samples = 20_000;
    let high = (0..samples).filter(|_| {
        run.board.run_until(run.board.now() + seconds(0.000_001)).unwrap();
        run.board.output(pin('B', 1))
    });
    let share = high.count() as f64 / f64::from(samples);
    assert!((0.005..0.05).contains(&share), "{share}");
}

/// The boards that count as many encoders as the rig of src/gains.rs has; for the others see `virtual_board.rs`.
#[test]
fn every_board_starts_with_its_own_chip_clock_and_led_and_with_no_other() {
    for (board, led, is_low) in [
        (DEFAULT_BOARD, pin('B', 2), false),
        (named("olimex-h405").unwrap(), pin('C', 12), true),
        (named("discovery-f407").unwrap(), pin('D', 12), false),
        (named("nucleo-f446").unwrap(), pin('A', 5), false),
    ] {
        let Some(elf) = built(board) else { return };
        let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
        let started = |conditions: &Conditions| {
            let mut run = Powered::strict(&image, conditions);
            run.run(0.5);
            (run.last(), run.board.output(led) != is_low, run.board.core_hz())
        };
        let own = conditions(board, 1).unwrap();
        assert_eq!(started(&own), ((State::Disarmed, None), true, 168_000_000), "{board}");
        if board.name == "nucleo-f446" {
            // MB1136 C-01 with a crystal fitted, and as it comes: without any clock.
            let crystal = Crystal { is_clock_input: false, ..own.crystal };
            let fitted = Conditions { crystal, ..own };
            assert_eq!(started(&fitted), ((State::Disarmed, None), true, 168_000_000));
            let bare = Conditions { crystal: Crystal { hz: 0, ..crystal }, ..own };
            assert_eq!(started(&bare), ((State::Fault, Some(Fault::Clock)), false, 16_000_000));
        }
        if board.name == "discovery-f407" {
            // It runs from 3.0 V at most; the first revision of its chip has another identity.
            for other in [Conditions { chip_v: 2.8, ..own }, Conditions { chip: Chip::F407RevisionA, ..own }]
            {
                assert_eq!(started(&other).0, (State::Disarmed, None), "{other:?}");
            }
        }
        let other = if own.chip == Chip::F446 { Chip::F405 } else { Chip::F446 };
        let on_other = started(&Conditions { chip: other, ..own });
        assert_eq!((on_other.0, on_other.1), ((State::Fault, Some(Fault::Board)), false), "{board}");
        let crystal = Crystal { hz: 12_000_000, ..own.crystal };
        let with_other = started(&Conditions { crystal, ..own });
        assert_eq!(with_other, ((State::Fault, Some(Fault::Clock)), false, 16_000_000), "{board}");
    }
}

#[test]
fn contacts_supply_and_the_longest_tick_are_reported_with_the_motor_off() {
    let Some(image) = image() else { return };
    let mut run = Powered::strict(&image, &Conditions::f405(1));
    run.run(0.05);
    let told = run.telemetry.last().unwrap();
    assert!((told.supply_v - 24.0).abs() < 0.15, "{} V", told.supply_v);
    assert_eq!(told.contacts, Contacts::default());
    for (wire, expected) in [
        (pin('C', 0), Contacts { limit_low: true, ..Contacts::default() }),
        (pin('C', 1), Contacts { limit_high: true, ..Contacts::default() }),
        (pin('B', 12), Contacts { emergency_stop: true, ..Contacts::default() }),
    ] {
        // An open wire: the internal pull-up pulls it high.
        run.board.apply(Input::Level(wire, ExternalLevel::Open));
        run.run(run.seconds() + 0.05);
        assert_eq!(run.telemetry.last().unwrap().contacts, expected);
        run.board.apply(Input::Level(wire, ExternalLevel::Low));
    }
    run.board.apply(Input::Supply(11.0));
    run.run(run.seconds() + 0.05);
    assert!((run.telemetry.last().unwrap().supply_v - 11.0).abs() < 0.15);
    let cycles: Vec<_> = run.telemetry.iter().map(|told| (told.cycles, told.worst_cycles)).collect();
    assert!(cycles.windows(2).all(|two| two[0].1 <= two[1].1), "it never falls: {cycles:?}");
    assert!(cycles.iter().all(|(cycles, worst)| cycles <= worst) && cycles[1].1 > 0, "{cycles:?}");
    // The tick that clears the counters is no shorter for it, and the longest tick stays.
    let worst = run.telemetry.last().unwrap().worst_cycles;
    run.ask(1, Request::ResetStatistics);
    run.run(run.seconds() + 0.05);
    assert!(run.telemetry.last().unwrap().worst_cycles >= worst);
}

/// A monitor that has watched the board for `time_s` (s) from now on.
fn monitored(run: &mut Powered, time_s: f64) -> Monitor {
    let mut monitor = Monitor::new("the virtual board");
    let end = run.seconds() + time_s;
    while run.seconds() < end {
        // Seconds since 1970: they only have to grow.
        let now = std::time::Duration::from_secs_f64(1.8e9 + run.seconds());
        monitor.poll(now);
        let bytes = monitor.take_outgoing();
        if !bytes.is_empty() {
            run.board.send(&bytes, BAUD);
        }
        run.board.run_until(run.board.now() + seconds(0.005)).unwrap();
        let sent: Vec<u8> = run.board.sent().iter().map(|byte| byte.value).collect();
        monitor.receive(&sent, now);
    }
    monitor
}

/// A bit flips in the pointers to the gain table that the firmware keeps in RAM: the next tick reads an address
/// without memory.
#[test]
fn a_crash_is_recorded_over_the_reset_and_shown_by_the_monitor() {
    let Some(image) = image() else { return };
    let rules = Rules { faults_are_taken: true, ..Rules::STRICT };
    let mut run = Powered::with(&image, &Conditions::f405(1), rules);
    // Between two frames, as is the crash.
    run.run(0.055);
    // The negative control: without a crash there is no record, whatever memory holds at power-on.
    let monitor = monitored(&mut run, 0.3);
    let Some(Info { reset: Reset::Power, image: number, .. }) = monitor.info else {
        panic!("{:?}", monitor.info)
    };
    assert_eq!((monitor.crash, number), (None, flash_checksum(&image)));

    let table = image.object("local_init_table").unwrap();
    let points_to_table = |word: u32| word.is_multiple_of(4) && table.contains(&word);
    let pointers: Vec<u32> = (0x2000_1400..0x2000_3000)
        .step_by(4)
        .filter(|&at| run.board.word(at).is_some_and(points_to_table))
        .collect();
    assert!(!pointers.is_empty());
    for address in pointers {
        // 0x20… becomes 0x30…
        run.board.apply(Input::FlipBit { address: address + 3, bit: 4 });
    }
    run.run(run.seconds() + 0.05);
    assert_eq!(run.board.resets(), 1);
    for _ in 0..2 {
        let monitor = monitored(&mut run, 0.3);
        assert_eq!(monitor.info.map(|info| info.reset), Some(Reset::Software));
        assert_eq!(monitor.cause.map(|cause| cause.fault), Some(Fault::Crash));
        let Some(CrashRecord([pc, _, cfsr, hfsr, bfar])) = monitor.crash else { panic!("no record") };
        let line = image.source_line(pc);
        println!("{:?} in {line:?}", monitor.crash);
        assert!(line.is_some_and(|line| line.contains(".rs:")), "{pc:#x}");
        // A precise bus fault with its address, escalated.
        assert_eq!((cfsr & 0x8200, hfsr), (0x8200, 1 << 30), "{cfsr:#x}");
        assert_eq!(bfar >> 16, (table.start | 1 << 28) >> 16, "{bfar:#x}");
    }
}
