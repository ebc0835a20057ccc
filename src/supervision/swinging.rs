//! The zeros of joints that swing out. A joint with friction comes to rest anywhere near hanging; while it swings, its
//! friction acts in both directions in turn, and the mean of its counts is where it would hang without friction.
//!
//! The mean is taken over windows of [`WINDOW_S`], with the weight `(1 - s²)²` for times `s` from -1 to 1: a swing of
//! angular frequency ω leaves at most `15 / (ω WINDOW_S / 2)³` of its amplitude in it. Zeros are taken if each joint
//! has swung to both sides by [`SWING`], and those of two windows in a row differ by no more than [`TOLERANCE`].

use crate::supervision::inhibits::Inhibits;
use crate::table::SensorRow;

/// Length of a window (s).
pub const WINDOW_S: f32 = 5.0;
/// Largest difference between the means of two windows (rad, m).
pub const TOLERANCE: f32 = 0.002;
/// A joint swings if it turns by more than this to both sides of the mean (rad); the cart has to stay within this of
/// its mean (m).
pub const SWING: f32 = 0.005;

/// Result of the last window.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Verdict {
    /// No window has ended yet.
    #[default]
    None,
    /// A joint has not swung, or there was no window before.
    Unknown,
    /// A mean differs from that of the window before.
    Contradicts,
    /// All means agree with those of the window before.
    Agrees,
}

/// Means of the counts, window by window.
#[derive(Debug, Clone)]
pub struct Swinging<const NY: usize> {
    /// Mean of the last window (counts).
    mean: [f32; NY],
    /// Weighted mean of this window so far, relative to `mean` (counts).
    moved: [f32; NY],
    /// Share of this window that has passed.
    time: f32,
    /// Two bits for each joint: to which sides it has swung in this window.
    sides: u32,
    /// Whether the cart is within [`SWING`] of its mean in the last window.
    is_near: bool,
    verdict: Verdict,
}

impl<const NY: usize> Default for Swinging<NY> {
    fn default() -> Self {
        Self {
            mean: [0.0; NY],
            moved: [0.0; NY],
            time: 0.0,
            sides: 0,
            is_near: false,
            verdict: Verdict::None,
        }
    }
}

impl<const NY: usize> Swinging<NY> {
    /// Takes the counts of a tick.
    pub fn update(&mut self, counts: &[i32; NY], sensors: &[SensorRow; NY], tick_s: f32) {
        let part = tick_s / WINDOW_S;
        let weight = self.time - self.time * self.time;
        // 1/30 is the mean of this square over the window.
        let weight = weight * weight * 30.0 * part;
        self.time += part;
        let ends = self.time >= 1.0;
        let (mut joints, mut agrees) = (0, true);
        for sensor in 0..NY {
            let away = counts[sensor] as f32 - self.mean[sensor];
            let is_far = f32::abs(away * sensors[sensor].step) > SWING;
            if sensors[sensor].turn_counts == 0 {
                self.is_near = !is_far;
            } else {
                let side = 1 << (2 * sensor % 32);
                joints |= 3 * side;
                if is_far {
                    self.sides |= if away > 0.0 { side } else { 2 * side };
                }
            }
            self.moved[sensor] += weight * away;
            if ends {
                agrees &= f32::abs(self.moved[sensor] * sensors[sensor].step) <= TOLERANCE;
                self.mean[sensor] += core::mem::take(&mut self.moved[sensor]);
            }
        }
        if ends {
            self.verdict = if self.verdict == Verdict::None || self.sides != joints {
                Verdict::Unknown
            } else if agrees {
                Verdict::Agrees
            } else {
                Verdict::Contradicts
            };
            (self.time, self.sides) = (0.0, 0);
        }
    }

    /// Forgets all means: from now on the counts are relative to another position.
    pub fn forget(&mut self) {
        self.verdict = Verdict::None;
    }

    /// The counts at which the links would hang, and where the cart is.
    ///
    /// # Errors
    /// [`Inhibits::MOVING`] if they are not known, or the cart is not where it was; [`Inhibits::ZEROS`], too, if two
    /// windows contradict each other.
    pub fn zeros(&self) -> Result<&[f32; NY], Inhibits> {
        if self.is_near && self.verdict == Verdict::Agrees {
            return Ok(&self.mean);
        }
        Err(Inhibits::MOVING.union(Inhibits::ZEROS.when(self.verdict == Verdict::Contradicts)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f32 = 0.002;
    /// A cart and a joint.
    fn sensors() -> [SensorRow; 2] {
        let of = |step, turn_counts| SensorRow { step, turn_counts, ..SensorRow::default() };
        [of(1e-4, 0), of(1e-3, 6283)]
    }

    /// What is known after `time_s` of a cart at `cart` and a joint that swings at 7 rad/s; both are functions of time,
    /// and give the cart's position, and amplitude and mean of the joint (counts).
    fn after(
        time_s: f32,
        cart: impl Fn(f32) -> f32,
        joint: impl Fn(f32) -> [f32; 2],
    ) -> Result<[f32; 2], Inhibits> {
        let mut swinging = Swinging::default();
        for tick in 0..(time_s / TICK_S) as u32 {
            let t = tick as f32 * TICK_S;
            let [amplitude, mean] = joint(t);
            let angle = mean + amplitude * libm::cosf(7.0 * t + 1.0);
            let counts = [libm::roundf(cart(t)) as i32, libm::roundf(angle) as i32];
            swinging.update(&counts, &sensors(), TICK_S);
        }
        swinging.zeros().copied()
    }

    #[test]
    fn the_mean_of_a_decaying_swing_is_its_zero() {
        let zeros = after(10.1, |_| 7.0, |t| [100.0 * libm::expf(-0.2 * t), 3141.3]).unwrap();
        assert!(f32::abs(zeros[0] - 7.0) < 0.01 && f32::abs(zeros[1] - 3141.3) < 0.1, "{zeros:?}");
    }

    #[test]
    fn what_is_not_known_is_refused() {
        let swing = |_| [50.0, 0.0];
        assert!(after(10.1, |_| 0.0, swing).is_ok());
        assert_eq!(after(9.9, |_| 0.0, swing), Err(Inhibits::MOVING), "one window only");
        assert_eq!(after(10.1, |_| 0.0, |_| [4.0, 0.0]), Err(Inhibits::MOVING), "it hardly swings");
        let stuck = |t| if t < 5.0 { [50.0, 0.0] } else { [0.0, 1.0] };
        assert_eq!(after(10.1, |_| 0.0, stuck), Err(Inhibits::MOVING), "it has stopped");
        let pushed = |t| if t < 10.01 { 0.0 } else { 60.0 };
        assert_eq!(after(10.1, pushed, swing), Err(Inhibits::MOVING), "the cart is elsewhere");
        let contradicts = Err(Inhibits::MOVING.union(Inhibits::ZEROS));
        assert_eq!(after(10.1, |_| 0.0, |t| [50.0, if t < 5.0 { 0.0 } else { 3.0 }]), contradicts);
        assert!(after(10.1, |_| 0.0, |t| [50.0, if t < 5.0 { 0.0 } else { 1.0 }]).is_ok());
        assert_eq!(after(10.1, |t| 30.0 * t, swing), contradicts, "the cart rolls away");
    }

    #[test]
    fn after_homing_the_means_before_do_not_count() {
        let mut swinging = Swinging::default();
        let mut swing_for = |ticks: u32, zero: i32| {
            for tick in 0..ticks {
                let angle = zero as f32 + 50.0 * libm::cosf(7.0 * TICK_S * tick as f32);
                swinging.update(&[0, libm::roundf(angle) as i32], &sensors(), TICK_S);
            }
            let zeros = swinging.zeros().map(|zeros| libm::roundf(zeros[1]));
            swinging.forget();
            zeros
        };
        assert_eq!(swing_for(5010, 20), Ok(20.0));
        assert_eq!(swing_for(2600, 3141), Err(Inhibits::MOVING), "a window of both");
        assert_eq!(swing_for(10_100, 3141), Ok(3141.0));
    }
}
