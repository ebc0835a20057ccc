//! Values a rig file may leave out. Those that follow from other values are not here: they stay `None` in the rig.

/// Viscous friction of the cart (N·s/m) and of a joint (N·m·s/rad).
pub const FRICTION: f64 = 0.0;
/// Ends of the rail (m).
pub const TRAVEL_M: [f64; 2] = [-2.0, 2.0];
/// Acceleration of gravity (m/s²).
pub const GRAVITY_M_PER_S2: f64 = 9.81;
/// Motor turns per pulley turn.
pub const GEAR_RATIO: f64 = 1.0;
/// Voltage below which the motor does not move (V).
pub const DEAD_ZONE_V: f64 = 0.0;
/// Control period (s).
pub const PERIOD_S: f64 = 0.001;
/// Ticks between measurement and force.
pub const DELAY_TICKS: u8 = 0;
/// Index of the controlled state of a `[model]`.
pub const OUTPUT: usize = 0;
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
