//! Defaults of `[limits]` that are computed when the gain table is made; the rig holds `None` for them.

/// Largest angle of a link from upright that the supervisor allows (rad): sin θ is within 2 % of θ.
pub const ANGLE_RAD: f64 = 0.35;
/// Share of the largest angle at which balancing may begin.
pub const ARM_ANGLE_SHARE: f64 = 0.1;
/// Share of the rail's length that is left free at each end.
pub const RAIL_MARGIN_SHARE: f64 = 0.025;
/// Largest difference between the rail's length and the distance of the limit switches, as a share of the length.
pub const TRAVEL_TOLERANCE_SHARE: f64 = 0.01;
/// Largest force of the jog, as a share of the force limit.
pub const JOG_FORCE_SHARE: f64 = 0.1;
/// Longest time for which the links are stilled after a fall (s).
pub const STILLING_S: f64 = 0.0;
/// Lowest supply voltage, as a share of the motor's supply voltage.
pub const SUPPLY_SHARE: f64 = 0.8;
