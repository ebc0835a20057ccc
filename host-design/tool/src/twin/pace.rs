//! The speed of simulated time.

use std::time::{Duration, Instant};

/// Time between two pictures.
pub(super) const PICTURE: Duration = Duration::from_nanos(16_666_667);
/// Longest real time for simulating between two pictures; time that is still due after it is skipped, and the page
/// shows it.
const BUDGET: Duration = Duration::from_millis(14);
/// Slowest speed (simulated seconds per second).
const SLOWEST: f64 = 1.0 / 50.0;
/// Fastest speed (simulated seconds per second).
const FASTEST: f64 = 10.0;

/// Runs as many ticks as are due.
#[derive(Debug)]
pub(super) struct SimulationPace {
    period_s: f64,
    factor: f64,
    is_paused: bool,
    steps: u32,
    /// Simulated time that is due (s).
    owed_s: f64,
    last: Instant,
    /// Simulated and real time of the last second (s).
    measured: [f64; 2],
    speed: f64,
}

impl SimulationPace {
    /// Real time, from now on.
    pub(super) fn new(period_s: f64) -> Self {
        Self {
            period_s,
            factor: 1.0,
            is_paused: false,
            steps: 0,
            owed_s: 0.0,
            last: Instant::now(),
            measured: [0.0; 2],
            speed: 1.0,
        }
    }

    /// Sets the speed; 1 is real time.
    pub(super) fn set(&mut self, factor: f64) {
        self.factor = factor.clamp(SLOWEST, FASTEST);
    }

    /// Stops simulated time, or resumes it.
    pub(super) fn pause(&mut self, is_paused: bool) {
        (self.is_paused, self.steps) = (is_paused, 0);
    }

    /// Runs some ticks while time is stopped.
    pub(super) fn step(&mut self, ticks: u32) {
        if self.is_paused {
            self.steps = ticks.min((1.0 / self.period_s) as u32);
        }
    }

    /// Runs the ticks that are due by now.
    ///
    /// # Errors
    /// Those of `tick`.
    pub(super) fn run<E>(&mut self, mut tick: impl FnMut() -> Result<(), E>) -> Result<(), E> {
        let begin = Instant::now();
        let passed_s = (begin - self.last).as_secs_f64();
        self.last = begin;
        if self.is_paused {
            self.owed_s = 0.0;
            for _ in 0..std::mem::take(&mut self.steps) {
                tick()?;
            }
            return Ok(());
        }
        self.owed_s += passed_s * self.factor;
        self.measured[1] += passed_s;
        while self.owed_s >= self.period_s {
            if begin.elapsed() > BUDGET {
                self.owed_s = 0.0;
                break;
            }
            tick()?;
            self.owed_s -= self.period_s;
            self.measured[0] += self.period_s;
        }
        if self.measured[1] >= 1.0 {
            self.speed = self.measured[0] / self.measured[1];
            self.measured = [0.0; 2];
        }
        Ok(())
    }

    /// The speed asked for; 1 is real time.
    pub(super) fn factor(&self) -> f64 {
        self.factor
    }

    /// Simulated seconds per second, measured over the last second.
    pub(super) fn speed(&self) -> f64 {
        self.speed
    }

    /// Whether time is stopped.
    pub(super) fn is_paused(&self) -> bool {
        self.is_paused
    }

    /// Waits for the next picture.
    pub(super) fn wait(&self) {
        std::thread::sleep((self.last + PICTURE).saturating_duration_since(Instant::now()));
    }
}
