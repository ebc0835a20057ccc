//! What an instruction does to the stack pointer and the control flow, for a bound on the stack.

use crate::decode::decode;
use crate::instruction::{Addressing, Alu, Op, Operand};

/// Effect of an instruction on the stack pointer or the control flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effect {
    /// Nothing that matters here.
    None,
    /// The stack grows by this many bytes.
    Grow(u32),
    /// A call of this address.
    Call(u32),
    /// A branch to this address: within the function, or a tail call.
    Jump(u32),
    /// A call or branch to an address in a register or in memory.
    Indirect,
    /// A branch to the address in this register.
    JumpTo(u8),
    /// This register becomes an address near the instruction, such as that of a branch table.
    Near(u8),
    /// The first register becomes the second plus another, or the word there: an entry of a table, if the second is
    /// the table's address.
    Indexed(u8, u8),
    /// This register becomes the word at this address.
    Literal(u8, u32),
    /// The stack pointer moves by this register's value.
    Moved(u8),
    /// The stack pointer becomes this register's value.
    FromRegister(u8),
    /// This register is rounded down to a multiple of this many bytes.
    Aligned(u8, u32),
    /// This register becomes the frame pointer (r7) less a constant.
    FromFrame(u8),
    /// The stack grows by an amount known only at run time.
    Unknown,
}

/// The stack pointer, the frame pointer, the link register and the program counter.
const SP: u8 = 13;
const FRAME: u8 = 7;
const LR: u8 = 14;
const PC: u8 = 15;
/// Largest distance of an address that an instruction forms from the program counter (bytes).
const NEAR: u32 = 0x1000 + 4;

/// The effect of the instruction at `address`; `second` is used only if it has two halfwords. What the processor does
/// not know has none.
pub fn effect(address: u32, first: u16, second: u16) -> Effect {
    let Ok(instruction) = decode(first, second, address) else { return Effect::None };
    let words = |count: u32| Effect::Grow(4 * count);
    match instruction.op {
        Op::Alu { alu, rd, rn, operand, .. } => of_result(address, alu, rd, rn, operand),
        Op::StoreMultiple { rn: SP, list, down: true, .. } => words(list.count_ones()),
        Op::FloatStoreMultiple { rn: SP, count, down: true, .. } => words(count.into()),
        Op::Store { rn: SP, place: Addressing::PreIndexed(offset), .. }
        | Op::StoreDual { rn: SP, offset, write_back: true, index: true, .. } => {
            Effect::Grow(u32::from(offset.min(0).unsigned_abs()))
        }
        Op::Load { rt: PC, rn, .. } if rn != SP => Effect::Indirect,
        Op::Load { rt, rn, place: Addressing::Indexed { .. }, .. } => Effect::Indexed(rt, rn),
        Op::LoadLiteral { rt: PC, .. } => Effect::Indirect,
        Op::LoadLiteral { rt, address, .. } => Effect::Literal(rt, address),
        Op::InsertField { rd, rn: PC, lsb: 0, width } => Effect::Aligned(rd, 1 << width),
        Op::BranchTo { rm: LR } => Effect::None,
        Op::BranchTo { .. } | Op::CallTo { .. } => Effect::Indirect,
        Op::Branch { target } | Op::BranchIf { target, .. } => Effect::Jump(target),
        Op::Call { target } => Effect::Call(target),
        _ => Effect::None,
    }
}

/// The effect of data processing whose result becomes `rd`.
fn of_result(address: u32, alu: Alu, rd: u8, rn: u8, operand: Operand) -> Effect {
    match (alu, rd, operand) {
        (Alu::Mov | Alu::Add, PC, Operand::Register(rm)) => Effect::JumpTo(rm),
        (_, PC, _) => Effect::Indirect,
        (Alu::Mov, SP, Operand::Register(rm)) => Effect::FromRegister(rm),
        (Alu::Sub, SP, Operand::Constant(bytes) | Operand::Rotated(bytes)) => Effect::Grow(bytes),
        (Alu::Sub, SP, _) => Effect::Unknown,
        (Alu::Add, SP, Operand::Register(rm)) => Effect::Moved(rm),
        (Alu::Add, _, Operand::Register(PC)) => Effect::Near(rd),
        (Alu::Sub, _, Operand::Constant(_) | Operand::Rotated(_)) if rn == FRAME => Effect::FromFrame(rd),
        (Alu::Mov, _, Operand::Constant(value)) if value.abs_diff(address) <= NEAR => Effect::Near(rd),
        (Alu::Add, _, Operand::Register(_) | Operand::Shifted { .. }) if rd != SP => Effect::Indexed(rd, rn),
        _ => Effect::None,
    }
}

#[cfg(test)]
mod tests {
    use super::{Effect, effect};

    /// Encodings by LLVM's assembler, all at 0x0800_1000.
    #[test]
    fn instructions_mean_what_the_assembler_says() {
        ASSEMBLED.iter().for_each(|(text, first, second, expected)| {
            assert_eq!(effect(0x0800_1000, *first, *second), *expected, "{text}");
        });
    }

    const ASSEMBLED: &[(&str, u16, u16, Effect)] = &[
        ("push {r4, r5, r7, lr}", 0xB5B0, 0x0000, Effect::Grow(16)),
        ("push.w {r4, r8, lr}", 0xE92D, 0x4110, Effect::Grow(12)),
        ("str r8, [sp, #-4]!", 0xF84D, 0x8D04, Effect::Grow(4)),
        ("str r0, [sp, #-16]!", 0xF84D, 0x0D10, Effect::Grow(16)),
        ("strd r0, r1, [sp, #-8]!", 0xE96D, 0x0102, Effect::Grow(8)),
        ("vpush {d8, d9, d10}", 0xED2D, 0x8B06, Effect::Grow(24)),
        ("vpush {s16}", 0xED2D, 0x8A01, Effect::Grow(4)),
        ("sub sp, #40", 0xB08A, 0x0000, Effect::Grow(40)),
        ("sub.w sp, sp, #1024", 0xF5AD, 0x6D80, Effect::Grow(1024)),
        ("sub.w sp, sp, #272", 0xF5AD, 0x7D88, Effect::Grow(272)),
        ("subw sp, sp, #1236", 0xF2AD, 0x4DD4, Effect::Grow(1236)),
        ("sub.w sp, sp, r3", 0xEBAD, 0x0D03, Effect::Unknown),
        ("mov sp, r4", 0x46A5, 0x0000, Effect::FromRegister(4)),
        ("sub.w r4, r7, #16", 0xF1A7, 0x0410, Effect::FromFrame(4)),
        ("subs r4, r7, #4", 0x1F3C, 0x0000, Effect::FromFrame(4)),
        ("bfc r4, #0, #3", 0xF36F, 0x0402, Effect::Aligned(4, 8)),
        ("bx lr", 0x4770, 0x0000, Effect::None),
        ("bx r3", 0x4718, 0x0000, Effect::Indirect),
        ("blx r3", 0x4798, 0x0000, Effect::Indirect),
        ("mov pc, r3", 0x469F, 0x0000, Effect::JumpTo(3)),
        ("add pc, r3", 0x449F, 0x0000, Effect::JumpTo(3)),
        ("add r2, pc", 0x447A, 0x0000, Effect::Near(2)),
        ("ldr r0, [r4, r0]", 0x5820, 0x0000, Effect::Indexed(0, 4)),
        ("add sp, r6", 0x44B5, 0x0000, Effect::Moved(6)),
        ("adr.w r6, #8", 0xF20F, 0x0608, Effect::Near(6)),
        ("add.w r6, r1, r10, lsl #2", 0xEB01, 0x068A, Effect::Indexed(6, 1)),
        ("adr r3, #8", 0xA302, 0x0000, Effect::Near(3)),
        ("ldr r0, [pc, #4]", 0x4801, 0x0000, Effect::Literal(0, 0x0800_1008)),
        ("ldr.w pc, [r3]", 0xF8D3, 0xF000, Effect::Indirect),
        ("ldr pc, [sp], #4", 0xF85D, 0xFB04, Effect::None),
        ("msr msp, r0", 0xF380, 0x8808, Effect::None),
        ("dsb sy", 0xF3BF, 0x8F4F, Effect::None),
        ("add sp, #40", 0xB00A, 0x0000, Effect::None),
        ("mov r7, sp", 0x466F, 0x0000, Effect::None),
        ("bl 0x0800_0800", 0xF7FF, 0xFBFE, Effect::Call(0x0800_0800)),
        ("bl 0x0800_17fc", 0xF000, 0xFBFC, Effect::Call(0x0800_17FC)),
        ("b.w 0x0800_07f8", 0xF7FF, 0xBBFA, Effect::Jump(0x0800_07F8)),
        ("b.w 0x0800_17f4", 0xF000, 0xBBF8, Effect::Jump(0x0800_17F4)),
        ("bne.w 0x0800_07f0", 0xF47F, 0xABF6, Effect::Jump(0x0800_07F0)),
        ("beq 0x0800_102c", 0xD014, 0x0000, Effect::Jump(0x0800_102C)),
        ("b 0x0800_102a", 0xE013, 0x0000, Effect::Jump(0x0800_102A)),
    ];
}
