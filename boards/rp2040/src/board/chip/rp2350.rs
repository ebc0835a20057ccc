//! What the RP2350 has otherwise than the RP2040. Sections are those of its own datasheet.

use hal::block::ImageDef;
pub(in crate::board) use hal::pac::{USB as UsbRegisters, USB_DPRAM as UsbMemory};
use upright::boards::rp::RpChip;

/// Processor clock (Hz).
pub(crate) const CLOCK_HZ: u32 = RpChip::Rp2350.clock_hz();

/// Bits of the blocks that this image uses, in RESETS (7.5.3): converter, pins, pads, both PIO, PWM.
pub(in crate::board) const BLOCKS: u32 = 1 << 0 | 1 << 6 | 1 << 9 | 1 << 11 | 1 << 12 | 1 << 16;

/// Name on the bus.
pub(in crate::board) const PRODUCT: &str = "Upright on a Pico 2";

/// Tells the boot ROM that this is a program for its Arm cores (5.9).
#[unsafe(link_section = ".start_block")]
#[used]
static IMAGE: ImageDef = ImageDef::secure_exe();
