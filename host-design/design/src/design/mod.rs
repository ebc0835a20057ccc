//! Control design: from a linear model to gains, each the correctly rounded exact answer.
//!
//! ```
//! use upright_design::design::design;
//! use upright_design::rig::Rig;
//!
//! let rig = Rig::from_path("../../rigs/single-quanser-ip02.toml".as_ref())?;
//! let certified = design(&rig)?;
//! let lqr = certified.double.sampled.lqr.ok_or("the file has [lqr]")?;
//! assert_eq!(lqr.k.cols(), rig.states());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod assessment;
mod certified;
mod controllability;
mod diagnosis;
mod doubling;
mod drive_limits;
mod error;
mod governor;
mod hold;
mod kalman;
mod lag;
mod loops;
mod place;
mod placed_observer;
mod pushed;
mod riccati;
mod stilling;
mod synthesis;
mod thresholds;
mod tolerated;
mod zero_order_hold;

pub use assessment::Assessment;
pub use certified::Uncertified;
pub use certified::{Certified, design};
pub use controllability::Reach;
pub use drive_limits::DriveLimits;
pub use error::{DesignError, Task};
pub use governor::setpoint_step;
pub use hold::with_braking;
pub use kalman::Kalman;
pub use kalman::add_rounded_motion;
pub use lag::{lag_s, shares_of_lag};
pub use lag::{shares, with_lag};
pub use loops::{DesignPoles, Poles};
pub use place::{Pole, dominant_pair, place};
pub use riccati::{Cost, NoStabilisingSolution, Regulator, care, dare, is_stable, is_stable_sampled};
pub use stilling::{NoStilling, Stilling};
pub use synthesis::continuous_plant;
pub use synthesis::{Design, Feedback, Laws};
pub use synthesis::{OBSERVER, noise_columns, wanted_poles};
pub use thresholds::{DetectionDesign, MotorDesign, detection_thresholds};
pub use zero_order_hold::{integrated_quadratic, sampled_cost, zero_order_hold};
