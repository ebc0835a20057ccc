//! Every strict rule is broken by a program that must not run; the same programs without the mistake do run.

use crate::program::{APB2ENR, Code, SYNC, clocks_on, run};
use upright_board::Violation;

fn breaks(code: Code) -> Violation {
    match run(&code, &[], 5_000) {
        Err(stopped) => stopped.violation,
        Ok(_) => panic!("the program must break something"),
    }
}

fn is_fine(code: Code) {
    if let Err(stopped) = run(&code, &[], 5_000) {
        panic!("{stopped}");
    }
}

fn write(address: u32, value: u32) -> Code {
    clocks_on().write(address, value)
}

#[test]
fn an_unknown_register_ends_the_run() {
    assert_eq!(breaks(write(0x4001_0050, 0)), Violation::UnknownRegister(0x4001_0050));
    assert_eq!(breaks(clocks_on().read(0x4002_38f0)), Violation::UnknownRegister(0x4002_38f0));
    assert_eq!(breaks(write(0xe000_ef90, 0)), Violation::UnknownRegister(0xe000_ef90));
    is_fine(write(0x4001_0034, 0));
}

#[test]
fn a_reserved_bit_ends_the_run() {
    let expected = Violation::ReservedBits { address: 0x4000_042c, bits: 0xffff_0000 };
    assert_eq!(breaks(write(0x4000_042c, u32::MAX)), expected);
    assert_eq!(
        breaks(write(0x4001_0010, 0xffff_ff7f)),
        Violation::ReservedBits { address: 0x4001_0010, bits: 0xffff_e100 }
    );
    is_fine(write(0x4000_042c, 0xffff));
    // Two counters have 32 bits.
    is_fine(write(0x4000_002c, u32::MAX));
    // A reserved bit that is one must stay so.
    assert!(matches!(
        breaks(write(0x4002_3804, 0x0400_3010)),
        Violation::ReservedBits { bits: 0x2000_0000, .. }
    ));
}

#[test]
fn ones_to_read_only_bits_end_the_run() {
    let expected = Violation::ReadOnlyBits { address: 0x4002_3800, bits: 2 };
    assert_eq!(breaks(write(0x4002_3800, 0x83)), expected);
    is_fine(write(0x4002_3800, 0x81));
}

#[test]
fn a_wrong_width_ends_the_run() {
    // STRB, STRH.
    let byte = clocks_on().set(0, 0x4001_0034).raw(&[0x7001]);
    assert_eq!(breaks(byte), Violation::Width { address: 0x4001_0034, bytes: 1 });
    let half = clocks_on().set(0, 0x4001_2000).raw(&[0x8001]);
    assert_eq!(breaks(half), Violation::Width { address: 0x4001_2000, bytes: 2 });
    is_fine(clocks_on().set(0, 0x4002_0414).set(1, 1).raw(&[0x7001]));
}

#[test]
fn a_peripheral_without_clock_ends_the_run() {
    assert_eq!(breaks(Code::new().write(0x4001_002c, 1)), Violation::NoClock(0x4001_002c));
    assert_eq!(breaks(Code::new().read(0x4002_0010)), Violation::NoClock(0x4002_0010));
    is_fine(clocks_on().read(0x4002_0010));
}

#[test]
fn a_peripheral_before_its_delay_is_over_ends_the_run() {
    // r0 = APB2ENR, r1 = TIM1EN, r2 = TIM1_ARR.
    let enable = Code::new().set(0, APB2ENR).set(1, 1).set(2, 0x4001_002c).raw(&[0x6001]);
    let expected = |cycles| Violation::Early { address: 0x4001_002c, cycles };
    assert_eq!(breaks(enable.clone().raw(&[0x6011])), expected(2));
    assert_eq!(breaks(enable.clone().raw(&[0xbf00, 0x6011])), expected(1));
    is_fine(enable.clone().raw(&[0xbf00, 0xbf00, 0x6011]));
    is_fine(enable.raw(&SYNC).raw(&[0x6011]));
}

#[test]
fn unknown_and_unpredictable_instructions_end_the_run() {
    assert_eq!(breaks(Code::new().raw(&[0xba80])), Violation::UnknownInstruction(0xba80));
    // VADD.F64
    let double = Code::new().write(0xe000_ed88, 0x00f0_0000).raw(&[0xee30, 0x0b00]);
    assert_eq!(breaks(double), Violation::UnknownInstruction(0xee30_0b00));
    // ADD.W R0, R0, PC and an empty register list.
    assert_eq!(breaks(Code::new().raw(&[0xeb00, 0x000f])), Violation::Unpredictable(0xeb00_000f));
    assert_eq!(breaks(Code::new().raw(&[0xb400])), Violation::Unpredictable(0xb400));
    // CBZ within an IT block; a branch that is not its last instruction.
    assert_eq!(breaks(Code::new().raw(&[0x2000, 0x4280, 0xbf08, 0xb100])), Violation::Unpredictable(0xb100));
    assert_eq!(breaks(Code::new().raw(&[0x2000, 0x4280, 0xbf04, 0xe000])), Violation::Unpredictable(0xe000));
    assert_eq!(breaks(Code::new().raw(&[0xde00])), Violation::Trap);
}

#[test]
fn unaligned_and_unmapped_accesses_end_the_run() {
    assert_eq!(breaks(clocks_on().read(0x4001_0036)), Violation::Unaligned(0x4001_0036));
    assert_eq!(breaks(Code::new().read(0x6000_0000)), Violation::Unmapped(0x6000_0000));
    assert_eq!(breaks(Code::new().write(0x1fff_fffc, 0)), Violation::ReadOnly(0x1fff_fffc));
    assert_eq!(breaks(Code::new().write(0x2002_0000, 0)), Violation::Unmapped(0x2002_0000));
    assert_eq!(breaks(Code::new().write(0x0800_0000, 0)), Violation::ReadOnly(0x0800_0000));
    // A jump to where nothing is.
    assert_eq!(breaks(Code::new().set(0, 0x3000_0001).raw(&[0x4700])), Violation::Unmapped(0x3000_0000));
    is_fine(Code::new().read(0x2000_1002));
}

#[test]
fn clocks_outside_their_limits_end_the_run() {
    // PLL from HSI, 16 MHz / 16 × 336 / 2 = 168 MHz, without wait states and with undivided buses.
    let pll = Code::new()
        .write(0x4002_3804, 0x2000_0000 | 7 << 24 | 336 << 6 | 16)
        .write(0x4002_3800, 1 << 24 | 0x81)
        // 4000 iterations: longer than the PLL takes to lock.
        .set(3, 4000)
        .raw(&[0x3b01, 0xd1fd]);
    let with = |acr: u32, cfgr: u32| pll.clone().write(0x4002_3c00, acr).write(0x4002_3808, cfgr);
    assert_eq!(breaks(with(5, 2)), Violation::ClockTooFast(168_000_000));
    is_fine(with(5, 2 | 5 << 10 | 4 << 13));
    assert!(matches!(breaks(with(4, 2 | 5 << 10 | 4 << 13)), Violation::WaitStates(4)));
    let fast = Code::new()
        .write(0x4002_3804, 0x2000_0000 | 7 << 24 | 336 << 6 | 8)
        .write(0x4002_3800, 1 << 24 | 0x81);
    assert_eq!(breaks(fast), Violation::ClockTooFast(672_000_000));
    let input = Code::new()
        .write(0x4002_3804, 0x2000_0000 | 7 << 24 | 100 << 6 | 4)
        .write(0x4002_3800, 1 << 24 | 0x81);
    assert!(matches!(breaks(input), Violation::Forbidden(_)));
}

#[test]
fn forbidden_settings_and_unknown_modes_end_the_run() {
    // The watchdog's registers without their key, a key that does not exist.
    assert!(matches!(breaks(write(0x4000_3008, 9)), Violation::Forbidden(_)));
    assert!(matches!(breaks(write(0x4000_3000, 0x1234)), Violation::Forbidden(_)));
    // A conversion at once after the converter is switched on; a reserved pull.
    assert!(matches!(breaks(write(0x4001_2008, 1).write(0x4001_2008, 0x4000_0001)), Violation::Forbidden(_)));
    assert!(matches!(breaks(write(0x4002_040c, 3)), Violation::Forbidden(_)));
    // Centre-aligned PWM, a slave mode of an encoder's timer that is not modelled, SLEEPDEEP.
    assert!(matches!(breaks(write(0x4001_0000, 0x20)), Violation::NotModelled(_)));
    assert!(matches!(breaks(write(0x4000_0008, 4)), Violation::NotModelled(_)));
    assert!(matches!(breaks(write(0xe000_ed10, 4)), Violation::NotModelled(_)));
}
