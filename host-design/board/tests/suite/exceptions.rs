//! Exceptions, priorities, lazy stacking, IT blocks, faults and memory protection, by directed programs.

use crate::program::{
    Code, INTERRUPTS_OFF, INTERRUPTS_ON, LOG, NOP, RETURN, STACK, SYNC, WFI, appended, board, logged, run,
};
use upright_board::{Rules, UNITS_PER_MICROSECOND};

const SYSTICK: usize = 15;
const PENDING: u32 = 0xe000_e200;
const ENABLE: u32 = 0xe000_e100;
const PRIORITY: u32 = 0xe000_e400;
const CPACR: u32 = 0xe000_ed88;

fn float_on() -> Code {
    Code::new().write(CPACR, 0x00f0_0000).raw(&SYNC)
}

#[test]
fn the_tick_comes_at_its_period_and_ends_the_wait_once() {
    let timer = Code::new().write(0xe000_e014, 1599).write(0xe000_e018, 0).write(0xe000_e010, 7);
    let main = timer.raw(&[WFI]).append(2).raw(&[0xe7f3]);
    let board = run(&main, &[(SYSTICK, Code::new().append(1).raw(&[RETURN]))], 1_050).unwrap();
    // 1600 cycles at 16 MHz are 100 µs; the set-up takes less than 5.
    assert_eq!(appended(&board), [1, 2].repeat(10));
}

/// Interrupts 0, 1 and 2 with priorities 0x80, 0x40 and 0x20.
fn three_interrupts(main: Code) -> Code {
    Code::new().write(PRIORITY, 0x0020_4080).write(ENABLE, 7).raw(&main.0)
}

#[test]
fn the_more_urgent_comes_first_and_the_next_is_chained() {
    let main = three_interrupts(
        Code::new().raw(&[INTERRUPTS_OFF]).write(PENDING, 3).append(9).raw(&[INTERRUPTS_ON, NOP]).append(8),
    );
    let handlers = [(16, Code::new().append(0).raw(&[RETURN])), (17, Code::new().append(1).raw(&[RETURN]))];
    let board = run(&main, &handlers, 100).unwrap();
    assert_eq!(appended(&board), [9, 1, 0, 8]);
    assert_eq!(board.registers()[13], STACK);
}

#[test]
fn a_more_urgent_interrupt_preempts_and_a_less_urgent_waits() {
    let main = three_interrupts(Code::new().write(PENDING, 2).raw(&[NOP, NOP]).append(8));
    let outer = Code::new().raw(&[0xb510]).append(1).write(PENDING, 5).raw(&SYNC).append(11).raw(&[0xbd10]);
    let inner = Code::new().append(2).raw(&[RETURN]);
    let late = Code::new().append(0).raw(&[RETURN]);
    let board = run(&main, &[(17, outer), (18, inner), (16, late)], 100).unwrap();
    assert_eq!(appended(&board), [1, 2, 11, 0, 8]);
}

#[test]
fn basepri_masks_the_less_urgent() {
    let main = three_interrupts(
        Code::new()
            .set(3, 0x40)
            .raw(&[0xf383, 0x8811])
            .write(PENDING, 7)
            .raw(&SYNC)
            .append(9)
            .set(3, 0)
            .raw(&[0xf383, 0x8811, NOP]),
    );
    let handler = |number| Code::new().append(number).raw(&[RETURN]);
    let board = run(&main, &[(16, handler(0)), (17, handler(1)), (18, handler(2))], 100).unwrap();
    assert_eq!(appended(&board), [2, 9, 1, 0]);
}

#[test]
fn a_handler_without_floating_point_leaves_the_frame_unwritten() {
    // s0 = 1.0; 0x5555_5555 where its place in the frame will be; interrupt 0; s0 to the log.
    let place = STACK - 0x68 + 0x20;
    let main = float_on()
        .write(place, 0x5555_5555)
        .raw(&[0xeeb7, 0x0a00])
        .write(ENABLE, 1)
        .write(PENDING, 1)
        .raw(&SYNC)
        .log(place, 4)
        .raw(&[0xee10, 0x2a10])
        .set(0, LOG + 20)
        .raw(&[0x6002]);
    let handler = Code::new().log(0xe000_ef34, 2).log(0xe000_ef38, 3).raw(&[RETURN]);
    let board = run(&main, &[(16, handler)], 100).unwrap();
    assert_eq!(logged(&board, 2) & 1, 1, "LSPACT");
    assert_eq!(logged(&board, 3), place);
    assert_eq!(logged(&board, 4), 0x5555_5555);
    assert_eq!(logged(&board, 5), 1f32.to_bits());
    assert_eq!(board.registers()[13], STACK);
}

#[test]
fn a_handler_with_floating_point_saves_and_restores() {
    let place = STACK - 0x68 + 0x20;
    let main = float_on()
        .raw(&[0xeeb7, 0x0a00])
        .write(ENABLE, 1)
        .write(PENDING, 1)
        .raw(&SYNC)
        .log(place, 4)
        .raw(&[0xee10, 0x2a10])
        .set(0, LOG + 20)
        .raw(&[0x6002]);
    // s0 = s0 + s0 in the handler.
    let handler = Code::new().raw(&[0xee30, 0x0a00]).log(0xe000_ef34, 2).raw(&[RETURN]);
    let board = run(&main, &[(16, handler)], 100).unwrap();
    assert_eq!(logged(&board, 2) & 1, 0, "LSPACT is over");
    assert_eq!(logged(&board, 4), 1f32.to_bits(), "saved");
    assert_eq!(logged(&board, 5), 1f32.to_bits(), "restored");
}

#[test]
fn an_it_block_goes_on_after_an_interrupt() {
    // r0 = PENDING, r1 = 1, r3 = r4 = 0, Z; ITTE EQ: store, r3 += 1 without flags; else r4 += 1.
    let main = Code::new()
        .write(ENABLE, 1)
        .set(0, PENDING)
        .raw(&[0x2101, 0x2300, 0x2400, 0xbf06, 0x6001, 0x3301, 0x3401])
        .set(0, LOG + 20)
        .raw(&[0x6003, 0x6044]);
    let board = run(&main, &[(16, Code::new().append(7).raw(&[0x2501, RETURN]))], 100).unwrap();
    assert_eq!((logged(&board, 5), logged(&board, 6)), (1, 0));
    assert_eq!(appended(&board), [7]);
}

#[test]
fn svc_returns_behind_itself() {
    let main = Code::new().append(1).raw(&[0xdf00]).append(3);
    let board = run(&main, &[(11, Code::new().append(2).raw(&[RETURN]))], 100).unwrap();
    assert_eq!(appended(&board), [1, 2, 3]);
}

#[test]
fn a_stack_overflow_into_a_protected_region_is_a_hard_fault() {
    // Region 0: no access to the 256 bytes below the stack's lowest 0x100; the stack is moved there.
    let main = Code::new()
        .write(0xe000_ed98, 0)
        .write(0xe000_ed9c, 0x2000_1000)
        .write(0xe000_eda0, 7 << 1 | 1)
        .write(0xe000_ed94, 5)
        .raw(&SYNC)
        .set(3, 0x2000_1104)
        .raw(&[0x469d, 0xb500, 0xb500, 0xb500]);
    let handler = Code::new().set(3, STACK).raw(&[0x469d]).append(3).log(0xe000_ed2c, 4).log(0xe000_ed28, 5);
    let board = run(&main, &[(3, handler)], 100).unwrap();
    assert_eq!(appended(&board), [3]);
    assert_eq!(logged(&board, 4), 1 << 30, "forced");
    assert_eq!(logged(&board, 5) & 0xff, 1 << 7 | 1 << 4 | 1 << 1, "MMARVALID, MSTKERR, DACCVIOL");
}

#[test]
fn without_the_region_the_same_program_goes_on() {
    let main = Code::new().set(3, 0x2000_1104).raw(&[0x469d, 0xb500, 0xb500, 0xb500]).append(8);
    assert_eq!(appended(&run(&main, &[], 100).unwrap()), [8]);
}

#[test]
fn a_fault_in_the_fault_handler_locks_the_core_up_until_the_watchdog() {
    let rules = Rules { faults_are_taken: true, ..Rules::STRICT };
    let start_watchdog = Code::new().write(0x4000_3000, 0xcccc);
    let main = start_watchdog.append(1).raw(&[0xde00]);
    let mut board = board(&main, &[(3, Code::new().append(3).raw(&[0xde00]))], rules);
    board.run_until(1_000 * UNITS_PER_MICROSECOND).unwrap();
    assert!(board.locked_up());
    assert_eq!(appended(&board), [1, 3]);
    // 4096 counts at 32 kHz / 4: 512 ms.
    board.run_until(511_000 * UNITS_PER_MICROSECOND).unwrap();
    assert_eq!(board.resets(), 0);
    board.run_until(513_000 * UNITS_PER_MICROSECOND).unwrap();
    assert_eq!(board.resets(), 1);
}

#[test]
fn a_usage_fault_comes_where_it_is_enabled() {
    let rules = Rules { faults_are_taken: true, ..Rules::STRICT };
    let main = Code::new().write(0xe000_ed24, 1 << 18).append(1).raw(&[0xde00]);
    let mut board =
        board(&main, &[(6, Code::new().append(6).log(0xe000_ed28, 5)), (3, Code::new().append(3))], rules);
    board.run_until(100 * UNITS_PER_MICROSECOND).unwrap();
    assert_eq!(appended(&board), [1, 6]);
    assert_eq!(logged(&board, 5), 1 << 16, "UNDEFINSTR");
}

#[test]
fn the_process_stack_is_used_in_thread_mode_alone() {
    // PSP = 0x2000_3000, CONTROL = 2, ISB, SVC: the frame lies on the process stack, the handler's SP is the main one.
    let main = Code::new()
        .set(3, 0x2000_3000)
        .raw(&[0xf383, 0x8809])
        .set(3, 2)
        .raw(&[0xf383, 0x8814, 0xf3bf, 0x8f6f, 0xdf00])
        .set(0, LOG + 24)
        .raw(&[0x466a, 0x6002]);
    let handler = Code::new().set(0, LOG + 16).raw(&[0x466a, 0x6002, 0xf3ef, 0x8209, 0x6042, RETURN]);
    let board = run(&main, &[(11, handler)], 100).unwrap();
    assert_eq!(logged(&board, 4), STACK);
    assert_eq!(logged(&board, 5), 0x2000_3000 - 0x20);
    assert_eq!(logged(&board, 6), 0x2000_3000);
}
