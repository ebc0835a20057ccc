//! Control design: from a linear model to gains, each the correctly rounded exact answer.

mod assessment;
mod certified;
mod controllability;
mod doubling;
mod error;
mod place;
mod riccati;
mod synthesis;
mod zero_order_hold;

pub use assessment::Assessment;
pub use certified::{Certified, design};
pub use controllability::Reach;
pub use error::{DesignError, Task};
pub use place::{Pole, dominant_pair, place};
pub use riccati::{Cost, NoStabilisingSolution, Regulator, care, dare, is_stable, is_stable_sampled};
pub use synthesis::{Design, Feedback, Laws, Poles};
pub use zero_order_hold::{integrated_quadratic, sampled_cost, zero_order_hold};
