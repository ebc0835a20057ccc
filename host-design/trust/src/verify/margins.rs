//! Distance of the loop from instability: margins of gain, phase and delay, sensitivity, disk margin.

use core::f64::consts::PI;

use serde::Serialize;

use super::loop_model::{ControllerModel, LoopModel, Numbers, PlantModel};
use super::response::Response;
use super::{VerifyError, radius};
use upright_design::design::Certified;
use upright_design::numerics::eigenvalues;
use upright_design::parallel;

/// Margins of a stable loop, broken at the plant's input.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[doc(alias = "margin")]
#[doc(alias = "gain_margin")]
#[doc(alias = "phase_margin")]
#[doc(alias = "allmargin")]
pub struct Margins {
    /// Smallest factor on the force below 1 at which the loop is still stable: 0 if every smaller one is stable.
    pub lowest_gain: f64,
    /// Largest factor on the force above 1; none: no limit.
    pub highest_gain: Option<f64>,
    /// Phase margin (rad), to either side; none if |L| is never 1.
    pub phase_margin_rad: Option<f64>,
    /// Delay margin (s): the smallest further delay of the force that makes the sampled loop unstable, including
    /// fractions of a tick; none if none was found.
    pub delay_margin_s: Option<f64>,
    /// Delay margin in ticks.
    pub delay_margin_ticks: Option<f64>,
    /// Frequencies at which |L| = 1 (rad/s).
    pub crossovers_rad_per_s: Vec<f64>,
    /// Ms = max |S|.
    pub peak_sensitivity: f64,
    /// Frequency of this peak (rad/s).
    pub peak_sensitivity_rad_per_s: f64,
    /// Mt = max |T|.
    pub peak_complementary_sensitivity: f64,
    /// Balanced disk margin `α = 2 / max |S - T|`: stable for every factor `(1 + δ/2) / (1 - δ/2)` on the force with
    /// complex |δ| < α (Seiler, Packard, Gahinet, *IEEE Control Systems* 40, 2020, with σ = 0).
    pub disk_margin: f64,
    /// Frequency that determines the disk margin (rad/s).
    pub disk_margin_rad_per_s: f64,
}

/// The loop's response at frequencies (rad per tick) that are dense around each of its poles; none on a pole.
pub(super) struct Grid<'m> {
    model: &'m LoopModel<f64>,
    points: Vec<(f64, Option<Response>)>,
}

impl<'m> Grid<'m> {
    /// From a hundredth of the slowest pole to Nyquist.
    pub(super) fn of(model: &'m LoopModel<f64>) -> Result<Self, VerifyError> {
        const POINTS: usize = 1500;
        let poles = eigenvalues(&model.matrix).map_err(|_| VerifyError::Poles)?;
        // The peak of a pole p is at the frequency arg p, and as wide as the distance of p from the unit circle.
        let shape = poles.iter().map(|pole| (pole.im.atan2(pole.re).abs(), (1.0 - pole.modulus()).abs()));
        let shape: Vec<(f64, f64)> = shape.collect();
        let slowest = shape.iter().map(|(angle, width)| angle.hypot(*width)).fold(PI, f64::min);
        let low = (slowest * 1e-2).max(1e-9);
        let step = (PI / low).ln() / POINTS as f64;
        let mut omegas: Vec<f64> = (0..POINTS).map(|i| low * (step * i as f64).exp()).collect();
        for (angle, width) in shape {
            omegas.extend((-8..=8).map(|i| angle + 0.25 * f64::from(i) * width));
        }
        omegas.retain(|omega| (low..PI).contains(omega));
        omegas.extend([0.0, PI]);
        omegas.sort_by(f64::total_cmp);
        let points = parallel::map(omegas, |omega| (omega, model.response(omega)));
        Ok(Self { model, points })
    }

    /// `f` at every point; NaN on a pole.
    fn values(&self, f: impl Fn(f64, &Response) -> f64) -> Vec<f64> {
        let at = |(omega, response): &(f64, Option<Response>)| {
            response.as_ref().map_or(f64::NAN, |r| f(*omega, r))
        };
        self.points.iter().map(at).collect()
    }

    /// Frequency (rad per tick) and value of the maximum of `f`; every local maximum near the top is refined by golden
    /// section.
    pub(super) fn maximum(&self, f: impl Fn(f64, &Response) -> f64) -> (f64, f64) {
        let at = |omega: f64| self.model.response(omega).map_or(f64::NAN, |r| f(omega, &r));
        let values = self.values(&f);
        let top = values.iter().copied().fold(0.0, f64::max);
        let mut best = (0.0, 0.0);
        for i in 0..values.len() {
            let (before, after) = (i.saturating_sub(1), (i + 1).min(values.len() - 1));
            if values[i] >= 0.8 * top && values[i] >= values[before] && values[i] >= values[after] {
                let refined = golden(&at, self.points[before].0, self.points[after].0);
                for candidate in [refined, (self.points[i].0, values[i])] {
                    if candidate.1 > best.1 {
                        best = candidate;
                    }
                }
            }
        }
        best
    }

    /// Frequencies at which `f` changes its sign, by bisection.
    fn zeros(&self, f: impl Fn(&Response) -> f64) -> Vec<f64> {
        let at = |omega: f64| self.model.response(omega).map_or(f64::NAN, |r| f(&r));
        let values = self.values(|_, r| f(r));
        let mut zeros = Vec::new();
        for (point, value) in self.points.windows(2).zip(values.windows(2)) {
            if value[0] * value[1] < 0.0 {
                let (mut low, mut high) = (point[0].0, point[1].0);
                while high - low > 1e-13 * high {
                    let middle = 0.5 * (low + high);
                    if middle <= low || middle >= high {
                        break;
                    }
                    if at(middle) * value[0] > 0.0 { low = middle } else { high = middle }
                }
                zeros.push(0.5 * (low + high));
            }
        }
        zeros
    }

    /// Frequencies at which |L| = 1 (rad per tick).
    fn crossovers(&self) -> Vec<f64> {
        self.zeros(|r| r.t.norm_sqr() - r.s.norm_sqr())
    }

    /// The smallest delay (ticks) that turns L to -1 at a crossover; infinite if there is none.
    fn lag_ticks(&self) -> f64 {
        let lags = self
            .crossovers()
            .into_iter()
            .filter_map(|omega| Some(self.model.response(omega)?.lag().rem_euclid(2.0 * PI) / omega));
        lags.fold(f64::INFINITY, f64::min)
    }
}

fn golden(f: &impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> (f64, f64) {
    const RATIO: f64 = 0.618_033_988_749_894_9;
    let (mut a, mut b) = (high - RATIO * (high - low), low + RATIO * (high - low));
    let (mut f_a, mut f_b) = (f(a), f(b));
    for _ in 0..60 {
        if f_a > f_b {
            (high, b, f_b) = (b, a, f_a);
            a = high - RATIO * (high - low);
            f_a = f(a);
        } else {
            (low, a, f_a) = (a, b, f_b);
            b = low + RATIO * (high - low);
            f_b = f(b);
        }
    }
    if f_a > f_b { (a, f_a) } else { (b, f_b) }
}

/// All margins of a stable loop. `numbers` are those of the controller, `tick_s` its period.
pub(super) fn margins(
    certified: &Certified,
    numbers: &Numbers<f64>,
    grid: &Grid<'_>,
    tick_s: f64,
) -> Result<Margins, VerifyError> {
    let model = grid.model;
    // 1 + g L = 0 has a real solution g where 1/L = S/T is real.
    let inverse = |r: &Response| r.s / r.t;
    let mut factors = Vec::new();
    for omega in grid.zeros(|r| inverse(r).im).into_iter().chain([0.0, PI]) {
        if let Some(response) = model.response(omega) {
            let q = inverse(&response);
            // A sign change at a pole of 1/L is not a zero.
            if q.im.abs() <= 1e-6 * q.re.abs() && -q.re > 1e-9 {
                factors.push(-q.re);
            }
        }
    }
    let lowest_gain = factors.iter().copied().filter(|&g| g < 1.0).fold(0.0, f64::max);
    let highest_gain = factors.iter().copied().filter(|&g| g > 1.0).min_by(f64::total_cmp);

    let crossovers = grid.crossovers();
    let lags = crossovers.iter().filter_map(|omega| Some(model.response(*omega)?.lag().abs()));
    let phase_margin_rad = lags.min_by(f64::total_cmp);
    let delay_margin_ticks = delay_margin(certified, numbers, tick_s, grid.lag_ticks())?;
    let sensitivity = grid.maximum(|_, r| r.s.norm_sqr().sqrt());
    let complementary = grid.maximum(|_, r| r.t.norm_sqr().sqrt());
    let disk = grid.maximum(|_, r| (r.s - r.t).norm_sqr().sqrt());
    Ok(Margins {
        lowest_gain,
        highest_gain,
        phase_margin_rad,
        delay_margin_s: delay_margin_ticks.map(|ticks| ticks * tick_s),
        delay_margin_ticks,
        crossovers_rad_per_s: crossovers.iter().map(|omega| omega / tick_s).collect(),
        peak_sensitivity: sensitivity.1,
        peak_sensitivity_rad_per_s: sensitivity.0 / tick_s,
        peak_complementary_sensitivity: complementary.1,
        disk_margin: 2.0 / disk.1,
        disk_margin_rad_per_s: disk.0 / tick_s,
    })
}

/// The smallest further delay (ticks) at which the sampled loop is unstable, to a relative 1e-9. `guess` is what the
/// phase at the crossovers suggests (ticks).
fn delay_margin(
    certified: &Certified,
    numbers: &Numbers<f64>,
    tick_s: f64,
    guess: f64,
) -> Result<Option<f64>, VerifyError> {
    /// Each tick of delay is one more state, and the eigenvalues of n states take n³ operations.
    const MOST_TICKS_AS_STATES: f64 = 40.0;
    if !guess.is_finite() {
        return Ok(None);
    }
    if guess > MOST_TICKS_AS_STATES {
        return long_delay_margin(certified, numbers, tick_s, guess).map(Some);
    }
    let unstable = |further: f64| Ok(radius(&delayed_loop(certified, numbers, tick_s, further))? >= 1.0);
    let step = (guess / 24.0).max(1e-3);
    first_failure(unstable, |i| step * f64::from(i), 72, 1e-9).map(|found| found.map(|bracket| bracket.1))
}

/// A long delay margin (ticks). Whole ticks only turn the phase: the model has the fraction of a tick, and its
/// crossovers say how many ticks remain. These depend little on the fraction, so a few rounds agree.
fn long_delay_margin(
    certified: &Certified,
    numbers: &Numbers<f64>,
    tick_s: f64,
    mut ticks: f64,
) -> Result<f64, VerifyError> {
    for _ in 0..50 {
        let fraction = ticks.fract();
        let model = delayed_loop(certified, numbers, tick_s, fraction);
        let next = fraction + Grid::of(&model)?.lag_ticks();
        if (next - ticks).abs() <= 1e-9 * ticks {
            break;
        }
        ticks = next;
    }
    Ok(ticks)
}

/// The loop with a further delay of the force, in ticks.
pub(super) fn delayed_loop(
    certified: &Certified,
    numbers: &Numbers<f64>,
    tick_s: f64,
    further: f64,
) -> LoopModel<f64> {
    let delay = numbers.delay_ticks() as f64 + further;
    let (a, b) = certified.double.driven();
    let plant = PlantModel::delayed(&a, &b, tick_s, delay, &numbers.c);
    LoopModel::of(&plant, &ControllerModel::of(numbers))
}

/// The first of `point(1)`, `point(2)` … `point(most)` that fails, narrowed by bisection to a relative width
/// `tolerance`: (last that holds, first that fails).
pub(super) fn first_failure(
    fails: impl Fn(f64) -> Result<bool, VerifyError>,
    point: impl Fn(u32) -> f64,
    most: u32,
    tolerance: f64,
) -> Result<Option<(f64, f64)>, VerifyError> {
    for i in 1..=most {
        if fails(point(i))? {
            let (mut holds, mut failed) = (point(i - 1), point(i));
            while (failed - holds).abs() > tolerance * failed.abs().max(holds.abs()) {
                let middle = 0.5 * (holds + failed);
                if fails(middle)? { failed = middle } else { holds = middle }
            }
            return Ok(Some((holds, failed)));
        }
    }
    Ok(None)
}
