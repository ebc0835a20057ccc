//! What was asked, found and decided, as lines and as a file.

use std::path::PathBuf;

use serde::Serialize;
use serde_json::Value;
use upright_design::rig::Rig;
use upright_design::table::{WriteError, write_atomically};

use super::step::CommissionStep;
use crate::monitor::now;

/// The record of a commissioning.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CommissionRecord {
    /// The rig.
    pub rig: String,
    /// Hash of its file.
    pub rig_hash: String,
    /// Where its firmware runs.
    pub machine: String,
    /// Version of the tool.
    pub version: &'static str,
    /// When it began: seconds since 1970.
    pub begun_s: u64,
    /// Each step, in the order in which it was done; one that was repeated is there twice.
    pub steps: Vec<StepRecord>,
    /// How it has ended.
    pub outcome: CommissionOutcome,
}

impl CommissionRecord {
    /// A record without steps, for the machine of `rig` whose firmware runs at `machine`.
    pub fn new(rig: &Rig, machine: &str) -> Self {
        Self {
            rig: rig.name.clone(),
            rig_hash: format!("{:016x}", rig.hash()),
            machine: machine.to_owned(),
            version: env!("CARGO_PKG_VERSION"),
            begun_s: now().as_secs(),
            steps: Vec::new(),
            outcome: CommissionOutcome::Unfinished,
        }
    }
}

/// How a commissioning has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CommissionOutcome {
    /// It is in progress, or was interrupted.
    Unfinished,
    /// A step was not passed.
    Stopped,
    /// Every step was passed.
    Done,
}

/// The record of one step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepRecord {
    /// The step.
    pub step: CommissionStep,
    /// What the person was asked to do.
    pub asked: Vec<String>,
    /// What was found.
    pub found: Vec<String>,
    /// Whether it was passed.
    pub passed: bool,
    /// Why it was not passed.
    pub stopped: Option<String>,
    /// The findings as numbers, in steps that have many.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub data: Option<Value>,
}

/// Writes the record while the steps are done, and shows it line by line.
pub struct Journal {
    /// The record so far.
    pub record: CommissionRecord,
    file: Option<PathBuf>,
    show: Box<dyn FnMut(&str)>,
}

impl Journal {
    /// A record that is written to `file` after each step, and shown line by line.
    pub fn new(record: CommissionRecord, file: Option<PathBuf>, show: Box<dyn FnMut(&str)>) -> Self {
        Self { record, file, show }
    }

    /// Begins a step, and shows its name.
    pub fn begin(&mut self, step: CommissionStep) {
        (self.show)(&format!("{}: {}", step.name(), step.finds_out()));
        let (asked, found) = (Vec::new(), Vec::new());
        self.record.steps.push(StepRecord { step, asked, found, passed: false, stopped: None, data: None });
    }

    /// Records and shows what the person is asked to do.
    pub fn asked(&mut self, task: impl ToString) {
        let task = task.to_string();
        (self.show)(&format!("  > {task}"));
        if let Some(step) = self.record.steps.last_mut() {
            step.asked.push(task);
        }
    }

    /// Records and shows a finding.
    pub fn found(&mut self, words: impl Into<String>) {
        let words = words.into();
        (self.show)(&format!("  {words}"));
        if let Some(step) = self.record.steps.last_mut() {
            step.found.push(words);
        }
    }

    /// Records the findings of the step as numbers.
    pub fn data(&mut self, data: Value) {
        if let Some(step) = self.record.steps.last_mut() {
            step.data = Some(data);
        }
    }

    /// Does a step that needs no machine.
    ///
    /// # Errors
    /// That of `action`, or [`WriteError`] if the record cannot be written.
    pub fn step<R, E>(
        &mut self,
        step: CommissionStep,
        action: impl FnOnce(&mut Self) -> Result<R, E>,
    ) -> Result<R, E>
    where
        E: From<WriteError> + ToString,
    {
        self.begin(step);
        let result = action(self);
        self.end(result.as_ref().err().map(ToString::to_string))?;
        result
    }

    /// Ends the step, passed or `stopped` for this reason.
    ///
    /// # Errors
    /// [`WriteError`] if the record cannot be written.
    pub fn end(&mut self, stopped: Option<String>) -> Result<(), WriteError> {
        (self.show)(&match &stopped {
            None => "  passed".to_owned(),
            Some(why) => format!("  NOT PASSED: {why}"),
        });
        self.record.outcome =
            if stopped.is_none() { CommissionOutcome::Unfinished } else { CommissionOutcome::Stopped };
        if let Some(step) = self.record.steps.last_mut() {
            step.passed = stopped.is_none();
            step.stopped = stopped;
        }
        self.write()
    }

    /// Shows that the steps are done again from `back` on.
    pub fn again(&mut self, back: CommissionStep) {
        (self.show)(&format!("begins again: {}", back.name()));
    }

    /// Completes the record: every step was passed. Shows those that were not at first.
    ///
    /// # Errors
    /// [`WriteError`] if the record cannot be written.
    pub fn done(&mut self) -> Result<(), WriteError> {
        self.record.outcome = CommissionOutcome::Done;
        for step in self.record.steps.iter().filter(|step| !step.passed) {
            let why = step.stopped.as_deref().unwrap_or_default();
            (self.show)(&format!("{} had to begin again: {why}", step.step.name()));
        }
        self.write()
    }

    fn write(&self) -> Result<(), WriteError> {
        let Some(file) = &self.file else { return Ok(()) };
        // Numbers, strings and lists can always be written as JSON.
        let text = serde_json::to_string_pretty(&self.record).unwrap_or_default() + "\n";
        write_atomically(file, text.as_bytes())
    }
}
