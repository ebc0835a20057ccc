//! Changes of the rig file that are tried as cures: what fault detection and observer are told about the machine.

use upright::table::Law;

use super::catalogue::Imperfection;
use crate::verify::VerifyError;
use upright_design::design::Uncertified;
use upright_design::number::{rounded, significant};
use upright_design::rig::{CartInput, Rig, Tolerances};
use upright_design::table::TableValues;

/// Friction of the cart, as a share of the largest force, for what acts like an unknown force.
const FORCE_SHARE: f64 = 0.05;
/// Wrong zeros (rad) for what acts like them.
const ZERO_RAD: f64 = 0.005;

/// The changes that are tried for every imperfection, and the rig as it is.
pub(super) struct Cures<'a> {
    rig: &'a Rig,
    table: &'a TableValues,
    law: Law,
    own: Uncertified,
    of_all: Vec<(String, TableValues)>,
}

impl<'a> Cures<'a> {
    pub(super) fn of(rig: &'a Rig, table: &'a TableValues, law: Law) -> Result<Self, VerifyError> {
        let own = Uncertified::sampled_alone(&rig.with_law_alone(law))?;
        let mut cures = Self { rig, table, law, own, of_all: Vec::new() };
        let friction_n = rounded(FORCE_SHARE * rig.force_limit_n().unwrap_or_default(), 2);
        cures.of_all = [("cart_friction_n", friction_n), ("homing_error_rad", ZERO_RAD)]
            .into_iter()
            .filter(|(_, size)| *size > 0.0)
            .filter_map(|(key, size)| cures.tolerating(key, size))
            .collect();
        let input = match rig.actuator.input() {
            CartInput::Force => "force_noise_n2_s",
            CartInput::Acceleration => "acceleration_noise_m2_per_s3",
        };
        for (name, factors) in [(input, [100.0, 1.0]), ("joint_noise", [1.0, 10.0])] {
            cures.of_all.extend(cures.noisier(law, name, factors));
        }
        Ok(cures)
    }

    /// The changes that are tried for this imperfection.
    pub(super) fn of_imperfection(&self, imperfection: &Imperfection) -> Vec<(String, TableValues)> {
        let [good, poor] = imperfection.typical;
        let key = match imperfection.key {
            "parameter_spread_percent" => "mass_percent",
            key => key,
        };
        let own = [poor, (good * poor).sqrt()].map(|size| self.tolerating(key, rounded(size, 2)));
        let stated = (key == "driver_lag_s").then(|| [2.0 * poor, poor].map(|lag_s| self.stating(lag_s)));
        own.into_iter()
            .chain(stated.into_iter().flatten())
            .flatten()
            .chain(self.of_all.iter().cloned())
            .collect()
    }

    /// `[actuator]` with this lag of the driver (s), for which the law is designed; none if one is stated already, or
    /// where none can be.
    fn stating(&self, lag_s: f64) -> Option<(String, TableValues)> {
        let actuator = &self.rig.actuator;
        if actuator.driver_lag_s.is_some() || !actuator.input().is_force() {
            return None;
        }
        let mut rig = self.rig.with_law_alone(self.law);
        rig.actuator.driver_lag_s = Some(lag_s);
        let table = TableValues::of_uncertified(&rig, &Uncertified::sampled_alone(&rig).ok()?).ok()?;
        Some((format!("actuator.driver_lag_s = {}", significant(lag_s, 2)), table))
    }

    /// `[robust]` with this tolerance, which widens the thresholds of fault detection; none if there is no such key.
    fn tolerating(&self, key: &str, size: f64) -> Option<(String, TableValues)> {
        let mut tolerances = self.rig.robust.clone().unwrap_or_default();
        let Tolerances { mass_percent, joint_friction_n_m, cart_friction_n, homing_error_rad, .. } =
            &mut tolerances;
        *match key {
            "mass_percent" => mass_percent,
            "joint_friction_n_m" => joint_friction_n_m,
            "cart_friction_n" if self.rig.actuator.input().is_force() => cart_friction_n,
            "homing_error_rad" => homing_error_rad,
            _ => return None,
        } = size;
        let rig = Rig { robust: Some(tolerances), ..self.rig.clone() };
        let mut table = self.table.clone();
        table.thresholds = TableValues::of_uncertified(&rig, &self.own).ok()?.thresholds;
        Some((format!("robust.{key} = {}", significant(size, 2)), table))
    }

    /// `[kalman]` with more noise of the cart's input and of the joints, by these factors, which changes the observer,
    /// too; none if that noise is 0.
    fn noisier(&self, law: Law, name: &str, [force, joints]: [f64; 2]) -> Option<(String, TableValues)> {
        let mut rig = self.rig.with_law_alone(law);
        let kalman = rig.kalman.as_mut()?;
        kalman.force_noise_n2_s *= force;
        kalman.joint_noise.iter_mut().for_each(|noise| *noise *= joints);
        if rig.kalman == self.rig.kalman {
            return None;
        }
        let design = Uncertified::sampled_alone(&rig).ok()?;
        let changed = TableValues::of_uncertified(&rig, &design).ok()?;
        let mut table = self.table.clone();
        (table.observer, table.thresholds) = (changed.observer, changed.thresholds);
        Some((format!("{} times kalman.{name}", force.max(joints)), table))
    }
}
