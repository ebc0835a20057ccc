//! The gain table on the host: its values for any number of states, as a firmware table and as Rust source.

mod any_size;
mod source;
mod supervision;
mod supervision_source;
mod write;

use nalgebra::{SMatrix, SVector};
use serde::Serialize;
use upright::control::actuator::MotorMap;
use upright::control::observer::ObserverGains;
use upright::control::state_feedback::LawGains;
use upright::table::{Build, GainTable, TABLE_FORMAT};

use crate::design::{Certified, Feedback, detection_thresholds, setpoint_step};
use crate::numerics::Matrix;
use crate::rig::{Motor, PlantDescription, Rig};

pub use any_size::{MAX_MODEL_SENSORS, MAX_SENSORS, MAX_STATES, WithSize, with_firmware_size, with_size};
pub use source::gains_source;
pub use supervision::{LimitValues, ThresholdValues};
pub use write::{WriteError, write_atomically};

/// Which gains go into a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gains {
    /// Those designed for the tick.
    Sampled,
    /// Those designed for continuous time: to see what the tick does to them.
    Continuous,
}

/// What goes into the table, with the numbers of states and sensors not yet in the type.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TableValues {
    /// Name of the rig.
    #[serde(skip)]
    pub rig: String,
    /// Hash of the rig file's values.
    #[serde(skip)]
    pub rig_hash: u64,
    /// Number of states.
    pub states: usize,
    /// Number of sensors.
    pub sensors: usize,
    /// Index of the state that follows the set-point.
    pub output: usize,
    /// Control period (s).
    pub tick_s: f32,
    /// 0 or 1.
    pub delay_ticks: u32,
    /// Largest force (N).
    pub force_limit_n: f32,
    /// LQR gains, with integral action if the rig file asks for it.
    pub lqr: Option<LawValues>,
    /// Pole placement gains.
    pub pole_placement: Option<LawValues>,
    /// The observer.
    pub observer: Option<ObserverValues>,
    /// The motor.
    pub motor: Option<MotorValues>,
    /// What the supervisor enforces.
    pub limits: LimitValues,
    /// When encoders and motor are at fault.
    pub thresholds: ThresholdValues,
}

/// Gains of one law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawValues {
    /// K, one per state.
    pub k: Vec<f32>,
    /// Gain on the force on its way.
    pub k_pending: f32,
    /// Gain on the integral.
    pub k_integral: f32,
    /// N; 0 if no constant force can hold the output away from 0.
    pub n: f32,
    /// Largest change of the governed set-point per tick (m).
    pub setpoint_step: f32,
}

/// Model and gain of the observer.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObserverValues {
    /// Ad by rows.
    pub ad: Vec<Vec<f32>>,
    /// Bd.
    pub bd: Vec<f32>,
    /// L (filter form) by rows.
    pub l: Vec<Vec<f32>>,
    /// Which state each sensor measures.
    pub measured: Vec<u32>,
    /// Travel per count of each sensor.
    pub step: Vec<f32>,
}

/// The motor as the cart sees it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MotorValues {
    /// V/N at standstill.
    pub volts_per_newton: f32,
    /// V·s/m of back-EMF.
    pub volts_per_speed: f32,
    /// V.
    pub dead_zone_v: f32,
    /// V per tick.
    pub slew_v_per_tick: f32,
    /// V.
    pub supply_v: f32,
}

/// A design that does not make a table.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoTable {
    /// The rig file asks for no control law.
    #[error("the rig file asks for no control law: add [lqr] or [pole_placement]")]
    NoLaw,
    /// A value is outside the range of single precision.
    #[error("{what} = {value:e} does not fit into single precision: choose units in which it does")]
    Range {
        /// Which value.
        what: &'static str,
        /// Its `f32`.
        value: f32,
    },
    /// Dimensions the firmware's types are not made for.
    #[error(
        "no gain table for {states} states and {sensors} sensors: a table holds up to {MAX_STATES} states; the controller of \
         a chain needs encoders on the cart and on every link, that of a model 1 to {MAX_MODEL_SENSORS} sensors"
    )]
    Size {
        /// States of the rig.
        states: usize,
        /// Sensors of the rig.
        sensors: usize,
    },
}

impl TableValues {
    /// The table of a certified design: every gain already rounded once to `f32`.
    ///
    /// # Errors
    /// [`NoTable`] if there is no law, a value does not fit, or the firmware has no types of this size.
    pub fn of(rig: &Rig, design: &Certified, gains: Gains) -> Result<Self, NoTable> {
        let states = rig.states();
        let single = &design.single;
        let laws = match gains {
            Gains::Sampled => single.sampled.in_table(),
            Gains::Continuous => single.continuous.in_table(),
        };
        // The governor's step comes from the loop the law was designed for.
        let steps = design
            .double
            .sampled
            .in_table()
            .map(|law| law.and_then(|law| setpoint_step(rig, &design.double.ad, &design.double.bd, law)));
        let law = |index: usize| laws[index].map(|law| LawValues::of(law, states, steps[index])).transpose();
        let (lqr, pole_placement) = (law(0)?, law(1)?);
        if lqr.is_none() && pole_placement.is_none() {
            return Err(NoTable::NoLaw);
        }
        let observer = single.kalman.as_ref().map(|kalman| ObserverValues {
            ad: rows(&single.ad),
            bd: single.bd.entries().to_vec(),
            l: rows(&kalman.l_filter),
            measured: rig.sensors().iter().map(|sensor| sensor.state as u32).collect(),
            step: kalman.steps.entries().to_vec(),
        });
        let sensors = match (&observer, &rig.plant) {
            (Some(observer), _) => observer.step.len(),
            (None, PlantDescription::Chain(chain)) => chain.links.len() + 1,
            (None, PlantDescription::Model(_)) => 1,
        };
        let steps = design.double.kalman.as_ref().map_or(&[][..], |kalman| kalman.steps.entries());
        let detection = detection_thresholds(rig, &design.double);
        let values = Self {
            rig: rig.name.clone(),
            rig_hash: rig.hash(),
            states,
            sensors,
            output: rig.output(),
            tick_s: finite("tick.period_s", rig.tick.period_s as f32)?,
            delay_ticks: u32::from(rig.tick.delay_ticks),
            force_limit_n: rig
                .force_limit_n()
                .map_or(Ok(f32::MAX), |limit| finite("actuator.force_limit_n", limit as f32))?,
            lqr,
            pole_placement,
            observer,
            motor: rig
                .actuator
                .motor
                .as_ref()
                .map(|motor| MotorValues::of(motor, rig.tick.period_s))
                .transpose()?,
            limits: LimitValues::of(rig, sensors, steps)?,
            thresholds: ThresholdValues::of(sensors, detection.as_ref()),
        };
        if let PlantDescription::Chain(chain) = &rig.plant
            && sensors != chain.links.len() + 1
        {
            return Err(NoTable::Size { states, sensors });
        }
        with_size(states, sensors, Checksum(&values)).ok_or(NoTable::Size { states, sensors })?;
        Ok(values)
    }

    /// The same table with a governor that lets every step of the set-point through, as the paper simulates.
    pub fn without_governor(mut self) -> Self {
        for law in [&mut self.lqr, &mut self.pole_placement].into_iter().flatten() {
            law.setpoint_step = f32::MAX;
        }
        self
    }

    /// The same table with nothing that the supervisor could find anything by: no thresholds, no limits. What happens to a
    /// rig without it.
    pub fn without_detection(mut self) -> Self {
        let sensors = self.sensors;
        self.thresholds = ThresholdValues::of(sensors, None);
        let limits = &mut self.limits;
        (limits.rail_m, limits.angle_rad, limits.speed_m_per_s) = ([-f32::MAX, f32::MAX], f32::MAX, f32::MAX);
        limits.saturated_ticks = u32::MAX;
        self
    }

    /// The firmware's table, sealed with its checksum.
    ///
    /// # Panics
    /// If `NX` and `NY` are not the table's numbers of states and sensors.
    pub fn table<const NX: usize, const NY: usize>(&self) -> GainTable<NX, NY> {
        assert_eq!((self.states, self.sensors), (NX, NY), "states and sensors of the table");
        let law = |law: &Option<LawValues>| {
            law.as_ref().map(|law| LawGains {
                k: SVector::from_fn(|i, _| law.k[i]),
                k_pending: law.k_pending,
                k_integral: law.k_integral,
                n: law.n,
                setpoint_step: law.setpoint_step,
            })
        };
        let mut table = GainTable {
            format: TABLE_FORMAT,
            states: NX as u32,
            sensors: NY as u32,
            output: self.output as u32,
            rig_hash: self.rig_hash,
            tick_s: self.tick_s,
            delay_ticks: self.delay_ticks,
            force_limit_n: self.force_limit_n,
            lqr: law(&self.lqr),
            pole_placement: law(&self.pole_placement),
            observer: self.observer.as_ref().map(|observer| ObserverGains {
                ad: SMatrix::from_fn(|i, j| observer.ad[i][j]),
                bd: SVector::from_fn(|i, _| observer.bd[i]),
                l: SMatrix::from_fn(|i, j| observer.l[i][j]),
                measured: core::array::from_fn(|i| observer.measured[i]),
                step: SVector::from_fn(|i, _| observer.step[i]),
            }),
            motor: self.motor.map(|motor| MotorMap {
                volts_per_newton: motor.volts_per_newton,
                volts_per_speed: motor.volts_per_speed,
                dead_zone_v: motor.dead_zone_v,
                slew_v_per_tick: motor.slew_v_per_tick,
                supply_v: motor.supply_v,
            }),
            limits: self.limits.limits(),
            thresholds: self.thresholds.thresholds(),
            crc: 0,
        };
        table.crc = table.checksum();
        table
    }

    /// The checksum the firmware expects.
    pub fn crc(&self) -> u32 {
        // Values are only made for sizes that exist.
        with_size(self.states, self.sensors, Checksum(self)).unwrap_or(0)
    }

    /// What a firmware image for this table is built for.
    pub fn build(&self) -> Build {
        Build { rig_hash: self.rig_hash, tick_s: self.tick_s }
    }
}

struct Checksum<'a>(&'a TableValues);

impl WithSize for Checksum<'_> {
    type Output = u32;

    fn run<const NX: usize, const NY: usize>(self) -> u32 {
        self.0.table::<NX, NY>().crc
    }
}

impl LawValues {
    /// K holds the gains on the states, then on the integral and on the force on its way, where there are such.
    fn of(law: &Feedback<f32>, states: usize, setpoint_step: Option<f64>) -> Result<Self, NoTable> {
        let entries: Vec<f32> =
            law.k.entries().iter().map(|&gain| finite("a gain", gain)).collect::<Result<_, _>>()?;
        let (k, further) = entries.split_at(states);
        let (k_integral, k_pending) = match (further, law.integral) {
            ([integral, pending], _) => (*integral, *pending),
            ([integral], true) => (*integral, 0.0),
            ([pending], false) => (0.0, *pending),
            _ => (0.0, 0.0),
        };
        Ok(Self {
            k: k.to_vec(),
            k_pending,
            k_integral,
            n: finite("the precompensation gain", law.n.unwrap_or(0.0))?,
            setpoint_step: setpoint_step.map_or(f32::MAX, |step| step as f32),
        })
    }
}

impl MotorValues {
    fn of(motor: &Motor, period_s: f64) -> Result<Self, NoTable> {
        let speed = motor.volts_per_speed();
        Ok(Self {
            volts_per_newton: finite("the motor's voltage per force", (motor.resistance_ohm / speed) as f32)?,
            volts_per_speed: finite("the motor's voltage per speed", speed as f32)?,
            dead_zone_v: finite("actuator.dead_zone_v", motor.dead_zone_v as f32)?,
            slew_v_per_tick: motor
                .slew_v_per_s
                .map_or(Ok(f32::MAX), |slew| finite("actuator.slew_v_per_s", (slew * period_s) as f32))?,
            supply_v: finite("actuator.supply_v", motor.supply_v as f32)?,
        })
    }
}

fn rows(matrix: &Matrix<f32>) -> Vec<Vec<f32>> {
    matrix.row_slices().map(<[f32]>::to_vec).collect()
}

fn finite(what: &'static str, value: f32) -> Result<f32, NoTable> {
    if value.is_finite() { Ok(value) } else { Err(NoTable::Range { what, value }) }
}
