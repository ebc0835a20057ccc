//! Assembles the log of a firmware that sends every tick.

use upright_closed_loop::client::AnyTickLog;
use upright_design::rig::Rig;
use upright_design::table::TableValues;

use crate::error::IdentifyError;
use crate::log::{DriveScale, Log, LogHeader, Tick};

/// Assembles the log messages of a firmware into a log.
#[derive(Debug, Clone)]
pub struct Recorder {
    log: Log,
    /// Counts of a whole turn of each sensor; 0 for the cart.
    turns: Vec<i32>,
    /// Number of messages that were rejected: they did not follow the one before, or had another number of channels.
    pub out_of_order: u32,
}

impl Recorder {
    /// A recorder with an empty log, for a rig and its gain table.
    pub fn new(rig: &Rig, table: &TableValues) -> Self {
        let drive = DriveScale::of(rig, table.drive.largest_force_n().into());
        let log = Log::new(LogHeader {
            rig: rig.name.clone(),
            hash: rig.hash(),
            period_ns: (rig.tick.period_s * 1e9).round() as u32,
            drive,
            hanging: table.rows().iter().map(|sensor| sensor.rest_counts as u16).collect(),
        });
        let turns = table.rows().iter().map(|sensor| sensor.turn_counts).collect();
        Self { log, turns, out_of_order: 0 }
    }

    /// Adds a message. The links have to hang in the first one: it shows how many whole turns they have made since
    /// they were homed.
    pub fn push(&mut self, message: &AnyTickLog) {
        if self.log.ticks().last().is_some_and(|last| message.first <= last.number) {
            self.out_of_order += 1;
            return;
        }
        for (logged, number) in message.ticks.iter().zip(message.first..) {
            let counts: Vec<u16> = logged.counts.iter().map(|&word| u16::from_le_bytes(word)).collect();
            if counts.len() != self.log.channels() {
                self.out_of_order += 1;
                return;
            }
            if self.log.ticks().is_empty() {
                self.take_turns(&counts);
            }
            let drive = i16::from_le_bytes(logged.drive);
            let tick = Tick { number, drive, supply_mv: message.supply_mv, contacts: message.contacts };
            self.log.push(tick, &counts);
        }
    }

    /// Adds whole turns to the counts of hanging, so that the first tick is within half a turn of them.
    fn take_turns(&mut self, counts: &[u16]) {
        for ((hanging, &count), &turn) in self.log.header.hanging.iter_mut().zip(counts).zip(&self.turns) {
            if turn > 0 {
                let away = f64::from(count.wrapping_sub(*hanging) as i16);
                let turns = (away / f64::from(turn)).round() as i32;
                *hanging = hanging.wrapping_add((turns * turn) as u16);
            }
        }
    }

    /// The log so far.
    pub fn log(&self) -> &Log {
        &self.log
    }

    /// Ends the recording and returns the log.
    ///
    /// # Errors
    /// [`IdentifyError::NothingRecorded`] if the firmware has sent none.
    pub fn finish(self) -> Result<Log, IdentifyError> {
        if self.log.ticks().is_empty() { Err(IdentifyError::NothingRecorded) } else { Ok(self.log) }
    }
}
