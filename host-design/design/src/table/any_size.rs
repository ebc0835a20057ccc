//! From numbers of states and sensors known at run time to the firmware's types, which take them as const parameters.
//!
//! Everything inside a [`WithSize`] is compiled once per size: only code that needs the numbers in a type belongs
//! there.

use nalgebra::SMatrix;
use upright::table::{GainTable, Scalar};

use crate::numerics::Matrix;

/// The largest number of states a gain table can hold.
pub const MAX_STATES: usize = 30;
/// The largest number of sensors a gain table can hold: cart and links of the longest chain.
pub const MAX_SENSORS: usize = 15;
/// The largest number of sensors for a `[model]` rig. A chain has one for the cart and one for each link instead.
pub const MAX_MODEL_SENSORS: usize = 2;

/// An action that needs the numbers of states (NX) and sensors (NY) as parameters of a type, and of a chain's links
/// (N).
pub trait WithSize {
    /// Result of the action.
    type Output;

    /// Runs the action for one size.
    fn run<const NX: usize, const NY: usize, const N: usize>(self) -> Self::Output;
}

macro_rules! dispatch {
    ($states:expr, $sensors:expr, $action:expr, $($nx:literal: $($ny:literal)*;)*) => {
        match ($states, $sensors) {
            $($(($nx, $ny) => Some($action.run::<$nx, $ny, { $ny - 1 }>()),)*)*
            _ => None,
        }
    };
}

/// Runs `action` with `NX = states` and `NY = sensors`; `None` for sizes that are not compiled on the host. The
/// compiled sizes are 1 to [`MAX_STATES`] states with 1 to [`MAX_MODEL_SENSORS`] sensors, or 2n + 2 states with n + 1
/// sensors; in a browser only the smaller ones, so that a page is loaded sooner.
pub fn with_size<A: WithSize>(states: usize, sensors: usize, action: A) -> Option<A::Output> {
    #[cfg(target_family = "wasm")]
    dispatch! { states, sensors, action,
        1: 1; 2: 1 2; 3: 1 2; 4: 1 2; 5: 1 2; 6: 1 2 3; 7: 1; 8: 1 4; 9: 1; 10: 1 5; 12: 6; 14: 7;
    }
    #[cfg(not(target_family = "wasm"))]
    dispatch! { states, sensors, action,
        1: 1; 2: 1 2; 3: 1 2; 4: 1 2; 5: 1 2; 6: 1 2 3; 7: 1 2; 8: 1 2 4; 9: 1 2; 10: 1 2 5; 11: 1 2; 12: 1 2 6; 13: 1 2;
        14: 1 2 7; 15: 1 2; 16: 1 2 8; 17: 1 2; 18: 1 2 9; 19: 1 2; 20: 1 2 10; 21: 1 2; 22: 1 2 11; 23: 1 2; 24: 1 2 12;
        25: 1 2; 26: 1 2 13; 27: 1 2; 28: 1 2 14; 29: 1 2; 30: 1 2 15;
    }
}

/// As [`with_size`], for the sizes with which the whole firmware runs on the host: chains of 1 to 6 links, and models
/// of up to 6 states with one sensor. More sizes would only take longer to compile.
pub fn with_firmware_size<A: WithSize>(states: usize, sensors: usize, action: A) -> Option<A::Output> {
    dispatch! { states, sensors, action,
        1: 1; 2: 1; 3: 1; 4: 1 2; 5: 1; 6: 1 3; 8: 4; 10: 5; 12: 6; 14: 7;
    }
}

/// The firmware's table in the largest size.
pub(super) type WidestTable = GainTable<MAX_STATES, MAX_SENSORS>;

/// `matrix`, padded with zeros to R×C.
pub(crate) fn widest<T: Scalar, const R: usize, const C: usize>(matrix: &Matrix<T>) -> SMatrix<T, R, C> {
    SMatrix::from_fn(|row, column| {
        if row < matrix.rows() && column < matrix.cols() { matrix[(row, column)] } else { T::default() }
    })
}
