//! The flash accelerator (RM0090, 3.4.2), approximately: 64 instruction lines and 8 data lines of 128 bits.
//!
//! Sequential fetches come from the prefetch unit and cost nothing; a jump to a line that is not cached costs the wait
//! states. Both caches are direct-mapped: the address of a line decides which line it replaces, not age.

/// Numbers of the cached lines, and the settings of FLASH_ACR.
#[derive(Debug, Clone)]
pub(crate) struct FlashCache {
    instructions: [u32; 64],
    data: [u32; 8],
    wait_states: u32,
    instruction_cache: bool,
    data_cache: bool,
}

impl FlashCache {
    pub(crate) fn new() -> Self {
        Self {
            instructions: [u32::MAX; 64],
            data: [u32::MAX; 8],
            wait_states: 0,
            instruction_cache: false,
            data_cache: false,
        }
    }

    /// Applies a value of FLASH_ACR.
    pub(crate) fn configure(&mut self, acr: u32) {
        self.wait_states = acr & 7;
        self.instruction_cache = acr & 1 << 9 != 0;
        self.data_cache = acr & 1 << 10 != 0;
    }

    #[inline]
    pub(crate) fn jump(&mut self, address: u32) -> u32 {
        if self.wait_states == 0 {
            return 0;
        }
        let line = address >> 4;
        let known = &mut self.instructions[line as usize % 64];
        if self.instruction_cache && *known == line {
            return 0;
        }
        *known = line;
        self.wait_states
    }

    #[inline]
    pub(crate) fn load(&mut self, address: u32) -> u32 {
        if self.wait_states == 0 {
            return 0;
        }
        let line = address >> 4;
        let known = &mut self.data[line as usize % 8];
        if self.data_cache && *known == line {
            return 0;
        }
        *known = line;
        self.wait_states
    }
}
