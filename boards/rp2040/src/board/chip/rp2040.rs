//! What the RP2040 has otherwise than the RP2350.

pub(in crate::board) use hal::pac::{USBCTRL_DPRAM as UsbMemory, USBCTRL_REGS as UsbRegisters};
use upright::boards::rp::RpChip;

/// Processor clock (Hz).
pub(crate) const CLOCK_HZ: u32 = RpChip::Rp2040.clock_hz();

/// Bits of the blocks that this image uses, in RESETS (2.14.3): converter, pins, pads, both PIO, PWM.
pub(in crate::board) const BLOCKS: u32 = 1 << 0 | 1 << 5 | 1 << 8 | 1 << 10 | 1 << 11 | 1 << 14;

/// Name on the bus.
pub(in crate::board) const PRODUCT: &str = "Upright on a Pico";

/// The second stage of the boot loader: it makes the flash readable.
#[unsafe(link_section = ".boot2")]
#[used]
static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_GENERIC_03H;
