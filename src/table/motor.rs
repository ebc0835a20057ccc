//! The motor, as seen by the cart.

use crate::table::force::ForceMap;
use crate::table::part::part;

part! {
    /// A DC motor that drives the cart through a gear and a pulley.
    #[derive(Copy)]
    pub struct MotorMap<; T> {
        /// The force that the voltages are for.
        pub force: ForceMap<T>,
        /// Voltage per force at standstill, `R r / (efficiency gear Kt)` (V/N).
        pub volts_per_newton: T,
        /// Back-EMF per cart speed, `gear Ke / r` (V s/m).
        pub volts_per_speed: T,
        /// Voltage below which the motor does not move (V).
        pub dead_zone_v: T,
        /// Largest change of the voltage in one tick (V).
        pub slew_v_per_tick: T,
        /// Supply voltage the table was designed for (V).
        pub supply_v: T,
    }
}

impl MotorMap {
    /// Whether every force maps to a voltage, and every voltage to a duty cycle.
    pub(crate) fn is_sound(&self) -> bool {
        self.volts_per_newton > 0.0 && self.supply_v > 0.0
    }
}
