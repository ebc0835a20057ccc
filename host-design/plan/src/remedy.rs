//! Changes of the rig file that relax one limit of the plans.

use upright_design::number::rounded;
use upright_design::rig::{PlantDescription, Rig};

/// Significant digits of an advised number. It is tried as it is printed.
const DIGITS: usize = 3;

/// A limit that planned motions have to keep.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum RigLimit {
    Rail,
    Input,
    Speed,
    Duration,
}

impl RigLimit {
    pub(crate) const ALL: [Self; 4] = [Self::Rail, Self::Input, Self::Speed, Self::Duration];

    /// Name of the limit for the user of `rig`.
    pub(crate) fn name(self, rig: &Rig) -> &'static str {
        match self {
            Self::Rail => "rail",
            Self::Input => rig.input_quantity().name,
            Self::Speed => "speed of the cart",
            Self::Duration => "duration",
        }
    }

    /// Multiplies this limit by `factor` in the rig of `remedy`; none if the rig has no such limit. `longest_s` is the
    /// longest duration that is tried without a change.
    pub(crate) fn relax(self, remedy: &mut Remedy, longest_s: f64, factor: f64) -> Option<()> {
        match self {
            Self::Rail => remedy.lengthen_rail(factor),
            Self::Input => remedy.strengthen(factor),
            Self::Speed => remedy.hasten(factor),
            Self::Duration => remedy.lengthen_time(factor * longest_s),
        }
    }
}

/// A rig file with other values.
#[derive(Debug, Clone)]
pub(crate) struct Remedy {
    pub(crate) rig: Rig,
    /// The changed keys with their new values, as in the file.
    keys: Vec<String>,
}

impl Remedy {
    /// A remedy that does not change `rig` yet.
    pub(crate) fn unchanged(rig: &Rig) -> Self {
        Self { rig: rig.clone(), keys: Vec::new() }
    }

    /// The changed keys with their new values.
    pub(crate) fn text(&self) -> String {
        self.rig.words(&self.keys.join(" and "))
    }

    /// Allows `factor` times as much rail in a plan: raises what `[swing_up]` allows, and lengthens the rail if it is
    /// too short for that.
    fn lengthen_rail(&mut self, factor: f64) -> Option<()> {
        let PlantDescription::Chain(chain) = &mut self.rig.plant else { return None };
        let travel_m = &mut chain.cart.travel_m;
        let farthest = travel_m[1].min(-travel_m[0]);
        let rules = self.rig.swing_up.get_or_insert_default();
        let wanted = rounded(factor * rules.rail_m.map_or(farthest, |rail| rail.min(farthest)), DIGITS);
        if let Some(rail) = &mut rules.rail_m {
            *rail = wanted;
            self.keys.push(format!("swing_up.rail_m = {wanted}"));
        }
        if wanted > farthest {
            *travel_m = travel_m.map(|end| rounded(end * wanted / farthest, DIGITS));
            self.keys.push(format!("cart.travel_m = {travel_m:?}"));
        }
        Some(())
    }

    /// Allows `factor` times as much force or acceleration in a plan: raises what `[swing_up]` allows, and strengthens
    /// the actuator if it is too weak for that.
    fn strengthen(&mut self, factor: f64) -> Option<()> {
        let full = self.rig.actuator.largest_input()?;
        let rules = self.rig.swing_up.get_or_insert_default();
        let wanted = rounded(factor * rules.input().map_or(full, |input| input.min(full)), DIGITS);
        let planned =
            [("force_n", &mut rules.force_n), ("acceleration_m_per_s2", &mut rules.acceleration_m_per_s2)];
        for (key, largest) in planned {
            if let Some(largest) = largest {
                *largest = wanted;
                self.keys.push(format!("swing_up.{key} = {wanted}"));
            }
        }
        if wanted > full {
            let actuator = &mut self.rig.actuator;
            if let Some(drive) = actuator.pulses_mut() {
                drive.acceleration_limit_m_per_s2 = wanted;
                self.keys.push(format!("actuator.acceleration_limit_m_per_s2 = {wanted}"));
            }
            if let Some(limit) = actuator.force_mut().and_then(|force| force.limit_n.as_mut()) {
                *limit = rounded(*limit * wanted / full, DIGITS);
                self.keys.push(format!("actuator.force_limit_n = {limit}"));
            }
            if let Some(motor) = actuator.motor_mut() {
                motor.supply_v = rounded(motor.supply_v * wanted / full, DIGITS);
                self.keys.push(format!("actuator.supply_v = {}", motor.supply_v));
            }
        }
        Some(())
    }

    fn hasten(&mut self, factor: f64) -> Option<()> {
        let of_plan = self.rig.swing_up.as_mut().and_then(|rules| rules.speed_m_per_s.as_mut());
        let section = if of_plan.is_some() { "swing_up" } else { "limits" };
        let speed = of_plan.or(self.rig.limits.speed_m_per_s.as_mut())?;
        *speed = rounded(factor * *speed, DIGITS);
        self.keys.push(format!("{section}.speed_m_per_s = {speed}"));
        let drive = self.rig.actuator.pulses_mut();
        let limits = drive.into_iter().flat_map(|drive| {
            [
                ("speed_limit_m_per_s", &mut drive.speed_limit_m_per_s),
                ("step_rate_limit_hz", &mut drive.step_rate_limit_hz),
            ]
        });
        for (key, limit) in limits {
            if let Some(limit) = limit {
                *limit = rounded(factor * *limit, DIGITS);
                self.keys.push(format!("actuator.{key} = {limit}"));
            }
        }
        Some(())
    }

    fn lengthen_time(&mut self, longest_s: f64) -> Option<()> {
        let longest_s = rounded(longest_s, DIGITS);
        self.rig.swing_up.get_or_insert_default().longest_s = Some(longest_s);
        self.keys.push(format!("swing_up.longest_s = {longest_s}"));
        Some(())
    }

    /// Multiplies the errors of masses and friction that a motion has to survive by `factor`.
    pub(crate) fn narrow(&mut self, factor: f64) {
        let rules = self.rig.swing_up.get_or_insert_default();
        let spreads = [
            ("mass_spread_percent", &mut rules.mass_spread_percent),
            ("friction_spread_percent", &mut rules.friction_spread_percent),
        ];
        for (key, percent) in spreads {
            *percent = rounded(factor * *percent, DIGITS);
            self.keys.push(format!("swing_up.{key} = {percent}"));
        }
    }
}
