//! Supply, debugger and identity of the chip, against the manuals (RM0090, RM0390).

use crate::program::{Code, FOREVER, LOG, RETURN, SYNC, appended, image, logged};
use upright_board::{
    BrownOut, Chip, Conditions, Input, Rules, SimulatedBoard, Stopped, UNITS_PER_MICROSECOND as US, Violation,
};

const PWR: u32 = 0x4000_7000;
const EXTI: u32 = 0x4001_3c00;
const ADC: u32 = 0x4001_2000;
const IWDG: u32 = 0x4000_3000;
const DBGMCU: u32 = 0xe004_2000;
const CSR: u32 = 0x4002_3874;

fn clocks_on() -> Code {
    Code::new().write(0x4002_3840, 0x1000_0000).write(0x4002_3844, 1 << 8 | 1 << 14).raw(&SYNC)
}

fn wait(turns: u32) -> Code {
    Code::new().set(3, turns).raw(&[0x3b01, 0xd1fd])
}

impl Code {
    fn then(self, next: &Code) -> Self {
        self.raw(&next.0)
    }
}

fn power_on(conditions: &Conditions, main: &Code, handlers: &[(usize, Code)]) -> SimulatedBoard {
    SimulatedBoard::power_on(&image(main, handlers), conditions, Rules::STRICT).unwrap()
}

fn f405(main: &Code) -> SimulatedBoard {
    power_on(&Conditions::f405(7), main, &[])
}

fn ends(main: &Code) -> Violation {
    let ended: Result<(), Stopped> = f405(main).run_until(5_000 * US);
    ended.expect_err("the program must break something").violation
}

/// Threshold 7 (3.03 V), line 16 rising, interrupt 1.
fn detector() -> Code {
    clocks_on()
        .write(EXTI + 8, 1 << 16)
        .write(EXTI, 1 << 16)
        .write(0xe000_e100, 1 << 1)
        .write(PWR, 1 << 14 | 7 << 5 | 1 << 4)
}

#[test]
fn the_voltage_detector_interrupts_as_the_supply_falls() {
    let handler = Code::new().append(1).write(EXTI + 0x14, 1 << 16).raw(&[RETURN]);
    let main = detector().raw(&[FOREVER]);
    let mut board = power_on(&Conditions::f405(7), &main, &[(17, handler.clone())]);
    board.run_until(100 * US).unwrap();
    assert_eq!(appended(&board), []);
    board.apply(Input::ChipSupply(2.95));
    board.run_until(120 * US).unwrap();
    assert_eq!(appended(&board), [1]);
    // Up again, less than the hysteresis, and down: nothing new. Beyond it: again.
    for (volts, count) in [(3.05, 1), (2.95, 1), (3.15, 1), (2.95, 2)] {
        board.apply(Input::ChipSupply(volts));
        board.run_until(board.now() + 20 * US).unwrap();
        assert_eq!(appended(&board).len(), count, "{volts}");
    }
    // A supply that is low when the detector is switched on.
    let mut low = power_on(&Conditions { chip_v: 2.9, ..Conditions::f405(7) }, &main, &[(17, handler)]);
    low.run_until(100 * US).unwrap();
    assert_eq!(appended(&low), [1]);
    // The negative control: the detector off.
    let off = clocks_on().write(PWR, 1 << 14 | 7 << 5).log(PWR + 4, 4).raw(&[FOREVER]);
    let mut board = power_on(&Conditions { chip_v: 2.9, ..Conditions::f405(7) }, &off, &[]);
    board.run_until(100 * US).unwrap();
    assert_eq!(logged(&board, 4) & 4, 0);
}

/// The typical values of datasheet DS8626.
#[test]
fn every_level_of_the_voltage_detector_has_its_own_thresholds() {
    let levels =
        [(2.04, 2.14), (2.19, 2.30), (2.35, 2.45), (2.51, 2.60), (2.66, 2.76), (2.84, 2.93), (2.93, 3.03)];
    for (level, (falling_v, rising_v)) in levels.into_iter().enumerate() {
        let handler = Code::new().append(1).write(EXTI + 0x14, 1 << 16).raw(&[RETURN]);
        let main = clocks_on()
            .write(EXTI + 8, 1 << 16)
            .write(EXTI, 1 << 16)
            .write(0xe000_e100, 1 << 1)
            .write(PWR, 1 << 14 | (level as u32) << 5 | 1 << 4)
            .raw(&[FOREVER]);
        let mut board = power_on(&Conditions::f405(7), &main, &[(17, handler)]);
        let just = 0.005;
        for (volts, count) in [
            (falling_v + just, 0),
            (falling_v - just, 1),
            (rising_v - just, 1),
            (falling_v - just, 1),
            (rising_v + just, 1),
            (falling_v - just, 2),
        ] {
            board.apply(Input::ChipSupply(volts));
            board.run_until(board.now() + 100 * US).unwrap();
            assert_eq!(appended(&board).len(), count, "level {level}: {volts} V");
        }
    }
}

#[test]
fn the_brown_out_level_of_the_option_bytes_resets() {
    let main = Code::new().log(0x4002_3c14, 4).log(CSR, 5).write(CSR, 1 << 24).raw(&[FOREVER]);
    for (brown_out, level_bits, volts, resets) in [
        (BrownOut::Off, 3, 1.9, 0),
        (BrownOut::Level1, 2, 2.3, 0),
        (BrownOut::Level1, 2, 2.1, 1),
        (BrownOut::Level2, 1, 2.4, 1),
        (BrownOut::Level3, 0, 2.7, 1),
    ] {
        let conditions = Conditions { brown_out, ..Conditions::f405(7) };
        let mut board = power_on(&conditions, &main, &[]);
        board.run_until(20 * US).unwrap();
        assert_eq!(logged(&board, 4) >> 2 & 3, level_bits);
        assert_eq!(logged(&board, 5) >> 25, 7, "power-on: PORRSTF, PINRSTF, BORRSTF");
        board.apply(Input::ChipSupply(volts));
        board.run_until(40 * US).unwrap();
        board.apply(Input::ChipSupply(3.3));
        board.run_until(60 * US).unwrap();
        assert_eq!(board.resets(), resets, "{brown_out:?} {volts}");
        if resets > 0 {
            assert_eq!(logged(&board, 5) >> 25, 3, "PINRSTF, BORRSTF");
        }
    }
}

#[test]
fn a_low_supply_needs_more_wait_states() {
    // 16 MHz needs none, 84 MHz from the PLL two at 3.3 V and three at 2.5 V.
    let fast = |states: u32| {
        Code::new()
            .write(0x4002_3804, 0x2000_0000 | 7 << 24 | 1 << 16 | 336 << 6 | 16)
            .write(0x4002_3800, 1 << 24 | 0x81)
            .then(&wait(4_000))
            .write(0x4002_3c00, states)
            .write(0x4002_3808, 2 | 4 << 10)
            .raw(&[FOREVER])
    };
    let ended = |volts, states| {
        let conditions = Conditions { chip_v: volts, ..Conditions::f405(7) };
        power_on(&conditions, &fast(states), &[]).run_until(5_000 * US).map_err(|stopped| stopped.violation)
    };
    assert_eq!(ended(3.3, 2), Ok(()));
    assert_eq!(ended(2.5, 2), Err(Violation::WaitStates(2)));
    assert_eq!(ended(2.5, 3), Ok(()));
}

#[test]
fn the_watchdog_goes_on_in_a_halt_unless_it_is_told_to_stop() {
    // 4 × 125 counts of 32 kHz: 15.6 ms; the program feeds it all the time.
    let start = |freeze: u32| {
        Code::new()
            .write(DBGMCU + 8, freeze)
            .write(IWDG, 0x5555)
            .write(IWDG + 8, 124)
            .then(&wait(4_000))
            .write(IWDG, 0xcccc)
            .set(0, IWDG)
            .set(1, 0xaaaa)
            .raw(&[0x6001, 0xe7fd])
    };
    for (freeze, resets) in [(0, 1), (1 << 12, 0)] {
        let mut board = f405(&start(freeze));
        board.run_until(5_000 * US).unwrap();
        board.apply(Input::Halt(true));
        let pc = board.program_counter();
        board.run_until(5_010 * US).unwrap();
        assert_eq!(board.program_counter(), pc);
        board.run_until(24_000 * US).unwrap();
        board.apply(Input::Halt(false));
        board.run_until(30_000 * US).unwrap();
        assert_eq!(board.resets(), resets, "{freeze:#x}");
    }
    assert!(matches!(ends(&Code::new().write(DBGMCU + 8, 1)), Violation::NotModelled(_)));
}

#[test]
fn the_chip_says_what_it_is() {
    let main = Code::new().log(DBGMCU, 4).read(0x1fff_7a20).set(0, LOG + 20).raw(&[0x6002, FOREVER]);
    for (chip, identity, kilobytes) in
        [(Chip::F405, 0x413, 1024), (Chip::F407, 0x413, 1024), (Chip::F446, 0x421, 512)]
    {
        let mut board = power_on(&Conditions::typical(chip, 7), &main, &[]);
        board.run_until(100 * US).unwrap();
        assert_eq!(logged(&board, 4) & 0xfff, identity);
        assert_eq!(logged(&board, 5) >> 16, kilobytes);
    }
    // Core-coupled memory, a bit of RCC that one of them has alone, and the reset value of PWR_CR.
    let core_coupled = Code::new().write(0x1000_0000, 1).raw(&[FOREVER]);
    assert!(f405(&core_coupled).run_until(100 * US).is_ok());
    let f446 = |main| power_on(&Conditions::typical(Chip::F446, 7), main, &[]).run_until(100 * US);
    assert_eq!(f446(&core_coupled).unwrap_err().violation, Violation::Unmapped(0x1000_0000));
    let divider = Code::new().write(0x4002_3804, 3 << 28 | 0x0400_3010).raw(&[FOREVER]);
    assert!(f446(&divider).is_ok());
    assert!(matches!(ends(&divider), Violation::ReservedBits { .. }));
    let over_drive = clocks_on().write(PWR, 0xc000 | 1 << 16).raw(&[FOREVER]);
    assert!(matches!(ends(&over_drive), Violation::ReservedBits { .. }));
}

/// The internal reference, sampled for `code`, `pause` turns after it is switched on.
fn reference(code: u32, pause: u32) -> Code {
    clocks_on()
        .write(ADC + 0x304, 1 << 23)
        .write(ADC + 0xc, code << 21)
        .write(ADC + 0x34, 17)
        .write(ADC + 8, 1)
        .then(&wait(pause))
        .write(ADC + 8, 0x4000_0001)
        .then(&wait(600))
        .log(ADC + 0x4c, 4)
        .read(0x1fff_7a28)
        .set(0, LOG + 20)
        .raw(&[0x6002, FOREVER])
}

#[test]
fn the_internal_reference_tells_the_supply() {
    for volts in [3.3, 3.0, 2.7] {
        let conditions = Conditions { chip_v: volts, ..Conditions::f405(7) };
        let mut board = power_on(&conditions, &reference(7, 100), &[]);
        board.run_until(1_000 * US).unwrap();
        let (measured, calibration) = (logged(&board, 4), logged(&board, 5) >> 16);
        // VDDA = 3.3 V × VREFIN_CAL / what is measured (RM0390, 13.10; datasheet).
        let found = 3.3 * calibration as f32 / measured as f32;
        assert!((found - volts).abs() < 0.01, "{volts}: {found}");
    }
    assert!(matches!(ends(&reference(0, 100)), Violation::Forbidden(why) if why.contains("TS_vrefint")));
    assert!(matches!(ends(&reference(7, 20)), Violation::Forbidden(why) if why.contains("tSTART")));
    // Switched off, the input reads nothing.
    let off = reference(7, 100).0;
    let begin = clocks_on().0.len();
    let write = Code::new().write(ADC + 0x304, 1 << 23).0.len();
    let without = Code([&off[..begin], &off[begin + write..]].concat());
    let mut board = f405(&without);
    board.run_until(1_000 * US).unwrap();
    assert_eq!(logged(&board, 4), 0);
}
