//! What the peripherals do, against the manual (RM0090).

use crate::program::{Code, FOREVER, LOG, NOP, RETURN, WFI, appended, board, clocks_on, image, logged};
use upright_board::{
    Conditions, ExternalLevel, Input, Rules, SimulatedBoard, Time, UNITS_PER_MICROSECOND as US,
    UNITS_PER_SECOND, Violation, pin,
};

const TIM1: u32 = 0x4001_0000;
const IWDG: u32 = 0x4000_3000;
const USART2: u32 = 0x4000_4400;

/// PA8 as TIM1_CH1, PB12 as BKIN with pull-up, PB14 and PB15 as outputs.
fn motor_pins() -> Code {
    clocks_on()
        .write(0x4002_0024, 1)
        .write(0x4002_0000, 0xa800_0000 | 2 << 16)
        .write(0x4002_0424, 1 << 16)
        .write(0x4002_040c, 0x100 | 1 << 24)
        .write(0x4002_0400, 0x280 | 2 << 24 | 1 << 28 | 1 << 30)
}

/// Period 800, active for 200 of it, three periods, break active high with OSSI and lock level 1.
fn pwm() -> Code {
    motor_pins()
        .write(TIM1 + 0x2c, 799)
        .write(TIM1 + 0x30, 2)
        .write(TIM1 + 0x34, 600)
        .write(TIM1 + 0x18, 0x78)
        .write(TIM1 + 0x20, 1)
        .write(TIM1 + 0x44, 1 << 13 | 1 << 12 | 1 << 10 | 1 << 8)
}

fn start() -> Code {
    Code::new()
        .write(TIM1 + 0x14, 1)
        .write(TIM1, 1 << 3 | 1)
        .write(TIM1 + 0x44, 1 << 15 | 1 << 13 | 1 << 12 | 1 << 10 | 1 << 8)
        .write(0x4002_0418, 1 << 15 | 1 << 14)
}

fn after(main: &Code, inputs: &[Input], microseconds: Time) -> SimulatedBoard {
    let mut board = board(main, &[], Rules::STRICT);
    for &input in inputs {
        board.apply(input);
    }
    board.run_until(microseconds * US).unwrap();
    board
}

const CLOSED: Input = Input::Level(pin('B', 12), ExternalLevel::Low);

#[test]
fn one_pulse_drives_its_periods_and_stops_low() {
    let mut board = after(&Code(pwm().0.into_iter().chain(start().0).collect()), &[CLOSED], 1_000);
    // 3 × 200 clocks of 16 MHz.
    assert_eq!(board.driven().pwm_high, 600 * (UNITS_PER_SECOND / 16_000_000));
    assert_eq!(board.driven().along, board.driven().pwm_high);
    let stage = board.power_stage();
    assert!(!stage.pwm && stage.enable && stage.main_output && stage.along);
}

/// Pulses of the timer in a run of `code` (timer clocks): when each begins after the first, and its width.
fn pulses(code: &Code) -> Vec<[Time; 2]> {
    let mut board = board(code, &[], Rules::STRICT);
    board.apply(CLOSED);
    board.record_pulses();
    board.run_until(1_000 * US).unwrap();
    let (clock, pulses) = (UNITS_PER_SECOND / 16_000_000, board.pulses());
    assert!(pulses.iter().all(|pulse| pulse.enabled && pulse.along && pulse.turned_at < pulse.at));
    assert!(board.pulses().is_empty());
    pulses
        .iter()
        .map(|pulse| [pulse.at - pulses[0].at, pulse.width.unwrap()].map(|time| time / clock))
        .collect()
}

#[test]
fn every_pulse_is_recorded_with_its_time_and_a_restart_cuts_what_is_left() {
    let joined = |parts: &[Code]| Code(parts.iter().flat_map(|part| part.0.iter().copied()).collect());
    let whole = pulses(&joined(&[pwm(), start()]));
    assert_eq!(whole, [[0, 200], [800, 200], [1600, 200]]);
    // Within the second period; nothing tells how many are left.
    let wait = Code(vec![NOP; 900]);
    let again = Code::new().log(TIM1 + 0x30, 4).write(TIM1 + 0x14, 1).write(TIM1, 1 << 3 | 1);
    let cut = joined(&[pwm(), start(), wait, again]);
    assert_eq!(pulses(&cut).len(), 4);
    assert_eq!(logged(&after(&cut, &[CLOSED], 1_000), 4), 2);
}

#[test]
fn a_lost_period_means_full_force() {
    let main = Code(pwm().0.into_iter().chain(start().0).collect());
    let mut board = board(&main, &[], Rules::STRICT);
    board.apply(CLOSED);
    board.apply(Input::LoseWrite(TIM1 + 0x2c));
    board.run_until(20_000 * US).unwrap();
    assert_eq!(board.power_stage().period_clocks, 65_536);
    assert_eq!(board.driven().pwm_high, 3 * (65_536 - 600) * (UNITS_PER_SECOND / 16_000_000));
}

#[test]
fn the_break_input_takes_the_output_away_at_its_edge() {
    // 100 periods of full duty.
    let main = pwm().write(TIM1 + 0x30, 100).write(TIM1 + 0x34, 0);
    let main = Code(main.0.into_iter().chain(start().0).collect());
    let mut broken = board(&main, &[], Rules::STRICT);
    broken.apply(CLOSED);
    broken.at(200 * US + 12_345, Input::Level(pin('B', 12), ExternalLevel::Open));
    broken.run_until(200 * US + 12_345).unwrap();
    let high = broken.driven().pwm_high;
    assert!(high > 100 * US);
    broken.run_until(1_000 * US).unwrap();
    assert_eq!(broken.driven().pwm_high, high);
    assert!(!broken.power_stage().main_output);
    // The negative control: a break input that is not wired.
    let mut unwired = board(&main, &[], Rules::STRICT);
    unwired.apply(CLOSED);
    unwired.apply(Input::IgnoreBreak);
    unwired.at(200 * US + 12_345, Input::Level(pin('B', 12), ExternalLevel::Open));
    unwired.run_until(1_000 * US).unwrap();
    assert!(unwired.driven().pwm_high > high);
}

#[test]
fn the_lock_keeps_the_break_until_the_next_reset() {
    let main = pwm().write(TIM1 + 0x44, 1 << 15).log(TIM1 + 0x44, 4);
    let board = after(&main, &[CLOSED], 100);
    assert_eq!(logged(&board, 4), 1 << 15 | 1 << 13 | 1 << 12 | 1 << 8);
}

#[test]
fn the_watchdogs_first_period_is_the_long_one_while_the_reload_is_on_its_way() {
    let set_up = Code::new().write(IWDG, 0xcccc).write(IWDG, 0x5555).write(IWDG + 8, 24);
    let time_of_reset = |main: &Code| {
        let mut board = board(main, &[], Rules::STRICT);
        for i in 1..600 {
            board.run_until(i * 1_000 * US).unwrap();
            if board.resets() > 0 {
                return i;
            }
        }
        0
    };
    // Restarted at once, the counter begins from 0xfff again: 512 ms (BOARD finding; 21.4.4).
    assert_eq!(time_of_reset(&set_up.clone().write(IWDG, 0xaaaa)), 512 + 1);
    // After RVU is clear: 25 counts of 125 µs.
    let patient = set_up.set(3, 4_000).raw(&[0x3b01, 0xd1fd]).write(IWDG, 0xaaaa);
    assert!(time_of_reset(&patient) <= 5);
}

/// Alternate functions of PA2 and PA3, 115 200 baud from 16 MHz.
fn serial() -> Code {
    clocks_on()
        .write(0x4002_0020, 7 << 8 | 7 << 12)
        .write(0x4002_000c, 0x6400_0000 | 1 << 6)
        .write(0x4002_0000, 0xa800_0000 | 2 << 4 | 2 << 6)
        .write(USART2 + 8, 139)
        .write(USART2 + 0xc, 1 << 13 | 1 << 5 | 3 << 2)
}

#[test]
fn bytes_take_their_time_both_ways_and_overruns_lose() {
    let main = serial().write(USART2 + 4, 0x41).write(USART2 + 4, 0x42).raw(&[WFI, 0xe7fd]);
    let mut board = board(&main, &[], Rules::STRICT);
    board.run_until(400 * US).unwrap();
    let sent = board.sent();
    assert_eq!(sent.iter().map(|byte| byte.value).collect::<Vec<_>>(), [0x41, 0x42]);
    assert_eq!(sent[1].end - sent[0].end, 10 * 139 * (UNITS_PER_SECOND / 16_000_000));
    // The program does not read the first byte, so the second is lost.
    board.send(&[1, 2], 115_200);
    board.run_until(800 * US).unwrap();
    assert_eq!(board.lost().0, 1);
}

#[test]
fn skipped_waiting_loops_make_no_difference() {
    // r3 = 2500; loop: r3 -= 1, r2 = SR << 24 (TXE to N), again while TXE is clear; then a byte, and all again.
    let main = serial().set(0, USART2).raw(&[
        0x2455,
        0xf640,
        0x13c4,
        0x3b01,
        0x8802,
        0x0612,
        0xd5fb,
        0x6044,
        0xe7f7,
    ]);
    let mut skipping = board(&main, &[], Rules::STRICT);
    let mut executing = board(&main, &[], Rules::STRICT);
    executing.skip_waiting(false);
    for i in 1..400 {
        skipping.run_until(i * 13 * US + i % 7).unwrap();
        executing.run_until(i * 13 * US + i % 7).unwrap();
        assert_eq!(skipping.registers(), executing.registers(), "{i}");
        assert_eq!(skipping.instructions().0, executing.instructions().0, "{i}");
        assert_eq!(skipping.now(), executing.now(), "{i}");
        assert_eq!(skipping.sent(), executing.sent(), "{i}");
    }
    assert!(skipping.instructions().1 > skipping.instructions().0 / 2, "{:?}", skipping.instructions());
    assert_eq!(executing.instructions().1, 0);
}

#[test]
fn received_bytes_interrupt() {
    let handler =
        Code::new().read(USART2).read(USART2 + 4).set(0, LOG + 16).raw(&[0x6803, 0x18d2, 0x6002, RETURN]);
    let main = serial().write(LOG + 16, 0).write(0xe000_e104, 1 << 6).raw(&[WFI, 0xe7fd]);
    let mut board = board(&main, &[(16 + 38, handler)], Rules::STRICT);
    board.run_until(100 * US).unwrap();
    let end = board.send(&[1, 2, 3, 100], 115_200);
    board.run_until(end + 10 * US).unwrap();
    assert_eq!(logged(&board, 4), 106);
    assert_eq!(board.lost().0, 0);
}

#[test]
fn the_dma_receives_in_a_circle() {
    let main = serial()
        .write(0x4002_6010 + 5 * 0x18 + 8, USART2 + 4)
        .write(0x4002_6010 + 5 * 0x18 + 12, LOG + 64)
        .write(0x4002_6010 + 5 * 0x18 + 4, 4)
        .write(0x4002_6010 + 5 * 0x18, 4 << 25 | 1 << 10 | 1 << 8 | 1)
        .write(USART2 + 0x14, 1 << 6)
        .write(USART2 + 0xc, 1 << 13 | 3 << 2)
        .raw(&[FOREVER]);
    let mut board = board(&main, &[], Rules::STRICT);
    board.run_until(100 * US).unwrap();
    let end = board.send(&[1, 2, 3, 4, 5, 6], 115_200);
    board.run_until(end + 10 * US).unwrap();
    assert_eq!(board.word(LOG + 64).unwrap().to_le_bytes(), [5, 6, 3, 4]);
}

#[test]
fn encoders_count_and_the_filter_swallows_what_is_too_fast() {
    let main = clocks_on()
        .write(0x4002_0420, 2 << 16 | 2 << 20)
        .write(0x4002_0400, 0x280 & !(3 << 8) | 2 << 8 | 2 << 10)
        .write(0x4000_0418, 0x3131)
        .write(0x4000_0408, 3)
        .write(0x4000_0400, 1)
        .set(3, 2_000)
        .raw(&[0x3b01, 0xd1fd])
        .log(0x4000_0424, 4)
        .raw(&[FOREVER]);
    let turned = |position, begin, end| {
        let mut board = board(&main, &[], Rules::STRICT);
        board.run_until(begin).unwrap();
        board.apply(Input::Encoder { encoder: 2, position, end });
        board.run_until(2_000 * US).unwrap();
        (logged(&board, 4), board.lost().1)
    };
    assert_eq!(turned(5, 100 * US, 200 * US), (5, 0));
    assert_eq!(turned(-5, 100 * US, 200 * US), (0xfffb, 0));
    // A movement without duration.
    assert_eq!(turned(7, 100 * US, 100 * US), (7, 0));
    // An edge every 100 ns: a level stays for 200 ns, and the filter wants eight samples, 500 ns.
    assert_eq!(turned(1_000, 100 * US, 200 * US), (0, 1_000));
}

#[test]
fn the_converter_measures_the_supply() {
    let main = clocks_on()
        .write(0x4002_0800, 3 << 4)
        .write(0x4001_200c, 4 << 6)
        .write(0x4001_2034, 12)
        .write(0x4001_2008, 1)
        .set(3, 100)
        .raw(&[0x3b01, 0xd1fd])
        .write(0x4001_2008, 0x4000_0001)
        .set(3, 200)
        .raw(&[0x3b01, 0xd1fd])
        .log(0x4001_2000, 4)
        .log(0x4001_204c, 5)
        .log(0x4001_2000, 6)
        .raw(&[FOREVER]);
    let board = after(&main, &[Input::Supply(24.0)], 200);
    assert_eq!(logged(&board, 4) & 2, 2);
    assert_eq!(logged(&board, 5), (24.0 / 23.0 / 3.3 * 4096.0) as u32);
    assert_eq!(logged(&board, 6) & 2, 0, "reading clears EOC");
}

#[test]
fn a_failing_crystal_breaks_and_interrupts() {
    let main = pwm()
        .write(0x4002_3800, 0x81 | 1 << 16)
        .set(3, 20_000)
        .raw(&[0x3b01, 0xd1fd])
        .write(0x4002_3800, 0x81 | 1 << 16 | 1 << 19);
    let main = Code(main.0.into_iter().chain(start().0).chain([FOREVER]).collect());
    let mut board = board(&main, &[(2, Code::new().append(2))], Rules::STRICT);
    board.apply(CLOSED);
    board.run_until(20_000 * US).unwrap();
    assert!(board.power_stage().main_output);
    board.apply(Input::StopCrystal);
    board.run_until(20_010 * US).unwrap();
    assert!(!board.power_stage().main_output);
    assert_eq!(appended(&board), [2]);
}

#[test]
fn the_crystal_can_be_measured_against_the_internal_oscillator() {
    // HSE / 25 for the RTC, captured by TIM11 every eighth edge: 8 × 25 periods of HSE in clocks of 16 MHz.
    let main = clocks_on()
        .write(0x4002_3808, 25 << 16)
        .write(0x4002_3800, 0x81 | 1 << 16)
        .set(3, 20_000)
        .raw(&[0x3b01, 0xd1fd])
        .write(0x4001_4850, 2)
        .write(0x4001_4818, 1 | 3 << 2)
        .write(0x4001_4820, 1)
        .write(0x4001_4800, 1)
        .set(3, 300)
        .raw(&[0x3b01, 0xd1fd])
        .log(0x4001_4834, 4)
        .set(3, 105)
        .raw(&[0x3b01, 0xd1fd])
        .log(0x4001_4834, 5)
        .raw(&[FOREVER]);
    for (hz, clocks) in [(8_000_000, 400), (12_000_000, 267), (16_000_000, 200)] {
        let mut conditions = Conditions::f405(1);
        conditions.crystal.hz = hz;
        let mut board = SimulatedBoard::power_on(&image(&main, &[]), &conditions, Rules::STRICT).unwrap();
        board.run_until(20_000 * US).unwrap();
        let between = logged(&board, 5).wrapping_sub(logged(&board, 4)) & 0xffff;
        let turns = (between + clocks / 2) / clocks;
        assert!(turns >= 1 && between.abs_diff(turns * clocks) <= turns, "{hz}: {between}");
    }
}

#[test]
fn external_edges_stay_until_they_are_cleared() {
    let main = clocks_on()
        .write(0x4001_3814, 1 << 4)
        .write(0x4001_3c0c, 1 << 13)
        .write(0x4001_3c00, 1 << 13)
        .set(3, 800)
        .raw(&[0x3b01, 0xd1fd])
        .log(0x4001_3c14, 4)
        .write(0x4001_3c14, 1 << 13)
        .log(0x4001_3c14, 5)
        .raw(&[FOREVER]);
    let mut board = board(&main, &[], Rules::STRICT);
    board.apply(Input::Level(pin('B', 13), ExternalLevel::High));
    board.at(50 * US, Input::Level(pin('B', 13), ExternalLevel::Low));
    board.at(50 * US + 100, Input::Level(pin('B', 13), ExternalLevel::High));
    board.run_until(400 * US).unwrap();
    assert_eq!((logged(&board, 4), logged(&board, 5)), (1 << 13, 0));
}

#[test]
fn memory_is_random_at_power_on_and_stays_over_a_reset() {
    let main = Code::new().raw(&[NOP]);
    let word = |seed| {
        let conditions = Conditions::f405(seed);
        let board = SimulatedBoard::power_on(&image(&main, &[]), &conditions, Rules::STRICT).unwrap();
        board.word(0x2000_8000).unwrap()
    };
    assert_ne!(word(1), word(2));
    assert_eq!(word(1), word(1));
    // AIRCR.SYSRESETREQ once: RCC_CSR then has SFTRSTF, and memory is as before.
    let main = Code::new()
        .log(0x4002_3874, 8)
        .read(LOG + 48)
        .set(3, 0x1234_5678)
        .raw(&[0x429a, 0xd00d])
        .set(0, LOG + 48)
        .raw(&[0x6003])
        .write(0xe000_ed0c, 0x05fa_0004);
    let board = after(&main, &[], 300);
    assert_eq!(logged(&board, 12), 0x1234_5678);
    assert!(board.resets() >= 1);
    assert_ne!(logged(&board, 8) & 1 << 28, 0);
}

#[test]
fn a_brown_out_resets_and_power_comes_back() {
    let mut board = board(&Code::new().append(1), &[], Rules::STRICT);
    board.run_until(100 * US).unwrap();
    board.apply(Input::ChipSupply(1.2));
    board.run_until(200 * US).unwrap();
    board.apply(Input::ChipSupply(3.3));
    board.run_until(300 * US).unwrap();
    assert_eq!(board.resets(), 1);
}

#[test]
fn a_flipped_bit_in_flash_is_executed() {
    let mut board = board(&Code::new().raw(&[0xe7fe]), &[], Rules::STRICT);
    board.run_until(10 * US).unwrap();
    let at = board.program_counter();
    // b . (0xe7fe) becomes 0xe77e: a jump elsewhere.
    board.apply(Input::FlipBit { address: at, bit: 7 });
    let ended = board.run_until(1_000 * US);
    assert!(ended.is_err() || board.program_counter() != at, "{ended:?}");
    assert!(!matches!(ended, Err(stopped) if stopped.violation == Violation::Trap));
}
