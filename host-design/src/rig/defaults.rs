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
