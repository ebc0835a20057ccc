//! A bound on the stack from the machine code: what functions push, what they call, and which handlers interrupt.
//!
//! It holds for every compiler and every input, because it takes every branch: a function costs the sum of everything
//! it ever pushes, and every handler of the vector table is assumed to interrupt all others at their deepest point.

use upright_board::{Effect, effect, is_wide};

use super::elf::LinkedImage;

/// The most stack that an image can need.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct StackBound {
    /// Sum of all levels, in bytes.
    pub bytes: u32,
    /// What memory.x reserves, in bytes.
    pub reserved: u32,
    /// The program and each handler.
    pub levels: Vec<StackLevel>,
}

/// The program from its start, or a handler.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct StackLevel {
    /// Functions of the deepest chain of calls, from the first one.
    pub chain: Vec<String>,
    /// Stack of that chain, with the exception frame, in bytes.
    pub bytes: u32,
}

/// Code for whose stack no bound was found.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum StackError {
    /// A function that calls itself, perhaps through others.
    #[error("no bound on the stack: {0} calls itself")]
    Recursion(String),
    /// A call through a pointer.
    #[error("no bound on the stack: {function} calls through a pointer, at {address:#010x}")]
    Indirect {
        /// The function.
        function: String,
        /// Address of the instruction.
        address: u32,
    },
    /// An array of a size that is not constant.
    #[error("no bound on the stack: {function} moves the stack pointer by a variable, at {address:#010x}")]
    Variable {
        /// The function.
        function: String,
        /// Address of the instruction.
        address: u32,
    },
    /// A call of an address that is not a function.
    #[error("{function} calls {target:#010x}, which is not a function")]
    Nowhere {
        /// The function.
        function: String,
        /// The address called.
        target: u32,
    },
}

/// Stack frame and calls of a function.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct FunctionFrame {
    name: String,
    /// Bytes that it pushes itself.
    frame: u32,
    /// Indices of the functions that it calls.
    calls: Vec<usize>,
}

/// Bounds the stack of an image.
///
/// # Errors
/// [`StackError`] if functions call each other recursively or through pointers.
pub fn stack_bound(image: &LinkedImage) -> Result<StackBound, StackError> {
    let nodes = reachable(image)?;
    let mut levels: Vec<StackLevel> = Vec::new();
    let mut entries: Vec<(usize, u32)> = Vec::new();
    for (number, address) in &image.vectors {
        let frame = if *number == 1 { 0 } else { image.chip.exception_frame() };
        let function = index_of(image, "the vector table", *address)?;
        if !entries.contains(&(function, frame)) {
            entries.push((function, frame));
        }
    }
    for (function, frame) in entries {
        let (bytes, chain) = deepest(&nodes, function)?;
        levels.push(StackLevel { chain, bytes: bytes + frame });
    }
    let bytes = levels.iter().map(|level| level.bytes).sum();
    Ok(StackBound { bytes, reserved: image.stack_reserved, levels })
}

/// The functions that interrupts and exceptions reach, which is what can delay or end a tick.
///
/// # Errors
/// As for [`stack_bound`], but functions may call themselves.
pub(super) fn reached_by_handlers(image: &LinkedImage) -> Result<Vec<&str>, StackError> {
    let nodes = reachable(image)?;
    let mut waiting = Vec::new();
    for (_, address) in image.vectors.iter().filter(|(number, _)| *number != 1) {
        waiting.push(index_of(image, "the vector table", *address)?);
    }
    let mut is_reached = vec![false; nodes.len()];
    while let Some(index) = waiting.pop() {
        if !std::mem::replace(&mut is_reached[index], true) {
            waiting.extend(&nodes[index].calls);
        }
    }
    let reached = image.functions.iter().zip(is_reached).filter(|(_, is_reached)| *is_reached);
    Ok(reached.map(|(function, _)| function.name.as_str()).collect())
}

fn index_of(image: &LinkedImage, caller: &str, target: u32) -> Result<usize, StackError> {
    image.function_at(target).ok_or_else(|| StackError::Nowhere { function: caller.to_owned(), target })
}

/// All functions of the image; those that no handler reaches are empty.
fn reachable(image: &LinkedImage) -> Result<Vec<FunctionFrame>, StackError> {
    let mut nodes = vec![None; image.functions.len()];
    let mut waiting = Vec::new();
    for (_, address) in &image.vectors {
        waiting.push(index_of(image, "the vector table", *address)?);
    }
    while let Some(index) = waiting.pop() {
        if nodes[index].is_none() {
            let node = node(image, index)?;
            waiting.extend(&node.calls);
            nodes[index] = Some(node);
        }
    }
    Ok(nodes.into_iter().map(Option::unwrap_or_default).collect())
}

/// The effect of each instruction of a function, with its address.
fn effects(image: &LinkedImage, index: usize) -> Vec<(u32, Effect)> {
    let mut effects = Vec::new();
    for code in image.code(&image.functions[index]) {
        let mut place = 0;
        while let Some(&first) = code.halfwords.get(place) {
            let address = code.address + 2 * place as u32;
            let second = code.halfwords.get(place + 1).copied().unwrap_or_default();
            effects.push((address, effect(address, first, second)));
            place += 1 + usize::from(is_wide(first));
        }
    }
    effects
}

fn node(image: &LinkedImage, index: usize) -> Result<FunctionFrame, StackError> {
    let name = image.functions[index].name.clone();
    let mut node = FunctionFrame { name: name.clone(), ..FunctionFrame::default() };
    let effects = effects(image, index);
    for (place, &(address, effect)) in effects.iter().enumerate() {
        match effect {
            Effect::Grow(bytes) => node.frame += bytes,
            // On a Cortex-M0, far jumps within a function are calls as well.
            Effect::Call(target) | Effect::Jump(target) => {
                let other = index_of(image, &name, target)?;
                let is_call = matches!(effect, Effect::Call(_)) && target == image.functions[index].address;
                if other != index || is_call {
                    node.calls.push(other);
                }
            }
            // A branch table: its branches are decoded as well.
            Effect::JumpTo(register) if is_in_a_table(&before(&effects, place), register) => {}
            // What the linker puts between code that is far apart: on a Cortex-M33, the address is in two instructions.
            Effect::Indirect | Effect::JumpTo(_) if name.contains("LongThunk_") => {
                let target =
                    image.code(&image.functions[index]).first().and_then(|code| moved(&code.halfwords));
                node.calls.push(index_of(image, &name, target.unwrap_or_default() & !1)?);
            }
            Effect::Indirect | Effect::JumpTo(_) => {
                return Err(StackError::Indirect { function: name, address });
            }
            Effect::FromRegister(register) => {
                let growth = growth(image, &effects, place, register);
                node.frame += growth.ok_or(StackError::Variable { function: name.clone(), address })?;
            }
            Effect::Moved(register) => {
                let growth = growth_by(image, &effects, place, register);
                node.frame += growth.ok_or(StackError::Variable { function: name.clone(), address })?;
            }
            // On a Cortex-M0, it is in a word behind them.
            Effect::Literal(_, at) if name.contains("LongThunk_") => {
                let target = image.word_in_code(at).unwrap_or_default() & !1;
                node.calls.push(index_of(image, &name, target)?);
            }
            Effect::Unknown => return Err(StackError::Variable { function: name, address }),
            Effect::Aligned(..)
            | Effect::FromFrame(_)
            | Effect::Near(_)
            | Effect::Indexed(..)
            | Effect::Literal(..)
            | Effect::None => {}
        }
    }
    node.calls.sort_unstable();
    node.calls.dedup();
    Ok(node)
}

/// The address that the first two instructions move into a register: `movw` and `movt`.
fn moved(halfwords: &[u16]) -> Option<u32> {
    let &[low, below_low, high, below_high, ..] = halfwords else { return None };
    let half = |first: u16, second: u16| {
        let parts = [(first & 15) << 12, (first >> 10 & 1) << 11, (second >> 12 & 7) << 8, second & 255];
        u32::from(parts[0] | parts[1] | parts[2] | parts[3])
    };
    Some(half(high, below_high) << 16 | half(low, below_low))
}

/// Up to five instructions before one.
fn before(effects: &[(u32, Effect)], place: usize) -> Vec<Effect> {
    effects[place.saturating_sub(5)..place].iter().map(|(_, effect)| *effect).collect()
}

/// Whether a register holds the address of a table near the code, or of an entry in it, after these instructions.
fn is_in_a_table(before: &[Effect], register: u8) -> bool {
    let is_near = |register| before.contains(&Effect::Near(register));
    let is_entry =
        |effect: &Effect| matches!(effect, Effect::Indexed(to, from) if *to == register && is_near(*from));
    is_near(register) || before.iter().any(is_entry)
}

/// Largest growth of the stack when its pointer becomes this register's value; `None` if unknown.
fn growth(image: &LinkedImage, effects: &[(u32, Effect)], place: usize, register: u8) -> Option<u32> {
    // r7 is the frame pointer: the stack pointer returns to where it was.
    if register == 7 {
        return Some(0);
    }
    before(effects, place).into_iter().rev().find_map(|effect| match effect {
        Effect::Aligned(aligned, bytes) if aligned == register => Some(bytes),
        Effect::FromFrame(from) if from == register => Some(0),
        // The handler of a fault resets the stack.
        Effect::Literal(loaded, at)
            if loaded == register && image.word_in_code(at) == Some(image.stack_start) =>
        {
            Some(0)
        }
        _ => None,
    })
}

/// Growth of the stack when its pointer moves by this register's value, a constant; `None` if it is not.
fn growth_by(image: &LinkedImage, effects: &[(u32, Effect)], place: usize, register: u8) -> Option<u32> {
    before(effects, place).into_iter().rev().find_map(|effect| match effect {
        Effect::Literal(loaded, at) if loaded == register => {
            image.word_in_code(at).map(|word| (word as i32).min(0).unsigned_abs())
        }
        _ => None,
    })
}

/// The deepest chain of calls from a function: bytes and names.
fn deepest(nodes: &[FunctionFrame], from: usize) -> Result<(u32, Vec<String>), StackError> {
    fn walk(
        nodes: &[FunctionFrame],
        index: usize,
        path: &mut Vec<usize>,
        known: &mut [Option<(u32, Option<usize>)>],
    ) -> Result<u32, StackError> {
        if let Some((bytes, _)) = known[index] {
            return Ok(bytes);
        }
        if path.contains(&index) {
            return Err(StackError::Recursion(nodes[index].name.clone()));
        }
        path.push(index);
        let (mut below, mut next) = (0, None);
        for &called in &nodes[index].calls {
            let bytes = walk(nodes, called, path, known)?;
            if next.is_none() || bytes > below {
                (below, next) = (bytes, Some(called));
            }
        }
        path.pop();
        let bytes = nodes[index].frame + below;
        known[index] = Some((bytes, next));
        Ok(bytes)
    }
    let mut known = vec![None; nodes.len()];
    let bytes = walk(nodes, from, &mut Vec::new(), &mut known)?;
    let mut chain = vec![nodes[from].name.clone()];
    let mut index = from;
    while let Some((_, Some(next))) = known[index] {
        chain.push(nodes[next].name.clone());
        index = next;
    }
    Ok((bytes, chain))
}

#[cfg(test)]
mod tests {
    use super::{FunctionFrame, StackError, deepest, moved};

    fn node(name: &str, frame: u32, calls: &[usize]) -> FunctionFrame {
        FunctionFrame { name: name.to_owned(), frame, calls: calls.to_vec() }
    }

    #[test]
    fn the_deepest_chain_counts_and_not_the_longest() {
        let nodes = [node("a", 8, &[1, 3]), node("b", 4, &[2]), node("c", 4, &[]), node("d", 100, &[])];
        assert_eq!(deepest(&nodes, 0).unwrap(), (108, vec!["a".to_owned(), "d".to_owned()]));
    }

    #[test]
    fn the_address_in_two_instructions_is_read() {
        // movw ip, #0xe129; movt ip, #0x2000; bx ip
        assert_eq!(moved(&[0xf24e, 0x1c29, 0xf2c2, 0x0c00, 0x4760]), Some(0x2000_e129));
        assert_eq!(moved(&[0xf24e, 0x1c29]), None);
    }

    #[test]
    fn functions_that_call_each_other_have_no_bound() {
        let nodes = [node("a", 8, &[1]), node("b", 4, &[2]), node("c", 4, &[1])];
        assert_eq!(deepest(&nodes, 0), Err(StackError::Recursion("b".to_owned())));
    }
}
