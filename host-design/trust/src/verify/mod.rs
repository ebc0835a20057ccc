//! The trust report: how far the loop can be trusted before a motor is connected.
//!
//! [`linear`] examines the linear model: margins, tick, noise, rounding, certificates. The rest runs the firmware's
//! own controller against nonlinear plants: [`attraction`], [`corners`], [`monte_carlo`], [`noise_run`],
//! [`coarsest_encoder`], [`imperfections()`], [`pushes()`].

mod attraction;
mod certificate;
mod continuous_margins;
mod corners;
mod covariance;
mod encoder;
mod error;
mod imperfections;
mod lag;
mod law;
mod linear;
mod loop_model;
mod margins;
mod monte_carlo;
mod needed_force;
mod noise_runs;
mod pushes;
mod report;
mod response;
mod rounding;
mod tick;
mod trial;

pub(crate) use covariance::stationary;
pub(crate) use error::chain;
pub(crate) use loop_model::{Numbers, radius};
pub(crate) use trial::{disturbed, leaning, moved_setpoint_m, waking_lean};

pub use attraction::{
    Attraction, AttractionSettings, Edge, Map, MapAxis, Tilt, WorstTilt, attraction, attraction_map,
    largest_tilts,
};
pub use certificate::Certificate;
pub use continuous_margins::continuous_margins;
pub use corners::{
    Corner, CornerSettings, Corners, Mass, MassTolerance, corners, largest_percent, mass_tolerances,
    wrong_masses,
};
pub use covariance::NoiseShare;
pub use encoder::{CoarsestEncoder, EncoderSettings, coarser, coarsest_encoder};
pub use error::VerifyError;
pub use imperfections::{
    BristleSurvival, Cure, ImperfectionSettings, Imperfections, LeftOut, RequiredSurvival, SizeRuns,
    Survival, imperfections, limit_cycle, of_size, required_imperfections, survival,
};
pub use lag::LagLimits;
pub use law::{FoundRow, LawTrust, QUANTITIES, TrustQuantity, rows};
pub use linear::{LinearReport, linear, margins_of};
pub use loop_model::{ControllerModel, LoopModel, PlantModel};
pub use margins::Margins;
pub use monte_carlo::{
    Effort, MonteCarlo, Spread, WorstCase, fewest_runs, monte_carlo, sample, spread, wilson,
};
pub use noise_runs::{Endurance, LimitShare, MeasuredRipple, NoiseRun, corner_noise, endurance, noise_run};
pub use pushes::{PushSearch, PushSurvival, pushes};
pub use report::{Check, TrustReport, brief, trust};
pub use response::Response;
pub use rounding::Rounding;
pub use tick::TickLimits;
pub use trial::{Horizon, Outcome, at_rest_disturbed, moving, trial, trials};
