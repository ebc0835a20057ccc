//! The Thumb-2 instructions that matter for the stack and for calls (Armv7-M Architecture Reference Manual, A5 and
//! A7.7).

/// Effect of an instruction on the stack pointer or the control flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Effect {
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
    /// The first register becomes the second plus another: an entry of a table, if the second is the table's address.
    Indexed(u8, u8),
    /// This register becomes the word at this address.
    Literal(u8, u32),
    /// The stack pointer becomes this register's value.
    FromRegister(u8),
    /// This register is rounded down to a multiple of this many bytes.
    Aligned(u8, u32),
    /// This register becomes the frame pointer (r7) less a constant.
    FromFrame(u8),
    /// The stack grows by an amount known only at run time.
    Unknown,
}

/// Whether an instruction with this first halfword has two (A5.1).
pub(crate) fn is_wide(first: u16) -> bool {
    first >> 11 >= 0b11101
}

/// Decodes the instruction at `address`; `second` is used only if it has two halfwords.
pub(crate) fn decode(address: u32, first: u16, second: u16) -> Effect {
    let to = |offset: i32| Effect::Jump(address.wrapping_add(4).wrapping_add_signed(offset));
    let register = |value: u16| (value & 15) as u8;
    if !is_wide(first) {
        return match first {
            0xB400..=0xB5FF => Effect::Grow(4 * (first & 0x1FF).count_ones()), // PUSH
            0xB080..=0xB0FF => Effect::Grow(4 * u32::from(first & 0x7F)),      // SUB SP
            _ if first & 0xFFF8 == 0x4770 => Effect::None,                     // BX LR
            _ if first & 0xFF87 == 0x4687 => Effect::JumpTo(register(first >> 3)), // MOV PC
            // BX, BLX; ADD to PC
            _ if first & 0xFF00 == 0x4700 || first & 0xFF87 == 0x4487 => Effect::Indirect,
            0xA000..=0xA7FF => Effect::Near((first >> 8 & 7) as u8), // ADR
            0x4800..=0x4FFF => {
                let at = (address.wrapping_add(4) & !3) + 4 * u32::from(first & 0xFF);
                Effect::Literal((first >> 8 & 7) as u8, at) // LDR
            }
            _ if first & 0xFF87 == 0x4685 => Effect::FromRegister(register(first >> 3)), // MOV SP
            _ if first & 0xFE38 == 0x1E38 => Effect::FromFrame((first & 7) as u8),       // SUBS Rd, R7
            0xD000..=0xDDFF => to(sign_extended(u32::from(first & 0xFF) << 1, 9)),
            0xE000..=0xE7FF => to(sign_extended(u32::from(first & 0x7FF) << 1, 12)),
            _ => Effect::None,
        };
    }
    let constant =
        u32::from(first >> 10 & 1) << 11 | u32::from(second >> 12 & 7) << 8 | u32::from(second & 0xFF);
    match first {
        0xE92D => Effect::Grow(4 * second.count_ones()), // PUSH, of registers
        0xF84D if second & 0x0F00 == 0x0D00 => Effect::Grow(u32::from(second & 0xFF)), // STR, pre-indexed
        0xE96D => Effect::Grow(4 * u32::from(second & 0xFF)), // STRD, pre-indexed
        _ if first & 0xFFBF == 0xED2D && second & 0x0E00 == 0x0A00 => {
            Effect::Grow(4 * u32::from(second & 0xFF)) // VPUSH
        }
        // SUB and SUBW, SP from SP
        _ if first & 0xFBEF == 0xF1AD && second & 0x8F00 == 0x0D00 => Effect::Grow(expanded(constant)),
        _ if first & 0xFBFF == 0xF2AD && second & 0x8F00 == 0x0D00 => Effect::Grow(constant),
        _ if first & 0xFFEF == 0xEBAD && second & 0x0F00 == 0x0D00 => Effect::Unknown, // SUB, a register
        _ if matches!(first & 0xFBFF, 0xF1A7 | 0xF2A7) && second & 0x8000 == 0 => {
            Effect::FromFrame(register(second >> 8)) // SUB Rd, R7
        }
        0xF20F | 0xF60F | 0xF2AF | 0xF6AF => Effect::Near(register(second >> 8)), // ADR
        // ADD, of a shifted register
        _ if first & 0xFFF0 == 0xEB00 => Effect::Indexed(register(second >> 8), register(first)),
        // BFC from bit 0
        0xF36F if second & 0x70C0 == 0 => Effect::Aligned(register(second >> 8), 2 << (second & 31)),
        // LDR to PC; from the stack, it is a return
        _ if first & 0xFF70 == 0xF850 && second >> 12 == 15 && first & 15 != 13 => Effect::Indirect,
        _ if first >> 11 == 0b11110 && second & 0x8000 != 0 => branch(address, first, second),
        _ => Effect::None,
    }
}

/// B and BL, encodings T1, T3 and T4.
fn branch(address: u32, first: u16, second: u16) -> Effect {
    let (sign, j1, j2) = (first >> 10 & 1, second >> 13 & 1, second >> 11 & 1);
    let (low, from) = (u32::from(second & 0x7FF) << 1, address.wrapping_add(4));
    let far = {
        let (i1, i2) = (u32::from(1 ^ j1 ^ sign), u32::from(1 ^ j2 ^ sign));
        let bits = u32::from(sign) << 24 | i1 << 23 | i2 << 22 | u32::from(first & 0x3FF) << 12 | low;
        from.wrapping_add_signed(sign_extended(bits, 25))
    };
    match second & 0x5000 {
        0x5000 => Effect::Call(far),
        0x1000 => Effect::Jump(far),
        // A condition of 111x is another instruction (MSR, DSB …).
        0x0000 if first >> 7 & 7 != 7 => {
            let bits = u32::from(sign) << 20
                | u32::from(j2) << 19
                | u32::from(j1) << 18
                | u32::from(first & 0x3F) << 12
                | low;
            Effect::Jump(from.wrapping_add_signed(sign_extended(bits, 21)))
        }
        _ => Effect::None,
    }
}

fn sign_extended(value: u32, bits: u32) -> i32 {
    (value << (32 - bits)) as i32 >> (32 - bits)
}

/// Expands a modified immediate constant of twelve bits (A5.3.2).
fn expanded(constant: u32) -> u32 {
    let byte = constant & 0xFF;
    match constant >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte << 24 | byte << 16 | byte << 8 | byte,
        _ => (0x80 | constant & 0x7F).rotate_right(constant >> 7),
    }
}

#[cfg(test)]
mod tests {
    use super::{Effect, decode};

    /// Encodings by LLVM's assembler, all at 0x0800_1000.
    #[test]
    fn instructions_mean_what_the_assembler_says() {
        ASSEMBLED.iter().for_each(|(text, first, second, effect)| {
            assert_eq!(decode(0x0800_1000, *first, *second), *effect, "{text}");
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
