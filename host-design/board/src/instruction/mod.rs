//! Decoded instructions, as the decoder returns them and the processor executes them.
//!
//! Names and operands follow the ARMv7-M Architecture Reference Manual (DDI 0403), chapter A7. Addresses that depend
//! on the program counter alone are computed by the decoder.

mod data;
mod float;
mod memory;
mod multiply;
mod special;

pub(crate) use data::{Alu, Compare, Extend, Operand, ParallelLanes, Prefix, Sets, Shift, Unary};
pub(crate) use float::{Float1, Float2};
pub(crate) use memory::{Addressing, Unit};
pub(crate) use multiply::{LongMultiply, Multiply};
pub(crate) use special::Special;

/// One instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Op {
    /// An entry of the cache that is not yet decoded.
    Undecoded,
    Nop,
    /// WFI
    WaitForInterrupt,
    /// WFE
    WaitForEvent,
    /// SEV
    SendEvent,
    /// DSB
    SyncData,
    /// DMB, ISB
    Barrier,
    ClearExclusive,
    It(u8),
    /// CPSIE or CPSID, of PRIMASK and FAULTMASK.
    ChangeMasks {
        disable: bool,
        primask: bool,
        faultmask: bool,
    },
    Svc,
    Breakpoint,
    Undefined,
    Alu {
        alu: Alu,
        sets: Sets,
        rd: u8,
        rn: u8,
        operand: Operand,
    },
    Compare {
        compare: Compare,
        rn: u8,
        operand: Operand,
    },
    ShiftBy {
        shift: Shift,
        sets: Sets,
        rd: u8,
        rn: u8,
        rm: u8,
    },
    /// MOVT
    MoveTop {
        rd: u8,
        value: u16,
    },
    Branch {
        target: u32,
    },
    BranchIf {
        condition: u8,
        target: u32,
    },
    Call {
        target: u32,
    },
    BranchTo {
        rm: u8,
    },
    CallTo {
        rm: u8,
    },
    /// CBZ, CBNZ
    BranchZero {
        rn: u8,
        if_zero: bool,
        target: u32,
    },
    /// TBB, TBH
    TableBranch {
        rn: u8,
        rm: u8,
        half: bool,
    },
    Load {
        unit: Unit,
        rt: u8,
        rn: u8,
        place: Addressing,
    },
    Store {
        unit: Unit,
        rt: u8,
        rn: u8,
        place: Addressing,
    },
    LoadLiteral {
        unit: Unit,
        rt: u8,
        address: u32,
    },
    LoadDual {
        rt: u8,
        rt2: u8,
        rn: u8,
        offset: i16,
        index: bool,
        write_back: bool,
    },
    StoreDual {
        rt: u8,
        rt2: u8,
        rn: u8,
        offset: i16,
        index: bool,
        write_back: bool,
    },
    LoadMultiple {
        rn: u8,
        list: u16,
        down: bool,
        write_back: bool,
    },
    StoreMultiple {
        rn: u8,
        list: u16,
        down: bool,
        write_back: bool,
    },
    LoadExclusive {
        unit: Unit,
        rt: u8,
        rn: u8,
        offset: u16,
    },
    StoreExclusive {
        unit: Unit,
        rd: u8,
        rt: u8,
        rn: u8,
        offset: u16,
    },
    /// `ra` 15: nothing is accumulated.
    Multiply {
        multiply: Multiply,
        sets: Sets,
        rd: u8,
        rn: u8,
        rm: u8,
        ra: u8,
    },
    LongMultiply {
        multiply: LongMultiply,
        low: u8,
        high: u8,
        rn: u8,
        rm: u8,
    },
    Divide {
        signed: bool,
        rd: u8,
        rn: u8,
        rm: u8,
    },
    /// BFI; BFC with `rn` 15.
    InsertField {
        rd: u8,
        rn: u8,
        lsb: u8,
        width: u8,
    },
    ExtractField {
        signed: bool,
        rd: u8,
        rn: u8,
        lsb: u8,
        width: u8,
    },
    /// SSAT, USAT
    Saturate {
        signed: bool,
        rd: u8,
        rn: u8,
        bits: u8,
        shift: Shift,
        amount: u8,
    },
    /// SSAT16, USAT16
    SaturateHalves {
        signed: bool,
        rd: u8,
        rn: u8,
        bits: u8,
    },
    /// `rn` 15: nothing is added.
    Extend {
        extend: Extend,
        rd: u8,
        rn: u8,
        rm: u8,
        rotate: u8,
    },
    Unary {
        unary: Unary,
        rd: u8,
        rm: u8,
    },
    Parallel {
        prefix: Prefix,
        lanes: ParallelLanes,
        rd: u8,
        rn: u8,
        rm: u8,
    },
    /// QADD, QSUB, QDADD, QDSUB
    SaturatingSum {
        double: bool,
        subtract: bool,
        rd: u8,
        rn: u8,
        rm: u8,
    },
    Select {
        rd: u8,
        rn: u8,
        rm: u8,
    },
    /// USAD8, USADA8 (`ra` 15: nothing is accumulated)
    AbsoluteDifferences {
        rd: u8,
        rn: u8,
        rm: u8,
        ra: u8,
    },
    /// PKHBT, PKHTB
    PackHalves {
        rd: u8,
        rn: u8,
        rm: u8,
        top_first: bool,
        amount: u8,
    },
    ReadSpecial {
        rd: u8,
        special: Special,
    },
    WriteSpecial {
        rn: u8,
        special: Special,
        mask: u8,
    },
    Float2 {
        op: Float2,
        d: u8,
        n: u8,
        m: u8,
    },
    Float1 {
        op: Float1,
        d: u8,
        m: u8,
    },
    FloatConstant {
        d: u8,
        bits: u32,
    },
    /// VCMP, VCMPE; `m` is `None` for a comparison with zero.
    FloatCompare {
        d: u8,
        m: Option<u8>,
        signal: bool,
    },
    /// VMOV between a core register and a single-precision register.
    FloatToCore {
        rt: u8,
        n: u8,
    },
    CoreToFloat {
        n: u8,
        rt: u8,
    },
    /// VMOV between two core registers and two consecutive single-precision registers.
    FloatPairToCore {
        rt: u8,
        rt2: u8,
        m: u8,
    },
    CorePairToFloat {
        rt: u8,
        rt2: u8,
        m: u8,
    },
    /// VMRS; register 15 stands for the flags.
    ReadFloatStatus {
        rt: u8,
    },
    /// VMSR
    WriteFloatStatus {
        rt: u8,
    },
    /// VLDR, VSTR: `count` words (1 or 2) from `d` on.
    FloatLoad {
        d: u8,
        rn: u8,
        offset: i16,
        count: u8,
    },
    FloatStore {
        d: u8,
        rn: u8,
        offset: i16,
        count: u8,
    },
    /// VLDM, VPOP
    FloatLoadMultiple {
        d: u8,
        rn: u8,
        count: u8,
        down: bool,
        write_back: bool,
    },
    /// VSTM, VPUSH
    FloatStoreMultiple {
        d: u8,
        rn: u8,
        count: u8,
        down: bool,
        write_back: bool,
    },
}

/// An instruction and its length in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Instruction {
    pub(crate) op: Op,
    pub(crate) length: u8,
}

impl Op {
    /// Whether it needs the floating-point unit.
    pub(crate) fn is_float(self) -> bool {
        matches!(
            self,
            Op::Float2 { .. }
                | Op::Float1 { .. }
                | Op::FloatConstant { .. }
                | Op::FloatCompare { .. }
                | Op::FloatToCore { .. }
                | Op::CoreToFloat { .. }
                | Op::FloatPairToCore { .. }
                | Op::CorePairToFloat { .. }
                | Op::ReadFloatStatus { .. }
                | Op::WriteFloatStatus { .. }
                | Op::FloatLoad { .. }
                | Op::FloatStore { .. }
                | Op::FloatLoadMultiple { .. }
                | Op::FloatStoreMultiple { .. }
        )
    }
}
