//! Images for the microcontroller: code, compiled once for rigs of a kind, with the tables of a rig written behind it;
//! and what they need and must not contain: size, stack, panics.
//!
//! ```
//! use upright::boards::named;
//! use upright_tool::image::conditions;
//!
//! let nucleo = conditions(named("nucleo-f446").unwrap(), 1)?;
//! assert!(nucleo.crystal.is_clock_input);
//! # Ok::<(), upright_tool::image::BuildError>(())
//! ```

mod build;
mod checksum;
mod compiler;
mod elf;
mod error;
mod forbidden;
mod gains;
mod kept;
mod limits;
mod prebuilt;
mod size;
mod stack;
mod tables;
mod ticks;
mod uf2;
mod usual;
mod virtual_board;

pub use build::{BuiltImage, PROFILE, build_for, usual_duration};
pub use checksum::{file_hash, flash_checksum};
pub use compiler::{Compiler, compiler, compiler_for_chips};
pub(crate) use compiler::{ForeignTarget, compiler_for};
pub use elf::{ElfError, LinkedImage};
pub use error::{BuildError, NoCompiler, TARGET};
pub use forbidden::{forbidden_functions, forbidden_in_handlers, wrong_functions};
pub use gains::CommittedGains;
pub use limits::{PICO_BALANCING_CYCLES, PICO_MOTION_CYCLES, PICO_READING_CYCLES, check_rig, check_table};
pub use prebuilt::{PREBUILT_FILE, PREBUILT_VARIABLE, Prebuilt, PrebuiltError};
pub use size::{ImagePart, Size, SizeError, size};
pub use stack::{StackBound, StackError, StackLevel, stack_bound};
pub use ticks::{ClassTicks, SPREAD};
pub use uf2::uf2;
pub use virtual_board::conditions;
