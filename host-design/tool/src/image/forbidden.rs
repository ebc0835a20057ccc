//! Check that an image for a board contains no code that panics or allocates.

use super::elf::{ImageChip, LinkedImage};
use super::stack::{StackError, reached_by_handlers};

/// Parts of the names of functions that only a panic, its message or an allocation brings into an image.
const FORBIDDEN: [&str; 9] = [
    "core::panicking::",
    "core::panic::",
    "core::fmt::",
    "rust_begin_unwind",
    "unwrap_failed",
    "expect_failed",
    "slice_index_fail",
    "__rust_alloc",
    "alloc::",
];

/// Names of functions in the image that panic, format a panic's message, or allocate; none in a good image.
///
/// An optimised build drops functions that are never called, so a function in the image may be reached.
pub fn forbidden_functions(image: &LinkedImage) -> Vec<&str> {
    let names = image.functions.iter().map(|function| function.name.as_str());
    names.filter(|name| is_forbidden(name)).collect()
}

/// Those of [`forbidden_functions`] that must not be in this image: all, or on a Pico and a Pico 2 those that an
/// interrupt reaches. There, the crates of the USB device contain panics. They run below the tick, and a panic turns
/// the motor off.
///
/// # Errors
/// [`StackError`] if it is unknown what an interrupt reaches.
pub fn wrong_functions(image: &LinkedImage) -> Result<Vec<&str>, StackError> {
    Ok(match image.chip {
        ImageChip::F4 => forbidden_functions(image),
        ImageChip::Rp2040 | ImageChip::Rp2350 => forbidden_in_handlers(image)?,
    })
}

/// Those of [`forbidden_functions`] that interrupts and exceptions reach, among them the tick.
///
/// # Errors
/// As for [`wrong_functions`].
pub fn forbidden_in_handlers(image: &LinkedImage) -> Result<Vec<&str>, StackError> {
    let reached = reached_by_handlers(image)?;
    Ok(reached.into_iter().filter(|name| is_forbidden(name)).collect())
}

fn is_forbidden(name: &str) -> bool {
    FORBIDDEN.iter().any(|part| match part.strip_suffix("::") {
        // A path begins with it, or holds it as a type: `<alloc::vec::Vec<u8>>::push`.
        Some(_) => name.match_indices(part).any(|(at, _)| {
            !name[..at].ends_with(|before: char| before.is_alphanumeric() || "_:".contains(before))
        }),
        None => name.contains(part),
    })
}

#[cfg(test)]
mod tests {
    use super::is_forbidden;

    #[test]
    fn only_panics_and_allocations_are_forbidden() {
        for name in [
            "core::panicking::panic_fmt",
            "core::option::unwrap_failed",
            "<core::fmt::Formatter>::pad",
            "<alloc::vec::Vec<u8>>::push",
            "__rust_alloc",
        ] {
            assert!(is_forbidden(name), "{name}");
        }
        for name in
            ["upright::control::controller::tick", "upright_image::app::idle", "heapless::pool::alloc::take"]
        {
            assert!(!is_forbidden(name), "{name}");
        }
    }
}
