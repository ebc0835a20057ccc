//! The values of a gain table.

use core::ops::{Deref, DerefMut};

use nalgebra::SVector;
use serde::{Serialize, Serializer};
use upright::table::{
    DriveMap, ForceMap, GainTable, Late, LawGains, MotionLimits, MotorMap, ObserverGains, PerLaw, Resize,
    SensorRow, StepMap, TABLE_FORMAT,
};

use super::any_size::{MAX_STATES, WidestTable, WithSize, widest, with_size};
use super::error::{NoTable, finite};
use super::swing_up::SwingUpValues;
use super::{contents, friction, stilling, supervision};
use crate::design::{Certified, Design, Feedback, Uncertified, detection_thresholds, setpoint_step, shares};
use crate::rig::{AccelerationDrive, Actuator, Motor, PlantDescription, Rig};

/// Which gains go into a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gains {
    /// Those designed for the tick.
    Sampled,
    /// Those designed for continuous time: to see the effect of the tick on them.
    Continuous,
}

/// The firmware's table in the largest size, with the numbers of states and sensors in use. Entries beyond these are
/// 0; in limits and thresholds they are those of [`Limits::none`](upright::table::Limits::none) and
/// [`Thresholds::none`](upright::table::Thresholds::none). Only [`table`](Self::table) computes the checksum.
#[derive(Debug, Clone, PartialEq)]
pub struct TableValues {
    /// Name of the rig.
    pub rig: String,
    /// The swing-up, if the rig has one.
    pub swing_up: Option<SwingUpValues>,
    widest: WidestTable,
}

/// Gains of one law in the largest size.
pub type LawValues = LawGains<MAX_STATES>;

/// Gives access to all fields of the table, for reading and for changes.
impl Deref for TableValues {
    type Target = WidestTable;

    fn deref(&self) -> &Self::Target {
        &self.widest
    }
}

impl DerefMut for TableValues {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.widest
    }
}

/// All fields except those that identify the table.
impl Serialize for TableValues {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let fields = self.fields();
        let shown = fields.iter().filter(|field| !["format", "rig_hash"].contains(&field.name));
        contents::object(shown, serializer)
    }
}

impl TableValues {
    /// The table of a certified design: every gain already rounded once to `f32`.
    ///
    /// # Errors
    /// [`NoTable`] if there is no law, a value does not fit, or the firmware has no types of this size.
    pub fn of(rig: &Rig, design: &Certified, gains: Gains) -> Result<Self, NoTable> {
        Self::of_rounded(rig, &design.single, &design.double, gains)
    }

    /// The table of an uncertified design, with the gains for the tick: for trials.
    pub fn of_uncertified(rig: &Rig, design: &Uncertified) -> Result<Self, NoTable> {
        Self::of_rounded(rig, &design.single, &design.double, Gains::Sampled)
    }

    fn of_rounded(
        rig: &Rig,
        single: &Design<f32>,
        double: &Design<f64>,
        gains: Gains,
    ) -> Result<Self, NoTable> {
        let states = rig.states();
        let laws = laws(rig, single, double, gains)?;
        let sensors = match (&single.kalman, &rig.plant) {
            (Some(kalman), _) => kalman.steps.entries().len(),
            (None, PlantDescription::Chain(chain)) => chain.links.len() + 1,
            (None, PlantDescription::Model(_)) => 1,
        };
        let steps = double.kalman.as_ref().map_or(&[][..], |kalman| kalman.steps.entries());
        let rounded = single.kalman.as_ref().map_or(&[][..], |kalman| kalman.steps.entries());
        let detection = detection_thresholds(rig, double);
        let friction = friction::friction_map(rig, double)?;
        let limits = supervision::limits(rig, steps)?;
        let widest = GainTable {
            format: TABLE_FORMAT,
            dimensions: [states as u32, sensors as u32],
            output: rig.output() as u32,
            rig_hash: rig.hash(),
            tick_s: finite("tick.period_s", rig.tick.period_s as f32)?,
            sensors: supervision::sensors(rig, sensors, steps, rounded),
            drive: drive_map(rig)?,
            laws,
            observer: single.kalman.as_ref().map(|kalman| ObserverGains {
                ad: widest(&single.ad),
                bd: widest(&single.bd),
                l: widest(&kalman.l_filter),
            }),
            friction,
            limits,
            thresholds: supervision::thresholds(detection.as_ref()),
            stilling: stilling::gains(rig, limits.rail_m)?,
            crc: 0,
        };
        let values = Self { rig: rig.name.clone(), swing_up: None, widest };
        if let Some(chain) = rig.chain()
            && sensors != chain.links.len() + 1
        {
            return Err(NoTable::Size { states, sensors });
        }
        with_size(states, sensors, Compiled).ok_or(NoTable::Size { states, sensors })?;
        Ok(values)
    }

    /// The same table with a governor that lets every step of the set-point pass, as in the paper's simulations.
    pub fn without_governor(mut self) -> Self {
        for law in self.laws.present_mut() {
            law.setpoint_step = f32::MAX;
        }
        self
    }

    /// The same table with no thresholds and no limits, so that the supervisor detects nothing: for runs that
    /// show what happens to a rig without a supervisor.
    pub fn without_detection(mut self) -> Self {
        self = self.without_tests();
        let limits = &mut self.limits;
        (limits.rail_m, limits.angle_rad, limits.speed_m_per_s) = ([-f32::MAX, f32::MAX], f32::MAX, f32::MAX);
        limits.saturated_ticks = u32::MAX;
        if let Some(swing_up) = &mut self.swing_up {
            swing_up.limits = MotionLimits::none();
        }
        self
    }

    /// The same table without the tests of the innovation, but with all limits.
    #[must_use]
    pub fn without_tests(mut self) -> Self {
        self.thresholds = supervision::thresholds(None);
        if let Some(swing_up) = &mut self.swing_up {
            swing_up.thresholds = supervision::thresholds(None);
        }
        self
    }

    /// Number of states.
    pub fn states(&self) -> usize {
        self.widest.dimensions[0] as usize
    }

    /// Number of sensors.
    pub fn sensors(&self) -> usize {
        self.widest.dimensions[1] as usize
    }

    /// The rows of the sensors that the table has.
    pub fn rows(&self) -> &[SensorRow] {
        &self.widest.sensors[..self.sensors()]
    }

    /// The states that the sensors measure; those of a chain are the positions, with or without observer.
    pub fn measured(&self) -> Vec<usize> {
        self.rows().iter().map(|sensor| sensor.state as usize).collect()
    }

    /// The firmware's table, complete with its checksum.
    ///
    /// # Panics
    /// If `NX` and `NY` are not the table's numbers of states and sensors.
    pub fn table<const NX: usize, const NY: usize>(&self) -> GainTable<NX, NY> {
        assert_eq!(self.states(), NX, "states of the table");
        self.padded()
    }

    /// As [`table`](Self::table), with room for more states than the table has: those stay 0, so that the others are
    /// the same to the bit (up to the sign of a 0).
    ///
    /// # Panics
    /// If `NX` is too small, or `NY` is not the table's number of sensors.
    pub fn padded<const NX: usize, const NY: usize>(&self) -> GainTable<NX, NY> {
        assert!(self.states() <= NX && self.sensors() == NY, "states and sensors of the table");
        let mut table: GainTable<NX, NY> = self.widest.resized();
        table.dimensions[0] = NX as u32;
        table.crc = table.checksum();
        table
    }

    /// Names, documentation and values of all fields.
    pub(super) fn fields(&self) -> Vec<contents::Field> {
        contents::in_use(&self.widest, self.states(), self.sensors())
    }

    /// Names, documentation and values of all fields of the swing-up, and its checksum, if there is one.
    pub(super) fn swing_up_fields(&self) -> Option<(Vec<contents::Field>, u32)> {
        let swing_up = self.swing_up.as_ref()?;
        with_size(self.states(), self.sensors(), SwingUpFields(swing_up))
    }

    /// The checksum the firmware expects.
    pub fn crc(&self) -> u32 {
        contents::checksum(&self.fields())
    }

    /// The words of which [`crc`](Self::crc) is the checksum.
    pub(super) fn words(&self) -> Vec<u32> {
        contents::words(&self.fields())
    }

    /// Bytes of its values.
    pub fn bytes(&self) -> usize {
        contents::bytes(&self.fields())
    }

    /// The checksum the firmware expects of its swing-up, if there is one.
    pub fn swing_up_crc(&self) -> Option<u32> {
        self.swing_up_fields().map(|(_, crc)| crc)
    }
}

/// Whether a size is compiled at all.
struct Compiled;

impl WithSize for Compiled {
    type Output = ();

    fn run<const NX: usize, const NY: usize, const N: usize>(self) {}
}

struct SwingUpFields<'a>(&'a SwingUpValues);

impl WithSize for SwingUpFields<'_> {
    type Output = (Vec<contents::Field>, u32);

    fn run<const NX: usize, const NY: usize, const N: usize>(self) -> Self::Output {
        let others = self.0.transitions();
        let table = self.0.table::<NY, N>(&others);
        (contents::fields(&table), table.crc)
    }
}

/// The gains of the laws that the rig asks for.
fn laws(
    rig: &Rig,
    single: &Design<f32>,
    double: &Design<f64>,
    gains: Gains,
) -> Result<PerLaw<Option<LawValues>>, NoTable> {
    let laws = match gains {
        Gains::Sampled => single.sampled.in_table(),
        Gains::Continuous => single.continuous.in_table(),
    };
    // The governor's step comes from the loop the law was designed for.
    let steps = double.sampled.in_table().map(|law| setpoint_step(rig, double, law?));
    let gains = |law| laws[law].map(|gains| law_gains(gains, rig.states(), steps[law])).transpose();
    let laws = PerLaw::from_fn(gains).transpose()?;
    if laws.present().next().is_none() { Err(NoTable::NoLaw) } else { Ok(laws) }
}

/// K of a design holds the gains on the states, then on the integral, then on the pending force, if there are any.
fn law_gains(law: &Feedback<f32>, states: usize, setpoint_step: Option<f64>) -> Result<LawValues, NoTable> {
    let entries: Vec<f32> =
        law.k.entries().iter().map(|&gain| finite("a gain", gain)).collect::<Result<_, _>>()?;
    let (k, further) = entries.split_at(states);
    let (k_integral, k_pending) = match (further, law.integral) {
        ([integral, pending], _) => (*integral, *pending),
        ([integral], true) => (*integral, 0.0),
        ([pending], false) => (0.0, *pending),
        _ => (0.0, 0.0),
    };
    Ok(LawGains {
        k: SVector::from_fn(|state, _| k.get(state).copied().unwrap_or_default()),
        k_pending,
        k_integral,
        n: finite("the precompensation gain", law.n.unwrap_or(0.0))?,
        setpoint_step: setpoint_step.map_or(f32::MAX, |step| step as f32),
    })
}

fn drive_map(rig: &Rig) -> Result<DriveMap, NoTable> {
    let period_s = rig.tick.period_s;
    let [acts, stays] = shares(rig, period_s).map(|share| share as f32);
    let limit_n = rig.actuator.largest_force_n();
    let limit_n = limit_n.map_or(Ok(f32::MAX), |n| finite("actuator.force_limit_n", n as f32))?;
    let force = ForceMap { limit_n, late: Late { acts, stays } };
    Ok(match &rig.actuator {
        Actuator::Force(_) => DriveMap::Force(force),
        Actuator::Motor(motor, _) => DriveMap::Volts(motor_map(motor, force, period_s)?),
        Actuator::Pulses(drive) => DriveMap::Pulses(step_map(drive, period_s)?),
    })
}

/// The drive with pulses as the controller sees it, with ticks of `period_s`: travel per pulse (m), limits (m/s², m/s),
/// lag and lead (s).
///
/// # Errors
/// [`NoTable::Range`] if a value is outside the range of single precision.
pub fn step_map(drive: &AccelerationDrive, period_s: f64) -> Result<StepMap, NoTable> {
    Ok(StepMap {
        step_m: finite("actuator.step_m", drive.step_m as f32)?,
        acceleration_limit_m_per_s2: finite(
            "actuator.acceleration_limit_m_per_s2",
            drive.acceleration_limit_m_per_s2 as f32,
        )?,
        speed_limit_m_per_s: drive
            .largest_speed_m_per_s(period_s)
            .map_or(Ok(f32::MAX), |limit| finite("actuator.speed_limit_m_per_s", limit as f32))?,
        lag_s: finite("the drive's lag", drive.lag_s() as f32)?,
        lead_s: finite("the drive's lead", drive.lead_s(period_s) as f32)?,
    })
}

fn motor_map(motor: &Motor, force: ForceMap, period_s: f64) -> Result<MotorMap, NoTable> {
    let volts_per_newton = motor.resistance_before_bridge_ohm() / motor.newtons_per_amp();
    Ok(MotorMap {
        force,
        volts_per_newton: finite("the motor's voltage per force", volts_per_newton as f32)?,
        volts_per_speed: finite("the motor's voltage per speed", motor.volts_per_speed() as f32)?,
        dead_zone_v: finite("actuator.dead_zone_v", motor.dead_zone_v as f32)?,
        slew_v_per_tick: motor
            .slew_v_per_s
            .map_or(Ok(f32::MAX), |slew| finite("actuator.slew_v_per_s", (slew * period_s) as f32))?,
        supply_v: finite("actuator.supply_v", motor.supply_v as f32)?,
    })
}
