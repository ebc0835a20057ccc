//! Limits and thresholds of the supervisor, from the rig file to the firmware's types.

use serde::Serialize;
use upright::supervision::detection::{MotorTest, Thresholds};
use upright::table::limits::Limits;

use super::{NoTable, finite};
use crate::design::DetectionDesign;
use crate::rig::{Chain, PlantDescription, Rig, defaults};

/// What a hand has to move when an encoder's sign is checked: a link by this angle (rad) …
const SIGN_RAD: f64 = 0.2;
/// … and the cart by this share of the rail.
const SIGN_SHARE: f64 = 0.05;

/// [`Limits`] with the number of sensors not yet in the type.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the fields are those of `Limits`")]
pub struct LimitValues {
    pub rail_m: [f32; 2],
    pub angle_rad: f32,
    pub speed_m_per_s: f32,
    pub supply_min_v: f32,
    pub supply_ticks: u32,
    pub saturated_ticks: u32,
    pub link_ticks: u32,
    pub arm_angle_rad: f32,
    pub arm_ticks: u32,
    pub still_ticks: u32,
    pub travel_counts: [i32; 2],
    pub middle_counts: i32,
    pub slow_counts: Vec<i32>,
    pub rest_counts: Vec<i32>,
    pub turn_counts: Vec<i32>,
    pub sign_counts: Vec<i32>,
}

impl LimitValues {
    /// Limits of `rig` with these steps of its sensors (m or rad); without steps no counts are known.
    pub(super) fn of(rig: &Rig, sensors: usize, steps: &[f64]) -> Result<Self, NoTable> {
        let limits = &rig.limits;
        let ticks =
            |seconds: f64| (seconds / rig.tick.period_s).round().clamp(1.0, f64::from(u32::MAX)) as u32;
        let none = Limits::<0>::none();
        let mut values = Self {
            rail_m: none.rail_m,
            angle_rad: none.angle_rad,
            speed_m_per_s: narrow("limits.speed_m_per_s", limits.speed_m_per_s)?
                .unwrap_or(none.speed_m_per_s),
            supply_min_v: narrow("limits.supply_min_v", supply_min_v(rig))?.unwrap_or(none.supply_min_v),
            supply_ticks: ticks(limits.supply_time_s),
            saturated_ticks: ticks(limits.saturation_time_s),
            link_ticks: ticks(limits.link_timeout_s),
            arm_angle_rad: none.arm_angle_rad,
            arm_ticks: ticks(limits.arm_time_s),
            still_ticks: ticks(limits.still_time_s),
            travel_counts: none.travel_counts,
            middle_counts: none.middle_counts,
            slow_counts: vec![i32::MAX; sensors],
            rest_counts: vec![0; sensors],
            turn_counts: vec![0; sensors],
            sign_counts: vec![0; sensors],
        };
        if let PlantDescription::Chain(chain) = &rig.plant {
            values.of_chain(rig, chain, steps)?;
        }
        Ok(values)
    }

    fn of_chain(&mut self, rig: &Rig, chain: &Chain, steps: &[f64]) -> Result<(), NoTable> {
        let limits = &rig.limits;
        let [low, high] = chain.cart.travel_m;
        let length = high - low;
        let margin = limits.rail_margin_m.unwrap_or_else(|| {
            // Position 0 stays within, however unequal the ends are.
            (defaults::RAIL_MARGIN_SHARE * length).min(0.5 * high.min(-low))
        });
        self.rail_m = [
            finite("cart.travel_m", (low + margin) as f32)?,
            finite("cart.travel_m", (high - margin) as f32)?,
        ];
        let angle = limits.angle_rad.unwrap_or(defaults::ANGLE_RAD);
        self.angle_rad = angle as f32;
        self.arm_angle_rad = limits.arm_angle_rad.unwrap_or(defaults::ARM_ANGLE_SHARE * angle) as f32;
        let Some((&cart, joints)) = steps.split_first() else { return Ok(()) };
        let tolerance = limits.travel_tolerance_m.unwrap_or(defaults::TRAVEL_TOLERANCE_SHARE * length);
        self.travel_counts = [counts(length, cart), counts(tolerance, cart).max(1)];
        self.middle_counts = counts(0.5 * (low + high), cart);
        let slow = |rate: f64, step: f64| counts(rate * limits.arm_time_s, step).max(1);
        self.slow_counts[0] = slow(limits.arm_speed_m_per_s, cart);
        self.sign_counts[0] = counts(SIGN_SHARE * length, cart).max(1);
        for (joint, &step) in joints.iter().enumerate() {
            let sensor = joint + 1;
            self.slow_counts[sensor] = slow(limits.arm_rate_rad_per_s, step);
            self.sign_counts[sensor] = counts(SIGN_RAD, step).max(1);
            self.turn_counts[sensor] = counts(core::f64::consts::TAU, step).max(1);
        }
        if let (Some(rest), Some(&step)) = (self.rest_counts.get_mut(1), joints.first()) {
            *rest = counts(core::f64::consts::PI, step);
        }
        Ok(())
    }

    /// The firmware's limits.
    ///
    /// # Panics
    /// If `NY` is not the number of sensors.
    pub fn limits<const NY: usize>(&self) -> Limits<NY> {
        let array = |counts: &[i32]| core::array::from_fn(|i| counts[i]);
        Limits {
            rail_m: self.rail_m,
            angle_rad: self.angle_rad,
            speed_m_per_s: self.speed_m_per_s,
            supply_min_v: self.supply_min_v,
            supply_ticks: self.supply_ticks,
            saturated_ticks: self.saturated_ticks,
            link_ticks: self.link_ticks,
            arm_angle_rad: self.arm_angle_rad,
            arm_ticks: self.arm_ticks,
            still_ticks: self.still_ticks,
            travel_counts: self.travel_counts,
            middle_counts: self.middle_counts,
            slow_counts: array(&self.slow_counts),
            rest_counts: array(&self.rest_counts),
            turn_counts: array(&self.turn_counts),
            sign_counts: array(&self.sign_counts),
        }
    }
}

/// [`Thresholds`] with the number of sensors not yet in the type.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the fields are those of `Thresholds` and `MotorTest`")]
pub struct ThresholdValues {
    pub innovation: Vec<f32>,
    pub frozen: Vec<f32>,
    pub motor_a: [f32; 4],
    pub motor_b: [f32; 2],
    pub motor_ratio: f32,
    pub motor_energy: f32,
}

impl ThresholdValues {
    /// Thresholds of a design; without one, thresholds that nothing exceeds.
    pub(super) fn of(sensors: usize, design: Option<&DetectionDesign>) -> Self {
        let narrow = |values: &[f64]| values.iter().map(|&value| threshold(value)).collect();
        let (innovation, frozen) = design.map_or_else(
            || (vec![f32::MAX; sensors], vec![f32::MAX; sensors]),
            |design| (narrow(&design.innovation), narrow(&design.frozen)),
        );
        let none = MotorTest::NONE;
        let motor = design.and_then(|design| design.motor);
        Self {
            innovation,
            frozen,
            motor_a: motor.map_or(none.a, |motor| motor.a.map(|a| a as f32)),
            motor_b: motor.map_or(none.b, |motor| motor.b.map(|b| b as f32)),
            motor_ratio: motor.map_or(none.ratio, |motor| motor.ratio as f32),
            motor_energy: motor.map_or(none.energy, |motor| threshold(motor.energy)),
        }
    }

    /// The firmware's thresholds.
    ///
    /// # Panics
    /// If `NY` is not the number of sensors.
    pub fn thresholds<const NY: usize>(&self) -> Thresholds<NY> {
        Thresholds {
            innovation: core::array::from_fn(|i| self.innovation[i]),
            frozen: core::array::from_fn(|i| self.frozen[i]),
            motor: MotorTest {
                a: self.motor_a,
                b: self.motor_b,
                ratio: self.motor_ratio,
                energy: self.motor_energy,
            },
        }
    }
}

fn supply_min_v(rig: &Rig) -> Option<f64> {
    let motor = rig.actuator.motor.as_ref();
    rig.limits.supply_min_v.or(motor.map(|motor| defaults::SUPPLY_SHARE * motor.supply_v))
}

/// Whole counts of a distance.
fn counts(distance: f64, step: f64) -> i32 {
    // Saturates far beyond any rail or turn.
    (distance / step).round() as i32
}

/// A threshold as f32: between the smallest and the largest that can be one.
fn threshold(value: f64) -> f32 {
    (value as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
}

fn narrow(what: &'static str, value: Option<f64>) -> Result<Option<f32>, NoTable> {
    value.map(|value| finite(what, value as f32)).transpose()
}
