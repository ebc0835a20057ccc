//! System configuration (RM0090, 9.2) and external interrupts (12.3).

use super::Bits;

const LINES: u32 = 0x007f_ffff;

/// SYSCFG and EXTI together, because SYSCFG selects the pins of the EXTI lines.
#[derive(Debug, Clone, Default)]
pub(crate) struct Exti {
    interrupts: u32,
    events: u32,
    rising: u32,
    falling: u32,
    pub(crate) pending: u32,
    sources: [u32; 4],
    remap: u32,
    mode: u32,
}

impl Exti {
    pub(crate) fn bits(offset: u32) -> Option<Bits> {
        matches!(offset, 0x00..=0x14).then_some(Bits::writable(LINES))
    }

    pub(crate) fn read(&self, offset: u32) -> u32 {
        match offset {
            0x00 => self.interrupts,
            0x04 => self.events,
            0x08 => self.rising,
            0x0c => self.falling,
            0x10 => 0,
            _ => self.pending,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) {
        match offset {
            0x00 => self.interrupts = value,
            0x04 => self.events = value,
            0x08 => self.rising = value,
            0x0c => self.falling = value,
            0x10 => self.pending |= value & self.interrupts,
            _ => self.pending &= !value,
        }
    }

    /// SYSCFG's registers.
    pub(crate) fn configuration_bits(offset: u32) -> Option<Bits> {
        Some(match offset {
            0x00 => Bits::writable(3),
            0x04 => Bits::writable(1 << 23),
            0x08..=0x14 => Bits::writable(0xffff),
            0x20 => Bits::writable(1).with_read_only(1 << 8),
            _ => return None,
        })
    }

    pub(crate) fn read_configuration(&self, offset: u32) -> u32 {
        match offset {
            0x00 => self.remap,
            0x04 => self.mode,
            0x08..=0x14 => self.sources[(offset as usize - 8) / 4],
            _ => 0,
        }
    }

    pub(crate) fn write_configuration(&mut self, offset: u32, value: u32) {
        match offset {
            0x00 => self.remap = value,
            0x04 => self.mode = value,
            0x08..=0x14 => self.sources[(offset as usize - 8) / 4] = value,
            _ => {}
        }
    }

    /// A pin of port number `port` changes its level.
    pub(crate) fn pin(&mut self, port: usize, pin: u8, high: bool) {
        let source = self.sources[usize::from(pin / 4)] >> (4 * (pin % 4)) & 15;
        if source as usize == port {
            self.line(pin, high);
        }
    }

    /// A line changes its level.
    pub(crate) fn line(&mut self, line: u8, high: bool) {
        let edges = if high { self.rising } else { self.falling };
        self.pending |= edges & self.interrupts & 1 << line;
    }

    /// Numbers of the interrupts, and whether each line is high.
    pub(crate) fn interrupts(&self) -> [(usize, bool); 8] {
        let any = |mask: u32| self.pending & mask != 0;
        [
            (1, any(1 << 16)),
            (6, any(1)),
            (7, any(2)),
            (8, any(4)),
            (9, any(8)),
            (10, any(16)),
            (23, any(0x3e0)),
            (40, any(0xfc00)),
        ]
    }
}
