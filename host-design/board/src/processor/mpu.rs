//! The memory protection unit (ARMv7-M Architecture Reference Manual, B3.5).

const REGIONS: usize = 8;

/// What an access is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    Read,
    Write,
    Execute,
}

/// The unit's registers.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mpu {
    pub(crate) control: u32,
    pub(crate) number: u32,
    regions: [Region; REGIONS],
    /// It allows everything, whatever its registers say.
    pub(crate) ignored: bool,
}

#[derive(Debug, Clone, Copy, Default)]
struct Region {
    base: u32,
    attributes: u32,
}

impl Region {
    fn size_bits(self) -> u32 {
        (self.attributes >> 1 & 31) + 1
    }

    fn covers(self, address: u32) -> bool {
        let bits = self.size_bits();
        if self.attributes & 1 == 0 || bits < 5 {
            return false;
        }
        let inside = bits >= 32 || (address ^ self.base) >> bits == 0;
        // Eight subregions, from 256 bytes on.
        let subregion = if bits >= 8 { address >> (bits - 3) & 7 } else { 8 };
        inside && (subregion == 8 || self.attributes >> (8 + subregion) & 1 == 0)
    }
}

impl Mpu {
    pub(crate) fn enabled(&self) -> bool {
        self.control & 1 != 0 && !self.ignored
    }

    /// Whether an access is allowed. `suspended`: in HardFault, NMI or with FAULTMASK.
    pub(crate) fn allows(&self, address: u32, purpose: Purpose, privileged: bool, suspended: bool) -> bool {
        if !self.enabled() || (suspended && self.control & 2 == 0) || address >> 20 == 0xe00 {
            return true;
        }
        let Some(region) = self.regions.iter().rev().find(|region| region.covers(address)) else {
            // The default map for the privileged, where everything from 0x4000_0000 to 0x5fff_ffff and from
            // 0xa000_0000 on is not executable.
            let executable = !matches!(address >> 29, 2 | 5..=7);
            return privileged && self.control & 4 != 0 && (purpose != Purpose::Execute || executable);
        };
        let (read, write) = match (region.attributes >> 24 & 7, privileged) {
            (1..=3, true) | (3, false) => (true, true),
            (5..=7, true) | (2 | 6 | 7, false) => (true, false),
            _ => (false, false),
        };
        match purpose {
            Purpose::Read => read,
            Purpose::Write => write,
            Purpose::Execute => read && region.attributes & 1 << 28 == 0,
        }
    }

    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        let region = self.regions[self.number as usize % REGIONS];
        Some(match offset {
            0x90 => (REGIONS as u32) << 8,
            0x94 => self.control,
            0x98 => self.number,
            0x9c | 0xa4 | 0xac | 0xb4 => region.base | self.number,
            0xa0 | 0xa8 | 0xb0 | 0xb8 => region.attributes,
            _ => return None,
        })
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> bool {
        match offset {
            0x94 => self.control = value & 7,
            0x98 => self.number = value & 7,
            0x9c | 0xa4 | 0xac | 0xb4 => {
                if value & 0x10 != 0 {
                    self.number = value & 7;
                }
                self.regions[self.number as usize % REGIONS].base = value & !0x1f;
            }
            0xa0 | 0xa8 | 0xb0 | 0xb8 => self.regions[self.number as usize % REGIONS].attributes = value,
            _ => return false,
        }
        true
    }
}
