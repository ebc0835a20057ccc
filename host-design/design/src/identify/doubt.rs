//! What casts doubt on an identification that may be written nevertheless.

use super::model::Model;
use super::parameters::ParameterKind;
use crate::number::significant;

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
    /// A step of the drive that imposes the cart's motion moves it by another distance than the file says.
    Travel {
        /// Travel per step, as a multiple of that of the file.
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
    },
}

impl Doubt {
    /// What the model's law of friction says, if it is not that of the simulated machine of a rig file.
    pub(super) fn of_friction(model: &Model) -> impl Iterator<Item = Self> {
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
                "A step moves the cart by {} times step_m (deviation {}): correct step_m, the driver's microsteps, or the \
                 pulley in the file. Lengths and moments are wrong until then.",
                significant(*share, 4),
                significant(*deviation, 2)
            ),
            Doubt::Scale(by) => f.write_str(&scale_text(*by)),
            Doubt::Tilted(slope_rad) => f.write_str(&tilt_text(*slope_rad)),
            Doubt::Residual { channel, allowed, times } => write!(
                f,
                "The residuals of {channel} are {times:.1} times what quantisation and noise of its encoder allow ({}): the model \
                 lacks something, or the times of the samples are not even.",
                significant(*allowed, 2)
            ),
        }
    }
}
