//! Violations that end a run, the rules for them, and the processor's own faults.

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
    /// UDF or BKPT, by which a program declares that it cannot continue.
    #[error("the program executes UDF or BKPT")]
    Trap,
    /// Nothing is at this address.
    #[error("nothing is mapped at {0:#010x}")]
    Unmapped(u32),
    /// A write to memory that cannot be written.
    #[error("{0:#010x} cannot be written")]
    ReadOnly(u32),
    /// An address that is not a multiple of the access's size.
    #[error("unaligned access to {0:#010x}")]
    Unaligned(u32),
    /// A register that the chip does not have, or that is not modelled.
    #[error("unknown register {0:#010x}")]
    UnknownRegister(u32),
    /// A register accessed with a width that it does not support.
    #[error("register {address:#010x} accessed with {bytes} bytes")]
    Width {
        /// Address of the access.
        address: u32,
        /// Width of the access.
        bytes: u32,
    },
    /// Reserved bits written with a value other than their reset value.
    #[error("reserved bits {bits:#x} of register {address:#010x} written")]
    ReservedBits {
        /// Address of the register.
        address: u32,
        /// Mask of the bits concerned.
        bits: u32,
    },
    /// Ones written to bits that only hardware changes.
    #[error("read-only bits {bits:#x} of register {address:#010x} written with ones")]
    ReadOnlyBits {
        /// Address of the register.
        address: u32,
        /// Mask of the bits concerned.
        bits: u32,
    },
    /// An access to a peripheral whose clock is not enabled.
    #[error("the peripheral at {0:#010x} has no clock")]
    NoClock(u32),
    /// A peripheral accessed too soon after its clock was enabled (ES0182, 2.1.13).
    #[error(
        "the peripheral at {address:#010x} is accessed {cycles} cycles too early after its clock was enabled"
    )]
    Early {
        /// Address of the access.
        address: u32,
        /// Processor cycles still to wait before an access is allowed.
        cycles: u32,
    },
    /// A clock above its limit (Hz).
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

/// Why, where and when a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("at program counter {program_counter:#010x}, {:.6} s after power-on: {violation}", *time as f64 / 25.2e9)]
pub struct Stopped {
    /// What ended the run.
    pub violation: Violation,
    /// Address of the instruction.
    pub program_counter: u32,
    /// Time since power-on.
    pub time: Time,
}

/// A violation that was noted instead of ending the run, with its repetitions at the same instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Note {
    /// The violation, and the place and time of its first occurrence.
    pub stopped: Stopped,
    /// Number of occurrences.
    pub count: u64,
}

/// Treatment of a violation that real hardware tolerates in one way or another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Strictness {
    /// The run ends.
    Stop,
    /// It is noted, and the board does what the hardware most likely does.
    Note,
    /// It is neither an error nor noted.
    Allow,
}

/// Treatment of each kind of violation that hardware tolerates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rules {
    /// Reserved bits written.
    pub reserved_bits: Strictness,
    /// Ones written to read-only bits.
    pub read_only_bits: Strictness,
    /// A peripheral accessed too early after its clock was enabled.
    pub early: Strictness,
    /// Where `early` does not end the run: whether a write that comes too early is lost.
    pub early_is_lost: bool,
    /// Unaligned accesses of one register to memory: the processor splits them, and compilers rely on that. All
    /// others (to peripherals, of several words) end the run or fault.
    pub unaligned: Strictness,
    /// Whether unmapped accesses, unknown instructions and UDF raise the processor's faults instead of ending the run.
    pub faults_are_taken: bool,
}

impl Rules {
    /// Every violation ends the run; unaligned accesses of one register to memory are allowed.
    pub const STRICT: Self = Self {
        reserved_bits: Strictness::Stop,
        read_only_bits: Strictness::Stop,
        early: Strictness::Stop,
        early_is_lost: false,
        unaligned: Strictness::Allow,
        faults_are_taken: false,
    };

    /// What hardware tolerates is noted; unaligned accesses of one register to memory are allowed.
    pub const NOTED: Self = Self {
        reserved_bits: Strictness::Note,
        read_only_bits: Strictness::Note,
        early: Strictness::Note,
        early_is_lost: false,
        unaligned: Strictness::Allow,
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
pub(crate) enum ProcessorFault {
    /// A precise data bus error, at this address.
    Bus(u32),
    /// The MPU denies a data access to this address.
    MemoryData(u32),
    /// The MPU denies an instruction fetch.
    MemoryInstruction,
    /// An undefined instruction.
    UndefinedInstruction,
    /// A coprocessor instruction while the floating-point unit is off.
    NoCoprocessor,
    /// An invalid EXC_RETURN or state.
    InvalidState,
    /// An unaligned LDM, LDRD or the like.
    Unaligned,
    /// SVC: a synchronous exception, not a fault.
    Supervisor,
}

/// Why an instruction did not complete.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Trap {
    /// The processor takes an exception.
    Fault(ProcessorFault),
    /// The run ends.
    Stop(Violation),
}

/// Whether an instruction completed.
pub(crate) type Done = Result<(), Trap>;

impl From<Violation> for Trap {
    fn from(violation: Violation) -> Self {
        Trap::Stop(violation)
    }
}

impl From<ProcessorFault> for Trap {
    fn from(fault: ProcessorFault) -> Self {
        Trap::Fault(fault)
    }
}
