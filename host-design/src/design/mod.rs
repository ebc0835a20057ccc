//! Control design: from a linear model to gains, each the correctly rounded exact answer.

mod controllability;
mod doubling;
mod place;
mod riccati;
mod zero_order_hold;

pub use controllability::Reach;
pub use place::{Pole, dominant_pair, place};
pub use riccati::{Cost, NoStabilisingSolution, Regulator, care, dare, is_stable, is_stable_sampled};
pub use zero_order_hold::{integrated_quadratic, sampled_cost, zero_order_hold};
