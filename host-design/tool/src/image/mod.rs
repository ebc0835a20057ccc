//! Images for the microcontroller: built with the compiler that is installed, and examined for size, stack and panics.

mod board;
mod build;
mod checksum;
mod compiler;
mod elf;
mod forbidden;
mod kept;
mod size;
mod stack;

pub use board::{Board, NoBoard};
pub use build::{ImageError, Kind, PROFILE, TARGET, build, build_for};
pub use checksum::{file_hash, flash_checksum};
pub use compiler::{Compiler, compiler};
pub use elf::{ElfError, Image};
pub use forbidden::forbidden_functions;
pub use size::{CODE_LIMIT, Part, RAM_LIMIT, Size, SizeError, size};
pub use stack::{StackBound, StackError, StackLevel, stack_bound};
