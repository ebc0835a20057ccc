//! Changes of the rig file that are tried as cures: what fault detection and observer are told about the machine.

use upright::table::Law;

use crate::verify::VerifyError;
use upright_design::design::Uncertified;
use upright_design::number::{rounded, significant};
use upright_design::rig::{Actuator, Allowance, CartInput, Imperfection, Rig, ToleranceKey, Tolerances};
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
        let friction_n = rounded(FORCE_SHARE * rig.actuator.largest_force_n().unwrap_or_default(), 2);
        cures.of_all = [(Tolerances::CART_FRICTION, friction_n), (Tolerances::HOMING_ERROR, ZERO_RAD)]
            .into_iter()
            .filter(|(_, size)| *size > 0.0)
            .filter_map(|(tolerance, size)| cures.tolerating(tolerance, size))
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
        let own = match imperfection.allowance {
            None => [None, None],
            Some(Allowance::Tolerated(tolerance)) => {
                [poor, (good * poor).sqrt()].map(|size| self.tolerating(tolerance, rounded(size, 2)))
            }
            Some(Allowance::Stated { key, at }) => [2.0 * poor, poor].map(|size| self.stating(key, at, size)),
        };
        own.into_iter().flatten().chain(self.of_all.iter().cloned()).collect()
    }

    /// `[actuator]` with this size of this key, for which the law is designed; none if one is stated already.
    fn stating(
        &self,
        key: &str,
        at: fn(&mut Actuator) -> Option<&mut Option<f64>>,
        size: f64,
    ) -> Option<(String, TableValues)> {
        let mut rig = self.rig.with_law_alone(self.law);
        if at(&mut rig.actuator)?.replace(size).is_some() {
            return None;
        }
        let table = TableValues::of_uncertified(&rig, &Uncertified::sampled_alone(&rig).ok()?).ok()?;
        Some((format!("actuator.{key} = {}", significant(size, 2)), table))
    }

    /// `[robust]` with this tolerance, which widens the thresholds of fault detection; none for friction
    /// of a cart that goes where its pulses say.
    fn tolerating(&self, ToleranceKey { key, at }: ToleranceKey, size: f64) -> Option<(String, TableValues)> {
        let mut tolerances = self.rig.robust.clone().unwrap_or_default();
        *at(&mut tolerances) = size;
        if tolerances.cart_friction_n > 0.0 && !self.rig.actuator.input().is_force() {
            return None;
        }
        let rig = Rig { robust: Some(tolerances), ..self.rig.clone() };
        let mut table = self.table.clone();
        table.thresholds = TableValues::of_uncertified(&rig, &self.own).ok()?.thresholds;
        Some((
            format!("{} = {}", self.rig.base().path(&format!("robust.{key}")), significant(size, 2)),
            table,
        ))
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
        Some((
            format!("{} times {}", force.max(joints), self.rig.base().path(&format!("kalman.{name}"))),
            table,
        ))
    }
}
