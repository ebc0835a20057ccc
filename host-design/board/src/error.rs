//! Why a run ends.

use crate::clock::Time;

/// What the image did that the hardware or its manual does not allow, or that is not modelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Violation {
    /// Not an instruction of this processor.
    #[error("unknown instruction {0:#x}")]
    UnknownInstruction(u32),
    /// An instruction whose effect the architecture does not define.
    #[error("UNPREDICTABLE instruction {0:#x}")]
    Unpredictable(u32),
    /// UDF or BKPT: the program says that it has no way on.
    #[error("the program executes UDF or BKPT")]
    Trap,
    /// Nothing is at this address.
    #[error("nothing is mapped at {0:#010x}")]
    Unmapped(u32),
    /// A write to memory that cannot be written.
    #[error("{0:#010x} cannot be written")]
    ReadOnly(u32),
    /// An address that is no multiple of the access's size.
    #[error("unaligned access to {0:#010x}")]
    Unaligned(u32),
    /// A register that the chip does not have, or that is not modelled.
    #[error("unknown register {0:#010x}")]
    UnknownRegister(u32),
    /// A register accessed with a width that it does not have.
    #[error("register {address:#010x} accessed with {bytes} bytes")]
    Width {
        /// Of the access.
        address: u32,
        /// Its width.
        bytes: u32,
    },
    /// Reserved bits written with something else than their reset value.
    #[error("reserved bits {bits:#x} of register {address:#010x} written")]
    ReservedBits {
        /// Of the register.
        address: u32,
        /// Which bits.
        bits: u32,
    },
    /// Ones written to bits that only hardware changes.
    #[error("read-only bits {bits:#x} of register {address:#010x} written with ones")]
    ReadOnlyBits {
        /// Of the register.
        address: u32,
        /// Which bits.
        bits: u32,
    },
    /// A peripheral whose clock is not enabled.
    #[error("the peripheral at {0:#010x} has no clock")]
    NoClock(u32),
    /// A peripheral accessed too soon after its clock was enabled (ES0182, 2.1.13).
    #[error(
        "the peripheral at {address:#010x} is accessed {cycles} cycles too early after its clock was enabled"
    )]
    Early {
        /// Of the access.
        address: u32,
        /// Processor cycles that are missing.
        cycles: u32,
    },
    /// A clock above its limit.
    #[error("a clock of {0} Hz is above its limit")]
    ClockTooFast(u32),
    /// Fewer wait states than the clock needs (RM0090, 3.5.1).
    #[error("{0} flash wait states are too few for this clock")]
    WaitStates(u32),
    /// A setting that the manual forbids.
    #[error("forbidden: {0}")]
    Forbidden(&'static str),
    /// A setting that this board does not model.
    #[error("not modelled: {0}")]
    NotModelled(&'static str),
}

/// Where a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("at program counter {program_counter:#010x}, {:.6} s after power-on: {violation}", *time as f64 / 25.2e9)]
pub struct Stopped {
    /// Why.
    pub violation: Violation,
    /// Address of the instruction.
    pub program_counter: u32,
    /// When.
    pub time: Time,
}

/// A violation that was let pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Note {
    /// What, where, and when it happened first.
    pub stopped: Stopped,
    /// How often.
    pub count: u64,
}

/// What happens at violations that real hardware would let pass in one way or another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// The run ends.
    Stop,
    /// It is noted, and what the hardware most likely does happens.
    Note,
    /// It is allowed.
    Allow,
}

/// Rules for the violations that hardware lets pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rules {
    /// Reserved bits written.
    pub reserved_bits: Rule,
    /// Ones written to read-only bits.
    pub read_only_bits: Rule,
    /// A peripheral accessed too early after its clock was enabled.
    pub early: Rule,
    /// With `early` noted: whether a write that comes too early is lost.
    pub early_is_lost: bool,
    /// Unaligned accesses of one register to memory: the processor splits them, and compilers make use of that. All
    /// others (to peripherals, of several words) end the run or fault.
    pub unaligned: Rule,
    /// Whether unmapped accesses, unknown instructions and UDF raise the processor's faults instead of ending the run.
    pub faults_are_taken: bool,
}

impl Rules {
    /// Everything ends the run.
    pub const STRICT: Self = Self {
        reserved_bits: Rule::Stop,
        read_only_bits: Rule::Stop,
        early: Rule::Stop,
        early_is_lost: false,
        unaligned: Rule::Allow,
        faults_are_taken: false,
    };

    /// What hardware lets pass is noted.
    pub const NOTED: Self = Self {
        reserved_bits: Rule::Note,
        read_only_bits: Rule::Note,
        early: Rule::Note,
        early_is_lost: false,
        unaligned: Rule::Allow,
        faults_are_taken: false,
    };
}

impl Default for Rules {
    fn default() -> Self {
        Self::STRICT
    }
}

/// The processor's own faults (B1.5.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fault {
    /// A precise data bus error, at this address.
    Bus(u32),
    /// The MPU refuses data at this address.
    MemoryData(u32),
    /// The MPU refuses an instruction.
    MemoryInstruction,
    /// An undefined instruction.
    UndefinedInstruction,
    /// A coprocessor instruction while the floating-point unit is off.
    NoCoprocessor,
    /// An invalid EXC_RETURN or state.
    InvalidState,
    /// An unaligned LDM, LDRD or the like.
    Unaligned,
    /// SVC, as an exception in sequence.
    Supervisor,
}

/// Why an instruction did not complete.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trap {
    /// The processor takes an exception.
    Fault(Fault),
    /// The run ends.
    Stop(Violation),
}

impl From<Violation> for Trap {
    fn from(violation: Violation) -> Self {
        Trap::Stop(violation)
    }
}

impl From<Fault> for Trap {
    fn from(fault: Fault) -> Self {
        Trap::Fault(fault)
    }
}
