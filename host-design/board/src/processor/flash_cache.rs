//! The flash accelerator (RM0090, 3.4.2), approximately: 64 instruction lines and 8 data lines of 128 bits.
//!
//! Sequential fetches come from the prefetch unit and cost nothing; a jump to a line that is not cached costs the wait
//! states. Both caches are direct-mapped: the address of a line decides which line it replaces, not age.
//!
//! By [`CoreTiming::Slow`], a line takes one cycle more than its wait states, and the prefetch unit begins to read the
//! next line when the core enters one: what is then missing of that time is waited for.

use crate::timing::CoreTiming;

/// Numbers of the cached lines, and the settings of FLASH_ACR.
#[derive(Debug, Clone)]
pub(crate) struct FlashCache {
    instructions: [u32; 64],
    data: [u32; 8],
    wait_states: u32,
    instruction_cache: bool,
    data_cache: bool,
    /// Cycles of a line in addition to its wait states.
    more: u32,
    /// The line that is being executed, and for how many cycles.
    line: u32,
    spent: u32,
    /// The last instruction jumped.
    has_jumped: bool,
}

impl FlashCache {
    pub(crate) fn new(timing: CoreTiming) -> Self {
        Self {
            instructions: [u32::MAX; 64],
            data: [u32::MAX; 8],
            wait_states: 0,
            instruction_cache: false,
            data_cache: false,
            more: u32::from(timing == CoreTiming::Slow),
            line: u32::MAX,
            spent: 0,
            has_jumped: false,
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
        (self.line, self.has_jumped) = (line, true);
        let known = &mut self.instructions[line as usize % 64];
        if self.instruction_cache && *known == line {
            return 0;
        }
        *known = line;
        self.wait_states + self.more
    }

    /// Cycles for which an instruction at `address`, after the one before it or jumped to, waits.
    #[inline]
    pub(crate) fn go_on_to(&mut self, address: u32) -> u32 {
        let line = address >> 4;
        if self.wait_states == 0 || line == self.line {
            return 0;
        }
        let is_known = self.instruction_cache && self.instructions[line as usize % 64] == line;
        let missing = (self.wait_states + self.more).saturating_sub(self.spent);
        (self.line, self.spent) = (line, 0);
        if is_known { 0 } else { missing }
    }

    /// An instruction that takes so many cycles ends.
    #[inline]
    pub(crate) fn spend(&mut self, cycles: u32) {
        self.spent = if std::mem::take(&mut self.has_jumped) { 0 } else { self.spent + cycles };
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
        self.wait_states + self.more
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The caches with five wait states, both enabled.
    fn cache(timing: CoreTiming) -> FlashCache {
        let mut cache = FlashCache::new(timing);
        cache.configure(5 | 3 << 9);
        cache
    }

    #[test]
    fn a_jump_and_a_load_wait_for_a_line_once() {
        for (timing, cycles) in [(CoreTiming::Quick, 5), (CoreTiming::Slow, 6)] {
            let mut cache = cache(timing);
            assert_eq!([cache.jump(0x0800_0100), cache.jump(0x0800_0108)], [cycles, 0], "{timing:?}");
            assert_eq!([cache.load(0x0800_0200), cache.load(0x0800_020c)], [cycles, 0], "{timing:?}");
        }
    }

    #[test]
    fn a_line_that_is_read_ahead_is_waited_for_as_long_as_the_core_is_faster() {
        let mut cache = cache(CoreTiming::Slow);
        cache.jump(0x0800_0100);
        cache.spend(9);
        // Four instructions of one cycle, then the next line: two of its six cycles are missing.
        for at in [0x0800_0103, 0x0800_0107, 0x0800_010b, 0x0800_010f] {
            assert_eq!(cache.go_on_to(at), 0);
            cache.spend(1);
        }
        assert_eq!(cache.go_on_to(0x0800_0113), 2);
        cache.spend(14);
        assert_eq!(cache.go_on_to(0x0800_0121), 0);
    }
}
