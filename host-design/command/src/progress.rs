//! Progress while something is computed, on stderr: a bar on a terminal, elsewhere a plain line now and then.

use std::fmt::Write;
use std::io::{IsTerminal, stderr};
use std::sync::{Mutex, MutexGuard, PoisonError, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use upright_design::parallel::{Progress, ProgressStep};

const SPINNER_STEP: Duration = Duration::from_millis(120);
/// Time between two lines where stderr is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(8);

/// Runs `work` with a spinner on stderr.
pub fn with_spinner<T>(message: &'static str, work: impl FnOnce() -> T) -> T {
    if !stderr().is_terminal() {
        let stage = Mutex::new(ProgressStage::begin(message, 0));
        return with_lines(LINE_EVERY, &|line| eprintln!("{line}"), &stage, work);
    }
    let spinner = ProgressBar::new_spinner().with_message(message);
    spinner.enable_steady_tick(SPINNER_STEP);
    let result = work();
    spinner.finish_and_clear();
    result
}

/// The same for work that usually takes the time `usual`: also says how much of that is left.
pub fn with_estimate<T>(message: &'static str, usual: Duration, work: impl FnOnce() -> T) -> T {
    let begin = || ProgressStage { usual: Some(usual), ..ProgressStage::begin(message, 0) };
    if !stderr().is_terminal() {
        return with_lines(LINE_EVERY, &|line| eprintln!("{line}"), &Mutex::new(begin()), work);
    }
    let stage = begin();
    let spinner = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {line}") {
        let line = move |state: &ProgressState, text: &mut dyn Write| {
            // A terminal takes everything.
            let _ = text.write_str(&stage.line(state.elapsed()));
        };
        spinner.set_style(style.with_key("line", line));
    }
    spinner.enable_steady_tick(SPINNER_STEP);
    let result = work();
    spinner.finish_and_clear();
    result
}

/// Runs `work` with a bar on stderr that names its stages and counts their steps. In a search, it also says how many
/// candidates are solved, and how good the best is.
pub fn with_progress<T>(work: impl FnOnce(Progress<'_>) -> T) -> T {
    let stage = Mutex::new(ProgressStage::begin("", 0));
    if !stderr().is_terminal() {
        let report = |line: &str| eprintln!("{line}");
        return with_lines(LINE_EVERY, &report, &stage, || work(&|step| locked(&stage).take(step)));
    }
    let bar = ProgressBar::new(1);
    // If the template does not parse, the default bar stays.
    if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix} {bar:30} {pos}/{len} {msg} {elapsed}")
    {
        bar.set_style(style);
    }
    bar.enable_steady_tick(SPINNER_STEP);
    let result = work(&|step| {
        let mut stage = locked(&stage);
        stage.take(step);
        bar.set_prefix(stage.name.clone());
        bar.set_message(stage.solutions());
        bar.set_length(stage.steps);
        bar.set_position(stage.done);
    });
    bar.finish_and_clear();
    result
}

/// As [`with_progress`], for a single stage; `work` calls its argument after each of the `steps`.
pub fn with_bar<T>(stage: &str, steps: u64, work: impl FnOnce(&(dyn Fn() + Sync)) -> T) -> T {
    with_progress(|progress| {
        progress(ProgressStep::Begin(stage, steps));
        work(&|| progress(ProgressStep::Done))
    })
}

/// A stage of a computation, and how far it is.
#[derive(Clone)]
struct ProgressStage {
    name: String,
    done: u64,
    /// Number of steps; 0 if it is not known.
    steps: u64,
    /// Number of candidates that a search has solved, and the figure of merit of the best.
    solved: (u32, f64),
    since: Instant,
    /// How long it usually takes, where no steps are counted.
    usual: Option<Duration>,
}

impl ProgressStage {
    fn begin(name: &str, steps: u64) -> Self {
        let solved = (0, f64::INFINITY);
        Self { name: name.to_owned(), done: 0, steps, solved, since: Instant::now(), usual: None }
    }

    fn take(&mut self, step: ProgressStep<'_>) {
        match step {
            ProgressStep::Begin(name, steps) => *self = Self::begin(name, steps),
            ProgressStep::Done => self.done += 1,
            ProgressStep::Solved(score) => {
                self.solved = (self.solved.0 + 1, self.solved.1.min(score));
                self.done += 1;
            }
        }
    }

    /// What a search has solved; empty if nothing.
    fn solutions(&self) -> String {
        match self.solved {
            (0, _) => String::new(),
            (solved, best) => format!("solved {solved}, best {best:.2}"),
        }
    }

    /// How far it is after this time, in a line.
    fn line(&self, spent: Duration) -> String {
        let Self { name, done, steps, usual, .. } = self;
        let seconds = spent.as_secs();
        if *steps == 0 {
            let left = usual.map(|usual| usual.as_secs().saturating_sub(seconds));
            return match left {
                Some(left_s @ 1..) => format!("{name}: {seconds} s so far, about {left_s} s left"),
                Some(0) => format!("{name}: {seconds} s so far, longer than usual"),
                None => format!("{name}: {seconds} s so far"),
            };
        }
        let mut line = format!("{name}: {done} of {steps}, {seconds} s so far");
        if let Some(left_s) = (seconds * steps.saturating_sub(*done)).checked_div(*done) {
            line += &format!(", about {left_s} s left");
        }
        match self.solutions() {
            solutions if solutions.is_empty() => line,
            solutions => format!("{line}; {solutions}"),
        }
    }
}

fn locked(stage: &Mutex<ProgressStage>) -> MutexGuard<'_, ProgressStage> {
    stage.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs `work`; meanwhile `report` gets a line after each `every`.
fn with_lines<T>(
    every: Duration,
    report: &(dyn Fn(&str) + Sync),
    stage: &Mutex<ProgressStage>,
    work: impl FnOnce() -> T,
) -> T {
    thread::scope(|scope| {
        let (ends, ended) = mpsc::channel::<()>();
        scope.spawn(move || {
            while ended.recv_timeout(every) == Err(mpsc::RecvTimeoutError::Timeout) {
                let stage = locked(stage);
                report(&stage.line(stage.since.elapsed()));
            }
        });
        let result = work();
        drop(ends);
        result
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_work_is_reported_line_by_line_and_short_work_is_not() {
        let lines = Mutex::new(Vec::new());
        let stage = Mutex::new(ProgressStage::begin("building", 0));
        let report = |line: &str| lines.lock().unwrap().push(line.to_owned());
        // The work ends only after two lines have come.
        let seen = || lines.lock().unwrap().len();
        let long = || {
            while seen() < 2 {
                thread::yield_now();
            }
            7
        };
        assert_eq!(with_lines(Duration::from_millis(1), &report, &stage, long), 7);
        assert!(lines.lock().unwrap().iter().all(|line| line.starts_with("building: ")));
        let before = seen();
        assert_eq!(with_lines(LINE_EVERY, &report, &stage, || 8), 8);
        assert_eq!(seen(), before);
    }

    #[test]
    fn a_line_tells_what_is_done_and_what_is_left() {
        let mut stage = ProgressStage::begin("designing", 0);
        let after = |stage: &ProgressStage, seconds| stage.line(Duration::from_secs(seconds));
        assert_eq!(after(&stage, 9), "designing: 9 s so far");
        stage.usual = Some(Duration::from_secs(60));
        assert_eq!(after(&stage, 16), "designing: 16 s so far, about 44 s left");
        assert_eq!(after(&stage, 60), "designing: 60 s so far, longer than usual");
        stage.take(ProgressStep::Begin("trajectories", 40));
        assert_eq!(after(&stage, 8), "trajectories: 0 of 40, 8 s so far");
        (0..9).for_each(|_| stage.take(ProgressStep::Done));
        stage.take(ProgressStep::Solved(1.25));
        let line = "trajectories: 10 of 40, 20 s so far, about 60 s left; solved 1, best 1.25";
        assert_eq!(after(&stage, 20), line);
    }
}
