//! A sign of life on the terminal while something takes longer.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

/// Runs `work` with a spinner on stderr, if that is a terminal.
pub(crate) fn with_spinner<T>(message: &'static str, work: impl FnOnce() -> T) -> T {
    let spinner = ProgressBar::new_spinner().with_message(message);
    spinner.enable_steady_tick(Duration::from_millis(120));
    let result = work();
    spinner.finish_and_clear();
    result
}

/// Runs `work` with a bar of `steps` on stderr, if that is a terminal; it calls what it is given after each step.
pub(crate) fn with_bar<T>(
    message: &'static str,
    steps: u64,
    work: impl FnOnce(&(dyn Fn() + Sync)) -> T,
) -> T {
    let bar = ProgressBar::new(steps).with_message(message);
    if let Ok(style) = ProgressStyle::with_template("{msg} {bar:40} {pos}/{len}, {eta} left") {
        bar.set_style(style);
    }
    let result = work(&|| bar.inc(1));
    bar.finish_and_clear();
    result
}

/// Runs `work` with a bar of `stages` on stderr, if that is a terminal; `work` names each stage before it starts it.
pub(crate) fn with_stages<T>(stages: u64, work: impl FnOnce(&dyn Fn(&'static str)) -> T) -> T {
    let bar = ProgressBar::new(stages);
    bar.set_style(
        ProgressStyle::with_template("{spinner} {bar:20} {pos}/{len} {msg} {elapsed}")
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar.enable_steady_tick(Duration::from_millis(120));
    let result = work(&|stage| {
        bar.inc(1);
        bar.set_message(stage);
    });
    bar.finish_and_clear();
    result
}
