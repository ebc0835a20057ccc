//! Connections whose request has not been read yet. They are few: a new one ends the oldest.

use std::collections::VecDeque;
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Mutex, PoisonError};

/// Most connections at a time whose request has not been read.
pub(super) const MAX_HALF_OPEN: usize = 16;

/// The half-open connections, by number, the oldest first.
#[derive(Clone, Default)]
pub(super) struct HalfOpen(Arc<Mutex<VecDeque<(u64, TcpStream)>>>);

impl HalfOpen {
    /// Takes connection `number`. Who asks at once is through long before sixteen others have come, however many
    /// connections are kept waiting.
    pub(super) fn begin(&self, number: u64, stream: &TcpStream) -> std::io::Result<()> {
        let stream = stream.try_clone()?;
        let mut waiting = self.locked();
        if waiting.len() >= MAX_HALF_OPEN {
            // A connection that is already closed is gone in any case.
            waiting.pop_front().map(|(_, oldest)| oldest.shutdown(Shutdown::Both));
        }
        waiting.push_back((number, stream));
        Ok(())
    }

    /// The request of connection `number` has been read, or will not be.
    pub(super) fn end(&self, number: u64) {
        self.locked().retain(|(other, _)| *other != number);
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, VecDeque<(u64, TcpStream)>> {
        // The content is consistent after every statement, so a panic elsewhere does not matter.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
