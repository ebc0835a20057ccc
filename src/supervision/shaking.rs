//! Shaking: the motor shakes the hanging rig, so that the host can identify its parameters from a log of every tick.
//!
//! The host sends the forces for coming ticks ahead; they wait in a ring buffer. A virtual spring and damper, whose
//! constants also come from the host, keep the cart near the middle. Whatever the host sends, the force is bounded and
//! changes slowly, and the rig stays within limits of its own: rail, speed, angle, rates, duration. When the host is
//! silent or the time is over, spring and damper bring the cart back, and then the motor goes off.
//!
//! For a drive with pulses, accelerations of the cart (m/s²) take the place of all these forces.

use serde::{Deserialize, Serialize};

use crate::control::spring_damper::SpringDamper;
use crate::control::state_feedback::saturate;
use crate::supervision::fault::Fault;
use crate::supervision::jog::SILENCE_S;
use crate::supervision::rates::{Found, Rates};
use crate::table::{Limits, SensorRow};

/// Number of forces in a command.
pub const FORCES: usize = 10;
/// Length of the ring buffer; it holds the forces for the next `AHEAD - 1` ticks.
pub const AHEAD: usize = 64;
/// Ticks without a command after which the host may count as silent: it answers to messages of up to ten ticks.
const MOST_SILENT: u16 = 2 * FORCES as u16;
/// Value in a command that stands for the largest force.
pub const FULL: i8 = i8::MAX;

/// The cart returns after this time (s).
pub const LONGEST_S: f32 = 120.0;
/// The motor goes off when the cart has not come back within this time (s).
pub const RETURN_S: f32 = 5.0;
/// The cart is back when it is slow and within this fraction of the length between the soft limits from 0.
const BACK: f32 = 0.05;
/// A cart is slow if it would need at least this time for that distance (s).
const SLOW_S: f32 = 0.5;
/// Largest slew rate of the force, relative to the largest force (1/s).
const SLEW_PER_S: f32 = 100.0;
/// An encoder is defective if it counts faster than this multiple of the cart's speed limit, or than this rate of a
/// joint (rad/s).
const RATE_OF_SPEED: f32 = 4.0;
const RATE_RAD_PER_S: f32 = 90.0;
/// Largest angle of a link from where it hung (rad).
pub const ANGLE_RAD: f32 = 2.1;
/// Time within which the force of the jog has to move everything by more than a count: cart, links (s). Other
/// forces have to do so within the same impulse.
pub const STILL_S: [f32; 2] = [0.25, 0.5];
/// Share of the cart's speed limit that a drive with pulses uses.
pub const SPEED_SHARE: f32 = 0.9;
/// Unit in which impulses are counted: this fraction of the jog force, for one tick.
const IMPULSE: f32 = 1.0 / 32.0;

/// How the rig is shaken, as commanded by the host.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Shaking {
    /// Largest force (N); for a drive with pulses, largest acceleration of the cart (m/s²).
    pub largest_input: f32,
    /// Stiffness of the spring that pulls the cart to the middle (N/m, or 1/s²).
    pub stiffness: f32,
    /// Constant of the damper on the cart (N·s/m, or 1/s).
    pub damping: f32,
}

impl Shaking {
    /// Whether the largest force is positive and at most `force_limit_n` (N, or m/s²), and both constants are finite
    /// and not negative.
    pub fn is_sound(&self, force_limit_n: f32) -> bool {
        let constants = [self.stiffness, self.damping];
        self.largest_input > 0.0
            && self.largest_input <= force_limit_n
            && constants.iter().all(|constant| (0.0..f32::MAX).contains(constant))
    }
}

/// State of the shaking of a rig with `NY` encoders: the cart's, then those of the joints.
#[derive(Debug, Clone)]
pub struct Shaker<const NY: usize> {
    shaking: Shaking,
    /// Forces of the coming ticks as parts of [`FULL`]; that of tick t is at t modulo [`AHEAD`].
    ring: [i8; AHEAD],
    start: [i32; NY],
    rates: Rates<NY>,
    /// Where each sensor was last seen to move.
    seen: [i32; NY],
    /// Impulse since then, in units of [`IMPULSE`].
    idle: [u16; NY],
    force_n: f32,
    ticks: u32,
    silent_ticks: u16,
    return_ticks: u16,
}

impl<const NY: usize> Default for Shaker<NY> {
    fn default() -> Self {
        Self {
            shaking: Shaking::default(),
            ring: [0; AHEAD],
            start: [0; NY],
            rates: Rates::default(),
            seen: [0; NY],
            idle: [0; NY],
            force_n: 0.0,
            ticks: 0,
            silent_ticks: 0,
            return_ticks: 0,
        }
    }
}

impl<const NY: usize> Shaker<NY> {
    /// Begins with everything at rest at these counts.
    pub fn begin(&mut self, shaking: Shaking, counts: &[i32; NY]) {
        let rates = Rates::at_rest(counts);
        *self = Self { shaking, start: *counts, rates, seen: *counts, ..Self::default() };
    }

    /// Takes forces from the host, in tick `now`: `first` holds the low 16 bits of the number of the tick that the
    /// first one is for. Forces for ticks that are over, or too far ahead, are ignored.
    pub fn take(&mut self, now: u32, first: u16, forces: &[i8; FORCES]) {
        self.silent_ticks = 0;
        for (tick, &force) in (0..).map(|index| first.wrapping_add(index)).zip(forces) {
            let ahead = usize::from(tick.wrapping_sub(now as u16));
            if let Some(waiting) = self.ring.get_mut(usize::from(tick) % AHEAD)
                && (1..AHEAD).contains(&ahead)
            {
                *waiting = force;
            }
        }
    }

    /// Speed of the cart (m/s), filtered.
    pub fn speed_m_per_s(&self) -> f32 {
        self.rates.speed_m_per_s()
    }

    /// Tick `now`, with the sensors at `counts`. Returns the force (N, or
    /// m/s²), or `None` when the shaking has ended.
    ///
    /// # Errors
    /// The fault, and the sensor, if it concerns one.
    pub fn update(
        &mut self,
        now: u32,
        counts: &[i32; NY],
        sensors: &[SensorRow; NY],
        limits: &Limits,
        tick_s: f32,
    ) -> Result<Option<f32>, Found> {
        let position_m = self.measure(counts, sensors, limits, tick_s)?;
        self.moves(counts, limits.jog_force_n, tick_s)?;
        self.ticks = self.ticks.saturating_add(1);
        self.silent_ticks = self.silent_ticks.saturating_add(1);
        let mut pushed = 0;
        if let Some(waiting) = self.ring.get_mut(now as usize % AHEAD) {
            core::mem::swap(&mut pushed, waiting);
        }
        // In slow ticks, the log, to which the host answers, comes later.
        let is_silent = f32::from(self.silent_ticks) * tick_s >= SILENCE_S && self.silent_ticks > MOST_SILENT;
        let is_over = is_silent || self.ticks as f32 * tick_s >= LONGEST_S;
        if is_over || self.return_ticks > 0 {
            pushed = 0;
            self.return_ticks = self.return_ticks.saturating_add(1);
            let near = BACK * (limits.rail_m[1] - limits.rail_m[0]);
            let is_back = f32::abs(position_m) <= near && f32::abs(self.speed_m_per_s()) * SLOW_S <= near;
            if is_back || f32::from(self.return_ticks) * tick_s >= RETURN_S {
                return Ok(None);
            }
        }
        let Shaking { largest_input: most, stiffness, damping } = self.shaking;
        let law = SpringDamper { constants: [stiffness, damping], most_n: [f32::MAX; 2] };
        let push = most * f32::from(pushed) / f32::from(FULL);
        let wanted = law.force_n(push, [position_m, self.speed_m_per_s()]);
        let change = saturate(saturate(wanted, most) - self.force_n, SLEW_PER_S * tick_s * most);
        self.force_n = saturate(self.force_n + change, most);
        if self.force_n.is_finite() { Ok(Some(self.force_n)) } else { Err((Fault::NotFinite, None)) }
    }

    /// Updates the positions and checks their limits; returns the cart's position (m).
    fn measure(
        &mut self,
        counts: &[i32; NY],
        sensors: &[SensorRow; NY],
        limits: &Limits,
        tick_s: f32,
    ) -> Result<f32, Found> {
        let fastest = [RATE_OF_SPEED * limits.speed_m_per_s, RATE_RAD_PER_S];
        self.rates.update(counts, sensors, fastest, tick_s)?;
        let (mut position_m, mut angle) = (0.0, 0.0);
        let counts = counts.iter().zip(&self.start);
        for (sensor, (row, (&count, &start))) in sensors.iter().zip(counts).enumerate() {
            if sensor == 0 {
                position_m = row.step * count as f32;
            } else {
                angle += row.step * count.wrapping_sub(start) as f32;
                if f32::abs(angle) > ANGLE_RAD {
                    return Err((Fault::Angle, None));
                }
            }
        }
        let [low, high] = limits.rail_m;
        if !(low..=high).contains(&position_m) {
            return Err((Fault::Rail, None));
        }
        if f32::abs(self.speed_m_per_s()) > limits.speed_m_per_s {
            return Err((Fault::Speed, None));
        }
        Ok(position_m)
    }

    /// Checks that every sensor moves that the force has to move.
    fn moves(&mut self, counts: &[i32; NY], jog_force_n: f32, tick_s: f32) -> Result<(), Found> {
        let impulse = (f32::abs(self.force_n) / (IMPULSE * jog_force_n)) as u16;
        let sensors = counts.iter().zip(self.seen.iter_mut().zip(&mut self.idle));
        for (sensor, (&count, (seen, idle))) in (0..).zip(sensors) {
            if count.wrapping_sub(*seen).unsigned_abs() > 1 {
                (*seen, *idle) = (count, 0);
            } else {
                *idle = idle.saturating_add(impulse);
            }
            let [cart_s, link_s] = STILL_S;
            let longest_s = if sensor == 0 { cart_s } else { link_s };
            if f32::from(*idle) * IMPULSE * tick_s > longest_s {
                return Err((Fault::Frozen, Some(sensor)));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f32 = 0.001;
    const STEP: [f32; 3] = [1e-4, 1e-3, 1e-3];
    const SHAKING: Shaking = Shaking { largest_input: 2.0, stiffness: 1.0, damping: 1.0 };

    /// Counts of cart and links as functions of the tick, and for how many ticks the host sends full force along +x.
    struct Run {
        counts: fn(i32) -> [i32; 3],
        fed_ticks: u32,
    }

    fn sensors() -> [SensorRow; 3] {
        STEP.map(|step| SensorRow { step, ..SensorRow::default() })
    }

    type Outcome = Result<Option<f32>, Found>;

    /// Result of such a run: the ticks with the motor on, the largest force, and how it ended.
    fn run(run: &Run) -> (u32, f32, Outcome) {
        let limits = Limits { rail_m: [-1.0, 1.0], speed_m_per_s: 2.0, jog_force_n: 1.0, ..Limits::none() };
        let mut shaker = Shaker::default();
        shaker.begin(SHAKING, &(run.counts)(0));
        let mut most = 0.0f32;
        for tick in 0..200_000u32 {
            if tick < run.fed_ticks && tick.is_multiple_of(10) {
                shaker.take(tick, (tick + 1) as u16, &[FULL; FORCES]);
            }
            match shaker.update(tick, &(run.counts)(tick as i32), &sensors(), &limits, TICK_S) {
                Ok(Some(force)) => most = most.max(force.abs()),
                ended => return (tick, most, ended),
            }
        }
        panic!("it does not end")
    }

    /// Everything moves back and forth.
    fn swings(tick: i32) -> [i32; 3] {
        let to_and_fro = (tick % 400 - 200).abs() - 100;
        [to_and_fro, 3 * to_and_fro, 5 * to_and_fro]
    }

    #[test]
    fn the_force_is_bounded_and_rises_slowly() {
        let limits = Limits { rail_m: [-1.0, 1.0], speed_m_per_s: 2.0, jog_force_n: 1.0, ..Limits::none() };
        let mut shaker = Shaker::default();
        shaker.begin(SHAKING, &[0; 3]);
        shaker.take(0, 0, &[FULL; FORCES]);
        let mut forces = (0..12u32)
            .map(|tick| shaker.update(tick, &[0; 3], &sensors(), &limits, TICK_S).unwrap().unwrap());
        // The force of the present tick comes too late.
        assert_eq!(forces.next(), Some(0.0));
        let rising: std::vec::Vec<f32> = forces.collect();
        assert!(rising[..9].iter().zip(1..).all(|(force, n)| (force - 0.2 * n as f32).abs() < 1e-5));
        // Nothing more was sent: back to 0.
        assert!(rising[9] < rising[8] && rising[10] < rising[9]);
        assert!(!Shaking { largest_input: 3.0, ..SHAKING }.is_sound(2.0) && SHAKING.is_sound(2.0));
        assert!(!Shaking { damping: f32::NAN, ..SHAKING }.is_sound(2.0));
        assert!(!Shaking { stiffness: f32::INFINITY, ..SHAKING }.is_sound(2.0));
        assert!(!Shaking { largest_input: f32::NAN, ..SHAKING }.is_sound(2.0));
    }

    #[test]
    fn forces_far_ahead_and_of_the_past_are_left_out() {
        let mut shaker = Shaker::<3>::default();
        let now = u32::from(u16::MAX) + 65_530;
        shaker.take(now, (now as u16).wrapping_add(AHEAD as u16 - 5), &[1; FORCES]);
        assert_eq!(shaker.ring.iter().filter(|force| **force != 0).count(), 5);
        shaker.take(now, (now as u16).wrapping_sub(5), &[2; FORCES]);
        assert_eq!(shaker.ring.iter().filter(|force| **force == 2).count(), 4);
    }

    #[test]
    fn a_silent_host_and_a_long_time_end_it_when_the_cart_is_back() {
        let (ticks, most, ended) = run(&Run { counts: swings, fed_ticks: 1000 });
        assert_eq!((ended, most), (Ok(None), 2.0));
        assert!((1089..1500).contains(&ticks), "{ticks}");
        let (ticks, _, ended) = run(&Run { counts: swings, fed_ticks: u32::MAX });
        assert!(ended == Ok(None) && (119_999..120_400).contains(&ticks), "{ticks}");
        // A cart that does not come back.
        let away = |tick: i32| [6000 + tick % 7, tick % 50, tick % 50];
        let (ticks, _, ended) = run(&Run { counts: away, fed_ticks: 500 });
        assert!(ended == Ok(None) && (5500..5700).contains(&ticks), "{ticks}");
    }

    #[test]
    fn every_limit_ends_it_with_its_fault() {
        type Case = (fn(i32) -> [i32; 3], Found);
        let cases: [Case; 8] = [
            (|tick| [10_001 * i32::from(tick > 50), tick, tick], (Fault::Encoder, Some(0))),
            (|tick| [5 * tick, swings(tick)[1], swings(tick)[2]], (Fault::Rail, None)),
            (|tick| [25 * (tick - 200), swings(tick)[1], swings(tick)[2]], (Fault::Speed, None)),
            (|tick| [tick % 9, -tick, swings(tick)[2]], (Fault::Angle, None)),
            (|tick| [tick % 9, tick, tick], (Fault::Angle, None)),
            (|tick| [tick % 9, 100 * i32::from(tick > 50), tick % 9], (Fault::Encoder, Some(1))),
            (|tick| [0, tick % 9, tick % 9], (Fault::Frozen, Some(0))),
            (|tick| [tick % 9, tick % 9, tick % 2], (Fault::Frozen, Some(2))),
        ];
        for (index, (counts, wanted)) in cases.into_iter().enumerate() {
            let (ticks, _, ended) = run(&Run { counts, fed_ticks: 10_000 });
            assert_eq!(ended, Err(wanted), "case {index}, tick {ticks}");
        }
    }
}
