//! Fault injection: the whole firmware in the loop, one defect per run, and the outcome.
//!
//! A [`Defect`] of defect has an [`Expected`] outcome. A [`Trial`] is a run with one defect, drawn from the campaign's
//! seed and its number, so that any of them can be run again alone. [`campaign`] runs many and counts the outcomes.
//!
//! ```
//! use upright_design::design::design;
//! use upright_design::rig::Rig;
//! use upright_design::table::{Gains, TableValues};
//! use upright_tool::campaign::{Trial, kinds};
//! use upright_tool::in_the_loop::RunPlace;
//!
//! let rig = Rig::from_path("../../rigs/single-quanser-ip02.toml".as_ref())?;
//! let table = TableValues::of(&rig, &design(&rig)?, Gains::Sampled)?;
//! let kinds = kinds(&table, RunPlace::Host);
//! // The same trial each time, whichever others are made.
//! assert_eq!(Trial::draw(&rig, &table, &kinds, 1, 7), Trial::draw(&rig, &table, &kinds, 1, 7));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod attempt;
mod jogged;
mod judge;
mod observed;
mod on_board;
mod push;
mod shaken;
mod stilled;
mod tally;

pub use attempt::{During, Setup};
pub use judge::{Class, TrialOutcome};
pub use shaken::feed;
pub use tally::{Campaign, CampaignError, DefectRow, campaign, kinds, one};
pub use upright_closed_loop::defects::{Defect, Defective, Expected, Needs, Phase, Ticks, Trial};
