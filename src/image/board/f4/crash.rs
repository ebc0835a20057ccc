//! The record of a crash, which survives a reset.

use core::mem::MaybeUninit;
use upright::protocol::message::CrashRecord;

use cortex_m::peripheral::SCB;

/// The last crash. It is not initialised at start-up, so it survives a reset.
#[unsafe(link_section = ".uninit.CRASH")]
static mut CRASH: MaybeUninit<Crash> = MaybeUninit::uninit();

#[repr(C)]
#[derive(Clone, Copy)]
struct Crash {
    mark: u32,
    record: CrashRecord,
}

/// Mark of a crash that caused the last reset, and of an older one. After power-on the mark is random.
const NEW: u32 = 0x5afe_0ff5;
const OLD: u32 = 0x5afe_0ff6;

/// Whether the program crashed before this reset, and the record of the last crash since power-on.
pub(super) fn take() -> (bool, Option<CrashRecord>) {
    let cell = (&raw mut CRASH).cast::<Crash>();
    // SAFETY: nothing else runs yet. After power-on the memory holds arbitrary bits, which are valid for this type.
    unsafe {
        let Crash { mark, record } = cell.read_volatile();
        if mark == NEW {
            (&raw mut (*cell).mark).write_volatile(OLD);
        }
        (mark == NEW, matches!(mark, NEW | OLD).then_some(record))
    }
}

/// Records a crash: PC, LR, CFSR, HFSR, BFAR (ARM DDI 0403, B3.2), PC and LR 0 if they are not saved. At `frame` the
/// processor has saved R0 to R3, R12, LR, PC and XPSR (ARM DDI 0403, B1.5.6), unless `frame` is outside the memory:
/// null after a panic, below the memory after a stack overflow.
pub(super) fn record(frame: *const u32) {
    let is_saved = (0x2000_0000..=0x2001_ffe0).contains(&(frame as u32)) && frame.is_aligned();
    // SAFETY: the frame is in memory; nothing else runs any more; reading these registers has no side effect.
    unsafe {
        let saved = |word: usize| if is_saved { frame.add(word).read_volatile() } else { 0 };
        let scb = &*SCB::PTR;
        let record = CrashRecord([saved(6), saved(5), scb.cfsr.read(), scb.hfsr.read(), scb.bfar.read()]);
        (&raw mut CRASH).cast::<Crash>().write_volatile(Crash { mark: NEW, record });
    }
}
