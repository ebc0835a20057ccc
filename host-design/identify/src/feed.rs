//! What a host sends to a firmware that shakes its rig: the forces of the coming ticks.

use upright::protocol::message::Request;
use upright::supervision::shaking::{AHEAD, FORCES, FULL, Shaking};
use upright_design::rig::Rig;
use upright_design::table::TableValues;

use crate::channel::chain_of;
use crate::error::IdentifyError;
use crate::excite::{AIM, Excitation, aim_rad, half_rail};
use crate::log::Log;

/// Begin and end of the weak pulses along +x and against it (s).
const PULSES_S: [[f64; 2]; 2] = [[0.2, 0.32], [0.7, 0.82]];
/// Time after which the excitation begins (s).
const LEAD_S: f64 = 1.2;
/// Time over which the speed of the cart is averaged before and after a pulse (s).
const SPEED_S: f64 = 0.04;
/// A pulse has to change the speed of the cart by at least this fraction of what it would do to the file's total mass
/// as one rigid body.
const FOLLOWS: f64 = 0.1;
/// Interval at which the motion is judged, and the amplitude changed if the rig moves too much or too little (s).
const ADAPT_S: f64 = 4.0;
/// The amplitude is raised if the rig moves less than this share of what the model does: the share, the largest factor
/// at a time, and the largest factor in total.
const RAISE: (f64, f64, f64) = (0.8, 1.3, 3.0);
/// The amplitude is multiplied by this factor, or a smaller one, if the rig moves more than intended.
const LOWER: f64 = 0.7;
/// It is not raised after an interval in which the model moves less than this share of the intended motion.
const QUIET: f64 = 0.25;
/// The amplitude is lowered at once beyond this multiple of the intended motion, and then not again within a time (s).
const BEYOND: (f64, f64) = (1.1, 1.0);
/// Number of ticks by which forces are sent ahead.
const SENT_AHEAD: u32 = 3 * AHEAD as u32 / 4;
/// Largest force allowed, over the largest force of the excitation: leaves room for spring and damper.
const ROOM: f64 = 1.5;

/// The forces of one run: a short weak pulse each way, then the excitation.
#[derive(Debug, Clone)]
pub struct Feed {
    excitation: Excitation,
    period_s: f64,
    steps: Vec<f64>,
    /// Largest intended angle of a link from hanging (rad).
    aim_rad: f64,
    half_rail_m: f64,
    pulse_n: f64,
    largest_input: f64,
    /// Change of speed by a pulse according to the file, with cart and links as one rigid body (m/s).
    jolt_m_per_s: f64,
    /// Tick from which the time of the forces is counted; none before the shaking has begun.
    begun: Option<u32>,
    /// First tick whose force has not been sent yet.
    unsent: u32,
    /// Number of pulses that have been checked.
    checked: usize,
    /// Factor on the amplitude.
    gain: f64,
    /// Tick at which the motion is judged next.
    judged: u32,
    /// Tick from which the amplitude may be lowered at once.
    alert: u32,
}

impl Feed {
    /// The forces for a rig, computed from its file and its gain table.
    ///
    /// # Errors
    /// [`IdentifyError`] if the rig has no chain with encoders.
    pub fn new(rig: &Rig, table: &TableValues, duration_s: f64, seed: u64) -> Result<Self, IdentifyError> {
        let chain = chain_of(rig)?;
        let excitation = Excitation::design(rig, duration_s, seed)?;
        let period_s = rig.tick.period_s;
        // The counts of a drive with pulses follow them whatever the cart does.
        let is_moved = table.drive.pulses().is_some();
        let limit_n = table.drive.largest_input().into();
        let pulse_n = if is_moved { 0.0 } else { f64::from(table.limits.jog_force_n).min(limit_n) };
        let ticks = (duration_s / period_s) as u32;
        let peak_n =
            (0..ticks).map(|tick| excitation.sines_n(f64::from(tick) * period_s).abs()).fold(0.0, f64::max);
        let jolt_m_per_s = pulse_n * (PULSES_S[0][1] - PULSES_S[0][0]) / chain.total_mass_kg();
        Ok(Self {
            excitation,
            period_s,
            steps: rig.sensors().iter().map(|sensor| sensor.step()).collect(),
            aim_rad: aim_rad(rig),
            half_rail_m: half_rail(chain),
            pulse_n,
            largest_input: (ROOM * RAISE.2 * peak_n).max(pulse_n).min(limit_n),
            jolt_m_per_s,
            begun: None,
            unsent: 0,
            checked: if is_moved { PULSES_S.len() } else { 0 },
            gain: 1.0,
            judged: 0,
            alert: 0,
        })
    }

    /// The request that makes the firmware begin to shake.
    pub fn begin(&self) -> Request {
        Request::Shake(Shaking {
            largest_input: self.largest_input as f32,
            stiffness: self.excitation.stiffness_n_per_m as f32,
            damping: self.excitation.damping_n_s_per_m as f32,
        })
    }

    /// Tells that the shaking has begun, and that the log so far ends with tick `last`.
    pub fn begun(&mut self, last: u32) {
        self.begun = Some(last);
        self.unsent = last + 1;
        self.judged = last + self.ticks(LEAD_S + ADAPT_S);
    }

    /// Requests with the forces that are due, given the log so far.
    ///
    /// # Errors
    /// [`IdentifyError::Excitation`] if the cart does not follow the pulses.
    pub fn due(&mut self, log: &Log) -> Result<Vec<Request>, IdentifyError> {
        let (Some(begun), Some(last)) = (self.begun, log.ticks().last().map(|tick| tick.number)) else {
            return Ok(Vec::new());
        };
        self.check_pulses(log, begun)?;
        if last >= self.judged {
            self.adapt(log, begun, last);
        }
        if last >= self.alert && self.share_at(log, log.ticks().len() - 1) > BEYOND.0 {
            self.gain *= LOWER;
            self.alert = last + self.ticks(BEYOND.1);
        }
        let mut requests = Vec::new();
        // No force is sent for later ticks: spring and damper bring the cart back.
        let end = begun + self.ticks(LEAD_S + self.excitation.duration_s);
        self.unsent = self.unsent.max(last + 1);
        while self.unsent < end.min(last + SENT_AHEAD) {
            let first = self.unsent;
            let forces = core::array::from_fn(|index| {
                let part = self.force_n(f64::from(first + index as u32 - begun) * self.period_s)
                    / self.largest_input;
                (part.clamp(-1.0, 1.0) * f64::from(FULL)).round() as i8
            });
            requests.push(Request::Forces { first: first as u16, forces });
            self.unsent += FORCES as u32;
        }
        Ok(requests)
    }

    /// Whether all forces have been sent and the log contains their ticks.
    pub fn is_over(&self, log: &Log) -> bool {
        let last = log.ticks().last().map_or(0, |tick| tick.number);
        self.begun.is_some_and(|begun| last >= begun + self.ticks(LEAD_S + self.excitation.duration_s))
    }

    /// Whether these are accelerations for a drive with pulses.
    pub fn is_of_pulses(&self) -> bool {
        self.pulse_n == 0.0
    }

    /// Whether [`begun`](Self::begun) was called.
    pub fn has_begun(&self) -> bool {
        self.begun.is_some()
    }

    fn ticks(&self, seconds: f64) -> u32 {
        (seconds / self.period_s).ceil() as u32
    }

    /// Force (N) at a time since the beginning, without spring and damper.
    fn force_n(&self, time_s: f64) -> f64 {
        let is_in = |pulse: &[f64; 2]| (pulse[0]..pulse[1]).contains(&time_s);
        match PULSES_S.iter().position(is_in) {
            Some(0) => self.pulse_n,
            Some(_) => -self.pulse_n,
            None if time_s < LEAD_S => 0.0,
            None => self.gain * self.excitation.sines_n(time_s - LEAD_S),
        }
    }

    /// Checks that the cart follows the next pulse, once that is in the log.
    fn check_pulses(&mut self, log: &Log, begun: u32) -> Result<(), IdentifyError> {
        let Some([from_s, to_s]) = PULSES_S.get(self.checked) else { return Ok(()) };
        let [from, to] = [*from_s, to_s + 2.0 * SPEED_S].map(|at_s| begun + self.ticks(at_s));
        let [Some(before), Some(_)] = [from, to].map(|at| self.speed(log, at)) else { return Ok(()) };
        let sign = if self.checked == 0 { 1.0 } else { -1.0 };
        self.checked += 1;
        // By the end of the interval, light links may have swung back and stopped the cart: the largest change counts.
        let change = (from..=to)
            .filter_map(|at| Some(sign * (self.speed(log, at)? - before)))
            .fold(f64::NEG_INFINITY, f64::max);
        if change < FOLLOWS * self.jolt_m_per_s {
            return Err(IdentifyError::Excitation(format!(
                "the cart does not follow a force of {:.2} N {}: its speed changes by {:.4} m/s, {:.4} m/s are expected; check \
                 motor, belt and rail",
                self.pulse_n,
                if sign > 0.0 { "along +x" } else { "against +x" },
                change,
                self.jolt_m_per_s
            )));
        }
        Ok(())
    }

    /// Speed of the cart just before a tick (m/s), averaged over [`SPEED_S`]; none if the log lacks a tick for it.
    fn speed(&self, log: &Log, at: u32) -> Option<f64> {
        let since = at.checked_sub(self.ticks(SPEED_S))?;
        let [from, to] =
            [since, at].map(|number| log.ticks().binary_search_by_key(&number, |tick| tick.number));
        let (from, to) = (from.ok()?, to.ok()?);
        let moved = log.counts(to)[0].wrapping_sub(log.counts(from)[0]) as i16;
        Some(f64::from(moved) * self.steps[0] / (f64::from(at - since) * self.period_s))
    }

    /// Adapts the amplitude to the motion since the last call: so that, if the rig goes on moving by this multiple of
    /// what the model does, its largest motion is the intended one.
    fn adapt(&mut self, log: &Log, begun: u32, last: u32) {
        let from = self.judged.saturating_sub(self.ticks(ADAPT_S));
        self.judged = last + self.ticks(ADAPT_S);
        let first = log.ticks().partition_point(|tick| tick.number < from);
        let most = (first..log.ticks().len()).map(|index| self.share_at(log, index)).fold(0.0, f64::max);
        let time_s = |tick: u32| f64::from(tick - begun) * self.period_s - LEAD_S;
        let of_model = self.excitation.reach(time_s(from.max(begun)), time_s(last));
        let wanted = self.gain * of_model / most;
        self.gain = if most > 1.0 {
            wanted.min(LOWER * self.gain)
        } else if of_model < QUIET {
            self.gain
        } else if most > of_model {
            wanted
        } else if most < RAISE.0 * of_model {
            wanted.min(RAISE.1 * self.gain).min(RAISE.2)
        } else {
            self.gain
        };
    }

    /// How far the rig is from where it hung, as a share of the intended motion, in this row of the log.
    fn share_at(&self, log: &Log, index: usize) -> f64 {
        let deviation = |channel: usize| {
            let counts = log.counts(index)[channel].wrapping_sub(log.header.hanging[channel]) as i16;
            f64::from(counts) * self.steps[channel]
        };
        let (mut angle, mut most) = (0.0, deviation(0).abs() / (AIM.1 * self.half_rail_m));
        for joint in 1..log.channels() {
            angle += deviation(joint);
            most = most.max(angle.abs() / self.aim_rad);
        }
        most
    }
}
