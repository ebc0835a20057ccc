//! Registers of the core (ARMv7-M Architecture Reference Manual, B1.4).

/// All registers that an instruction can name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Registers {
    /// R0 to R14; while an instruction executes, R15 is its address plus 4.
    pub(crate) r: [u32; 16],
    /// The stack pointer that is not in use.
    pub(crate) other_sp: u32,
    /// Address of the next instruction, or of the one that executes.
    pub(crate) pc: u32,
    pub(crate) n: bool,
    pub(crate) z: bool,
    pub(crate) c: bool,
    pub(crate) v: bool,
    pub(crate) q: bool,
    /// GE flags, which parallel additions and subtractions set.
    pub(crate) ge: u8,
    /// ITSTATE; 0 outside an IT block.
    pub(crate) it: u8,
    /// Number of the active exception; 0 in thread mode.
    pub(crate) ipsr: u16,
    pub(crate) primask: bool,
    pub(crate) faultmask: bool,
    pub(crate) basepri: u8,
    /// CONTROL.nPRIV
    pub(crate) unprivileged: bool,
    /// CONTROL.SPSEL
    pub(crate) process_stack: bool,
    /// CONTROL.FPCA
    pub(crate) float_active: bool,
    /// Single-precision registers S0 to S31, as bits.
    pub(crate) s: [u32; 32],
    pub(crate) fpscr: u32,
}

impl Registers {
    /// The state after a reset; registers whose reset value is UNKNOWN are filled from `unknown`.
    pub(crate) fn after_reset(mut unknown: impl FnMut() -> u32) -> Self {
        Self {
            r: std::array::from_fn(|_| unknown()),
            other_sp: unknown() & !3,
            pc: 0,
            n: false,
            z: false,
            c: false,
            v: false,
            q: false,
            ge: 0,
            it: 0,
            ipsr: 0,
            primask: false,
            faultmask: false,
            basepri: 0,
            unprivileged: false,
            process_stack: false,
            float_active: false,
            s: std::array::from_fn(|_| unknown()),
            fpscr: 0,
        }
    }

    pub(crate) fn get(&self, register: u8) -> u32 {
        self.r[usize::from(register & 15)]
    }

    /// Writes R0 to R14; the lower two bits of the stack pointer are cleared.
    pub(crate) fn set(&mut self, register: u8, value: u32) {
        let value = if register == 13 { value & !3 } else { value };
        self.r[usize::from(register & 15)] = value;
    }

    pub(crate) fn single(&self, register: u8) -> u32 {
        self.s[usize::from(register & 31)]
    }

    pub(crate) fn set_single(&mut self, register: u8, value: u32) {
        self.s[usize::from(register & 31)] = value;
    }

    /// Whether a condition holds (A7.3).
    pub(crate) fn holds(&self, condition: u8) -> bool {
        let holds = match condition >> 1 {
            0 => self.z,
            1 => self.c,
            2 => self.n,
            3 => self.v,
            4 => self.c && !self.z,
            5 => self.n == self.v,
            6 => !self.z && self.n == self.v,
            _ => return true,
        };
        holds != (condition & 1 != 0)
    }

    /// Advances ITSTATE by one instruction.
    pub(crate) fn advance_it(&mut self) {
        self.it = if self.it & 7 == 0 { 0 } else { self.it & 0xe0 | self.it << 1 & 0x1f };
    }

    /// XPSR as it is stacked.
    pub(crate) fn xpsr(&self) -> u32 {
        let it = u32::from(self.it);
        self.apsr() | (it & 3) << 25 | 1 << 24 | (it >> 2) << 10 | u32::from(self.ipsr)
    }

    pub(crate) fn apsr(&self) -> u32 {
        u32::from(self.n) << 31
            | u32::from(self.z) << 30
            | u32::from(self.c) << 29
            | u32::from(self.v) << 28
            | u32::from(self.q) << 27
            | u32::from(self.ge) << 16
    }

    pub(crate) fn set_flags(&mut self, bits: u32) {
        self.n = bits & 1 << 31 != 0;
        self.z = bits & 1 << 30 != 0;
        self.c = bits & 1 << 29 != 0;
        self.v = bits & 1 << 28 != 0;
    }

    /// Flags, IT state and exception number from a stacked XPSR.
    pub(crate) fn set_xpsr(&mut self, bits: u32) {
        self.set_flags(bits);
        self.q = bits & 1 << 27 != 0;
        self.ge = (bits >> 16 & 15) as u8;
        self.it = (bits >> 25 & 3 | bits >> 8 & 0xfc) as u8;
        self.ipsr = (bits & 0x1ff) as u16;
    }

    /// Whether the processor is in handler mode.
    pub(crate) fn handler_mode(&self) -> bool {
        self.ipsr != 0
    }

    pub(crate) fn privileged(&self) -> bool {
        self.handler_mode() || !self.unprivileged
    }

    /// Whether R13 is the process stack pointer.
    pub(crate) fn uses_process_stack(&self) -> bool {
        self.process_stack && !self.handler_mode()
    }
}
