//! Images for the microcontroller: built with the compiler that is installed, and examined for size, stack and panics.
//!
//! ```
//! use upright_tool::image::BoardName;
//!
//! let [shortest_s, longest_s] = BoardName::FeatherF405.tick_s();
//! assert!(shortest_s < 0.001 && longest_s > 0.02);
//! ```

mod board;
mod build;
mod checksum;
mod compiler;
mod elf;
mod error;
mod facts;
mod forbidden;
mod kept;
mod pico;
mod pico_board;
mod pico_limits;
mod size;
mod stack;
mod uf2;

pub use board::{BoardName, NoBoard};
pub use build::{PROFILE, build, build_for, check_rig};
pub use checksum::{file_hash, flash_checksum};
pub use compiler::{Compiler, compiler, compiler_for_chips};
pub(crate) use compiler::{ForeignTarget, compiler_for};
pub use elf::{ElfError, LinkedImage};
pub use error::{BuildError, NoCompiler, TARGET};
pub use facts::{BoardFacts, board_facts};
pub use forbidden::{forbidden_functions, forbidden_in_handlers, wrong_functions};
pub use pico::{PicoImage, build_pico, check_rig_for_pico};
pub use pico_board::PicoBoard;
pub use pico_limits::{PICO_BALANCING_CYCLES, PICO_ENCODERS, PICO_MOTION_CYCLES, PICO_TICK_S, PicoError};
pub use size::{ImagePart, Size, SizeError, size};
pub use stack::{StackBound, StackError, StackLevel, stack_bound};
pub use uf2::uf2;
