//! What casts doubt on an identification that may be written nevertheless.

use upright_design::number::significant;

use crate::model::Model;
use crate::parameters::ParameterKind;

/// Nothing is written of frictions that are this many of their deviations below 0. With three, 2 of 40 sound machines
/// were refused, with four, none.
const FAR_BELOW_0: f64 = 4.0;

/// A reason to doubt an identification.
#[derive(Debug, Clone, PartialEq)]
pub enum Doubt {
    /// A term of friction was left out on request, but the recordings want it.
    LeftOut {
        /// The term.
        kind: ParameterKind,
        /// By how much -2 ln L falls with it.
        worth: f64,
    },
    /// The first and the second half of the recordings contradict each other.
    Halves {
        /// The parameters that differ.
        kinds: Vec<ParameterKind>,
        /// Their largest difference, in the deviations that follow from the scatter within the halves.
        deviations: f64,
    },
    /// The friction of the cart or of the joints at rest is larger than in motion, by these shares.
    LargerAtRest([f64; 2]),
    /// The cart never sticks: its friction is about constant only above this speed (m/s).
    NeverSticks(f64),
    /// A count of the cart's sensor, or a step of the drive that imposes its motion, is another distance than the file
    /// says.
    Travel {
        /// Travel per count, as a multiple of that of the file.
        share: f64,
        /// Its standard deviation.
        deviation: f64,
    },
    /// Total mass, first and second moments are all about this many times those of the file.
    Scale(f64),
    /// The rail is not level (rad).
    Tilted(f64),
    /// The model leaves far more of the measurements unexplained than the sensor would.
    Residual {
        /// The cart, or a joint from 1.
        channel: String,
        /// Quantisation and noise of its sensor (rms; m, rad).
        allowed: f64,
        /// Residuals of windows of 0.5 s (rms), as a multiple of that.
        times: f64,
        /// The same, in percent of the range of the motion.
        percent: f64,
    },
    /// A friction comes out negative.
    Negative {
        /// Which one.
        kind: ParameterKind,
        /// Its value without the bound at 0.
        value: f64,
        /// Its standard deviation.
        deviation: f64,
    },
    /// A value is far from that of the file.
    Far {
        /// Which one.
        kind: ParameterKind,
        /// How far, in its prior deviations.
        deviations: f64,
    },
    /// The new numbers predict a channel worse than the old file does.
    Worse {
        /// The cart, or a joint from 1.
        channel: String,
        /// Errors (rms) in percent of the range, with the old file and with the new numbers.
        percent: [f64; 2],
    },
    /// The new file predicts a channel worse than the numbers that were found.
    Rewritten {
        /// The cart, or a joint from 1.
        channel: String,
        /// Errors (rms) in percent of the range, with the numbers found and with the new file.
        percent: [f64; 2],
    },
    /// Measurements are between the counts that the sensor gives.
    BetweenCounts {
        /// The cart, or a joint from 1.
        channel: String,
        /// Share of the small differences that are no whole counts.
        share: f64,
    },
    /// Recordings that were not used are not predicted.
    Unpredicted {
        /// The cart, or a joint from 1.
        channel: String,
        /// Length of the windows (s).
        window_s: f64,
        /// Error (rms) in percent of the range.
        percent: f64,
        /// The largest that is accepted.
        most: f64,
    },
}

impl Doubt {
    /// Whether nothing is written unless the user trusts the numbers nevertheless. The law of friction alone is no
    /// reason: the deviations allow for it. Nor are measurements between two counts: a camera has none.
    pub fn needs_trust(&self) -> bool {
        match self {
            Doubt::Negative { value, deviation, .. } => *value < -FAR_BELOW_0 * deviation,
            Doubt::LargerAtRest(_)
            | Doubt::NeverSticks(_)
            | Doubt::Tilted(_)
            | Doubt::BetweenCounts { .. } => false,
            _ => true,
        }
    }

    /// What the model's law of friction says, if it is not that of the simulated machine of a rig file.
    pub(crate) fn of_friction(model: &Model) -> impl Iterator<Item = Self> {
        let larger = (model.excess != [0.0; 2]).then_some(Doubt::LargerAtRest(model.excess));
        larger.into_iter().chain(model.creeping.map(Doubt::NeverSticks))
    }
}

fn scale_text(by: f64) -> String {
    format!(
        "Masses and moments are all about {} times those of the file: the force is rather {} times what is said. Check \
         supply_v, torque_constant_n_m_per_a, resistance_ohm, gear_ratio, the pulley, and the unit of the drive.",
        significant(by, 2),
        significant(1.0 / by, 2)
    )
}

fn tilt_text(slope_rad: f64) -> String {
    let degrees = significant(slope_rad.to_degrees(), 2);
    format!("The rail rises by {degrees}°: level it, or the cart rolls off while the links balance.")
}

impl core::fmt::Display for Doubt {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Doubt::LeftOut { kind, worth } => write!(
                f,
                "The recordings want what was left out: {}, with which -2 ln L falls by {worth:.0}. The other frictions are wrong \
                 without it.",
                kind.name_and_unit().0
            ),
            Doubt::Halves { kinds, deviations } => {
                let names: Vec<String> = kinds.iter().map(|kind| kind.name_and_unit().0).collect();
                write!(
                    f,
                    "The halves of the recordings contradict each other by up to {deviations:.1} deviations: {}. The model lacks \
                     something, such as play, an eccentric encoder or another law of friction.",
                    names.join("; ")
                )
            }
            Doubt::LargerAtRest(excesses) => {
                let parts = ["cart", "joints"].into_iter().zip(excesses).filter(|(_, excess)| **excess > 0.0);
                let parts: Vec<String> = parts
                    .map(|(part, excess)| format!("of the {part} by about {:.0} %", 100.0 * excess))
                    .collect();
                write!(
                    f,
                    "Dry friction at rest is larger than in motion: {}. The dry frictions above are those in motion; give \
                     breakaway_percent in [reality].",
                    parts.join(", ")
                )
            }
            Doubt::NeverSticks(speed) => write!(
                f,
                "The cart never sticks: below about {} mm/s its dry friction falls with the speed. The law of friction is not that \
                 of the simulated machine, whose cart comes to rest where this one creeps.",
                significant(1e3 * speed, 2)
            ),
            Doubt::Travel { share, deviation } => write!(
                f,
                "A count of the cart's sensor, or a step of its drive, is {} times the travel in the file (deviation {}): measure \
                 how far the cart goes per count, and look at counts, microsteps and pulley. Masses and frictions are right only \
                 with the new travel.",
                significant(*share, 4),
                significant(*deviation, 2)
            ),
            Doubt::Scale(by) => f.write_str(&scale_text(*by)),
            Doubt::Tilted(slope_rad) => f.write_str(&tilt_text(*slope_rad)),
            Doubt::Residual { channel, allowed, times, percent } => write!(
                f,
                "The residuals of {channel} are {times:.1} times what quantisation and noise of its encoder allow ({}), and {} % \
                 of its motion: the model lacks something, or the times of the samples are not even.",
                significant(*allowed, 2),
                significant(*percent, 2)
            ),
            _ => self.fmt_of_numbers(f),
        }
    }
}

impl Doubt {
    /// What a value or a prediction casts doubt on.
    fn fmt_of_numbers(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Doubt::Negative { kind, value, deviation } => write!(
                f,
                "{} comes out negative: {} (deviation {}). The file gets 0; what makes it negative is wrong elsewhere: the scale \
                 of a sensor or of the force, the age of its readings, or the law of friction.",
                capital(*kind),
                significant(*value, 3),
                significant(*deviation, 2)
            ),
            Doubt::BetweenCounts { channel, share } => write!(
                f,
                "{:.0} % of the small differences of {channel} are no whole counts of the sensor in the file: it is another sensor, \
                 or the values were smoothed or interpolated. Smoothed values hide fast motion, and friction is found too large: \
                 record the counts.",
                100.0 * share
            ),
            Doubt::Far { kind, deviations } => write!(
                f,
                "{} is {deviations:.1} prior deviations away from the file: {}.",
                capital(*kind),
                cause(*kind)
            ),
            Doubt::Worse { channel, percent: [file, found] } => write!(
                f,
                "The new numbers predict {channel} worse than the old file does, by {} instead of {} % of its motion: the model \
                 lacks something, or the log says too little. Keep the old file.",
                significant(*found, 3),
                significant(*file, 3)
            ),
            Doubt::Rewritten { channel, percent: [found, file] } => write!(
                f,
                "The new file predicts {channel} worse than the numbers above, by {} instead of {} % of its motion: a rig file \
                 cannot say what was found, such as a negative friction or a weighed scale without a motor.",
                significant(*file, 3),
                significant(*found, 3)
            ),
            Doubt::Unpredicted { channel, window_s, percent, most } => write!(
                f,
                "Recordings that were not used are not predicted: {channel} is off by {} % of its motion over {window_s} s, at \
                 most {} % are accepted. Are they of this machine, after the same homing, and read in the same way?",
                significant(*percent, 3),
                significant(*most, 2)
            ),
            Doubt::LeftOut { .. }
            | Doubt::Halves { .. }
            | Doubt::LargerAtRest(_)
            | Doubt::NeverSticks(_)
            | Doubt::Travel { .. }
            | Doubt::Scale(_)
            | Doubt::Tilted(_)
            | Doubt::Residual { .. } => Ok(()),
        }
    }
}

/// Name of a parameter at the beginning of a sentence.
fn capital(kind: ParameterKind) -> String {
    let name = kind.name_and_unit().0;
    name[..1].to_uppercase() + &name[1..]
}

/// The likely cause of a value that is far from the file.
fn cause(kind: ParameterKind) -> &'static str {
    match kind {
        ParameterKind::TotalMass => {
            "the scale of the force or of the cart's sensor, or the masses of the file"
        }
        ParameterKind::FirstMoment(_) | ParameterKind::SecondMoment(_) | ParameterKind::Length(_) => {
            "lengths or masses of the file, the period of the samples, or the counts of a sensor"
        }
        ParameterKind::Tilt | ParameterKind::Zero(_) => {
            "the links did not hang still when they were homed, or the zero of a sensor"
        }
        ParameterKind::Delay => "a delay that the file does not state, or the age of the readings",
        ParameterKind::DeadZone => "the driver, or the supply of the file",
        ParameterKind::Travel => "counts, microsteps or pulley of the cart",
        ParameterKind::EccentricSine(_)
        | ParameterKind::EccentricCosine(_)
        | ParameterKind::TwiceSine(_)
        | ParameterKind::TwiceCosine(_) => {
            "the magnet or its distance, the counts of the sensor, or the scale of the cart's"
        }
        _ => "something rubs or is loose, or another error looks like friction",
    }
}
