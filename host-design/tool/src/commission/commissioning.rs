//! The steps in their order, and the return to an earlier step after one that was not passed.

use upright_identify::{Identification, Log};

use super::designing::{Designed, designed, identified, verified};
use super::guide::Guide;
use super::machine::{MachineAtHand, Stop};
use super::plan::CommissionPlan;
use super::record::Journal;
use super::step::CommissionStep;
use super::{balance, contacts, homing, motor, shaking, signs};

/// A rig on the way from wired to balancing.
pub struct Commissioning<'a> {
    plan: CommissionPlan<'a>,
    /// Number of times the machine was shaken; each time the excitation has other phases.
    shaken: u64,
    log: Option<Log>,
    found: Option<Identification>,
    designed: Option<Designed>,
}

impl<'a> Commissioning<'a> {
    /// A commissioning before its first step.
    pub fn new(plan: CommissionPlan<'a>) -> Self {
        Self { plan, shaken: 0, log: None, found: None, designed: None }
    }

    /// Does the steps with the firmware of the rig file; returns the rig as it was found, with its gains.
    ///
    /// # Errors
    /// [`Stop`] of the step that was not passed.
    pub fn first(
        plan: CommissionPlan<'a>,
        machine: &mut dyn MachineAtHand,
        journal: &mut Journal,
    ) -> Result<Designed, Stop> {
        let mut all = Self::new(plan);
        all.run(machine, journal, &CommissionStep::FIRST)?;
        all.designed.ok_or_else(not_before)
    }

    /// Does the steps with the firmware for the machine as it was found, which `plan` describes, and completes the
    /// record.
    ///
    /// # Errors
    /// [`Stop`] of the step that was not passed.
    pub fn second(
        plan: CommissionPlan<'a>,
        machine: &mut dyn MachineAtHand,
        journal: &mut Journal,
    ) -> Result<(), Stop> {
        Self::new(plan).run(machine, journal, &CommissionStep::SECOND)?;
        Ok(journal.done()?)
    }

    /// Does these steps one after the other. A step that is not passed turns the motor off; the person may go back to
    /// it, or to what it depends on.
    ///
    /// # Errors
    /// [`Stop`] of the step that was not passed.
    pub fn run(
        &mut self,
        machine: &mut dyn MachineAtHand,
        journal: &mut Journal,
        steps: &[CommissionStep],
    ) -> Result<(), Stop> {
        let mut guide = Guide::new(machine, journal);
        let mut next = 0;
        while let Some(&step) = steps.get(next) {
            guide.journal.begin(step);
            let result = self.one(&mut guide, step);
            if result.is_err() {
                guide.turn_off();
            }
            guide.journal.end(result.as_ref().err().map(ToString::to_string))?;
            let back = step.back(self.plan.table.drive.pulses().is_some());
            match result {
                Ok(()) => next += 1,
                Err(Stop::Machine(_)) if guide.machine.again(step, back) => {
                    guide.journal.again(back);
                    next = steps.iter().position(|&one| one == back).unwrap_or(next);
                }
                Err(stop) => return Err(stop),
            }
        }
        Ok(())
    }

    fn one(&mut self, guide: &mut Guide<'_>, step: CommissionStep) -> Result<(), Stop> {
        let plan = self.plan;
        // Until then, a pressed emergency stop or a power stage without supply may be the cause of a fault.
        if !matches!(step, CommissionStep::Connect | CommissionStep::Contacts) {
            guide.clear()?;
        }
        match step {
            CommissionStep::Connect => contacts::connect(guide, plan)?,
            CommissionStep::Contacts => contacts::check(guide, plan)?,
            CommissionStep::Homing => homing::home(guide, plan)?,
            CommissionStep::Signs => signs::check(guide)?,
            CommissionStep::Turns => signs::turns(guide, plan)?,
            CommissionStep::Motor => motor::check(guide, plan)?,
            CommissionStep::Excitation => {
                let seed = plan.seed.wrapping_add(self.shaken);
                self.shaken += 1;
                self.log = Some(shaking::shake(guide, CommissionPlan { seed, ..plan })?);
            }
            CommissionStep::Identification => {
                let log = self.log.as_ref().ok_or_else(not_before)?;
                self.found = Some(identified(guide.journal, plan, log)?);
            }
            CommissionStep::Design => {
                let found = self.found.as_ref().ok_or_else(not_before)?;
                self.designed = Some(designed(guide.journal, plan, found)?);
            }
            CommissionStep::Verification => {
                verified(guide.journal, self.designed.as_ref().ok_or_else(not_before)?)?
            }
            // The firmware changes here; this one has nothing to do.
            CommissionStep::Image => {}
            CommissionStep::Balance => balance::balance(guide, plan)?,
        }
        Ok(())
    }
}

/// A step is only done after those that it depends on.
fn not_before() -> Stop {
    Stop::Machine("the steps before were not done".to_owned())
}
