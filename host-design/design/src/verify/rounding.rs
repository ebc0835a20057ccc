//! What single precision does: to the gains, to the poles, and to the force tick by tick.

use serde::Serialize;
use upright::control::actuator::MotorMap;
use upright::table::Law;

use super::loop_model::{LoopModel, Numbers};
use super::{VerifyError, radius};
use crate::design::Certified;
use crate::numerics::{Matrix, Wide, with_precision};
use crate::rig::Rig;
use crate::simulate::{Sample, Scenario, run};
use crate::table::TableValues;

/// The table's `f32` against exact numbers.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rounding {
    /// Largest error of a gain on a state, the force on its way, the integral or the set-point, in units of the last place
    /// of its `f32`; at most 0.5 if all are correctly rounded.
    pub gain_ulp: f64,
    /// The same for the observer's gain L; none without observer.
    pub observer_ulp: Option<f64>,
    /// Spectral radius with the table's numbers less that with the exact ones.
    pub spectral_radius_change: f64,
    /// Largest difference between the firmware's force and the same law in `f64` with exact gains, fed with the same
    /// encoder readings and applied forces, along the acceptance run (N); none if that run cannot be made.
    pub force_difference_n: Option<f64>,
    /// The same relative to the largest force of that run.
    pub force_difference_relative: Option<f64>,
}

/// None if the table's gains are not those of the design.
pub(super) fn rounding(
    rig: &Rig,
    certified: &Certified,
    table: &TableValues,
    law: Law,
    spectral_radius: f64,
) -> Result<Option<Rounding>, VerifyError> {
    let (Some(exact), Some(single)) =
        (Numbers::<f64>::exact(rig, certified, table, law), Numbers::<f64>::of_table(table, law))
    else {
        return Ok(None);
    };
    let mut gain_ulp = largest_ulp(&exact.k, &single.k);
    for (exact, single) in
        [(exact.k_pending, single.k_pending), (exact.k_integral, single.k_integral), (exact.n, single.n)]
    {
        gain_ulp = gain_ulp.max(ulp(exact, single));
    }
    let observers = exact.observer.as_ref().zip(single.observer.as_ref());
    // In f64 the eigenvalues of a loop this stiff are not good enough to see the change.
    let (single_radius, exact_radius) = with_precision(128, || {
        let radius = |numbers: Option<Numbers<Wide>>| {
            numbers.map(|numbers| radius(&LoopModel::with_numbers(certified, &numbers))).transpose()
        };
        let of_table = radius(Numbers::of_table(table, law))?;
        Ok::<_, VerifyError>((of_table, radius(Numbers::exact(rig, certified, table, law))?))
    })?;
    let change = single_radius.zip(exact_radius).map_or(0.0, |(single, exact)| single - exact);
    let difference = if spectral_radius < 1.0 {
        force_difference(rig, table, law, &exact, spectral_radius)?
    } else {
        None
    };
    Ok(Some(Rounding {
        gain_ulp,
        observer_ulp: observers.map(|(exact, single)| largest_ulp(&exact.l, &single.l)),
        spectral_radius_change: change,
        force_difference_n: difference.map(|(absolute, _)| absolute),
        force_difference_relative: difference.map(|(absolute, peak)| absolute / peak),
    }))
}

fn largest_ulp(exact: &Matrix<f64>, single: &Matrix<f64>) -> f64 {
    exact
        .entries()
        .iter()
        .zip(single.entries())
        .map(|(&exact, &single)| ulp(exact, single))
        .fold(0.0, f64::max)
}

/// `|single - exact|` in units of the last place of an `f32` in the binade of `exact`. `exact` is itself rounded to
/// `f64`, which is good to 2⁻³⁰ of such a unit: that much is taken off.
fn ulp(exact: f64, single: f64) -> f64 {
    const SLACK: f64 = 1.0 / (1u64 << 30) as f64;
    if exact == single {
        return 0.0;
    }
    let unit = libm::scalbn(1.0, libm::ilogb(exact).max(-126) - 23);
    ((single - exact).abs() / unit - SLACK).max(0.0)
}

/// (largest |Δu|, largest |u|) along the acceptance run.
fn force_difference(
    rig: &Rig,
    table: &TableValues,
    law: Law,
    exact: &Numbers<f64>,
    spectral_radius: f64,
) -> Result<Option<(f64, f64)>, VerifyError> {
    let slowest_s = -rig.tick.period_s / spectral_radius.ln();
    let mut scenario = Scenario::acceptance(rig, law, slowest_s);
    if exact.observer.is_none() {
        scenario.sensing = crate::simulate::Sensing::FullState;
    }
    let mut shadow = Shadow::new(exact, table);
    let (mut largest, mut peak) = (0.0f64, 0.0f64);
    let fall = run(rig, table, &scenario, &mut |sample| {
        let force = shadow.tick(sample);
        largest = largest.max((force - sample.requested).abs());
        peak = peak.max(sample.requested.abs());
    })?;
    Ok((fall.is_none() && peak > 0.0).then_some((largest, peak)))
}

/// The law in `f64`, beside the firmware: sees its encoder readings, set-point and applied forces.
struct Shadow<'a> {
    numbers: &'a Numbers<f64>,
    motor: Option<MotorMap>,
    force_limit: f32,
    last_volts: f32,
    predicted: Option<Matrix<f64>>,
    integral: f64,
    pending: f64,
}

impl<'a> Shadow<'a> {
    fn new(numbers: &'a Numbers<f64>, table: &TableValues) -> Self {
        let motor = table.motor.map(|motor| MotorMap {
            volts_per_newton: motor.volts_per_newton,
            volts_per_speed: motor.volts_per_speed,
            dead_zone_v: motor.dead_zone_v,
            slew_v_per_tick: motor.slew_v_per_tick,
            supply_v: motor.supply_v,
        });
        Self {
            numbers,
            motor,
            force_limit: table.force_limit_n,
            last_volts: 0.0,
            predicted: None,
            integral: 0.0,
            pending: 0.0,
        }
    }

    /// The force asked for; then prepares the next tick.
    fn tick(&mut self, sample: &Sample<&[f64]>) -> f64 {
        let numbers = self.numbers;
        let states = numbers.k.cols();
        let x = match &numbers.observer {
            // What the firmware converts to f32.
            None => Matrix::from_fn(states, 1, |i, _| f64::from(sample.state[i] as f32)),
            Some(observer) => {
                let counts = numbers.measured.iter().zip(&observer.step);
                let y: Vec<f64> =
                    counts.map(|(&state, step)| libm::round(sample.state[state] / step) * step).collect();
                let predicted = self.predicted.take().unwrap_or_else(|| {
                    // At the start: positions as read, rates 0.
                    let mut x = Matrix::zeros(states, 1);
                    for (&state, &y) in numbers.measured.iter().zip(&y) {
                        x[(state, 0)] = y;
                    }
                    x
                });
                let e = Matrix::from_fn(y.len(), 1, |i, _| y[i] - predicted[(numbers.measured[i], 0)]);
                &predicted + &(&observer.l * &e)
            }
        };
        let force = numbers.n * sample.setpoint
            - (&numbers.k * &x)[(0, 0)]
            - numbers.k_pending * self.pending
            - numbers.k_integral * self.integral;
        let applied = self.applied(sample);
        let during_this_tick = if numbers.delay_ticks == 1 { self.pending } else { applied };
        let moved = numbers.tick_s * (x[(numbers.output, 0)] - sample.setpoint);
        if (sample.requested - applied) * (-numbers.k_integral * moved) <= 0.0 {
            self.integral += moved;
        }
        self.pending = applied;
        self.predicted = numbers
            .observer
            .as_ref()
            .map(|observer| &(&observer.ad * &x) + &observer.bd.scaled(&during_this_tick));
        force
    }

    /// The force that the firmware takes for applied: its own actuator map on its own request.
    fn applied(&mut self, sample: &Sample<&[f64]>) -> f64 {
        let limited = upright::control::state_feedback::saturate(sample.requested as f32, self.force_limit);
        let Some(motor) = &self.motor else { return f64::from(limited) };
        let speed = sample.estimate.get(1).copied().unwrap_or_default() as f32;
        let (volts, force) = motor.drive(limited, speed, self.last_volts);
        self.last_volts = volts;
        f64::from(force)
    }
}
