//! What an identification finds.

use crate::doubt::Doubt;
use crate::parameters::ParameterKind;
use crate::realise::Realised;
use crate::record::Record;
use crate::recordings::RowTimes;
use crate::verdict::{ChannelFit, Refusal};
use crate::window_errors::WindowErrors;
use crate::wiring::WiringFound;

/// An identified parameter, in the unit of its [`ParameterKind`].
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Which parameter it is.
    pub kind: ParameterKind,
    /// Value of the rig file, or the start value that is assumed if the file has none.
    pub old: f64,
    /// Identified value.
    pub new: f64,
    /// Standard deviation of the identified value.
    pub deviation: f64,
    /// Values from the first and the second half of the recordings.
    pub halves: Option<[f64; 2]>,
    /// Whether the log says little about it: the deviation exceeds half of the prior one.
    pub held_by_prior: bool,
}

impl Estimate {
    /// Whether a machine can have this value: a number, and no negative mass, length or friction.
    pub fn is_possible(&self) -> bool {
        let is_number = self.new.is_finite() && self.deviation.is_finite();
        let signs = match self.kind {
            ParameterKind::TotalMass
            | ParameterKind::FirstMoment(_)
            | ParameterKind::Length(_)
            | ParameterKind::SecondMoment(_)
            | ParameterKind::Presliding(_)
            | ParameterKind::Travel => self.new > 0.0,
            ParameterKind::CartViscous
            | ParameterKind::JointViscous(_)
            | ParameterKind::CartDry
            | ParameterKind::JointDry(_)
            | ParameterKind::AirDrag(_)
            | ParameterKind::DeadZone => self.new >= 0.0,
            _ => true,
        };
        is_number && signs
    }
}

/// Result of an identification.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Identification {
    /// Duration of the logs without their gaps (s).
    pub seconds: f64,
    /// Number of ticks that are missing in the logs.
    pub lost_ticks: u64,
    /// The times of the rows, of tables.
    pub rows: Option<RowTimes>,
    /// Largest angle of a link from hanging (rad).
    pub largest_angle_rad: f64,
    /// Result of the wiring check; none if the wiring was taken on trust.
    pub wiring: Option<WiringFound>,
    /// All parameters that are identified; none if the wiring is wrong.
    pub estimates: Vec<Estimate>,
    /// Time from one sample to the next (s).
    pub sample_s: f64,
    /// Correlations of the estimates, row by row.
    pub correlations: Vec<f64>,
    /// How well the model explains each channel.
    pub channels: Vec<ChannelFit>,
    /// Whether the times are the ticks of the firmware, and the counts those of the rig file.
    pub is_log: bool,
    /// Whether the drive is known, and with it the scale of masses and frictions.
    pub is_driven: bool,
    /// Whether the drive imposes the cart's motion: then the scale of masses and frictions is that of the file, and the
    /// cart's own are not seen.
    pub is_moved: bool,
    /// Errors of predictions of parts of the recordings, each with numbers from the other parts; only without a drive.
    pub left_out: Vec<WindowErrors>,
    /// Errors of predictions of other recordings.
    pub predicted: Vec<WindowErrors>,
    /// The numbers for the rig file; none if the wiring is wrong or the numbers are not physical.
    pub realised: Option<Realised>,
    /// Whole ticks, or rows of a table, by which the drive was shifted, because it acts that much later than the file
    /// says; the estimate of the delay includes them.
    pub late_ticks: i64,
    /// Delay that the rig file states (ticks).
    pub delay_ticks: u8,
    /// What casts doubt on the numbers.
    pub doubts: Vec<Doubt>,
    /// Why no rig file may be written; none if it may.
    pub refusal: Option<Refusal>,
}

impl Identification {
    /// What a record says of itself, with nothing identified yet.
    pub(crate) fn of_record(record: &Record) -> Self {
        Self {
            seconds: record.seconds(),
            lost_ticks: 0,
            rows: None,
            largest_angle_rad: record.largest_angle(),
            wiring: None,
            estimates: Vec::new(),
            sample_s: record.dt_s,
            correlations: Vec::new(),
            channels: Vec::new(),
            is_log: true,
            is_driven: true,
            is_moved: record.is_moved,
            left_out: Vec::new(),
            predicted: Vec::new(),
            realised: None,
            late_ticks: 0,
            delay_ticks: 0,
            doubts: Vec::new(),
            refusal: None,
        }
    }

    /// Adds the ticks by which the drive was shifted to the estimate of the delay.
    pub(crate) fn add_to_delay(&mut self) {
        let late = self.late_ticks as f64;
        let delays = self.estimates.iter_mut().filter(|estimate| estimate.kind == ParameterKind::Delay);
        delays.for_each(|delay| delay.new += late);
    }

    /// The estimate of a parameter, if it was identified.
    pub fn estimate(&self, kind: ParameterKind) -> Option<&Estimate> {
        self.estimates.iter().find(|estimate| estimate.kind == kind)
    }

    /// The first doubt because of which nothing is written, unless the user trusts the numbers.
    pub fn doubted(&self) -> Option<&Doubt> {
        self.doubts.iter().find(|doubt| doubt.needs_trust())
    }

    /// The delay that the rig file should state (ticks), if that differs from the one it states.
    pub fn other_delay(&self) -> Option<u8> {
        let delay = self.estimate(ParameterKind::Delay)?;
        match self.delay_ticks {
            0 if delay.new > 0.5 + 2.0 * delay.deviation => Some(1),
            1 if delay.new < -0.5 - 2.0 * delay.deviation => Some(0),
            _ => None,
        }
    }
}
