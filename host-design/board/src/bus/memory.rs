//! Flash, SRAM and the chip's own data.

use super::Bus;
use crate::error::{ProcessorFault, Trap, Violation};
use crate::instruction::Unit;

/// Reads a little-endian value, not sign-extended; `None` beyond the end.
#[inline]
fn get(memory: &[u8], offset: usize, unit: Unit) -> Option<u32> {
    match unit {
        Unit::Word => memory.get(offset..offset + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        Unit::Half | Unit::SignedHalf => {
            memory.get(offset..offset + 2).map(|b| u16::from_le_bytes([b[0], b[1]]).into())
        }
        Unit::Byte | Unit::SignedByte => memory.get(offset).map(|&b| b.into()),
    }
}

#[inline]
fn put(memory: &mut [u8], offset: usize, unit: Unit, value: u32) -> bool {
    let bytes = value.to_le_bytes();
    match unit {
        Unit::Word => memory.get_mut(offset..offset + 4).map(|place| place.copy_from_slice(&bytes)),
        Unit::Half | Unit::SignedHalf => {
            memory.get_mut(offset..offset + 2).map(|place| place.copy_from_slice(&bytes[..2]))
        }
        Unit::Byte | Unit::SignedByte => memory.get_mut(offset).map(|place| *place = bytes[0]),
    }
    .is_some()
}

impl Bus {
    /// Reads memory; `None` outside it.
    #[inline]
    pub(crate) fn read_memory(&self, address: u32, unit: Unit) -> Option<u32> {
        let offset = (address & 0x00ff_ffff) as usize;
        match address >> 24 {
            0x20 => get(&self.sram, offset, unit),
            0x08 => get(&self.flash, offset, unit),
            0x00 => get(&self.flash, offset, unit),
            0x10 => get(&self.core_coupled, offset, unit),
            0x1f => match self.below_sram(address) {
                Some(offset) => get(&self.below_sram, offset, unit),
                None => self.identity(address, unit),
            },
            _ => None,
        }
    }

    /// Writes RAM; returns whether there is any at the address.
    #[inline]
    pub(crate) fn write_memory(&mut self, address: u32, unit: Unit, value: u32) -> bool {
        let offset = (address & 0x00ff_ffff) as usize;
        match address >> 24 {
            0x20 => put(&mut self.sram, offset, unit, value),
            0x10 => put(&mut self.core_coupled, offset, unit, value),
            0x1f => match self.below_sram(address) {
                Some(offset) => put(&mut self.below_sram, offset, unit, value),
                None => false,
            },
            _ => false,
        }
    }

    /// Offset in the reserved space below the SRAM, if that behaves as memory.
    pub(crate) fn below_sram(&self, address: u32) -> Option<usize> {
        let offset = address.checked_sub(0x2000_0000 - self.below_sram.len() as u32)? as usize;
        (offset < self.below_sram.len()).then_some(offset)
    }

    /// An aligned word of memory.
    pub(crate) fn peek(&self, address: u32) -> Option<u32> {
        self.read_memory(address, Unit::Word)
    }

    /// Writes a byte by DMA, which reaches the SRAM but not the core-coupled memory.
    pub(super) fn poke(&mut self, address: u32, byte: u8) {
        if address >> 24 == 0x20 {
            self.write_memory(address, Unit::Byte, byte.into());
        }
    }

    /// The unique device ID, the flash size and VREFIN_CAL (RM0090, 39; datasheet, internal reference voltage).
    fn identity(&self, address: u32, unit: Unit) -> Option<u32> {
        let mut data = [0u8; 0x40];
        data[0x10..0x1c].copy_from_slice(b"\x2a\0\x31\0\x0c5133713");
        data[0x22..0x24].copy_from_slice(&((self.chip.flash_bytes() >> 10) as u16).to_le_bytes());
        // 1.21 V of 3.3 V in 12 bits; erased if the chip is not calibrated.
        let calibration = if self.is_calibrated { 1502u16 } else { u16::MAX };
        data[0x2a..0x2c].copy_from_slice(&calibration.to_le_bytes());
        let offset = address.checked_sub(0x1fff_7a00)? as usize;
        get(&data, offset, unit)
    }

    /// Fetches a half-word of code from flash or SRAM.
    #[inline]
    pub(crate) fn fetch(&self, address: u32) -> Option<u16> {
        match address >> 24 {
            0x08 | 0x20 => self.read_memory(address, Unit::Half).map(|half| half as u16),
            _ => None,
        }
    }

    /// The trap for an access to an address that does not support it: a bus fault, or the end of the run.
    pub(crate) fn nothing_at(&self, address: u32, violation: Violation) -> Trap {
        if self.rules.faults_are_taken { ProcessorFault::Bus(address).into() } else { violation.into() }
    }
}
