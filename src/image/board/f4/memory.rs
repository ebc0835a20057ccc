//! Memory that nobody writes, checked while the processor has nothing else to do.

use upright::flash_image::{ImageTables, REFERENCE, WordSums};
use upright::gains::{SENSORS, STATES};
use upright::table::GainTable;

use super::chosen::NAME;

/// Time from one check to the next (s), if a tick is shorter. A check empties the caches of the flash, so the tick
/// after it takes longer.
const CHECK_S: f32 = 8e-3;
/// Time in which all of the image is read, whatever its size (s). A bit that changes just behind the reader is found at
/// the end of the next pass, so within twice this time.
const PASS_S: f32 = 0.1;

unsafe extern "C" {
    static __sdata: u32;
    static __edata: u32;
    static __sidata: u32;
}

const FLASH: usize = 0x0800_0000;
/// The smallest flash of the chips.
const FLASH_END: usize = FLASH + 512 * 1024;

/// The words of flash from `begin` to `end`.
fn flash(begin: usize, end: usize) -> &'static [u32] {
    // SAFETY: within the flash, which nothing writes.
    unsafe { core::slice::from_raw_parts(begin as *const u32, end.saturating_sub(begin) / 4) }
}

/// Where the code ends: behind the initial values of variables, which come last.
fn code_end() -> usize {
    let values = (&raw const __edata) as usize - (&raw const __sdata) as usize;
    (&raw const __sidata) as usize + values
}

/// The tables of the rig, behind the code.
pub(crate) fn tables() -> ImageTables<'static> {
    ImageTables::at(flash(code_end(), FLASH_END), NAME, [STATES, SENSORS])
}

/// The image in flash: code and tables. Where it ends is read from the tables.
pub(super) fn words() -> &'static [u32] {
    flash(FLASH, code_end() + size_of_val(tables().words))
}

/// The checksum of an image.
pub(super) fn of_image(image: &[u32]) -> WordSums {
    let mut sums = WordSums::default();
    add(&mut sums, image.get(..REFERENCE.start).unwrap_or_default());
    add(&mut sums, image.get(REFERENCE.end..).unwrap_or_default());
    sums
}

// Once in the image.
#[inline(never)]
fn add(sums: &mut WordSums, words: &[u32]) {
    sums.add(words);
}

/// Checks the gain table in RAM and the image in flash again and again.
pub(crate) struct MemoryCheck {
    tables: [&'static GainTable<STATES, SENSORS>; 2],
    /// The image, and its sums at the start.
    image: &'static [u32],
    reference: WordSums,
    /// Ticks from one check to the next, and words of the image that it reads.
    ticks_per_check: u32,
    words_per_check: usize,
    /// Interrupts until the next check, one of them in each tick.
    wait: u32,
    /// Words of the image that have been read, and their sums.
    read: usize,
    sums: WordSums,
}

impl MemoryCheck {
    /// The check of a table and its copy, and of the image as it is now.
    pub(super) fn new(
        tables: [&'static GainTable<STATES, SENSORS>; 2],
        image: &'static [u32],
        tick_s: f32,
    ) -> Self {
        let mut reference = WordSums::default();
        add(&mut reference, image);
        let ticks_per_check = ((CHECK_S / tick_s) as u32).max(1);
        let checks_per_pass = ((PASS_S / (ticks_per_check as f32 * tick_s)) as usize).max(1);
        Self {
            tables,
            image,
            reference,
            ticks_per_check,
            words_per_check: image.len().div_ceil(checks_per_pass),
            wait: ticks_per_check,
            read: 0,
            sums: WordSums::default(),
        }
    }

    /// To be called after each interrupt. If it is time, compares all of the table with its copy, and reads the next
    /// part of the image. Returns where a bit has changed: the address of the table's word, or of the end of the image.
    pub(crate) fn advance(&mut self) -> Option<u32> {
        self.wait -= 1;
        if self.wait > 0 {
            return None;
        }
        self.wait = self.ticks_per_check;
        let [table, copy] = self.tables.map(|table| core::ptr::from_ref(table).cast::<u32>());
        for word in 0..size_of::<GainTable<STATES, SENSORS>>() / 4 {
            // SAFETY: within the tables. Volatile, because the compiler knows that nobody writes them.
            unsafe {
                if table.add(word).read_volatile() != copy.add(word).read_volatile() {
                    return Some(table.add(word) as u32);
                }
            }
        }
        let rest = self.image.get(self.read..).unwrap_or_default();
        let part = rest.get(..self.words_per_check).unwrap_or(rest);
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
