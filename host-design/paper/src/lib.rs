//! The results of the paper compared with ours: F. J. Ticona Coaquira, "Design and comparison of two linear
//! controllers with precompensation gain for the Quadruple inverted pendulum".
//!
//! [`published`] holds what is printed, [`designs`] compares matrices, gains and poles digit by digit, [`errata`] says
//! what the paper leaves open or misprints, [`responses`] are its figures 5 to 8, [`settling`] its Table 2,
//! [`robustness`] what it says about the two laws without numbers. [`ContinuousRun`] is the loop that the paper
//! simulates; where a tick is involved, the firmware's own controller runs.
//!
//! ```
//! use upright_paper::{Agreement, ComparedValue, Digits};
//!
//! let gain = |ours| ComparedValue::printed("K[1]", "A, B", "3.1623", Digits::Decimals(4), ours).verdict;
//! assert_eq!(gain(3.162_278), Agreement::EveryDigit);
//! assert_eq!(gain(3.162_4), Agreement::UnitsOfLastDigit(1));
//! ```

#![forbid(unsafe_code)]

mod claims;
mod comparison;
mod continuous_loop;
mod designs;
mod errata;
mod error;
mod figures;
mod firmware_loop;
pub mod published;
mod reproduction;
mod responses;
mod rigs;
mod robustness;
mod settling;
mod summary;
mod trajectory;

pub use comparison::{Agreement, ComparedValue, Digits};
pub use continuous_loop::ContinuousRun;
pub use designs::{Designs, PoleSet, designs};
pub use errata::{Erratum, Evidence, errata};
pub use error::ReproduceError;
pub use reproduction::{Reproduction, reproduce};
pub use responses::{Loop, Loops, StepResponse, responses};
pub use rigs::{PaperDesigns, PaperRigs, SEED};
pub use robustness::{Ripple, Robustness, robustness};
pub use settling::{HORIZON_S, LONGEST_S, Sensitivity, Settling, SettlingRow, printed, settling};
pub use trajectory::{BAND, StepFigures, Trajectory};
