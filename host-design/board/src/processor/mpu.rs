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
    /// It allows every access, whatever its registers say.
    pub(crate) ignored: bool,
    /// Cache of the blocks allowed last, by purpose and by the upper three address bits; emptied by register writes.
    known: [[KnownBlock; 8]; 3],
}

/// A block in which all addresses are allowed: those with `address & mask == begin`.
#[derive(Debug, Clone, Copy)]
struct KnownBlock {
    begin: u32,
    mask: u32,
    privileged: bool,
    suspended: bool,
}

impl Default for KnownBlock {
    /// A block without addresses.
    fn default() -> Self {
        Self { begin: 1, mask: 0, privileged: false, suspended: false }
    }
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

    /// Size of the largest block around an address of which the region covers all or nothing, in address bits.
    fn uniform_bits(self, address: u32) -> u32 {
        let bits = self.size_bits();
        if self.attributes & 1 == 0 || bits < 5 {
            return 32;
        }
        // Base bits below the region's size do not count.
        let differs = address.checked_shr(bits).unwrap_or(0) ^ self.base.checked_shr(bits).unwrap_or(0);
        match differs.checked_ilog2() {
            Some(highest) => bits + highest,
            None if bits >= 8 => bits - 3,
            None => bits,
        }
    }

    fn covers(self, address: u32) -> bool {
        let bits = self.size_bits();
        if self.attributes & 1 == 0 || bits < 5 {
            return false;
        }
        let inside = bits >= 32 || (address ^ self.base) >> bits == 0;
        // Regions of 256 bytes or more have eight subregions.
        let subregion = if bits >= 8 { address >> (bits - 3) & 7 } else { 8 };
        inside && (subregion == 8 || self.attributes >> (8 + subregion) & 1 == 0)
    }
}

impl Mpu {
    pub(crate) fn enabled(&self) -> bool {
        self.control & 1 != 0 && !self.ignored
    }

    /// Whether an access is allowed. `suspended`: in HardFault or NMI, or with FAULTMASK set.
    #[inline]
    pub(crate) fn allows(
        &mut self,
        address: u32,
        purpose: Purpose,
        privileged: bool,
        suspended: bool,
    ) -> bool {
        let known = self.known[purpose as usize][(address >> 29) as usize];
        if address & known.mask == known.begin
            && (known.privileged, known.suspended) == (privileged, suspended)
        {
            return true;
        }
        self.ask(address, purpose, privileged, suspended)
    }

    /// Decides, and caches the block around an allowed address.
    #[cold]
    fn ask(&mut self, address: u32, purpose: Purpose, privileged: bool, suspended: bool) -> bool {
        let allowed = self.decide(address, purpose, privileged, suspended);
        if allowed {
            // The default map and the system space are told apart by the upper address bits.
            let by_address = if address >> 29 == 7 { 20 } else { 29 };
            let bits =
                self.regions.iter().fold(by_address, |bits, region| bits.min(region.uniform_bits(address)));
            let mask = u32::MAX << bits;
            self.known[purpose as usize][(address >> 29) as usize] =
                KnownBlock { begin: address & mask, mask, privileged, suspended };
        }
        allowed
    }

    fn decide(&self, address: u32, purpose: Purpose, privileged: bool, suspended: bool) -> bool {
        if !self.enabled() || (suspended && self.control & 2 == 0) || address >> 20 == 0xe00 {
            return true;
        }
        let Some(region) = self.regions.iter().rev().find(|region| region.covers(address)) else {
            // The default map, for privileged code only: 0x4000_0000 to 0x5fff_ffff and everything from
            // 0xa000_0000 on are not executable.
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
        self.known = Default::default();
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Cached decisions equal fresh ones.
    #[test]
    fn what_was_allowed_around_an_address_is_allowed_there() {
        let mut noise = 1u64;
        let mut random = || {
            noise ^= noise << 13;
            noise ^= noise >> 7;
            noise ^= noise << 17;
            noise.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 32
        };
        let mut known = 0;
        for _ in 0..300 {
            let mut mpu = Mpu::default();
            // Regions and accesses near each other, of all sizes, some switched off, some with subregions.
            let near = |random: &mut dyn FnMut() -> u64| {
                let upper = [0, 0x0800_0000, 0x2000_0000, 0x4000_0000, 0xe000_0000][random() as usize % 5];
                upper + (random() as u32 >> (8 + random() % 24))
            };
            for number in 0..REGIONS as u32 {
                let base = near(&mut random);
                mpu.write(0x9c, base & !0x1f | 0x10 | number);
                let subregions = [0, 0xff & random() as u32][number as usize % 2] << 8;
                let size = [random() as u32 % 32, 3 + random() as u32 % 14][number as usize / 4];
                let access = random() as u32 & 0x1700_0000;
                mpu.write(0xa0, access | subregions | size << 1 | u32::from(random() % 4 > 0));
            }
            mpu.write(0x94, 1 | random() as u32 & 6);
            for _ in 0..1000 {
                let address = near(&mut random);
                let purpose = [Purpose::Read, Purpose::Write, Purpose::Execute][random() as usize % 3];
                let (privileged, suspended) = (random() % 8 > 0, random() % 8 == 0);
                let entry = mpu.known[purpose as usize][(address >> 29) as usize];
                known += usize::from(address & entry.mask == entry.begin);
                let decided = mpu.decide(address, purpose, privileged, suspended);
                assert_eq!(
                    mpu.allows(address, purpose, privileged, suspended),
                    decided,
                    "{address:x} {mpu:?}"
                );
            }
        }
        assert!(known > 10_000, "{known}");
    }
}
