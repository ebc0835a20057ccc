//! The steps in their order, and the return to an earlier step after one that was not passed.

use std::path::Path;

use upright_design::identify::{Identification, Log};
use upright_design::rig::Rig;
use upright_design::table::TableValues;

use super::designing::{Designed, designed, identified, verified};
use super::guide::Guide;
use super::machine::{Machine, Stop};
use super::record::Journal;
use super::step::Step;
use super::{balance, contacts, homing, motor, shaking, signs};

/// What is commissioned, and how.
#[derive(Debug, Clone, Copy)]
pub struct Plan<'a> {
    /// The rig, as in its file.
    pub rig: &'a Rig,
    /// Its gain table, which the firmware has.
    pub table: &'a TableValues,
    /// Path of the rig file.
    pub file: &'a Path,
    /// The text of the file.
    pub text: &'a str,
    /// Duration of the shaking (s).
    pub seconds: f64,
    /// Seed of the excitation's phases.
    pub seed: u64,
}

/// A rig on the way from wired to balancing.
pub struct Commissioning<'a> {
    plan: Plan<'a>,
    /// Number of times the machine was shaken; each time the excitation has other phases.
    shaken: u64,
    log: Option<Log>,
    found: Option<Identification>,
    designed: Option<Designed>,
}

impl<'a> Commissioning<'a> {
    /// A commissioning before its first step.
    pub fn new(plan: Plan<'a>) -> Self {
        Self { plan, shaken: 0, log: None, found: None, designed: None }
    }

    /// Does the steps with the firmware of the rig file; returns the rig as it was found, with its gains.
    ///
    /// # Errors
    /// [`Stop`] of the step that was not passed.
    pub fn first(plan: Plan<'a>, machine: &mut dyn Machine, journal: &mut Journal) -> Result<Designed, Stop> {
        let mut all = Self::new(plan);
        all.run(machine, journal, &Step::FIRST)?;
        all.designed.ok_or_else(not_before)
    }

    /// Does the steps with the firmware for the machine as it was found, which `plan` describes, and completes the
    /// record.
    ///
    /// # Errors
    /// [`Stop`] of the step that was not passed.
    pub fn second(plan: Plan<'a>, machine: &mut dyn Machine, journal: &mut Journal) -> Result<(), Stop> {
        Self::new(plan).run(machine, journal, &Step::SECOND)?;
        Ok(journal.done()?)
    }

    /// Does these steps one after the other. A step that is not passed turns the motor off; the person may go back to
    /// it, or to what it depends on.
    ///
    /// # Errors
    /// [`Stop`] of the step that was not passed.
    pub fn run(
        &mut self,
        machine: &mut dyn Machine,
        journal: &mut Journal,
        steps: &[Step],
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
            match result {
                Ok(()) => next += 1,
                Err(Stop::Machine(_)) if guide.machine.again(step) => {
                    next = steps.iter().position(|&one| one == step.back()).unwrap_or(next);
                }
                Err(stop) => return Err(stop),
            }
        }
        Ok(())
    }

    fn one(&mut self, guide: &mut Guide<'_>, step: Step) -> Result<(), Stop> {
        let plan = self.plan;
        // Until then, a pressed emergency stop or a power stage without supply may be the cause of a fault.
        if !matches!(step, Step::Connect | Step::Contacts) {
            guide.clear()?;
        }
        match step {
            Step::Connect => contacts::connect(guide, plan)?,
            Step::Contacts => contacts::check(guide, plan)?,
            Step::Homing => homing::home(guide, plan)?,
            Step::Signs => signs::check(guide)?,
            Step::Turns => signs::turns(guide, plan)?,
            Step::Motor => motor::check(guide)?,
            Step::Excitation => {
                let seed = plan.seed.wrapping_add(self.shaken);
                self.shaken += 1;
                self.log = Some(shaking::shake(guide, Plan { seed, ..plan })?);
            }
            Step::Identification => {
                let log = self.log.as_ref().ok_or_else(not_before)?;
                self.found = Some(identified(guide.journal, plan, log)?);
            }
            Step::Design => {
                let found = self.found.as_ref().ok_or_else(not_before)?;
                self.designed = Some(designed(guide.journal, plan, found)?);
            }
            Step::Verification => verified(guide.journal, self.designed.as_ref().ok_or_else(not_before)?)?,
            // The firmware changes here; this one has nothing to do.
            Step::Image => {}
            Step::Balance => balance::balance(guide)?,
        }
        Ok(())
    }
}

/// A step is only done after those that it depends on.
fn not_before() -> Stop {
    Stop::Machine("the steps before were not done".to_owned())
}
