//! `[limits]`: what the supervisor enforces.

use serde::Serialize;

/// Limits of the rig and times of the supervisor. What is not given follows from other values where the table is made.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Limits {
    /// Largest absolute angle of any link from upright (rad).
    pub angle_rad: Option<f64>,
    /// Largest cart speed (m/s).
    pub speed_m_per_s: Option<f64>,
    /// Distance from each end of the rail at which the motor is turned off (m).
    pub rail_margin_m: Option<f64>,
    /// By how much the distance between the limit switches may differ from the rail's length (m).
    pub travel_tolerance_m: Option<f64>,
    /// Least supply voltage of the power stage (V).
    pub supply_min_v: Option<f64>,
    /// The supply may be too low for so long (s).
    pub supply_time_s: f64,
    /// The law may ask for more than the largest force for so long (s).
    pub saturation_time_s: f64,
    /// A host that commands the set-point may be silent for so long (s).
    pub link_timeout_s: f64,
    /// Largest angle of any link from upright at which balancing begins (rad).
    pub arm_angle_rad: Option<f64>,
    /// Largest rate of any joint at which balancing begins (rad/s).
    pub arm_rate_rad_per_s: f64,
    /// Largest speed of the cart at which balancing begins (m/s).
    pub arm_speed_m_per_s: f64,
    /// Links and cart have to be upright and slow for so long before balancing begins (s).
    pub arm_time_s: f64,
    /// Links and cart have to be still for so long before they are homed (s).
    pub still_time_s: f64,
    /// Mean time between false alarms of the tests for encoders and motor while balancing (h).
    pub false_alarm_h: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            angle_rad: None,
            speed_m_per_s: None,
            rail_margin_m: None,
            travel_tolerance_m: None,
            supply_min_v: None,
            supply_time_s: 0.005,
            saturation_time_s: 0.5,
            link_timeout_s: 0.1,
            arm_angle_rad: None,
            arm_rate_rad_per_s: 0.1,
            arm_speed_m_per_s: 0.05,
            arm_time_s: 0.3,
            still_time_s: 0.5,
            false_alarm_h: 1000.0,
        }
    }
}
