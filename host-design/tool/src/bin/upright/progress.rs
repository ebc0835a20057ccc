//! Progress on the terminal while a command computes.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use upright_design::parallel::{Progress, ProgressStep};

const SPINNER_STEP: Duration = Duration::from_millis(120);

/// Runs `work` with a spinner on stderr, if stderr is a terminal.
pub(crate) fn with_spinner<T>(message: &'static str, work: impl FnOnce() -> T) -> T {
    let spinner = ProgressBar::new_spinner().with_message(message);
    spinner.enable_steady_tick(SPINNER_STEP);
    let result = work();
    spinner.finish_and_clear();
    result
}

/// Runs `work` with a bar that names its stages and counts their steps, on stderr, if this is a terminal. In a search,
/// it also says how many candidates are solved, and how good the best is.
pub(crate) fn with_progress<T>(work: impl FnOnce(Progress<'_>) -> T) -> T {
    let bar = ProgressBar::new(1);
    // If the template does not parse, the default bar stays.
    if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix} {bar:30} {pos}/{len} {msg} {elapsed}")
    {
        bar.set_style(style);
    }
    bar.enable_steady_tick(SPINNER_STEP);
    let solved = Mutex::new((0u32, f64::INFINITY));
    let result = work(&|step| {
        let mut solved = solved.lock().unwrap_or_else(PoisonError::into_inner);
        match step {
            ProgressStep::Begin(stage, steps) => {
                *solved = (0, f64::INFINITY);
                bar.set_prefix(stage.to_owned());
                bar.set_message("");
                bar.set_length(steps);
                bar.set_position(0);
            }
            ProgressStep::Done => bar.inc(1),
            ProgressStep::Solved(score) => {
                *solved = (solved.0 + 1, solved.1.min(score));
                bar.set_message(format!("solved {}, best {:.2}", solved.0, solved.1));
                bar.inc(1);
            }
        }
    });
    bar.finish_and_clear();
    result
}

/// As [`with_progress`], for a single stage; `work` calls its argument after each of the `steps`.
pub(crate) fn with_bar<T>(stage: &str, steps: u64, work: impl FnOnce(&(dyn Fn() + Sync)) -> T) -> T {
    with_progress(|progress| {
        progress(ProgressStep::Begin(stage, steps));
        work(&|| progress(ProgressStep::Done))
    })
}
