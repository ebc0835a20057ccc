//! The number types that tables, control law and equations of motion are generic over.

mod double;
mod floats;
mod number;
mod single;

pub use double::{LARGEST_RAD, in_quadrant};
pub use number::{Number, Scalar};
