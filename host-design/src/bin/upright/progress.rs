//! A sign of life on the terminal while something takes longer.

use std::time::Duration;

use indicatif::ProgressBar;

/// Runs `work` with a spinner on stderr, if that is a terminal.
pub(crate) fn with_spinner<T>(message: &'static str, work: impl FnOnce() -> T) -> T {
    let spinner = ProgressBar::new_spinner().with_message(message);
    spinner.enable_steady_tick(Duration::from_millis(120));
    let result = work();
    spinner.finish_and_clear();
    result
}
