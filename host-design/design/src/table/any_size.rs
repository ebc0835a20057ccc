//! From numbers of states and sensors known at run time to the firmware's types, which take them as const parameters.
//!
//! Everything inside a [`WithSize`] is compiled once per size: only code that needs the numbers in a type belongs
//! there, and few sizes are compiled.

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

/// Compares with `$nx` in the order of the list, which has to be ascending for each `$ny`.
macro_rules! dispatch {
    ($fits:ident($states:expr, $sensors:expr), $action:expr, $($ny:literal: $($nx:literal)*;)*) => {
        match $sensors {
            $($ny => {
                $(if $fits($states, $nx) {
                    return Some($action.run::<$nx, $ny, { $ny - 1 }>());
                })*
                None
            })*
            _ => None,
        }
    };
}

/// Runs `action` for the smallest compiled size that has room for `states` and exactly so many `sensors`: NX may be
/// larger than `states`. `None` if there is none.
///
/// The sizes of chains, 2n + 2 states with n + 1 sensors, are all compiled. A `[model]`, of up to [`MAX_STATES`] states
/// with up to [`MAX_MODEL_SENSORS`] sensors, is padded to the next size with states that stay 0. In a browser there are
/// only the smaller sizes, so that a page is loaded sooner.
pub fn with_size<A: WithSize>(states: usize, sensors: usize, action: A) -> Option<A::Output> {
    let is_model = sensors <= MAX_MODEL_SENSORS;
    let has_room = |states: usize, nx: usize| states == nx || (is_model && (1..nx).contains(&states));
    #[cfg(target_family = "wasm")]
    dispatch! { has_room(states, sensors), action,
        1: 2 6 10; 2: 4 6; 3: 6; 4: 8; 5: 10; 6: 12; 7: 14;
    }
    #[cfg(not(target_family = "wasm"))]
    dispatch! { has_room(states, sensors), action,
        1: 2 6 14 30; 2: 4 8 16 30; 3: 6; 4: 8; 5: 10; 6: 12; 7: 14; 8: 16; 9: 18; 10: 20; 11: 22; 12: 24; 13: 26; 14: 28;
        15: 30;
    }
}

/// As [`with_size`], but for exactly so many states, for the sizes with which the whole firmware runs on the host:
/// chains of 1 to 6 links, and models of up to 6 states with one sensor. More sizes would only take longer to compile.
pub fn with_firmware_size<A: WithSize>(states: usize, sensors: usize, action: A) -> Option<A::Output> {
    let is_exact = |states: usize, nx: usize| states == nx;
    dispatch! { is_exact(states, sensors), action,
        1: 1 2 3 4 5 6; 2: 4; 3: 6; 4: 8; 5: 10; 6: 12; 7: 14;
    }
}

/// The firmware's table in the largest size.
pub(super) type WidestTable = GainTable<MAX_STATES, MAX_SENSORS>;

/// `matrix`, padded with zeros to R×C.
pub fn widest<T: Scalar, const R: usize, const C: usize>(matrix: &Matrix<T>) -> SMatrix<T, R, C> {
    SMatrix::from_fn(|row, column| {
        if row < matrix.rows() && column < matrix.cols() { matrix[(row, column)] } else { T::default() }
    })
}
