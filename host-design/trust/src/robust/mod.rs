//! Gains that survive a machine that differs from its file, chosen among multiples of the file's own numbers.
//!
//! [`choose`] sorts all candidates by predicted ripple, and simulates those with the least ripple whose linear loop is
//! stable, with a margin of 2e-4, at all mass errors. The joint noise chosen is the one with the least sum of the laws'
//! ripples, each relative to that of the file. The choice is designed again and certified. If nothing is chosen, the
//! share of the tolerances that can be reached is found by bisection, with 8 loops of each law and joint noise at each
//! share. Friction is judged by simulation only: neither margins nor norms rank designs as friction does.
//! [`false_alarms`] balances machines within the tolerances with the whole firmware.
//!
//! ```
//! use upright::table::Law;
//! use upright_design::design::design;
//! use upright_design::rig::{Rig, Tolerances};
//! use upright_trust::robust::{JudgeSettings, judge};
//! use upright_design::study::Study;
//! use upright_design::table::{Gains, TableValues};
//!
//! let rig = Rig::from_path("../../rigs/single-quanser-ip02.toml".as_ref())?;
//! let table = TableValues::of(&rig, &design(&rig)?, Gains::Sampled)?;
//! let tolerances = Tolerances { mass_percent: 5.0, ..Tolerances::default() };
//! let settings = JudgeSettings { runs: 1, duration_s: 1.0, ..JudgeSettings::of(&rig) };
//! assert!(judge(&rig, &table, Law::Lqr, &tolerances, &settings, &Study::whole())?.survives());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod candidate;
mod error;
mod false_alarms;
mod file;
mod front;
mod judge;
mod linear;
mod loops;
mod reason;
mod search;

pub use candidate::{Candidate, LawNumbers};
pub use error::RobustError;
pub use false_alarms::{FalseAlarms, Healthy, Machines, balance, false_alarms};
pub use file::{rewritten, set_tolerances};
pub use front::{Front, FrontPoint, LawRipple, LeastRipple};
pub use judge::{JudgeSettings, Judgement, Runs, judge};
pub use search::{Choice, Chosen, choose};
