//! Coverage of the stated deviations: many simulated machines that differ from their file are shaken and identified.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use upright_design::rig::Rig;
use upright_design::study::{Study, StudyError};

use crate::channel::chain_of;
use crate::doubt::Doubt;
use crate::error::IdentifyError;
use crate::estimate::{Settings, identify};
use crate::estimated::Identification;
use crate::excite::shake_machine;
use crate::log::{DriveScale, Log};
use crate::machines::{DrawnMachine, TrueFriction};
use crate::parameters::ParameterKind;

/// Half-width of a 95 % interval, in standard deviations.
const INTERVAL: f64 = 1.96;

/// Why a coverage study failed.
#[derive(Debug, thiserror::Error)]
pub enum CoverageError {
    /// The rig cannot be identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The runs that other processes made cannot be used.
    #[error(transparent)]
    Study(#[from] StudyError),
}

/// Kind of an identified number; the numbers of all links count together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)] // `ALL` says what each is
pub enum CoveredQuantity {
    Length,
    Moment,
    TotalMass,
    CartViscous,
    JointViscous,
    CartDry,
    JointDry,
    AirDrag,
    DeadZone,
    Tilt,
    Delay,
    Travel,
    Zero,
    SensorOnce,
    SensorTwice,
    Shape,
    Scale,
}

impl CoveredQuantity {
    /// Every quantity with its name, the unit in which its error is shown, and the factor that converts
    /// [`Missed::error`] to that unit.
    pub const ALL: [(CoveredQuantity, &str, &str, f64); 17] = {
        let degrees = 180.0 / core::f64::consts::PI;
        [
            (CoveredQuantity::Length, "lengths", "%", 100.0),
            (CoveredQuantity::Moment, "moments a, J", "%", 100.0),
            (CoveredQuantity::TotalMass, "total mass", "%", 100.0),
            (CoveredQuantity::CartViscous, "viscous friction, cart", "%", 100.0),
            (CoveredQuantity::JointViscous, "viscous friction, joints", "%", 100.0),
            (CoveredQuantity::CartDry, "dry friction, cart", "%", 100.0),
            (CoveredQuantity::JointDry, "dry friction, joints", "%", 100.0),
            (CoveredQuantity::AirDrag, "air drag", "%", 100.0),
            (CoveredQuantity::DeadZone, "dead zone", "%", 100.0),
            (CoveredQuantity::Tilt, "tilt", "°", degrees),
            (CoveredQuantity::Delay, "delay", "ticks", 1.0),
            (CoveredQuantity::Travel, "travel per count, cart", "%", 100.0),
            (CoveredQuantity::Zero, "zeros", "°", degrees),
            (CoveredQuantity::SensorOnce, "sensors, once per turn", "°", degrees),
            (CoveredQuantity::SensorTwice, "sensors, twice per turn", "°", degrees),
            (CoveredQuantity::Shape, "shape: lengths, a/a_n, J/a_n", "%", 100.0),
            (CoveredQuantity::Scale, "scale: a_n", "%", 100.0),
        ]
    };

    fn of(kind: ParameterKind) -> Option<Self> {
        Some(match kind {
            ParameterKind::Length(_) => Self::Length,
            ParameterKind::FirstMoment(_) | ParameterKind::SecondMoment(_) => Self::Moment,
            ParameterKind::TotalMass => Self::TotalMass,
            ParameterKind::CartViscous => Self::CartViscous,
            ParameterKind::JointViscous(_) => Self::JointViscous,
            ParameterKind::CartDry => Self::CartDry,
            ParameterKind::JointDry(_) => Self::JointDry,
            ParameterKind::DeadZone => Self::DeadZone,
            ParameterKind::Tilt => Self::Tilt,
            ParameterKind::Delay => Self::Delay,
            ParameterKind::Zero(_) => Self::Zero,
            ParameterKind::AirDrag(_) => Self::AirDrag,
            ParameterKind::Travel => Self::Travel,
            ParameterKind::EccentricSine(_) | ParameterKind::EccentricCosine(_) => Self::SensorOnce,
            ParameterKind::TwiceSine(_) | ParameterKind::TwiceCosine(_) => Self::SensorTwice,
            ParameterKind::Presliding(_) => return None,
        })
    }

    fn is_absolute(self) -> bool {
        matches!(self, Self::Tilt | Self::Delay | Self::Zero | Self::SensorOnce | Self::SensorTwice)
    }
}

/// Error of one identified number.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Missed {
    /// The quantity that the number belongs to.
    pub quantity: CoveredQuantity,
    /// Identified minus true value: in rad for a tilt or zero, in ticks for the delay, else relative to the truth.
    pub error: f64,
    /// Stated standard deviation in the same unit; a shape and a scale have none.
    pub deviation: Option<f64>,
}

impl Missed {
    /// Absolute error in stated deviations.
    fn in_deviations(&self) -> Option<f64> {
        self.deviation.map(|deviation| self.error.abs() / deviation)
    }
}

/// Result for one machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Identified {
    /// Number of the machine, from 0; together with the seed it determines what is drawn.
    pub number: u64,
    /// Why no rig file would be written; none if one would be.
    pub refused: Option<String>,
    /// Why one would be written only on trust; a file whose travel per count is off is rightly doubted.
    pub doubted: Option<String>,
    /// Error of each number, even if no rig file would be written.
    pub missed: Vec<Missed>,
}

/// Statistics of one quantity over all machines.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CoverageRow {
    /// The quantity that is summarised.
    pub quantity: CoveredQuantity,
    /// Its name in a table.
    pub name: &'static str,
    /// Unit of `rms`, `worst` and `stated`.
    pub unit: &'static str,
    /// How many numbers were identified and would be written.
    pub count: usize,
    /// How many of them have a 95 % interval that covers the truth; none if the quantity has no intervals.
    pub covered: Option<usize>,
    /// Root mean square of the errors.
    pub rms: f64,
    /// Largest absolute error.
    pub worst: f64,
    /// Largest error in its own stated deviations; none if the quantity has no intervals.
    pub furthest: Option<f64>,
    /// Root mean square of the stated deviations; none if the quantity has no intervals.
    pub stated: Option<f64>,
}

/// Result of a coverage study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// Number of machines.
    pub machines: usize,
    /// Numbers of the machines for which no rig file would be written, and why.
    pub refused: Vec<(u64, String)>,
    /// The same of those for which one would be written only on trust.
    pub doubted: Vec<(u64, String)>,
    /// One row for each quantity that the rig has.
    pub rows: Vec<CoverageRow>,
}

/// Settings of a coverage study: how machines are drawn, and how long each is shaken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawn {
    /// Number of machines.
    pub runs: u64,
    /// Largest error of the file's masses, lengths and inertias (%).
    pub off_percent: f64,
    /// Duration of each log (s).
    pub seconds: f64,
    /// Law of the machines' dry friction.
    pub friction: TrueFriction,
    /// Seed of the machines.
    pub seed: u64,
    /// Whether to skip the check of the wiring; it is always that of the file.
    pub trust_wiring: bool,
}

/// Shakes and identifies machines that differ from `file`; `done` is called after each, from any thread.
///
/// # Errors
/// [`CoverageError`] if the rig cannot be identified, or the runs that other processes made are not of this study.
pub fn coverage(
    file: &Rig,
    drawn: &Drawn,
    study: &Study,
    done: &(dyn Fn() + Sync),
) -> Result<Coverage, CoverageError> {
    chain_of(file)?;
    let one = |number: u64| -> Result<Identified, CoverageError> {
        let found = identified(file, drawn, number);
        done();
        found
    };
    let all = study.outcomes("machines", drawn.runs, one)?;
    let written = || all.iter().filter(|one| one.refused.is_none()).flat_map(|one| &one.missed);
    let row = |(quantity, name, unit, factor): (CoveredQuantity, &'static str, &'static str, f64)| {
        let of: Vec<&Missed> = written().filter(|missed| missed.quantity == quantity).collect();
        let rms = |values: &mut dyn Iterator<Item = f64>| {
            factor * (values.map(|value| value * value).sum::<f64>() / of.len() as f64).sqrt()
        };
        let has_interval = of.iter().all(|missed| missed.deviation.is_some());
        let covers = |missed: &&&Missed| missed.deviation.is_some_and(|s| missed.error.abs() <= INTERVAL * s);
        (!of.is_empty()).then(|| CoverageRow {
            quantity,
            name,
            unit,
            count: of.len(),
            covered: has_interval.then(|| of.iter().filter(covers).count()),
            rms: rms(&mut of.iter().map(|missed| missed.error)),
            worst: factor * of.iter().map(|missed| missed.error.abs()).fold(0.0, f64::max),
            furthest: has_interval
                .then(|| of.iter().filter_map(|missed| missed.in_deviations()).fold(0.0, f64::max)),
            stated: has_interval.then(|| rms(&mut of.iter().filter_map(|missed| missed.deviation))),
        })
    };
    Ok(Coverage {
        machines: all.len(),
        refused: all.iter().filter_map(|one| Some((one.number, one.refused.clone()?))).collect(),
        doubted: all.iter().filter_map(|one| Some((one.number, one.doubted.clone()?))).collect(),
        rows: CoveredQuantity::ALL.into_iter().filter_map(row).collect(),
    })
}

/// Shakes and identifies one machine.
///
/// # Errors
/// [`IdentifyError`] if the rig has no chain with encoders; later failures are in [`Identified::refused`].
pub fn identified(file: &Rig, drawn: &Drawn, number: u64) -> Result<Identified, CoverageError> {
    let machine = DrawnMachine::draw(file, drawn.off_percent, drawn.friction, drawn.seed, number)?;
    let settings = Settings { trust_wiring: drawn.trust_wiring, ..Settings::default() };
    let known = |mut log: Log| {
        // The log states the step of the file, which is all that the board knows.
        if let (DriveScale::Steps(step_m), Some(drive)) = (&mut log.header.drive, file.actuator.pulses()) {
            *step_m = drive.step_m;
        }
        log
    };
    let found = shake_machine(file, &machine.rig, drawn.seconds, number)
        .map(known)
        .and_then(|log| identify(file, &[(PathBuf::from("log"), log)], &settings, &|_| ()));
    Ok(match found {
        Ok(found) => Identified {
            number,
            refused: found.refusal.as_ref().map(ToString::to_string),
            doubted: wrongly_doubted(&machine, &found),
            missed: missed(&machine, &found),
        },
        Err(error) => {
            Identified { number, refused: Some(error.to_string()), doubted: None, missed: Vec::new() }
        }
    })
}

/// Every reason to trust no numbers but that the travel per count is not that of the file, if so it is.
fn wrongly_doubted(machine: &DrawnMachine, found: &Identification) -> Option<String> {
    let travel = machine.truth(ParameterKind::Travel).unwrap_or(1.0);
    let is_right = |doubt: &Doubt| match doubt {
        Doubt::Travel { share, .. } => (share - travel).abs() < (travel - 1.0).abs(),
        _ => false,
    };
    let doubts = found.doubts.iter().filter(|doubt| doubt.needs_trust() && !is_right(doubt));
    let all: Vec<String> = doubts.map(ToString::to_string).collect();
    (!all.is_empty()).then(|| all.join(" "))
}

fn missed(machine: &DrawnMachine, found: &Identification) -> Vec<Missed> {
    let mut all = Vec::new();
    for estimate in &found.estimates {
        let (Some(truth), Some(quantity)) =
            (machine.truth(estimate.kind), CoveredQuantity::of(estimate.kind))
        else {
            continue;
        };
        let unit = if quantity.is_absolute() { 1.0 } else { truth };
        let error = (estimate.new - truth) / unit;
        all.push(Missed { quantity, error, deviation: Some(estimate.deviation / unit) });
    }
    // The shape is what does not depend on the scale of the force.
    let ratio = |kind: ParameterKind| Some(found.estimate(kind)?.new / machine.truth(kind)?);
    let moments = found.estimates.iter().filter_map(|estimate| match estimate.kind {
        ParameterKind::SecondMoment(link) => Some(link),
        _ => None,
    });
    let Some(last) = moments.max() else { return all };
    // If the drive imposes the cart's motion, the true values are ratios, too.
    let of_force = ratio(ParameterKind::FirstMoment(last)).filter(|_| !found.is_moved);
    let Some(scale) = of_force.or(found.is_moved.then_some(1.0)) else { return all };
    let error = |quantity: CoveredQuantity, error: f64| Missed { quantity, error, deviation: None };
    for link in 0..=last {
        let [first, second] =
            [ParameterKind::FirstMoment(link), ParameterKind::SecondMoment(link)].map(ratio);
        let first = first.filter(|_| link < last);
        let shapes = first.into_iter().chain(second).map(|ratio| ratio / scale);
        all.extend(
            shapes
                .chain(ratio(ParameterKind::Length(link)))
                .map(|ratio| error(CoveredQuantity::Shape, ratio - 1.0)),
        );
    }
    all.extend(of_force.map(|scale| error(CoveredQuantity::Scale, scale - 1.0)));
    all
}
