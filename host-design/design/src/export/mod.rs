//! The controller for programs that are not written in Rust: [`c_header`] makes one C99 header from a gain table.
//!
//! Its results are those of the firmware's balancing, bit for bit: the header adds, multiplies and divides in single
//! precision, in the order of `upright`. What the compiler must not change is checked where the header is compiled, and
//! again when the program starts.

mod absolute;
mod c_header;
mod calling;
mod faults;
mod initializer;

pub use c_header::{NoHeader, c_header};
pub use calling::CALLING;
pub use faults::{HeaderFault, header_faults};
