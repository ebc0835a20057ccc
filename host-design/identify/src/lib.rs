#![doc = include_str!("../README.md")]
//!
//! # Contents
//!
//! - [`Log`]: every tick's counters and drive, as a file.
//! - [`Excitation`], [`shake`]: the force that shakes the machine, and the log of a simulated one.
//! - [`shake_with`]: the log of a simulated machine that the whole firmware shakes; [`Feed`] and [`Recorder`] are the
//!   host's part of it.
//! - [`OverLine`]: the same for a machine at the other end of a serial line.
//! - [`identify`]: the wiring, then multiple shooting, then a prediction-error fit, then deviations and a verdict.
//! - [`coverage`]: how often the stated intervals cover the truth, over many machines that differ from their file.
//! - [`Realised`]: the numbers of a rig file with the identified parameters.
//!
//! # What is done with a log
//!
//! [`identify`] does this:
//!
//! 1. Wiring: a few seconds are fitted with the wiring of the file, and with motor or encoders reversed, exchanged, or
//!    with other counts. If another wiring fits better, it is named, and nothing else is done.
//! 2. Multiple shooting: in windows of 0.25 s, each with its own initial state, parameters and initial states are
//!    fitted by the Levenberg–Marquardt method. The dry friction of the cart is a bristle (Dahl's model), so that the
//!    cart sticks for a moment when it reverses; that of the joints is `c tanh(ω/ε)`.
//!    A cart that never sticks has a tanh, too, if the log shows it.
//! 3. Prediction error: an extended Kalman filter predicts each measurement from the earlier ones. Its noise
//!    intensities and the smoothing of the friction are chosen by maximum likelihood; the parameters minimise the
//!    squared innovations divided by their variances (Gauss–Newton).
//! 4. Deviations: from the normal equations, widened by a share of the change that other models of the dry friction and
//!    finer sampling cause.
//! 5. Verdict: the last 10 s (of a short log, a quarter) are held out of the fit, and predicted in windows of 0.5 s
//!    with the new rig file, which is read again for that.
//!
//! `docs/identify.md` describes the experiment, what can be identified, and how to read the answer.

#![forbid(unsafe_code)]

mod at_rest;
mod cart_force;
mod channel;
mod convert;
mod counted;
mod covariance;
mod coverage;
mod creeping;
#[cfg(test)]
mod decay;
mod doubt;
mod error;
mod estimate;
mod estimated;
mod excite;
mod feed;
mod free;
mod imposed;
mod late;
mod log;
mod machines;
mod model;
mod modes;
mod normal;
mod of_rig;
mod old_values;
mod over_line;
mod parameters;
mod prediction;
mod realise;
mod record;
mod recorder;
mod recordings;
mod rerecorded;
mod rig_file;
mod rows;
mod shooting;
mod step;
mod stribeck;
mod suspect;
mod table;
mod verdict;
mod whole;
mod window_errors;
mod wiring;
mod wiring_search;
mod with_firmware;
mod written;

pub use coverage::{
    Coverage, CoverageError, CoverageRow, CoveredQuantity, Drawn, Identified, Missed, coverage, identified,
};
pub use doubt::Doubt;
pub use error::{IdentifyError, LogError};
pub use estimate::{Settings, identify, identify_recordings};
pub use estimated::{Estimate, Identification};
pub use excite::{Excitation, shake};
pub use feed::Feed;
pub use log::{CONTACTS, DriveScale, Log, LogHeader, Tick};
pub use machines::{DrawnMachine, TrueFriction};
pub use over_line::{LineError, OverLine};
pub use parameters::ParameterKind;
pub use realise::{Realised, RealisedCart, RealisedLink};
pub use recorder::Recorder;
pub use recordings::{Recordings, RowTimes};
pub use rig_file::rig_file;
pub use table::{
    AngleReference, AngleZero, Misreading, Reading, RecordingError, RecordingTable, SaidOfTable,
};
pub use verdict::{ChannelFit, Predicted, Refusal};
pub use window_errors::{ChannelError, WindowErrors};
pub use wiring::{Wiring, WiringFault, WiringFound};
pub use with_firmware::{ShakeError, ShakingHost, checked_and_hanging, shake_with};
