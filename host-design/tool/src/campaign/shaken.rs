//! Defects while the rig is shaken.

use core::f64::consts::PI;

use upright::control::actuator::Drive;
use upright::protocol::message::Request;
use upright::supervision::shaking::ANGLE_RAD;
use upright::supervision::supervisor::State;
use upright_closed_loop::defects::{Defect, Expected, Injection, Phase, SHAKEN_S};
use upright_closed_loop::harness::{HarnessError, Target};
use upright_design::plant::absolute_angles;
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_identify::{Feed, IdentifyError, Shaken};

use super::attempt::{BEYOND, DefectRun, During};
use super::observed::Observed;

/// The excitation forces of a campaign's runs.
///
/// # Errors
/// [`IdentifyError`] if the rig cannot be shaken.
pub fn feed(rig: &Rig, table: &TableValues, seed: u64) -> Result<Feed, IdentifyError> {
    Feed::new(rig, table, SHAKEN_S, seed)
}

impl During<'_> {
    /// The phase that decides which outcomes the defects must have.
    pub(super) fn phase(&self) -> Phase {
        match self {
            During::Balancing => Phase::Balancing,
            During::Jog => Phase::Jogging,
            During::Shaking(_) => Phase::Shaken,
        }
    }

    /// Whether a defect of this kind proves something in this campaign.
    pub fn is_proof(&self, kind: Defect) -> bool {
        match self {
            During::Balancing => true,
            During::Jog => kind.while_jogging().is_some(),
            // A host that hears nothing does not know that a drive with pulses has ended and only holds the cart.
            During::Shaking(feed) => {
                kind.while_shaken().is_some() && !(feed.is_of_pulses() && kind == Defect::HostDeaf)
            }
        }
    }

    /// Whether a defect must be missed without thresholds and limits.
    pub fn needs_detection(&self, kind: Defect) -> bool {
        let must_end = match self {
            During::Shaking(_) => kind.while_shaken() == Some(Expected::Changed),
            During::Balancing | During::Jog => true,
        };
        must_end && kind.needs_detection()
    }
}

impl DefectRun<'_> {
    /// The rig is shaken by a host that turns the motor off if the cart does not follow.
    pub(super) fn shake(&self, feed: &Feed, target: &mut dyn Target) -> Result<Observed, HarnessError> {
        let trial = self.trial;
        let mut shaken = Shaken::begin_with(feed.clone(), self.rig, self.table, target, trial.seed)?;
        let mut observed = Observed::default();
        let mut injection = Injection::new(self.rig, self.table, trial.clone());
        let mut host_is_content = true;
        for tick in 0usize.. {
            let since = tick.checked_sub(trial.onset).filter(|_| self.with_defect);
            let inputs = self.pins(&mut shaken.harness, &mut injection, since, &mut false)?;
            if let Some(defect) = since.and_then(|since| injection.step_defect(since)) {
                shaken.harness.bench.spoil(defect);
            }
            shaken.harness.bench.push(since.map_or(0.0, |since| injection.push_n(since)));
            let output = shaken.act(&inputs, |drive| self.acting(&mut injection, since, drive))?;
            // A drive with pulses also holds the cart and brings it to rest, which does not count.
            let state = shaken.harness.session.status().state;
            let is_shaken = self.table.drive.pulses().is_none() || state == State::Identifying;
            let before = usize::from(output.enable && !is_shaken);
            observed.output(tick, output, output.enable && is_shaken, before);
            observed.outside |= observed.off.is_none() && self.is_out_of_bounds(shaken.harness.bench.state());
            if observed.off.is_some() {
                observed.fault = shaken.harness.session.fault();
            }
            if self.hanging_is_over(tick, &observed) {
                break;
            }
            if since == Some(0) {
                injection.serial(&mut shaken.harness.session);
            }
            if host_is_content && injection.host_is_alive(since) && shaken.feed().is_err() {
                host_is_content = false;
                shaken.harness.session.send(Request::Disarm);
            }
        }
        self.find_reason(&mut shaken.harness, &mut observed);
        Ok(observed)
    }

    /// The drive that acts on the cart, which the defect may change.
    fn acting(&self, injection: &mut Injection<'_>, since: Option<usize>, drive: Drive) -> Drive {
        let mut acting = upright::board::Output::on(drive, &self.table.drive);
        if let Some(since) = since {
            injection.output(since, &mut acting);
        }
        acting.drive
    }

    /// Whether a link has turned too far from hanging, or the cart is off its rail.
    fn is_out_of_bounds(&self, state: &[f64]) -> bool {
        let farthest = f64::from(ANGLE_RAD) * (1.0 + BEYOND);
        self.is_off_rail(state) || absolute_angles(state).any(|angle| (angle - PI).abs() > farthest)
    }
}
