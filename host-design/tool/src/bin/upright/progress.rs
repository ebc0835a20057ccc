//! Progress on the terminal while a command computes.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use upright_design::swing_up::{SearchProgress, SearchStep};

const SPINNER_STEP: Duration = Duration::from_millis(120);

/// Runs `work` with a spinner on stderr, if stderr is a terminal.
pub(crate) fn with_spinner<T>(message: &'static str, work: impl FnOnce() -> T) -> T {
    let spinner = ProgressBar::new_spinner().with_message(message);
    spinner.enable_steady_tick(SPINNER_STEP);
    let result = work();
    spinner.finish_and_clear();
    result
}

/// Runs `work` with a bar of `steps` on stderr, if stderr is a terminal; it calls its argument after each step.
pub(crate) fn with_bar<T>(
    message: &'static str,
    steps: u64,
    work: impl FnOnce(&(dyn Fn() + Sync)) -> T,
) -> T {
    let bar = ProgressBar::new(steps).with_message(message);
    style(&bar, "{msg} {bar:40} {pos}/{len}, {eta} left");
    let result = work(&|| bar.inc(1));
    bar.finish_and_clear();
    result
}

/// Runs `work` with a bar of `runs` random plants on stderr, if stderr is a terminal. `work` names each stage before
/// it starts it, and calls its second argument after each run.
pub(crate) fn with_random_plants<T>(
    runs: u64,
    work: impl FnOnce(&dyn Fn(&str), &(dyn Fn() + Sync)) -> T,
) -> T {
    let bar = ProgressBar::new(runs);
    style(&bar, "{spinner} {msg} {wide_bar} {pos}/{len} random plants {elapsed}");
    let result = work(&|stage| bar.set_message(stage.to_owned()), &|| bar.inc(1));
    bar.finish_and_clear();
    result
}

/// Runs `work` with a bar of `stages` on stderr, if stderr is a terminal; `work` names each stage before it starts it.
pub(crate) fn with_stages<T>(stages: u64, work: impl FnOnce(&dyn Fn(&'static str)) -> T) -> T {
    let bar = ProgressBar::new(stages);
    style(&bar, "{spinner} {bar:20} {pos}/{len} {msg} {elapsed}");
    let result = work(&|stage| {
        bar.inc(1);
        bar.set_message(stage);
    });
    bar.finish_and_clear();
    result
}

/// Runs the search for a swing-up with a bar that says what is being tried, if stderr is a terminal.
pub(crate) fn with_search<T>(work: impl FnOnce(SearchProgress<'_>) -> T) -> T {
    let bar = ProgressBar::new(1);
    style(&bar, "{spinner} {prefix} {bar:30} {pos}/{len} {msg} {elapsed}");
    let best = std::sync::Mutex::new((0u32, f64::INFINITY));
    let result = work(&|trying| match trying {
        SearchStep::Stage { transition, what, steps } => {
            bar.set_prefix(format!("{transition}: {what}"));
            bar.set_length(steps);
            bar.set_position(0);
            if let Ok(mut best) = best.lock() {
                *best = (0, f64::INFINITY);
            }
            bar.set_message("");
        }
        SearchStep::Step { score } => {
            bar.inc(1);
            if let (Some(score), Ok(mut best)) = (score, best.lock()) {
                *best = (best.0 + 1, best.1.min(score));
                bar.set_message(format!("solved {}, least fragility {:.2}", best.0, best.1));
            }
        }
    });
    bar.finish_and_clear();
    result
}

/// Runs `work` with a bar that names its stages and counts their steps, if stderr is a terminal.
pub(crate) fn with_steps<T>(work: impl FnOnce(upright_design::parallel::Progress<'_>) -> T) -> T {
    let bar = ProgressBar::new(1);
    style(&bar, "{spinner} {msg} {bar:30} {pos}/{len} {elapsed}");
    let result = work(&|step| match step {
        Some((stage, steps)) => {
            bar.set_message(stage.to_owned());
            bar.set_length(steps);
            bar.set_position(0);
        }
        None => bar.inc(1),
    });
    bar.finish_and_clear();
    result
}

fn style(bar: &ProgressBar, template: &str) {
    // If the template does not parse, the default bar stays.
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar.enable_steady_tick(SPINNER_STEP);
}
