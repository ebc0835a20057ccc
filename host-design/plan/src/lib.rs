#![doc = include_str!("../README.md")]
//!
//! # How a motion is found
//!
//! ```text
//! candidates: random duration, bounds, cost ─► shooting ─► knots ─► refine ─► path at ticks, held forces
//!                                                                                │
//! stored file ◄── runs of the firmware ◄── random runs ◄── the best by score ◄── gains and filter along the path
//! ```
//!
//! | module | what is in it |
//! |---|---|
//! | `problem` | ends, bounds and cost of a trajectory |
//! | `dynamics`, `hold` | the chain over a step and over a tick with held force, with derivatives |
//! | `riccati`, `interior_point`, `shooting` | multiple shooting with Gauss-Newton steps |
//! | `refine` | turns knots into ticks |
//! | `tracking`, `gains` | feedback and filter along a path |
//! | `closed_loop`, `robustness` | runs with wrong masses, friction, start and encoders: to choose candidates |
//! | `firmware_runs` | such runs of the whole firmware: to judge the chosen ones |
//! | `search`, `plan` | candidates and selection |
//! | `advice`, `remedy` | what would help if there is no motion |
//! | `demonstration` | all of it in one run of the firmware |
//! | `supervision` | the supervisor's limits in motion |
//! | `stilling`, `recovery` | runs of the firmware that stills tumbling links, and raises a rig that was felled |
//! | `in_table` | the table of the firmware |
//! | `margins`, `trade` | pushes that a motion survives; duration, force and robustness of candidates |
//! | `check`, `stored` | independent check; the file beside the rig file |
//!
//! Everything random has a fixed seed, and every sum is taken in a fixed order, so the result does not depend on the
//! machine or on its threads.

#![forbid(unsafe_code)]

mod advice;
mod check;
mod closed_loop;
mod demonstration;
mod dynamics;
mod error;
mod firmware_runs;
mod gains;
mod hold;
mod in_table;
mod interior_point;
mod margins;
mod plan;
mod problem;
mod recovery;
mod refine;
mod remedy;
mod riccati;
mod robustness;
mod route;
mod search;
mod setting;
mod shooting;
mod stilling;
mod stored;
mod supervision;
mod tracking;
mod trade;
mod transitions;

pub use check::Peaks;
pub use demonstration::{Demonstration, Script, hangs, up_and_down};
pub use error::SwingUpError;
pub use firmware_runs::{Condition, FirmwareRuns, firmware_runs};
pub use in_table::{designed_table, designed_table_with, with_motions};
pub use margins::{Margin, margins};
pub use plan::{MotionJudgement, SwingUpPlan, judge, motions, refined, search};
pub use recovery::{Recovered, RecoveryRuns, recovered};
pub use robustness::{MotionSpread, RandomRuns};
pub use route::{Route, RouteRuns, TransitionRuns, on_route, route_runs};
pub use stilling::{Stilled, StillingRuns, Tumbling, quantile_s, stilled};
pub use stored::Stored;
pub use trade::{SolvedCandidate, solved};
pub use transitions::{Searched, StoredTransitions};
