//! What an instruction waits for, by [`CoreTiming::Slow`](crate::timing::CoreTiming::Slow), because of the one before.

use crate::instruction::{Float1, Float2, Op};

/// What is remembered of the instruction before.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pipeline {
    /// The floating-point register that it computed: a bit.
    computed: u32,
}

impl Pipeline {
    /// Cycles for which `op` waits for a floating-point result; it is then the instruction before.
    #[inline]
    pub(crate) fn wait_for_result(&mut self, op: Op) -> u32 {
        let waits = self.computed & used_singles(op) != 0;
        self.computed = computed_single(op);
        waits.into()
    }
}

/// The floating-point registers that an instruction reads, as bits.
fn used_singles(op: Op) -> u32 {
    let singles =
        |first: u8, count: u8| (((1u64 << count) - 1) as u32 * u32::from(first < 32)) << (first & 31);
    match op {
        Op::Float2 { op, d, n, m } => {
            let adds_to =
                !matches!(op, Float2::Add | Float2::Sub | Float2::Mul | Float2::NegMul | Float2::Div);
            singles(n, 1) | singles(m, 1) | singles(d, u8::from(adds_to))
        }
        Op::Float1 { m, .. } => singles(m, 1),
        Op::FloatCompare { d, m, .. } => singles(d, 1) | m.map_or(0, |m| singles(m, 1)),
        Op::FloatToCore { n, .. } => singles(n, 1),
        Op::FloatPairToCore { m, .. } => singles(m, 2),
        Op::FloatStore { d, count, .. } | Op::FloatStoreMultiple { d, count, .. } => singles(d, count),
        _ => 0,
    }
}

/// The register for whose value the next instruction would have to wait: arithmetic and conversions (DDI 0439, 7.2.3).
fn computed_single(op: Op) -> u32 {
    match op {
        Op::Float2 { d, .. } => 1 << (d & 31),
        Op::Float1 { op: Float1::Move | Float1::Abs | Float1::Neg, .. } => 0,
        Op::Float1 { d, .. } => 1 << (d & 31),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_result_is_waited_for_by_the_instruction_that_uses_it_and_by_no_other() {
        let float2 = |op, d, n, m| Op::Float2 { op, d, n, m };
        let product = computed_single(float2(Float2::Mul, 31, 1, 2));
        assert_eq!(product, 1 << 31);
        assert_ne!(used_singles(float2(Float2::Add, 4, 31, 3)) & product, 0);
        assert_ne!(used_singles(float2(Float2::Mla, 31, 1, 2)) & product, 0);
        assert_eq!(used_singles(float2(Float2::Add, 31, 1, 2)) & product, 0);
        let store = |d, count| Op::FloatStore { d, rn: 0, offset: 0, count };
        assert_ne!(used_singles(store(30, 2)) & product, 0);
        assert_eq!(used_singles(store(30, 1)) & product, 0);
        assert_eq!(computed_single(Op::Float1 { op: Float1::Neg, d: 3, m: 1 }), 0);
    }
}
