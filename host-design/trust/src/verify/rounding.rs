//! Effect of single precision on the gains, on the poles, and on the force tick by tick.

use nalgebra::SVector;
use serde::Serialize;
use upright::control::controller::Controller;
use upright::control::encoder::CounterWidth;
use upright::control::state_feedback::saturate;
use upright::table::{
    DriveMap, ForceMap, FrictionMap, GainTable, Late, Law, LawGains, Limits, ObserverGains, PerLaw,
    SensorRow, Thresholds,
};

use super::loop_model::{LoopModel, Numbers, seen_plant};
use super::{VerifyError, radius};
use upright_design::design::Certified;
use upright_design::numerics::{Matrix, Wide, with_precision};
use upright_design::rig::{CartInput, Rig};
use upright_design::simulate::{Sample, Scenario, SimulationError, run};
use upright_design::table::{MAX_SENSORS, MAX_STATES, TableValues, widest};

/// The table's `f32` numbers compared with the exact ones.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rounding {
    /// Largest error of a gain on a state, pending force, integral or set-point, in units of the last place of its
    /// `f32`; at most 0.5 if all are correctly rounded.
    pub gain_ulp: f64,
    /// The same for the observer's gain L; none without observer.
    pub observer_ulp: Option<f64>,
    /// Spectral radius with the table's numbers minus that with the exact ones.
    pub spectral_radius_change: f64,
    /// Largest difference between the firmware's force and the same law in `f64` with exact gains, fed with the same
    /// encoder readings and applied forces, along the acceptance run (N); none if that run cannot be made.
    pub force_difference_n: Option<f64>,
    /// The same relative to the largest force of that run.
    pub force_difference_relative: Option<f64>,
}

/// Compares the table with the exact numbers; none if the table's gains are not those of the design.
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
    // In `f64` the eigenvalues of a loop this stiff are not accurate enough to show the change.
    let (single_radius, exact_radius) = with_precision(128, || {
        let radius = |numbers: Option<Numbers<Wide>>| {
            let model = |numbers| LoopModel::with_numbers(&seen_plant(certified, &numbers), &numbers);
            numbers.map(|numbers| radius(&model(numbers))).transpose()
        };
        let of_table = radius(Numbers::of_table(table, law))?;
        Ok::<_, VerifyError>((of_table, radius(Numbers::exact(rig, certified, table, law))?))
    })?;
    let change = single_radius.zip(exact_radius).map_or(0.0, |(single, exact)| single - exact);
    // The cart of a drive with pulses ends each tick at a step, which this comparison does not know.
    let has_force = rig.actuator.input() == CartInput::Force;
    let difference = if spectral_radius < 1.0 && has_force {
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
/// `f64`, which is accurate to 2⁻³⁰ of such a unit: that much is subtracted.
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
        scenario.sensing = upright_design::simulate::Sensing::FullState;
    }
    let double = in_double_precision(exact, table, law);
    let mut shadow = Shadow::new(&double, table)?;
    let (mut largest, mut peak, mut refused) = (0.0f64, 0.0f64, None);
    let fall = run(rig, table, &scenario, &mut |sample| {
        match shadow.tick(sample) {
            Ok(force) => largest = largest.max((force - sample.requested).abs()),
            Err(error) => refused = Some(error),
        }
        peak = peak.max(sample.requested.abs());
    })?;
    if let Some(error) = refused {
        return Err(error.into());
    }
    Ok((fall.is_none() && peak > 0.0).then_some((largest, peak)))
}

/// The widest table, so that the firmware's code in `f64` is compiled for one size only.
type Double = GainTable<MAX_STATES, MAX_SENSORS, f64>;

/// The table with exact gains and without limits: force and set-point come from the firmware that runs beside it,
/// which has already limited them.
fn in_double_precision(exact: &Numbers<f64>, table: &TableValues, law: Law) -> Double {
    let mut laws = PerLaw::default();
    laws[law] = Some(LawGains {
        k: widest(&exact.k.transpose()),
        k_pending: exact.k_pending,
        k_integral: exact.k_integral,
        n: exact.n,
        setpoint_step: f64::MAX,
    });
    let [acts, stays] = exact.pending;
    let observer = exact.observer.as_ref().filter(|_| table.observer.is_some());
    let sensor = |index: usize| {
        let SensorRow { state, kind, delay_s, .. } = table.sensors[index];
        let step = observer.and_then(|observer| observer.step.get(index)).copied().unwrap_or_default();
        SensorRow { state, kind, step, delay_s: delay_s.into(), ..SensorRow::default() }
    };
    GainTable {
        format: table.format,
        dimensions: table.dimensions,
        output: table.output,
        rig_hash: table.rig_hash,
        tick_s: exact.tick_s,
        sensors: core::array::from_fn(sensor),
        drive: DriveMap::Force(ForceMap { limit_n: f64::MAX, late: Late { acts, stays } }),
        laws,
        observer: observer.map(|exact| ObserverGains {
            ad: widest(&exact.ad),
            bd: widest(&exact.bd),
            l: widest(&exact.l),
        }),
        friction: table.friction.as_ref().map(|single| FrictionMap {
            axes: single.axes.map(f64::from),
            effect: single.effect.map(f64::from),
        }),
        limits: Limits::none(),
        thresholds: Thresholds::none(),
        stilling: None,
        crc: 0,
    }
}

/// The firmware's controller in `f64`, run beside the one in `f32` with the same encoder readings, set-point and
/// forces.
struct Shadow<'t> {
    controller: Controller<'t, MAX_STATES, MAX_SENSORS, f64>,
    double: &'t Double,
    table: &'t TableValues,
    last_volts: f32,
    is_started: bool,
}

impl<'t> Shadow<'t> {
    fn new(double: &'t Double, table: &'t TableValues) -> Result<Self, SimulationError> {
        let controller = Controller::with_checked(double, [CounterWidth::Bits32; MAX_SENSORS])?;
        Ok(Self { controller, double, table, last_volts: 0.0, is_started: false })
    }

    /// Returns the requested force (N), and prepares the next tick.
    fn tick(&mut self, sample: &Sample<&[f64]>) -> Result<f64, SimulationError> {
        let command = match &self.double.observer {
            None => {
                // The firmware gets the state in `f32`.
                let state = |i| sample.state.get(i).map_or(0.0, |&value| f64::from(value as f32));
                let x = SVector::from_fn(|i, _| state(i));
                if !self.is_started {
                    self.controller.start_in_state(&x);
                }
                self.controller.set_setpoint(sample.setpoint)?;
                self.controller.control_from_state(&x)
            }
            Some(_) => {
                let mut counts = [0; MAX_SENSORS];
                for (sensor, state) in self.table.measured().into_iter().enumerate() {
                    counts[sensor] =
                        libm::round(sample.state[state] / self.double.sensors[sensor].step) as i32 as u32;
                }
                if !self.is_started {
                    self.controller.start(&counts)?;
                }
                self.controller.set_setpoint(sample.setpoint)?;
                self.controller.control(&counts)
            }
        };
        self.is_started = true;
        let applied = self.applied(sample);
        self.controller.take_force(sample.requested, applied);
        self.controller.predict();
        Ok(command.requested_n)
    }

    /// The force that the firmware assumes to be applied (N): its actuator map applied to its own requested force.
    fn applied(&mut self, sample: &Sample<&[f64]>) -> f64 {
        let drive = &self.table.drive;
        let limited = saturate(sample.requested as f32, drive.largest_force_n());
        let DriveMap::Volts(motor) = drive else { return f64::from(limited) };
        let speed = sample.estimate.get(1).copied().unwrap_or_default() as f32;
        let (volts, force) = motor.volts_and_force(limited, speed, self.last_volts);
        self.last_volts = volts;
        f64::from(force)
    }
}
