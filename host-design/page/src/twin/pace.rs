//! The speed of simulated time.

/// Slowest speed (simulated seconds per second).
const SLOWEST: f64 = 1.0 / 50.0;
/// Fastest speed (simulated seconds per second).
const FASTEST: f64 = 10.0;

/// Runs as many ticks as are due.
#[derive(Debug)]
pub(crate) struct SimulationPace {
    period_s: f64,
    factor: f64,
    is_paused: bool,
    steps: u32,
    /// Simulated time that is due (s).
    owed_s: f64,
    /// Simulated and real time of the last second (s).
    measured: [f64; 2],
    speed: f64,
}

impl SimulationPace {
    /// Real time, from now on.
    pub(crate) fn new(period_s: f64) -> Self {
        Self {
            period_s,
            factor: 1.0,
            is_paused: false,
            steps: 0,
            owed_s: 0.0,
            measured: [0.0; 2],
            speed: 1.0,
        }
    }

    /// Sets the speed; 1 is real time.
    pub(crate) fn set(&mut self, factor: f64) {
        self.factor = factor.clamp(SLOWEST, FASTEST);
    }

    /// Stops simulated time, or resumes it.
    pub(crate) fn pause(&mut self, is_paused: bool) {
        (self.is_paused, self.steps) = (is_paused, 0);
    }

    /// Runs some ticks while time is stopped.
    pub(crate) fn step(&mut self, ticks: u32) {
        if self.is_paused {
            self.steps = ticks.min((1.0 / self.period_s) as u32);
        }
    }

    /// The number of ticks that are due after `passed_s` more of real time.
    pub(crate) fn due(&mut self, passed_s: f64) -> u32 {
        if self.is_paused {
            self.owed_s = 0.0;
            return std::mem::take(&mut self.steps);
        }
        self.owed_s += passed_s * self.factor;
        self.measured[1] += passed_s;
        let ticks = (self.owed_s / self.period_s) as u32;
        self.owed_s -= f64::from(ticks) * self.period_s;
        ticks
    }

    /// Of the ticks that were due, `ticks` have been run: the time of the others is skipped.
    pub(crate) fn ran(&mut self, ticks: u32) {
        self.measured[0] += f64::from(ticks) * self.period_s;
        if self.measured[1] >= 1.0 {
            self.speed = self.measured[0] / self.measured[1];
            self.measured = [0.0; 2];
        }
    }

    /// The speed asked for; 1 is real time.
    pub(crate) fn factor(&self) -> f64 {
        self.factor
    }

    /// Simulated seconds per second, measured over the last second.
    pub(crate) fn speed(&self) -> f64 {
        self.speed
    }

    /// Whether time is stopped.
    pub(crate) fn is_paused(&self) -> bool {
        self.is_paused
    }
}
