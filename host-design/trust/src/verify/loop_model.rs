//! The loop with the numbers of the table, as matrices: sampled plant, delay, observer, control law.
//!
//! Poles, margins and covariances need the law as a matrix; this is the only place where it is written a second time.
//! A simulation runs the firmware's own controller, and a test compares this model with it.

use std::borrow::Cow;

use upright::table::{DriveMap, Law};

use super::VerifyError;
use upright_design::design::{Certified, Design, Feedback, Kalman, shares, zero_order_hold};
use upright_design::numerics::{Matrix, Real, spectral_radius};
use upright_design::rig::Rig;
use upright_design::table::{MAX_STATES, TableValues};

/// The plant from command to measurement, `x⁺ = A x + B u`, `y = C x`, with pending forces as further states.
#[derive(Debug, Clone, PartialEq)]
pub struct PlantModel<R> {
    a: Matrix<R>,
    b: Matrix<R>,
    c: Matrix<R>,
    states: usize,
}

/// The controller from measurement to force, `ξ⁺ = A ξ + B y`, `u = C ξ + D y`, with set-point 0, and to what the drive
/// holds in the tick.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerModel<R> {
    a: Matrix<R>,
    b: Matrix<R>,
    /// C and D of the requested force.
    force: [Matrix<R>; 2],
    /// C and D of what the drive holds: that force, or the force of its voltage at standstill.
    held: [Matrix<R>; 2],
}

/// The closed loop `ζ⁺ = M ζ + E w + F v`, `u = C ζ + D v`, with w (N) added to what the drive holds and v to the
/// measurement. The first entries of ζ are the plant's states.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopModel<R> {
    /// M.
    pub matrix: Matrix<R>,
    /// E: where a force enters.
    pub force_input: Matrix<R>,
    /// F: where the error of each sensor enters.
    pub sensor_input: Matrix<R>,
    /// C: the requested force.
    pub force_output: Matrix<R>,
    /// D: effect of a sensor's error on the force in the same tick.
    pub sensor_to_force: Matrix<R>,
    /// What the drive holds, from ζ: the requested force, or with a motor the force of its voltage at standstill.
    pub held_output: Matrix<R>,
    /// Number of states of the plant.
    pub states: usize,
}

/// The numbers of a control law and its observer, in a working precision.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Numbers<R> {
    pub(super) k: Matrix<R>,
    pub(super) k_pending: R,
    pub(super) k_integral: R,
    pub(super) n: R,
    pub(super) observer: Option<ObserverNumbers<R>>,
    /// C of `y = C x`.
    pub(crate) c: Matrix<R>,
    pub(super) output: usize,
    pub(super) tick_s: R,
    /// Shares of the pending force: in the mean force of a tick, and left for the next one.
    pub(super) pending: [R; 2],
    /// Loss of force per speed of a motor that holds its voltage during the tick (N·s/m); 0 if the force is held.
    pub(super) braking: R,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct ObserverNumbers<R> {
    pub(super) ad: Matrix<R>,
    pub(super) bd: Matrix<R>,
    pub(super) l: Matrix<R>,
    pub(super) step: Vec<R>,
}

type LawVector = nalgebra::SVector<f32, MAX_STATES>;

impl<R: Real> Numbers<R> {
    /// The table's numbers, converted exactly; none if the table does not hold `law`.
    pub(super) fn of_table(table: &TableValues, law: Law) -> Option<Self> {
        let values = table.law(law)?;
        let (states, sensors) = (table.states(), table.sensors());
        let exact = |x: f32| R::from_f64(f64::from(x));
        let column = |x: &LawVector| Matrix::from_fn(states, 1, |i, _| exact(x[i]));
        let late = table.drive.late();
        Some(Self {
            k: column(&values.k).transpose(),
            k_pending: exact(values.k_pending),
            k_integral: exact(values.k_integral),
            n: exact(values.n),
            observer: table.observer.as_ref().map(|observer| ObserverNumbers {
                ad: Matrix::from_fn(states, states, |i, j| exact(observer.ad[(i, j)])),
                bd: column(&observer.bd),
                l: Matrix::from_fn(states, sensors, |i, j| exact(observer.l[(i, j)])),
                step: table.rows().iter().map(|sensor| exact(sensor.step)).collect(),
            }),
            c: measurement(table),
            output: table.output as usize,
            tick_s: exact(table.tick_s),
            pending: [exact(late.acts), exact(late.stays)],
            braking: match &table.drive {
                DriveMap::Volts(motor) => exact(motor.volts_per_speed) / &exact(motor.volts_per_newton),
                DriveMap::Force(_) | DriveMap::Pulses(_) => R::zero(),
            },
        })
    }

    /// The `f64` numbers from which the table's were rounded; none if the table's gains are not those of the design.
    pub(super) fn exact(rig: &Rig, certified: &Certified, table: &TableValues, law: Law) -> Option<Self> {
        let feedback = exact_law(certified, table, law)?;
        let kalman = certified.double.kalman.as_ref().filter(|_| table.observer.is_some());
        Self::of_design(rig, &certified.double, feedback, kalman)
    }

    /// The numbers of `feedback` for the plant of `design`, with the observer `kalman` or from the whole state.
    pub(crate) fn of_design(
        rig: &Rig,
        design: &Design<f64>,
        feedback: &Feedback<f64>,
        kalman: Option<&Kalman<f64>>,
    ) -> Option<Self> {
        let states = rig.states();
        let entries: Vec<R> = feedback.k.entries().iter().map(|&gain| R::from_f64(gain)).collect();
        let (k, further) = entries.split_at_checked(states)?;
        let (k_integral, k_pending) = match (further, feedback.integral) {
            ([integral, pending], _) => (integral.clone(), pending.clone()),
            ([integral], true) => (integral.clone(), R::zero()),
            ([pending], false) => (R::zero(), pending.clone()),
            _ => (R::zero(), R::zero()),
        };
        let exact = |m: &Matrix<f64>| m.map(|&entry| R::from_f64(entry));
        let sensors = rig.sensors();
        let c = if kalman.is_some() { rig.measurement() } else { Matrix::identity(states) };
        Some(Self {
            k: Matrix::column(k).transpose(),
            k_pending,
            k_integral,
            n: R::from_f64(feedback.n.unwrap_or(0.0)),
            observer: kalman.map(|kalman| ObserverNumbers {
                ad: exact(&design.ad),
                bd: exact(&design.bd),
                l: exact(&kalman.l_filter),
                step: sensors.iter().map(upright_design::rig::Sensor::step).collect(),
            }),
            c,
            output: rig.output(),
            tick_s: R::from_f64(rig.tick.period_s),
            pending: shares(rig, rig.tick.period_s).map(R::from_f64),
            braking: R::from_f64(rig.actuator.held().braking_n_s_per_m()),
        })
    }

    /// Whole ticks by which the force is late.
    pub(super) fn delay_ticks(&self) -> usize {
        usize::from(self.pending[0] >= R::one())
    }
}

/// C of `y = C x` for what the controller measures: the states with encoders, or all.
fn measurement<R: Real>(table: &TableValues) -> Matrix<R> {
    if table.observer.is_none() {
        return Matrix::identity(table.states());
    }
    let rows = table.rows();
    Matrix::from_fn(rows.len(), table.states(), |i, j| match rows[i].state as usize {
        state if state == j => R::one(),
        state if state + 1 == j => R::from_f64(-f64::from(rows[i].delay_s)),
        _ => R::zero(),
    })
}

/// The certified feedback that rounds to the table's K: that for the tick or that for continuous time.
pub(super) fn exact_law<'c>(
    certified: &'c Certified,
    table: &TableValues,
    law: Law,
) -> Option<&'c Feedback<f64>> {
    let k = &table.law(law)?.k.as_slice()[..table.states()];
    let pairs = [
        (certified.single.sampled.in_table(), certified.double.sampled.in_table()),
        (certified.single.continuous.in_table(), certified.double.continuous.in_table()),
    ];
    pairs.into_iter().find_map(|(single, double)| {
        single[law].filter(|single| single.k.entries().starts_with(k)).and(double[law])
    })
}

impl<R: Real> PlantModel<R> {
    /// The plant sampled at its tick, with a delay of whole ticks.
    pub(crate) fn held(ad: &Matrix<R>, bd: &Matrix<R>, delay_ticks: usize, c: &Matrix<R>) -> Self {
        let mut taps = vec![Matrix::zeros(ad.rows(), 1); delay_ticks];
        taps.push(bd.clone());
        Self::with_taps(ad, &taps, c)
    }

    /// `ẋ = a x + b u` sampled every `period` seconds, with a force that arrives `delay_ticks` (any real number)
    /// later. A fraction f splits the tick: the old force acts for f of it, the new one for 1 - f (Åström &
    /// Wittenmark, *Computer-Controlled Systems*, section 2.3).
    pub(crate) fn delayed(
        a: &Matrix<R>,
        b: &Matrix<R>,
        period: f64,
        delay_ticks: f64,
        c: &Matrix<R>,
    ) -> Self {
        let (ad, bd) = zero_order_hold(a, b, &R::from_f64(period));
        let (whole, fraction) = (delay_ticks.floor(), delay_ticks - delay_ticks.floor());
        if fraction == 0.0 {
            return Self::held(&ad, &bd, whole as usize, c);
        }
        let (transition, new) = zero_order_hold(a, b, &R::from_f64(period * (1.0 - fraction)));
        let (_, old) = zero_order_hold(a, b, &R::from_f64(period * fraction));
        let mut taps = vec![Matrix::zeros(a.rows(), 1); whole as usize];
        taps.extend([new, &transition * &old]);
        Self::with_taps(&ad, &taps, c)
    }

    /// `x⁺ = Ad x + Σ taps[i] u(k - i)`.
    fn with_taps(ad: &Matrix<R>, taps: &[Matrix<R>], c: &Matrix<R>) -> Self {
        let (s, past) = (ad.rows(), taps.len() - 1);
        let mut a = Matrix::zeros(s + past, s + past).with_block(0, 0, ad);
        let mut b = Matrix::zeros(s + past, 1).with_block(0, 0, &taps[0]);
        for (i, tap) in taps.iter().enumerate().skip(1) {
            a = a.with_block(0, s + i - 1, tap);
            let (row, one) = (s + i - 1, R::one());
            if i == 1 { b[(row, 0)] = one } else { a[(row, row - 1)] = one }
        }
        Self { a, b, c: c.beside(&Matrix::zeros(c.rows(), s + past - c.cols())), states: s }
    }
}

impl<R: Real> ControllerModel<R> {
    /// The firmware's tick without limits and with set-point 0:
    ///
    /// ```text
    /// x̂ = x̂⁻ + L (y - C x̂⁻),   u = -K x̂ - k_pending u_pending - k_integral z,
    /// x̂⁻⁺ = Ad x̂ + Bd (α u_pending + (1-α) u),   z⁺ = z + T x̂_output,   u_pending⁺ = β u_pending + (1-β) u
    /// ```
    ///
    /// α and β are `acts` and `stays` of the table's [`Late`](upright::table::Late). A motor gets the voltage that
    /// gives u at the estimated speed, and holds it.
    pub(crate) fn of(numbers: &Numbers<R>) -> Self {
        let (s, p) = (numbers.k.cols(), numbers.c.rows());
        let [acts, stays] = &numbers.pending;
        let observed = if numbers.observer.is_some() { s } else { 0 };
        let z = (!numbers.k_integral.is_zero()).then_some(observed);
        let pending =
            (!acts.is_zero() || !numbers.k_pending.is_zero()).then_some(observed + usize::from(z.is_some()));
        let size = observed + usize::from(z.is_some()) + usize::from(pending.is_some());

        // x̂ = from_memory ξ + from_sensors y
        let mut from_memory = Matrix::zeros(s, size);
        let mut from_sensors = Matrix::identity(s);
        if let Some(observer) = &numbers.observer {
            let l_c = &observer.l * &numbers.c;
            from_memory = from_memory.with_block(0, 0, &(&Matrix::identity(s) - &l_c));
            from_sensors = observer.l.clone();
        }
        let mut c = -&(&numbers.k * &from_memory);
        let d = -&(&numbers.k * &from_sensors);
        for (index, gain) in [(z, &numbers.k_integral), (pending, &numbers.k_pending)] {
            if let Some(index) = index {
                c[(0, index)] = c[(0, index)].clone() - gain;
            }
        }
        // A share of the pending force, and the rest of the command.
        let mixed = |share: &R, pending: Option<usize>| {
            let pick = |_, j| if Some(j) == pending { share.clone() } else { R::zero() };
            let rest = R::one() - share;
            (&Matrix::from_fn(1, size, pick) + &c.scaled(&rest), d.scaled(&rest))
        };
        let (mut a, mut b) = (Matrix::zeros(size, size), Matrix::zeros(size, p));
        if let Some(observer) = &numbers.observer {
            let now = mixed(acts, pending);
            a = a.with_block(0, 0, &(&(&observer.ad * &from_memory) + &(&observer.bd * &now.0)));
            b = b.with_block(0, 0, &(&(&observer.ad * &from_sensors) + &(&observer.bd * &now.1)));
        }
        if let Some(z) = z {
            let moved = |m: &Matrix<R>| m.block(numbers.output, 0, 1, m.cols()).scaled(&numbers.tick_s);
            a = a.with_block(z, 0, &moved(&from_memory));
            a[(z, z)] = R::one();
            b = b.with_block(z, 0, &moved(&from_sensors));
        }
        if let Some(pending) = pending {
            let left = mixed(stays, Some(pending));
            a = a.with_block(pending, 0, &left.0);
            b = b.with_block(pending, 0, &left.1);
        }
        // At a cart with one more state there is a speed to make up for.
        let with_braking = |force: &Matrix<R>, estimate: &Matrix<R>| match s {
            ..2 => force.clone(),
            _ => force + &estimate.block(1, 0, 1, estimate.cols()).scaled(&numbers.braking),
        };
        let held = [with_braking(&c, &from_memory), with_braking(&d, &from_sensors)];
        Self { a, b, force: [c, d], held }
    }
}

impl<R: Real> LoopModel<R> {
    /// Closes the loop of plant and controller.
    pub fn of(plant: &PlantModel<R>, controller: &ControllerModel<R>) -> Self {
        let (n, m) = (plant.a.rows(), controller.a.rows());
        let output = |[c, d]: &[Matrix<R>; 2]| (d * &plant.c).beside(c);
        let held_output = output(&controller.held);
        let top = &plant.a.beside(&Matrix::zeros(n, m)) + &(&plant.b * &held_output);
        let below = (&controller.b * &plant.c).beside(&controller.a);
        Self {
            matrix: top.above(&below),
            force_input: plant.b.above(&Matrix::zeros(m, 1)),
            sensor_input: (&plant.b * &controller.held[1]).above(&controller.b),
            force_output: output(&controller.force),
            sensor_to_force: controller.force[1].clone(),
            held_output,
            states: plant.states,
        }
    }

    /// The loop of the rig as it will run with the table's `law`; none if the table does not hold it.
    pub fn as_it_runs(certified: &Certified, table: &TableValues, law: Law) -> Option<Self> {
        let numbers = Numbers::of_table(table, law)?;
        Some(Self::with_numbers(&seen_plant(certified, &numbers), &numbers))
    }

    pub(super) fn with_numbers(certified: &Certified, numbers: &Numbers<R>) -> Self {
        let exact = |m: &Matrix<f64>| m.map(|&entry| R::from_f64(entry));
        let (ad, bd) = certified.double.driven_sampled(&numbers.tick_s.to_f64());
        let plant = PlantModel::held(&exact(&ad), &exact(&bd), numbers.delay_ticks(), &numbers.c);
        Self::of(&plant, &ControllerModel::of(numbers))
    }
}

/// The design with the plant that `numbers` control, from what the drive holds.
pub(super) fn seen_plant<'a, R: Real>(certified: &'a Certified, numbers: &Numbers<R>) -> Cow<'a, Certified> {
    if !numbers.braking.is_zero() {
        let mut braked = certified.clone();
        braked.double = braked.double.braked(numbers.braking.to_f64(), numbers.tick_s.to_f64());
        return Cow::Owned(braked);
    }
    let is_unseen = numbers.observer.as_ref().is_some_and(|observer| {
        let column = observer.l.block(0, 0, observer.l.rows(), 1);
        column.entries().iter().all(R::is_zero)
    });
    if is_unseen { Cow::Owned(unseen(certified, numbers.tick_s.to_f64())) } else { Cow::Borrowed(certified) }
}

/// An observer that does not correct by the first sensor takes the cart's position and speed from the commands alone:
/// where the cart really is changes nothing in the loop, so that it must not look like two poles at 1. Its rows decay
/// within a tick.
fn unseen(certified: &Certified, tick_s: f64) -> Certified {
    let mut seen = certified.clone();
    let (design, rate) = (&mut seen.double, -1.0 / tick_s);
    for cart in 0..2 {
        for column in 0..design.a.cols() {
            (design.a[(cart, column)], design.ad[(cart, column)]) = (0.0, 0.0);
        }
        design.a[(cart, cart)] = rate;
        (design.b[(cart, 0)], design.bd[(cart, 0)]) = (0.0, 0.0);
    }
    seen
}

/// Largest absolute value of a pole of the loop.
pub(crate) fn radius<R: Real>(model: &LoopModel<R>) -> Result<f64, VerifyError> {
    spectral_radius(&model.matrix).map(|radius| radius.to_f64()).map_err(|_| VerifyError::Poles)
}
