//! The image in flash, and the tables in it.

use upright::flash_image::ImageTables;

use crate::gains::{SENSORS, STATES};

/// The board's name.
const NAME: &str = env!("UPRIGHT_BOARD");

/// What both boards have at least.
const FLASH_END: usize = 0x1000_0000 + 2048 * 1024;

unsafe extern "C" {
    static __sdata: u32;
    static __edata: u32;
    static __sidata: u32;
    static __vector_table: u32;
    static mut __euninit: u32;
    static __ram_end: u32;
}

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

fn in_flash() -> ImageTables<'static> {
    ImageTables::at(flash(code_end(), FLASH_END), NAME, [STATES, SENSORS])
}

/// The tables of the rig, copied into RAM, where no tick waits for the flash and its cache. To be called once.
pub(crate) fn tables() -> ImageTables<'static> {
    let tables = in_flash();
    let begin = &raw mut __euninit;
    let room = (&raw const __ram_end) as usize - begin as usize;
    if size_of_val(tables.words) > room {
        return tables;
    }
    // SAFETY: there is room behind all variables, and nothing else uses it.
    let words = unsafe {
        begin.copy_from_nonoverlapping(tables.words.as_ptr(), tables.words.len());
        core::slice::from_raw_parts(begin, tables.words.len())
    };
    ImageTables::at(words, NAME, [STATES, SENSORS])
}

/// The image in flash, from its vector table on, with the tables: the boot ROM checks what an RP2040 has before it.
pub(super) fn words() -> &'static [u32] {
    flash((&raw const __vector_table) as usize, code_end() + size_of_val(in_flash().words))
}
