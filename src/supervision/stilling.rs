//! Stilling: the motor brings links that tumble or swing to rest hanging, from any motion.
//!
//! The motor imitates a spring and a damper on the base, each with a largest force. Whatever the masses of the rig,
//! they only take energy from it, and the base goes no further than the energy bends the spring. Where the table says
//! so, the motor also imitates a base of less mass and friction, on which the links swing out sooner. With `M` and `D`
//! its mass and viscous friction, `m` and `d` those of the real one and `F` the force of spring and damper:
//!
//! ```text
//! ẍ = the acceleration of the imitated base with these links under F
//! u = F + (m - M) ẍ + (d - D) ẋ + dry friction,   or u = ẍ for a drive that imposes the acceleration
//! ```
//!
//! An outward bound base that would otherwise pass the soft end of the rail is braked with the largest force.
//!
//! A motor that is reversed, or that follows a sensor that is, adds energy instead. So the momentum of base and links
//! along the rail is compared with the impulse of the motor: nothing else changes it but friction of the base, however
//! the links tumble.

use crate::control::spring_damper::SpringDamper;
use crate::control::state_feedback::saturate;
use crate::plant::ChainState;
use crate::supervision::fault::Fault;
use crate::supervision::rates::{Found, Rates};
use crate::table::{GainTable, ImitatedBase, StillingGains};

/// After a command, the motor goes off after this time, whether the links hang still or not (s).
pub const LONGEST_S: f32 = 20.0;
/// The base's encoder is defective if it counts faster than this multiple of the largest speed of stilling. Short outer
/// links of a chain that tumbles whip round faster than anything that an encoder could be told by.
const RATE_OF_SPEED: f32 = 2.0;
/// A slower base may stick: dry friction is made up for along the wanted force (m/s).
const STICKS_M_PER_S: f32 = 0.02;
/// That force, times this, is what is made up for, at most all of the known friction.
const STUCK_GAIN: f32 = 5.0;
/// Time over which they are compared (s).
const COMPARED_S: f32 = 0.1;
/// Change of momentum that no impulse explains, as a share of the impulse and of the momentum that base and links have
/// if they move together with the energy of upright links: the masses are wrong, and the base has dry friction.
const UNEXPLAINED: [f32; 2] = [0.5, 0.3];

/// Momentum along the rail, compared with the impulse of the motor.
#[derive(Debug, Clone, Default)]
struct MomentumBalance {
    /// Momentum a tick ago (N s); none before.
    momentum: Option<f32>,
    /// Change of the momentum that the force does not explain, and impulse without its sign (N s).
    unexplained: f32,
    impulse: f32,
}

impl MomentumBalance {
    /// A tick with the rig in `state`, in which the motor has applied `force_n`. Returns whether they fit.
    fn fits<const NY: usize>(
        &mut self,
        state: &ChainState<NY>,
        base: &ImitatedBase<NY>,
        force_n: f32,
        tick_s: f32,
    ) -> bool {
        let [mass, friction] = base.taken;
        let momentum = base.model.momentum(state) + mass * state.xdot;
        let Some(before) = self.momentum.replace(momentum) else { return true };
        let left = 1.0 - (tick_s / COMPARED_S).min(1.0);
        let explained = (force_n - (friction + base.model.cart_friction) * state.xdot) * tick_s;
        self.unexplained = left * self.unexplained + (momentum - before) - explained;
        self.impulse = left * self.impulse + f32::abs(force_n) * tick_s;
        let [of_impulse, of_upright] = UNEXPLAINED;
        let excess = f32::abs(self.unexplained) - of_impulse * self.impulse;
        let total_kg = 1.0 / base.model.inverse_mass + mass;
        let upright_j = 2.0 * base.model.weight.sum();
        excess <= 0.0 || excess * excess <= of_upright * of_upright * 2.0 * total_kg * upright_j
    }
}

/// State of the stilling of a rig with `NY` sensors.
#[derive(Debug, Clone)]
pub struct Stiller<const NY: usize> {
    rates: Rates<NY>,
    ticks_left: u32,
    balance: MomentumBalance,
    /// Force of the last tick (N).
    applied_n: f32,
}

impl<const NY: usize> Default for Stiller<NY> {
    fn default() -> Self {
        Self { rates: Rates::default(), ticks_left: 0, balance: MomentumBalance::default(), applied_n: 0.0 }
    }
}

impl<const NY: usize> Stiller<NY> {
    /// Begins with the sensors at these counts, for at most so many ticks. The rates are known a tick later.
    pub fn begin(&mut self, counts: &[i32; NY], longest_ticks: u32) {
        *self = Self { rates: Rates::moving(counts), ticks_left: longest_ticks, ..Self::default() };
    }

    /// Speed of the base (m/s), filtered.
    pub fn speed_m_per_s(&self) -> f32 {
        self.rates.speed_m_per_s()
    }

    /// Takes the force that the motor applies until the next tick (N).
    pub fn take_applied(&mut self, applied_n: f32) {
        self.applied_n = applied_n;
    }

    /// Whether the time is over.
    pub fn is_over(&self) -> bool {
        self.ticks_left == 0
    }

    /// A tick with the sensors at `counts`. Returns the input of the plant: a force (N), or an acceleration (m/s²). A
    /// drive with pulses knows its speed (`driven_m_per_s`).
    ///
    /// # Errors
    /// The fault, and the sensor, if it concerns one.
    pub fn update<const NX: usize>(
        &mut self,
        counts: &[i32; NY],
        table: &GainTable<NX, NY>,
        gains: &StillingGains<NY>,
        driven_m_per_s: Option<f32>,
    ) -> Result<f32, Found> {
        self.ticks_left = self.ticks_left.saturating_sub(1);
        let fastest = [RATE_OF_SPEED * gains.speed_m_per_s, f32::MAX];
        self.rates.update(counts, &table.sensors, fastest, table.tick_s)?;
        let mut state = self.state(counts, table);
        state.xdot = driven_m_per_s.unwrap_or(state.xdot);
        let [low, high] = gains.rail_m;
        if (state.x < low && state.xdot < 0.0) || (state.x > high && state.xdot > 0.0) {
            return Err((Fault::Rail, None));
        }
        if f32::abs(state.xdot) > gains.speed_m_per_s {
            return Err((Fault::Speed, None));
        }
        if let Some(base) = gains.imitated.as_ref().filter(|_| driven_m_per_s.is_none())
            && !self.balance.fits(&self.in_last_tick(&state, table), base, self.applied_n, table.tick_s)
        {
            return Err((Fault::Motor, None));
        }
        let most = table.drive.largest_input();
        if gains.has_to_brake(&state, table.limits.rail_m) {
            return Ok(f32::copysign(most, -state.xdot));
        }
        let input = gains.input(&state, table.drive.pulses().is_some());
        if input.is_finite() { Ok(input) } else { Err((Fault::NotFinite, None)) }
    }

    /// The state in the middle of the last tick, with the rates that the counts say: filtered ones are too late for
    /// links that whip round.
    fn in_last_tick<const NX: usize>(
        &self,
        now: &ChainState<NY>,
        table: &GainTable<NX, NY>,
    ) -> ChainState<NY> {
        let mut state = ChainState { xdot: self.rates.latest().first().copied().unwrap_or_default(), ..*now };
        let mut rate = 0.0;
        let links = state.phi.iter_mut().zip(&mut state.phidot);
        for (&joint_rate, (phi, phidot)) in self.rates.latest().iter().skip(1).zip(links) {
            rate += joint_rate;
            (*phi, *phidot) = (*phi - 0.5 * table.tick_s * rate, rate);
        }
        state
    }

    /// The state at these counts, with the angles of the links from the vertical up to whole turns.
    fn state<const NX: usize>(&self, counts: &[i32; NY], table: &GainTable<NX, NY>) -> ChainState<NY> {
        let mut state = ChainState::upright();
        let (mut angle, mut rate) = (0.0, 0.0);
        let links = state.phi.iter_mut().zip(&mut state.phidot);
        let joints = counts.iter().zip(&table.sensors).zip(self.rates.all());
        for (((&count, sensor), joint_rate), (phi, phidot)) in joints.skip(1).zip(links) {
            angle += sensor.step * sensor.within_half_a_turn(count) as f32;
            rate += joint_rate;
            (*phi, *phidot) = (angle, rate);
        }
        let cart = counts.iter().zip(&table.sensors).next();
        state.x = cart.map_or(0.0, |(&count, sensor)| sensor.step * count as f32);
        state.xdot = self.speed_m_per_s();
        state
    }
}

impl<const NY: usize> StillingGains<NY> {
    /// Whether a base that is outward bound has to be braked with all force to turn before the soft end of the rail.
    fn has_to_brake(&self, state: &ChainState<NY>, [low, high]: [f32; 2]) -> bool {
        let left = if state.xdot > 0.0 { high - state.x } else { state.x - low };
        let from_middle = state.x - 0.5 * (low + high);
        from_middle * state.xdot > 0.0 && state.xdot * state.xdot > 2.0 * self.braking_m_per_s2 * left
    }

    /// The force (N) in this state, or the acceleration (m/s²) if the drive imposes that.
    fn input(&self, state: &ChainState<NY>, is_acceleration: bool) -> f32 {
        let law = SpringDamper { constants: [self.stiffness, self.damping], most_n: self.most_n };
        let mut wanted = law.force_n(0.0, [state.x, state.xdot]);
        if let Some(base) = &self.imitated {
            let acceleration = base.model.derivative(state, wanted, &[0.0; NY]).xdot;
            if is_acceleration {
                return acceleration;
            }
            let [mass, friction] = base.taken;
            wanted += mass * acceleration + friction * state.xdot;
        }
        let stuck = saturate(STUCK_GAIN * wanted, self.friction_n);
        let moves = f32::abs(state.xdot) > STICKS_M_PER_S;
        wanted + if moves { f32::copysign(self.friction_n, state.xdot) } else { stuck }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gains::{SENSORS, TABLE};
    use core::f32::consts::PI;

    /// Input in the first tick at these counts of the cart, in the second one of which it has moved by `moved`.
    fn input(cart: i32, moved: i32, gains: &StillingGains<SENSORS>) -> Result<f32, Found> {
        let mut counts = TABLE.sensors.map(|sensor| sensor.rest_counts);
        counts[0] = cart;
        let mut stiller = Stiller::default();
        stiller.begin(&counts, 10);
        // Long enough for the filter.
        let mut last = Ok(0.0);
        for _ in 0..40 {
            counts[0] += moved;
            last = stiller.update(&counts, &TABLE, gains, None);
        }
        last
    }

    fn counts(position_m: f32) -> i32 {
        (position_m / TABLE.sensors[0].step) as i32
    }

    #[test]
    fn spring_and_damper_pull_the_base_back_and_no_force_is_larger_than_theirs() {
        let gains = StillingGains { imitated: None, ..TABLE.stilling.unwrap() };
        let [spring_n, damper_n] = gains.most_n;
        let at_rest = input(counts(0.1), 0, &gains).unwrap();
        assert!((at_rest + 0.1 * gains.stiffness).abs() < 1e-3, "{at_rest}");
        assert_eq!(input(counts(1.7), 0, &gains), Ok(-spring_n));
        // 3 m/s to the middle, from 1.2 m.
        let inward = input(counts(-1.2), 150, &gains).unwrap();
        assert!((inward - (spring_n - damper_n)).abs() < 0.01, "{inward}");
    }

    #[test]
    fn links_that_hang_at_rest_add_nothing_to_the_force_of_a_lighter_base() {
        let gains = TABLE.stilling.unwrap();
        let base = gains.imitated.unwrap();
        // The base starts with the acceleration of a mass with links of which only their first moment resists.
        let (spring, pulled) = (-0.1 * gains.stiffness, input(counts(0.1), 0, &gains).unwrap());
        assert!(pulled < spring && pulled > spring * (1.0 + base.taken[0] / 0.018), "{pulled} {spring}");
    }

    #[test]
    fn a_base_that_would_pass_the_soft_end_is_braked_with_all_force() {
        let gains = TABLE.stilling.unwrap();
        let high = TABLE.limits.rail_m[1];
        let (step_m, speed) = (TABLE.sensors[0].step, 3.0);
        let moved = (speed * TABLE.tick_s / step_m) as i32;
        let way_m = speed * speed / (2.0 * gains.braking_m_per_s2);
        let start = |before_m: f32| counts(high - way_m - before_m) - 40 * moved;
        assert_eq!(input(start(-0.02), moved, &gains), Ok(-20.0));
        // A little further away, a weak spring and a weak damper are left alone.
        let weak = StillingGains { stiffness: 1.0, damping: 0.1, imitated: None, ..gains };
        assert_eq!(input(start(-0.02), moved, &weak), Ok(-20.0));
        assert!(input(start(0.05), moved, &weak).unwrap() > -20.0);
        // It is not braked on its way back.
        let inward =
            input(-start(-0.02) - 80 * moved, moved, &StillingGains { imitated: None, ..gains }).unwrap();
        assert!(inward > 0.0 && inward < 20.0, "{inward}");
    }

    /// Ticks until momentum and impulse no longer fit, of a base whose links hang at rest: the motor applies 5 N, and
    /// the base follows this multiple of it.
    fn misfit(share: f32) -> Option<u32> {
        let base = TABLE.stilling.unwrap().imitated.unwrap();
        let mut state = ChainState { phi: [PI; SENSORS], ..ChainState::upright() };
        let mut balance = MomentumBalance::default();
        (0..1000).find(|_| {
            let total_kg = 1.0 / base.model.inverse_mass + base.taken[0];
            state.xdot += share * 5.0 / total_kg * TABLE.tick_s;
            !balance.fits(&state, &base, 5.0, TABLE.tick_s)
        })
    }

    #[test]
    fn a_base_that_does_not_follow_the_motor_is_found() {
        assert_eq!([1.0, 0.6, 1.4].map(misfit), [None; 3]);
        let [reversed, runs_away] = [-1.0, 3.0].map(|share| misfit(share).unwrap());
        assert!(reversed < 70 && runs_away < 70, "{reversed} {runs_away}");
    }

    #[test]
    fn stilling_ends_at_its_own_limits() {
        let gains = TABLE.stilling.unwrap();
        let end = counts(gains.rail_m[1]) + 10;
        assert_eq!(input(end, 2, &gains), Err((Fault::Rail, None)));
        // Beyond the limit, but on the way back.
        assert!(input(end + 200, -2, &gains).is_ok());
        let slow = StillingGains { speed_m_per_s: 2.0, ..gains };
        assert_eq!(input(-4000, 150, &slow), Err((Fault::Speed, None)));
        assert_eq!(input(0, 250, &slow), Err((Fault::Encoder, Some(0))));
        let mut stiller = Stiller::default();
        stiller.begin(&TABLE.sensors.map(|sensor| sensor.rest_counts), 1);
        assert!(!stiller.is_over());
        let _ = stiller.update(&TABLE.sensors.map(|sensor| sensor.rest_counts), &TABLE, &gains, None);
        assert!(stiller.is_over());
    }

    #[test]
    fn dry_friction_is_made_up_for_along_the_motion_and_at_rest_along_the_wanted_force() {
        let gains = StillingGains { imitated: None, friction_n: 0.5, ..TABLE.stilling.unwrap() };
        let without = StillingGains { friction_n: 0.0, ..gains };
        let added = |cart: i32, moved: i32| {
            input(cart, moved, &gains).unwrap() - input(cart, moved, &without).unwrap()
        };
        assert!((added(0, 5) - 0.5).abs() < 1e-4 && (added(0, -5) + 0.5).abs() < 1e-4);
        assert!((added(counts(0.1), 0) + 0.5).abs() < 1e-4);
        let little = added(counts(0.001), 0);
        assert!(little < 0.0 && little > -0.1, "{little}");
    }
}
