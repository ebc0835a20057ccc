//! The log of every tick: when it is kept, and when a message of it is complete.

use super::Firmware;
use crate::protocol::tick_log::{LoggedTick, TickLog};
use crate::table::SwingUp;

impl<const NX: usize, const NY: usize, S: SwingUp<NX, NY>> Firmware<'_, NX, NY, S> {
    /// Begins or ends the log.
    pub(super) fn keep_log(&mut self, is_kept: bool) {
        self.log = is_kept.then(TickLog::default);
    }

    /// Logs this tick, once its output is known; returns the message that the previous tick completed, if it did.
    pub fn log_tick(&mut self) -> Option<TickLog<NY>> {
        let log = self.log.as_mut()?;
        let mut complete = None;
        if log.ticks.is_empty() || log.is_complete(&self.contacts) {
            let next = TickLog::new(self.tick, &self.contacts, self.supply_v);
            complete = Some(core::mem::replace(log, next)).filter(|log| !log.ticks.is_empty());
        }
        log.push(LoggedTick::new(self.controller.encoders().counts(), &self.output));
        complete
    }
}
