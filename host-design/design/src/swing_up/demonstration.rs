//! One run of everything: up, balance, a step of the set-point, back, and down.

use super::SwingUpError;
use super::closed_loop::{ClosedLoop, LOST_RAD, Law, deviation, law_at};
use super::motion::{Motion, SwingUp};
use super::robustness::{Spread, sample};
use super::setting::Setting;
use super::way::Way;
use crate::rig::Rig;
use crate::simulate::{Sample, Trace};

/// How long it balances between two motions, and how long it hangs at the end (s).
const PAUSE_S: f64 = 1.5;
/// Time of a move of the set-point (s).
const MOVE_S: f64 = 3.0;
/// The move (m), and the share of the rail that it may take.
const MOVE_M: f64 = 0.5;
const RAIL_SHARE: f64 = 0.5;

/// A demonstration, tick by tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Demonstration {
    /// The record. The set-point is the reference of the cart.
    pub trace: Trace,
    /// Start of each part (s).
    pub parts: Vec<(f64, &'static str)>,
    /// Whether it stood all of it and hung at rest in the end. If not, the record ends where it was lost.
    pub arrived: bool,
}

/// Runs both motions with encoders and the rig's noise, from a start that is off by 1° and 1 mm, drawn with `seed`.
/// Masses and friction are the rig's, or wrong by up to the spreads of `[swing_up]`.
///
/// # Errors
/// [`SwingUpError`] if the rig cannot be raised at all.
pub fn demonstrate(
    rig: &Rig,
    motions: &SwingUp,
    seed: u64,
    is_wrong: bool,
) -> Result<Demonstration, SwingUpError> {
    let setting = Setting::of(rig)?;
    let share = |percent: f64| if is_wrong { percent / 100.0 } else { 0.0 };
    let spread =
        Spread::of(share(setting.rules.mass_spread_percent), share(setting.rules.friction_spread_percent));
    let trial = sample(&setting, &motions.raise, &spread, seed);
    let ticks = |duration_s: f64| (duration_s / setting.tick_s).round() as usize;
    let mut show = Show {
        at: ClosedLoop::new(&setting, &trial, &motions.raise.x[0])?,
        trace: Trace::new(
            rig,
            motions.raise.steps() + motions.lower.steps() + ticks(4.0 * (PAUSE_S + MOVE_S)),
        ),
        parts: Vec::new(),
        ticks: 0,
        setting: &setting,
    };
    let travel = setting.chain.cart.travel_m;
    let far = MOVE_M.min(RAIL_SHARE * travel[1].min(-travel[0]));
    let stood = show.motion("raise", &motions.raise, Way::Up)
        && show.balance("balance", [0.0, 0.0], ticks(PAUSE_S))
        && show.balance("step", [0.0, far], ticks(MOVE_S))
        && show.balance("balance", [far, far], ticks(PAUSE_S))
        && show.balance("back", [far, 0.0], ticks(MOVE_S))
        && show.balance("balance", [0.0, 0.0], ticks(PAUSE_S))
        && show.motion("lower", &motions.lower, Way::Down)
        && show.hang(&motions.lower, ticks(PAUSE_S));
    Ok(Demonstration { trace: show.trace, parts: show.parts, arrived: stood })
}

struct Show<'a> {
    at: ClosedLoop<'a>,
    trace: Trace,
    parts: Vec<(f64, &'static str)>,
    ticks: usize,
    setting: &'a Setting<'a>,
}

impl Show<'_> {
    fn part(&mut self, name: &'static str) {
        self.parts.push((self.ticks as f64 * self.setting.tick_s, name));
    }

    /// Whether the rig still follows the law's reference and is on the rail.
    fn tick(&mut self, law: &Law<'_>) -> bool {
        let t = self.ticks as f64 * self.setting.tick_s;
        let trace = &mut self.trace;
        self.at.tick(law, &mut |at, force| {
            trace.push(&Sample {
                t,
                target: law.x[0],
                setpoint: law.x[0],
                requested: force,
                force,
                state: &at.state,
                estimate: &at.estimate,
            });
        });
        self.ticks += 1;
        deviation(&self.at.state, law.x) <= LOST_RAD + self.in_a_tick(law.x) && !self.at.is_at_the_end()
    }

    /// How far the links turn in a tick at most (rad): the state is that after the tick.
    fn in_a_tick(&self, x: &[f64]) -> f64 {
        x.iter().skip(3).step_by(2).map(|rate| rate.abs()).sum::<f64>() * self.setting.tick_s
    }

    fn motion(&mut self, name: &'static str, motion: &Motion, way: Way) -> bool {
        self.part(name);
        (0..motion.steps()).all(|k| self.tick(&law_at(self.setting, motion, way, k)))
    }

    /// Hangs with the motor off.
    fn hang(&mut self, motion: &Motion, ticks: usize) -> bool {
        self.part("hang");
        (0..ticks).all(|k| self.tick(&law_at(self.setting, motion, Way::Down, motion.steps() + k)))
    }

    /// Balances while the set-point goes smoothly from the first to the second position (m).
    fn balance(&mut self, name: &'static str, [from, to]: [f64; 2], ticks: usize) -> bool {
        self.part(name);
        let mut x = vec![0.0; self.setting.rig.states()];
        (0..ticks).all(|k| {
            // 10 s³ - 15 s⁴ + 6 s⁵: begins and ends at rest and without acceleration.
            let s = (k + 1) as f64 / ticks as f64;
            x[0] = from + (to - from) * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
            x[1] = (to - from) * 30.0 * s * s * (1.0 - s) * (1.0 - s) / (ticks as f64 * self.setting.tick_s);
            let (k, l) = (Some(&self.setting.upright_k), &self.setting.upright_l);
            self.tick(&Law { x: &x, u: 0.0, k, l })
        })
    }
}
