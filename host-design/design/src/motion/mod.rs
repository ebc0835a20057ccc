//! Planned motions and the equilibria between which they lead: what the search for a swing-up makes, and the gain table
//! takes.
//!
//! ```
//! use upright_design::motion::Transition;
//!
//! // From both links up to the upper one down.
//! let transition = Transition::named("uu-ud", 2).ok_or("no such transition")?;
//! assert_eq!(transition.name(2), "uu-ud");
//! assert_eq!(Transition::named("dd-uu", 2), Some(Transition::Up));
//! # Ok::<(), &str>(())
//! ```

mod planned;
mod transition;

pub use transition::rest;

pub use planned::{MotionError, PlannedMotion, RaiseAndLower};
pub use transition::{Transition, equilibrium_named, posture_name};
