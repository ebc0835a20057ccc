//! `[limits]`

use super::super::error::RigError;
use super::super::node::Node;
use super::super::rule::Rule;
use super::super::{Limits, PlantDescription};

const KEYS: &[&str] = &[
    "angle_rad",
    "speed_m_per_s",
    "rail_margin_m",
    "travel_tolerance_m",
    "supply_min_v",
    "supply_time_s",
    "saturation_time_s",
    "link_timeout_s",
    "arm_angle_rad",
    "arm_rate_rad_per_s",
    "arm_speed_m_per_s",
    "arm_time_s",
    "still_time_s",
    "false_alarm_h",
];

pub(super) fn limits(node: &Node<'_>, plant: &PlantDescription) -> Result<Limits, RigError> {
    let table = node.section(KEYS)?;
    let usual = Limits::default();
    let optional =
        |name, rule, meaning: &str| table.number_if_given(name, rule, &format!("{meaning}, or leave it out"));
    let number = |name, rule, meaning: &str, usual| {
        Ok::<f64, RigError>(table.number_if_given(name, rule, meaning)?.unwrap_or(usual))
    };
    let limits = Limits {
        angle_rad: optional("angle_rad", Rule::ANGLE, "the largest angle from upright in rad")?,
        speed_m_per_s: optional("speed_m_per_s", Rule::POSITIVE, "the largest speed of the cart in m/s")?,
        rail_margin_m: optional(
            "rail_margin_m",
            Rule::NOT_NEGATIVE,
            "the distance from an end of the rail at which the motor is turned off, in m",
        )?,
        travel_tolerance_m: optional(
            "travel_tolerance_m",
            Rule::POSITIVE,
            "by how much the distance between the limit switches may differ from travel_m, in m",
        )?,
        supply_min_v: optional("supply_min_v", Rule::NOT_NEGATIVE, "the least supply voltage in V")?,
        supply_time_s: number(
            "supply_time_s",
            Rule::DURATION,
            "how long the supply may be too low, in s",
            usual.supply_time_s,
        )?,
        saturation_time_s: number(
            "saturation_time_s",
            Rule::DURATION,
            "how long the force may be at its limit, in s",
            usual.saturation_time_s,
        )?,
        link_timeout_s: number(
            "link_timeout_s",
            Rule::DURATION,
            "how long the host may be silent, in s",
            usual.link_timeout_s,
        )?,
        arm_angle_rad: optional(
            "arm_angle_rad",
            Rule::ANGLE,
            "the largest angle from upright at which balancing begins, in rad",
        )?,
        arm_rate_rad_per_s: number(
            "arm_rate_rad_per_s",
            Rule::POSITIVE,
            "the largest rate of a joint at which balancing begins, in rad/s",
            usual.arm_rate_rad_per_s,
        )?,
        arm_speed_m_per_s: number(
            "arm_speed_m_per_s",
            Rule::POSITIVE,
            "the largest speed of the cart at which balancing begins, in m/s",
            usual.arm_speed_m_per_s,
        )?,
        arm_time_s: number(
            "arm_time_s",
            Rule::DURATION,
            "how long all links have to be upright and slow before balancing begins, in s",
            usual.arm_time_s,
        )?,
        still_time_s: number(
            "still_time_s",
            Rule::DURATION,
            "how long everything has to be still before it is homed, in s",
            usual.still_time_s,
        )?,
        false_alarm_h: number(
            "false_alarm_h",
            Rule::FALSE_ALARM,
            "the mean time between false alarms of the tests for encoders and motor, in hours",
            usual.false_alarm_h,
        )?,
    };
    let rail = match plant {
        PlantDescription::Chain(chain) => chain.cart.travel_m,
        PlantDescription::Model(_) => return Ok(limits),
    };
    let room = rail[1].min(-rail[0]);
    match (table.get("rail_margin_m"), limits.rail_margin_m) {
        (Some(node), Some(margin)) if margin >= room => Err(node.out_of_range(
            &format!("a number >= 0 and < {room} (m), which leaves the start of the rail's position 0 free"),
            "give a margin smaller than the way from 0 to either end of travel_m",
        )),
        _ => Ok(limits),
    }
}
