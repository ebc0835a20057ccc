//! Defaults of `[limits]` that are worked out where the gain table is made; the rig holds `None` for them.

/// Largest angle of a link from upright that the supervisor admits (rad): sin θ is within 2 % of θ.
pub const ANGLE_RAD: f64 = 0.35;
/// Share of the largest angle at which balancing may begin.
pub const ARM_ANGLE_SHARE: f64 = 0.1;
/// Share of the rail's length that is left free at each end.
pub const RAIL_MARGIN_SHARE: f64 = 0.025;
/// Share of the rail's length by which the distance between the limit switches may differ from it.
pub const TRAVEL_TOLERANCE_SHARE: f64 = 0.01;
/// Share of the motor's supply voltage below which the supply is too low.
pub const SUPPLY_SHARE: f64 = 0.8;
