//! `[limits]`: what the supervisor enforces.

use super::super::error::RigError;
use super::super::key::{Absent, Section};
use super::super::node::Node;
use super::super::rule::Rule;
use super::super::value::{Keys, keys};
use super::chain::{CartInput, PlantDescription};

/// `[limits]`
pub(crate) static LIMITS: Section = Section {
    name: "limits",
    title: "[limits]",
    meaning: "what the supervisor enforces",
    absent: Absent::Follows("as below"),
    keys: &[Limits::KEYS],
};

keys! {
    /// Limits of the rig and times of the supervisor, `[limits]`. A limit that is not given is derived from other
    /// values when the gain table is made.
    pub struct Limits {
        angle_rad: Option<f64>, "rad", Rule::ANGLE,
            "largest angle of a link from upright; the governor uses half of it",
            Absent::Numbers(&[super::super::defaults::ANGLE_RAD]);
        speed_m_per_s: Option<f64>, "m/s", Rule::POSITIVE,
            "largest speed of the cart", Absent::Follows("no limit");
        rail_margin_m: Option<f64>, "m",
            Rule::NOT_NEGATIVE.worded("a number >= 0, less than from 0 to either end of travel_m"),
            "distance from an end of the rail at which the motor is turned off; set-points end a tenth of the remaining rail before",
            Absent::Follows("2.5 % of the rail");
        travel_tolerance_m: Option<f64>, "m", Rule::POSITIVE,
            "allowed difference between the length of travel_m and the distance between the limit switches",
            Absent::Follows("1 % of the rail");
        // Skipped if absent: a rig without it keeps the hash by which stored motions and gain tables identify it.
        #[serde(skip_serializing_if = "Option::is_none")]
        jog_force_n: Option<f64>, "N", Rule::POSITIVE,
            "largest force of the jog; at most force_limit_n is used",
            Absent::Follows("10 % of force_limit_n");
        supply_min_v: Option<f64>, "V", Rule::NOT_NEGATIVE,
            "lowest allowed supply voltage of the power stage", Absent::Follows("80 % of supply_v; 0 without a motor");
        supply_time_s: f64, "s", Rule::DURATION,
            "time for which the supply voltage may be too low", Absent::Numbers(&[0.005]);
        saturation_time_s: f64, "s", Rule::DURATION,
            "time for which the law may request more than the largest force", Absent::Numbers(&[0.5]);
        link_timeout_s: f64, "s", Rule::DURATION,
            "time for which a host that commands the set-point may be silent", Absent::Numbers(&[0.1]);
        arm_angle_rad: Option<f64>, "rad", Rule::ANGLE,
            "largest angle of a link from upright at which balancing begins",
            Absent::Follows("10 % of angle_rad");
        arm_rate_rad_per_s: f64, "rad/s", Rule::POSITIVE,
            "largest rate of a joint at which balancing begins", Absent::Numbers(&[0.1]);
        arm_speed_m_per_s: f64, "m/s", Rule::POSITIVE,
            "largest speed of the cart at which balancing begins", Absent::Numbers(&[0.05]);
        arm_time_s: f64, "s", Rule::DURATION,
            "time for which all links have to be upright and slow before balancing begins", Absent::Numbers(&[0.3]);
        still_time_s: f64, "s", Rule::DURATION,
            "time for which links and cart have to be still before they are homed", Absent::Numbers(&[0.5]);
        // Skipped if absent, as above.
        #[serde(skip_serializing_if = "Option::is_none")]
        stilling_s: Option<f64>, "s", Rule::AT_MOST_A_MINUTE,
            "longest time for which the motor stills the links after a fall; 0: it goes off instead",
            Absent::Follows("0");
        false_alarm_h: f64, "h", Rule::FALSE_ALARM,
            "mean time between false alarms of the encoder and motor tests while balancing",
            Absent::Numbers(&[1000.0]);
    }
}

impl Default for Limits {
    fn default() -> Self {
        Limits::when_absent().expect("no key of [limits] is required")
    }
}

/// Reads `[limits]`; the margin at the rail's ends has to leave the start position free.
pub(crate) fn limits(
    node: &Node<'_>,
    plant: &PlantDescription,
    input: CartInput,
) -> Result<Limits, RigError> {
    let table = node.table(&LIMITS)?;
    if input == CartInput::Acceleration {
        table.refuse_for_acceleration(&["jog_force_n", "supply_min_v", "supply_time_s"])?;
    }
    let limits = Limits::read(&table)?;
    let PlantDescription::Chain(chain) = plant else { return Ok(limits) };
    let [low, high] = chain.cart.travel_m;
    let room = high.min(-low);
    match (table.get("rail_margin_m"), limits.rail_margin_m) {
        (Some(node), Some(margin)) if margin >= room => Err(node.out_of_range(
            &format!("a number >= 0 and < {room} (m), which leaves the start position 0 free"),
            "give a margin smaller than the distance from 0 to either end of travel_m",
        )),
        _ => Ok(limits),
    }
}
