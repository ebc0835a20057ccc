//! Limits and thresholds as Rust source.

use core::fmt::{Display, Write};

use super::source::literal;
use super::{LimitValues, ThresholdValues};

/// Writes the table's fields `limits` and `thresholds`; `sensors` are the names of what the sensors measure.
pub(super) fn write_supervision(
    out: &mut String,
    limits: &LimitValues,
    thresholds: &ThresholdValues,
    sensors: &[&str],
) -> core::fmt::Result {
    writeln!(out, "    // what the supervisor enforces")?;
    writeln!(out, "    limits: Limits {{")?;
    let LimitValues { rail_m: [low, high], travel_counts: [travel, tolerance], .. } = limits;
    pair(out, "rail_m", "m: soft limits of the rail", [literal(*low), literal(*high)])?;
    field(out, "angle_rad", "rad: largest angle of a link from the vertical", literal(limits.angle_rad))?;
    field(out, "speed_m_per_s", "m/s: largest speed of the cart", literal(limits.speed_m_per_s))?;
    field(out, "supply_min_v", "V: least supply", literal(limits.supply_min_v))?;
    field(out, "supply_ticks", "ticks: the supply may be too low for so long", limits.supply_ticks)?;
    field(
        out,
        "saturated_ticks",
        "ticks: the force may be at its limit for so long",
        limits.saturated_ticks,
    )?;
    field(out, "link_ticks", "ticks: the host may be silent for so long", limits.link_ticks)?;
    field(out, "arm_angle_rad", "rad: largest angle to begin at", literal(limits.arm_angle_rad))?;
    field(out, "arm_ticks", "ticks: upright and slow before it begins", limits.arm_ticks)?;
    field(out, "still_ticks", "ticks: still before homing", limits.still_ticks)?;
    pair(out, "travel_counts", "counts: between the limit switches, and its tolerance", [travel, tolerance])?;
    field(out, "middle_counts", "counts: middle of the rail", limits.middle_counts)?;
    list(out, 8, "slow_counts", "counts: most motion that is slow", &limits.slow_counts, sensors)?;
    list(out, 8, "rest_counts", "counts: links hanging at rest", &limits.rest_counts, sensors)?;
    list(out, 8, "turn_counts", "counts: a whole turn", &limits.turn_counts, sensors)?;
    list(out, 8, "sign_counts", "counts: motion that shows the sign", &limits.sign_counts, sensors)?;
    writeln!(out, "    }},\n    // when encoders and motor are at fault\n    thresholds: Thresholds {{")?;
    let literals = |values: &[f32]| values.iter().map(|&value| literal(value)).collect::<Vec<_>>();
    list(out, 8, "innovation", "m or rad: largest innovation", &literals(&thresholds.innovation), sensors)?;
    let meaning = "m or rad: most predicted motion while the counter stands still";
    list(out, 8, "frozen", meaning, &literals(&thresholds.frozen), sensors)?;
    writeln!(out, "        motor: MotorTest {{")?;
    let of = ["position from position", "position from speed", "speed from position", "speed from speed"];
    list(out, 12, "a", "error of the prediction, a tick later", &literals(&thresholds.motor_a), &of)?;
    let of = ["m/N: position", "m/(s N): speed"];
    list(out, 12, "b", "of a missing newton", &literals(&thresholds.motor_b), &of)?;
    let mut number = |name: &str, meaning: &str, value: f32| {
        writeln!(out, "            // {meaning}\n            {name}: {},", literal(value))
    };
    number("ratio", "1: share of the force that may be missing", thresholds.motor_ratio)?;
    number("energy", "m²: least for a verdict", thresholds.motor_energy)?;
    writeln!(out, "        }},\n    }},")
}

fn field(out: &mut String, name: &str, meaning: &str, value: impl Display) -> core::fmt::Result {
    writeln!(out, "        // {meaning}\n        {name}: {value},")
}

fn pair(
    out: &mut String,
    name: &str,
    meaning: &str,
    [first, second]: [impl Display; 2],
) -> core::fmt::Result {
    writeln!(out, "        // {meaning}\n        {name}: [{first}, {second}],")
}

fn list(
    out: &mut String,
    indent: usize,
    name: &str,
    meaning: &str,
    values: &[impl Display],
    of: &[&str],
) -> core::fmt::Result {
    writeln!(out, "{0:indent$}// {meaning}\n{0:indent$}{name}: [", "")?;
    for (index, value) in values.iter().enumerate() {
        let of = of.get(index).copied().unwrap_or_default();
        writeln!(out, "{0:indent$}    // {of}\n{0:indent$}    {value},", "")?;
    }
    writeln!(out, "{0:indent$}],", "")
}
