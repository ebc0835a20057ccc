//! Memory that nobody writes, checked while the processor has nothing else to do.

use upright::flash_image::{REFERENCE, WordSums};
use upright::gains::{SENSORS, STATES};
use upright::table::GainTable;

/// Ticks from one check to the next: 8 ms, if a tick is shorter. A check empties the caches of the flash, so the tick
/// after it takes longer.
const TICKS_PER_CHECK: u32 = {
    let ticks = super::CLOCK_HZ / 125 / crate::CYCLES_PER_TICK;
    if ticks > 1 { ticks } else { 1 }
};
/// Checks in which all of the image is read, whatever its size: 0.1 s. A bit that changes just behind the reader is
/// found at the end of the next pass, so within 0.2 s.
const CHECKS_PER_PASS: usize = {
    let checks = super::CLOCK_HZ / 10 / (TICKS_PER_CHECK * crate::CYCLES_PER_TICK);
    if checks > 1 { checks as usize } else { 1 }
};

unsafe extern "C" {
    static __sdata: u32;
    static __edata: u32;
    static __sidata: u32;
}

/// The image in flash: from its start to the end of the initial values of variables, which come last.
pub(super) fn words() -> &'static [u32] {
    const FLASH: usize = 0x0800_0000;
    // SAFETY: symbols of the linker, of which only the addresses are used, and the image's own memory.
    unsafe {
        let values = (&raw const __edata) as usize - (&raw const __sdata) as usize;
        let end = (&raw const __sidata) as usize + values;
        core::slice::from_raw_parts(FLASH as *const u32, (end - FLASH) / 4)
    }
}

/// The checksum of the image as it is now.
pub(super) fn of_image() -> WordSums {
    let mut sums = WordSums::default();
    add(&mut sums, words().get(..REFERENCE.start).unwrap_or_default());
    add(&mut sums, words().get(REFERENCE.end..).unwrap_or_default());
    sums
}

// Once in the image.
#[inline(never)]
fn add(sums: &mut WordSums, words: &[u32]) {
    sums.add(words);
}

/// Checks the gain table in RAM and the image in flash again and again.
pub(crate) struct MemoryCheck {
    table: &'static GainTable<STATES, SENSORS>,
    /// WordSums of the image at the start.
    reference: WordSums,
    /// Interrupts until the next check, one of them in each tick.
    wait: u32,
    /// Words of the image that have been read, and their sums.
    read: usize,
    sums: WordSums,
}

impl MemoryCheck {
    /// The check of this table, and of the image as it is now.
    pub(super) fn new(table: &'static GainTable<STATES, SENSORS>) -> Self {
        let mut reference = WordSums::default();
        add(&mut reference, words());
        Self { table, reference, wait: TICKS_PER_CHECK, read: 0, sums: WordSums::default() }
    }

    /// To be called after each interrupt. If it is time, compares all of the table with its initial values in flash,
    /// and reads the next part of the image. Returns where a bit has changed: the address of the table's word, or of
    /// the end of the image.
    pub(crate) fn advance(&mut self) -> Option<u32> {
        self.wait -= 1;
        if self.wait > 0 {
            return None;
        }
        self.wait = TICKS_PER_CHECK;
        let table = core::ptr::from_ref(self.table).cast::<u32>();
        for word in 0..size_of_val(self.table) / 4 {
            // SAFETY: within the table, and within its initial values, which lie in flash as the variables do in RAM.
            // Volatile, because the compiler knows that nobody writes the table.
            unsafe {
                let at = table.add(word);
                let initial = (&raw const __sidata).byte_add(at as usize - (&raw const __sdata) as usize);
                if at.read_volatile() != initial.read_volatile() {
                    return Some(at as u32);
                }
            }
        }
        let rest = words().get(self.read..).unwrap_or_default();
        let part = rest.get(..words().len().div_ceil(CHECKS_PER_PASS)).unwrap_or(rest);
        add(&mut self.sums, part);
        self.read += part.len();
        if part.len() < rest.len() {
            return None;
        }
        let has_changed = self.sums != self.reference;
        (self.read, self.sums) = (0, WordSums::default());
        has_changed.then_some(rest.as_ptr_range().end as u32)
    }
}
