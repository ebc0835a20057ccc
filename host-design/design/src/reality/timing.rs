//! When the force of a tick begins and ends.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::rig::Rig;

/// Latency of the force and jitter of the tick: tick k begins at `k T + j_k` with `j_k` drawn uniformly from ± the
/// jitter, and the force of tick k begins to act one latency later.
#[derive(Debug, Clone)]
pub struct Timing {
    period_s: f64,
    latency_s: f64,
    jitter_s: f64,
    random: Pcg64,
    offset_s: f64,
}

impl Timing {
    /// The timing of a rig; `seed` is that of the run.
    pub fn of(rig: &Rig, seed: u64) -> Self {
        // A different sequence from that of the disturbances.
        let random = Pcg64::seed_from_u64(!seed);
        let driver = &rig.reality.driver;
        let (latency_s, jitter_s) = (driver.latency_s, driver.jitter_s);
        Self { period_s: rig.tick.period_s, latency_s, jitter_s, random, offset_s: 0.0 }
    }

    /// The two parts of the next tick (s): with the force of the tick before, and with its own.
    pub fn next_tick(&mut self) -> [f64; 2] {
        let mut length_s = self.period_s;
        if self.jitter_s > 0.0 {
            let next = self.jitter_s * self.random.random_range(-1.0..=1.0);
            length_s += next - self.offset_s;
            self.offset_s = next;
        }
        [self.latency_s, length_s - self.latency_s]
    }
}
