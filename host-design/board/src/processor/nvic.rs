//! Exceptions: enabled, pending, active, and their priorities (B1.5, B3.4).

/// Number of external interrupts of the largest chip here.
pub(crate) const INTERRUPTS: usize = 97;
/// Number of exception numbers, external interrupts included.
const EXCEPTIONS: usize = 16 + INTERRUPTS;

pub(crate) const NMI: usize = 2;
pub(crate) const HARD_FAULT: usize = 3;
pub(crate) const MEM_MANAGE: usize = 4;
pub(crate) const BUS_FAULT: usize = 5;
pub(crate) const USAGE_FAULT: usize = 6;
pub(crate) const SV_CALL: usize = 11;
pub(crate) const PEND_SV: usize = 14;
pub(crate) const SYS_TICK: usize = 15;

/// A set of exceptions.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Set(u128);

impl Set {
    pub(crate) fn has(self, exception: usize) -> bool {
        self.0 >> exception & 1 != 0
    }

    pub(crate) fn put(&mut self, exception: usize, member: bool) {
        self.0 = self.0 & !(1 << exception) | u128::from(member) << exception;
    }

    pub(crate) fn is_empty(self) -> bool {
        self.0 == 0
    }

    fn members(self) -> impl Iterator<Item = usize> {
        let mut bits = self.0;
        std::iter::from_fn(move || {
            let next = bits.trailing_zeros() as usize;
            (bits != 0).then(|| {
                bits &= bits - 1;
                next
            })
        })
    }

    /// 32 external interrupts, as a register of the NVIC holds them.
    pub(crate) fn word(self, word: usize) -> u32 {
        (self.0 >> (16 + 32 * word)) as u32
    }

    fn external(word: usize, bits: u32) -> u128 {
        let all = (1u128 << EXCEPTIONS) - 1;
        if word > 3 { 0 } else { (u128::from(bits) << (16 + 32 * word)) & all }
    }

    pub(crate) fn put_word(&mut self, word: usize, bits: u32, member: bool) {
        let bits = Self::external(word, bits);
        self.0 = if member { self.0 | bits } else { self.0 & !bits };
    }
}

/// State of the interrupt controller.
#[derive(Debug, Clone)]
pub(crate) struct Nvic {
    pub(crate) enabled: Set,
    pub(crate) pending: Set,
    pub(crate) active: Set,
    /// Interrupt lines that are high now.
    pub(crate) lines: Set,
    /// Priorities, in the upper four bits of each byte.
    pub(crate) priority: [u8; EXCEPTIONS],
    /// AIRCR.PRIGROUP
    pub(crate) group: u8,
    /// Something has changed that may cause an exception to be taken.
    pub(crate) changed: bool,
}

impl Nvic {
    pub(crate) fn new() -> Self {
        let mut enabled = Set::default();
        for always in [NMI, HARD_FAULT, SV_CALL, PEND_SV, SYS_TICK] {
            enabled.put(always, true);
        }
        Self {
            enabled,
            pending: Set::default(),
            active: Set::default(),
            lines: Set::default(),
            priority: [0; EXCEPTIONS],
            group: 0,
            changed: true,
        }
    }

    pub(crate) fn pend(&mut self, exception: usize) {
        self.pending.put(exception, true);
        self.changed = true;
    }

    /// Sets the level of an external interrupt line; its rising edge makes the interrupt pending (B3.4.1).
    pub(crate) fn line(&mut self, interrupt: usize, high: bool) {
        let exception = 16 + interrupt;
        if high && !self.lines.has(exception) {
            self.pend(exception);
        }
        self.lines.put(exception, high);
    }

    /// Full priority, subpriority included; a lower value is more urgent.
    fn priority_of(&self, exception: usize) -> i32 {
        match exception {
            NMI => -2,
            HARD_FAULT => -1,
            _ => i32::from(self.priority[exception]),
        }
    }

    /// Group priority, which decides about preemption.
    fn grouped(&self, priority: i32) -> i32 {
        if priority < 0 { priority } else { priority & !((2 << self.group) - 1) }
    }

    /// Execution priority (B1.5.4); 256 in thread mode without masks.
    pub(crate) fn executing(&self, primask: bool, faultmask: bool, basepri: u8) -> i32 {
        let mut lowest = 256;
        for exception in self.active.members() {
            lowest = lowest.min(self.grouped(self.priority_of(exception)));
        }
        if basepri != 0 {
            lowest = lowest.min(self.grouped(basepri.into()));
        }
        if primask {
            lowest = lowest.min(0);
        }
        if faultmask {
            lowest = lowest.min(-1);
        }
        lowest
    }

    /// The pending and enabled exception of highest priority, and its group priority.
    pub(crate) fn most_urgent(&self) -> Option<(usize, i32)> {
        if self.pending.is_empty() {
            return None;
        }
        let ready = Set(self.pending.0 & self.enabled.0);
        let first = ready.members().min_by_key(|&exception| (self.priority_of(exception), exception))?;
        Some((first, self.grouped(self.priority_of(first))))
    }

    /// Group priority of an exception.
    pub(crate) fn preemption(&self, exception: usize) -> i32 {
        self.grouped(self.priority_of(exception))
    }

    pub(crate) fn activate(&mut self, exception: usize) {
        self.pending.put(exception, false);
        self.active.put(exception, true);
    }

    /// Deactivates an exception at its return; an interrupt whose line is still high becomes pending again.
    pub(crate) fn deactivate(&mut self, exception: usize) {
        self.active.put(exception, false);
        if self.lines.has(exception) {
            self.pending.put(exception, true);
        }
        self.changed = true;
    }

    /// Enables the faults whose bits are set in SHCSR.
    pub(super) fn enable_faults(&mut self, shcsr: u32) {
        for (bit, exception) in [(16, MEM_MANAGE), (17, BUS_FAULT), (18, USAGE_FAULT)] {
            self.enabled.put(exception, shcsr >> bit & 1 != 0);
        }
    }

    pub(super) fn read(&self, address: u32) -> Option<u32> {
        Some(match address {
            0xe000_e100..0xe000_e110 | 0xe000_e180..0xe000_e190 => self.enabled.word(word(address)),
            0xe000_e200..0xe000_e210 | 0xe000_e280..0xe000_e290 => self.pending.word(word(address)),
            0xe000_e300..0xe000_e310 => self.active.word(word(address)),
            0xe000_e400..0xe000_e464 => self.priorities(16 + (address - 0xe000_e400) as usize),
            _ => return None,
        })
    }

    /// Writes a register; returns whether there is one at this address.
    pub(super) fn write(&mut self, address: u32, value: u32) -> bool {
        let word = word(address);
        match address {
            0xe000_e100..0xe000_e110 => self.enabled.put_word(word, value, true),
            0xe000_e180..0xe000_e190 => self.enabled.put_word(word, value, false),
            0xe000_e200..0xe000_e210 => self.pending.put_word(word, value, true),
            0xe000_e280..0xe000_e290 => {
                self.pending.put_word(word, value, false);
                let high = self.lines.word(word) & value & !self.active.word(word);
                self.pending.put_word(word, high, true);
            }
            0xe000_e400..0xe000_e464 => self.set_priorities(16 + (address - 0xe000_e400) as usize, value),
            _ => return false,
        }
        true
    }

    /// ICSR: pending bits (B3.2.4).
    pub(super) fn pend_system(&mut self, value: u32) {
        for (bit, exception, pend) in [
            (31, NMI, true),
            (28, PEND_SV, true),
            (27, PEND_SV, false),
            (26, SYS_TICK, true),
            (25, SYS_TICK, false),
        ] {
            if value >> bit & 1 != 0 {
                self.pending.put(exception, pend);
            }
        }
    }

    /// ICSR as it is read; `current` is the number of the running handler.
    pub(crate) fn interrupt_state(&self, current: u16) -> u32 {
        let pending = self.most_urgent().map_or(0, |(exception, _)| exception as u32);
        let bit = |exception, bit: u32| u32::from(self.pending.has(exception)) << bit;
        u32::from(current) | pending << 12 | bit(SYS_TICK, 26) | bit(PEND_SV, 28) | bit(NMI, 31)
    }

    /// Writes a byte of a priority register; returns whether there is one at this address.
    pub(crate) fn write_byte(&mut self, address: u32, value: u8) -> bool {
        self.changed = true;
        let Some(exception) = exception_of(address) else { return false };
        self.priority[exception] = value & 0xf0;
        true
    }

    pub(crate) fn read_byte(&self, address: u32) -> Option<u8> {
        exception_of(address).map(|exception| self.priority[exception])
    }

    pub(super) fn priorities(&self, first: usize) -> u32 {
        (0..4).fold(0, |word, i| {
            word | u32::from(self.priority.get(first + i).copied().unwrap_or(0)) << (8 * i)
        })
    }

    pub(super) fn set_priorities(&mut self, first: usize, value: u32) {
        for i in 0..4 {
            if let Some(priority) = self.priority.get_mut(first + i) {
                *priority = (value >> (8 * i)) as u8 & 0xf0;
            }
        }
    }
}

/// The exception whose priority is the byte at an address.
fn exception_of(address: u32) -> Option<usize> {
    match address {
        0xe000_e400..0xe000_e461 => Some(16 + (address - 0xe000_e400) as usize),
        0xe000_ed18..0xe000_ed24 => Some(4 + (address - 0xe000_ed18) as usize),
        _ => None,
    }
}

/// Index of a register in its array of NVIC registers.
fn word(address: u32) -> usize {
    (address >> 2 & 7) as usize
}
