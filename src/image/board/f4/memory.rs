//! Memory that nobody writes, checked while the processor has nothing else to do.

use upright::gains::{SENSORS, STATES};
use upright::table::GainTable;
use upright::table::checksum::crc32;

/// Ticks from one check to the next: 8 ms, if a tick is shorter. A check empties the caches of the flash, so the tick
/// after it takes longer.
const TICKS_PER_CHECK: u32 = {
    let ticks = super::CLOCK_HZ / 125 / crate::CYCLES_PER_TICK;
    if ticks > 1 { ticks } else { 1 }
};
/// Bytes of the image that a check reads: 48 KiB in less than half a second.
const BYTES_PER_CHECK: usize = 1024;

unsafe extern "C" {
    static __sdata: u32;
    static __edata: u32;
    static __sidata: u32;
}

/// The image in flash: from its start to the end of the initial values of variables, which come last.
fn image() -> &'static [u8] {
    const FLASH: usize = 0x0800_0000;
    // SAFETY: symbols of the linker, of which only the addresses are used, and the image's own memory.
    unsafe {
        let values = (&raw const __edata) as usize - (&raw const __sdata) as usize;
        let end = (&raw const __sidata) as usize + values;
        core::slice::from_raw_parts(FLASH as *const u8, end - FLASH)
    }
}

/// CRC-32 of the image, which identifies it.
pub(super) fn image_checksum() -> u32 {
    crc32(0, image())
}

/// Checks the gain table in RAM and the image in flash again and again.
pub(crate) struct MemoryCheck {
    table: &'static GainTable<STATES, SENSORS>,
    image_checksum: u32,
    /// Interrupts until the next check, one of them in each tick.
    wait: u32,
    /// Bytes of the image that have been read, and their CRC-32.
    read: usize,
    crc: u32,
}

impl MemoryCheck {
    /// `image_checksum` is that of the start.
    pub(crate) fn new(table: &'static GainTable<STATES, SENSORS>, image_checksum: u32) -> Self {
        Self { table, image_checksum, wait: TICKS_PER_CHECK, read: 0, crc: 0 }
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
        let rest = image().get(self.read..).unwrap_or_default();
        let part = rest.get(..BYTES_PER_CHECK).unwrap_or(rest);
        self.crc = crc32(self.crc, part);
        self.read += part.len();
        if !part.is_empty() {
            return None;
        }
        let has_changed = self.crc != self.image_checksum;
        (self.read, self.crc) = (0, 0);
        has_changed.then_some(rest.as_ptr() as u32)
    }
}
