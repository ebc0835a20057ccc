//! Defects while the rig is shaken.

use core::f64::consts::PI;

use upright::board::Output;
use upright::protocol::message::Request;
use upright::supervision::shaking::ANGLE_RAD;
use upright::supervision::supervisor::State;
use upright_closed_loop::defects::{Defect, Defective, Expected, Phase, SHAKEN_S};
use upright_closed_loop::harness::{Flow, HarnessError, Participant, Pins, Target, World, until};
use upright_design::plant::absolute_angles;
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_identify::{Feed, IdentifyError, ShakingHost, checked_and_hanging};

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
        let mut world = checked_and_hanging(self.rig, self.table, target, self.trial.seed)?;
        let host = ShakingHost::begin(feed.clone(), self.rig, self.table, &mut world)?;
        let defect = self.defective(Some(self.trial.onset));
        let mut shaken = WhileShaken { run: self, host: Some(host), defect, observed: Observed::default() };
        world.run(usize::MAX, &mut [&mut shaken])?;
        let mut observed = shaken.observed;
        self.find_reason(&mut world, &mut observed);
        Ok(observed)
    }

    /// Whether a link has turned too far from hanging, or the cart is off its rail.
    fn is_out_of_bounds(&self, state: &[f64]) -> bool {
        let farthest = f64::from(ANGLE_RAD) * (1.0 + BEYOND);
        self.is_off_rail(state) || absolute_angles(state).any(|angle| (angle - PI).abs() > farthest)
    }
}

/// A rig that is shaken, with a defect from the onset on.
struct WhileShaken<'r> {
    run: &'r DefectRun<'r>,
    /// The host, until the cart does not follow.
    host: Option<ShakingHost>,
    defect: Defective<'r>,
    observed: Observed,
}

impl Participant for WhileShaken<'_> {
    fn act(&mut self, world: &mut World<'_>, output: &mut Output) -> Flow {
        // A drive with pulses also holds the cart and brings it to rest, which does not count.
        let state = world.session.status().state;
        let is_shaken = self.run.table.drive.pulses().is_none() || state == State::Identifying;
        let before = usize::from(output.enable && !is_shaken);
        self.observed.output(world.ticks(), *output, output.enable && is_shaken, before);
        if self.observed.off.is_some() {
            self.observed.fault = world.session.fault();
        }
        world.bench.push(self.defect.push_n(world.ticks()));
        let _ = self.defect.act(world, output)?;
        until(false)
    }

    fn pins(&mut self, world: &mut World<'_>, pins: &mut Pins) -> Result<(), HarnessError> {
        self.run.disturb(world, &mut self.defect, pins)
    }

    fn saw(&mut self, world: &mut World<'_>) -> Flow {
        let observed = &mut self.observed;
        observed.outside |= observed.off.is_none() && self.run.is_out_of_bounds(world.bench.state());
        let is_alive = self.defect.host_is_alive(world.ticks());
        if let Some(host) = self.host.as_mut().filter(|_| is_alive)
            && host.feed(&mut world.session).is_err()
        {
            self.host = None;
            world.session.send(Request::Disarm);
        }
        until(self.run.hanging_is_over(world.ticks() - 1, &self.observed))
    }
}
