//! Ends an emulator whose image does not answer any more, so that nobody waits for it for ever.

use std::process::Child;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Longest time for an answer, which takes some microseconds on an idle computer.
pub(super) const LONGEST: Duration = Duration::from_secs(300);

/// Watches over the answers of an emulator, on a thread of its own.
pub(super) struct AnswerLimit {
    /// Requests and answers so far: odd while an answer is waited for.
    exchanged: Arc<AtomicU64>,
}

impl AnswerLimit {
    /// Kills `process`, which ends its channels, as soon as an answer takes longer than `longest`.
    pub(super) fn of(process: &Arc<Mutex<Child>>, longest: Duration) -> Self {
        let exchanged = Arc::new(AtomicU64::new(0));
        let (watched, process) = (Arc::downgrade(&exchanged), Arc::clone(process));
        std::thread::spawn(move || {
            let (mut last, mut since) = (0, Instant::now());
            while let Some(exchanged) = watched.upgrade() {
                let now = exchanged.load(Ordering::Relaxed);
                if now != last || now.is_multiple_of(2) {
                    (last, since) = (now, Instant::now());
                } else if since.elapsed() > longest {
                    // A process that has ended in between cannot be killed.
                    let _ = process.lock().unwrap_or_else(PoisonError::into_inner).kill();
                    return;
                }
                drop(exchanged);
                std::thread::sleep(Duration::from_millis(100));
            }
        });
        Self { exchanged }
    }

    /// A request is sent, or its answer has come.
    pub(super) fn exchange(&self) {
        self.exchanged.fetch_add(1, Ordering::Relaxed);
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn an_emulator_is_ended_if_an_answer_is_missing_and_not_while_nobody_asks() {
        let sleeping =
            || Arc::new(Mutex::new(std::process::Command::new("sleep").arg("3600").spawn().unwrap()));
        let (asked, idle) = (sleeping(), sleeping());
        let limits = [&asked, &idle].map(|process| AnswerLimit::of(process, Duration::from_millis(200)));
        // A request and its answer, and one request more.
        let [of_asked, of_idle] = limits;
        for limit in [&of_asked, &of_asked, &of_idle, &of_idle, &of_asked] {
            limit.exchange();
        }
        let has_ended = |process: &Mutex<Child>| process.lock().unwrap().try_wait().unwrap().is_some();
        let begin = Instant::now();
        while !has_ended(&asked) {
            assert!(begin.elapsed() < LONGEST, "it goes on");
            std::thread::sleep(Duration::from_millis(10));
        }
        assert!(!has_ended(&idle));
        idle.lock().unwrap().kill().unwrap();
        idle.lock().unwrap().wait().unwrap();
    }
}
