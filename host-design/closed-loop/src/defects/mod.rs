//! Fault injection: a defect between the rig and the whole firmware, tick by tick.
//!
//! A [`Defect`] has an [`Expected`] outcome. A [`Trial`] is a run with one defect, drawn from a seed and its number, so
//! that any of them can be run again alone. [`Defective`] takes part in a run and changes what the firmware reads and
//! drives.
//!
//! ```
//! use upright_closed_loop::defects::{Defect, Expected};
//!
//! assert_eq!(Defect::BadSample.expected(), Expected::Counted);
//! ```

mod by_hand;
mod defect;
mod expected;
mod in_phase;
mod injection;
mod trial;

pub use by_hand::Defective;
pub use defect::{Defect, Needs};
pub use expected::{Expected, Phase, Ticks};
pub use in_phase::SHAKEN_S;
pub use injection::push_limit_n;
pub use trial::Trial;
