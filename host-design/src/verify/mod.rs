//! The trust report: how far the loop can be trusted before a motor is connected.

mod attraction;
mod corners;
mod encoder;
mod monte_carlo;
mod noise_runs;
mod trial;

pub use attraction::{
    Attraction, AttractionSettings, Axis, Edge, Map, Tilt, WorstTilt, attraction, attraction_map,
};
pub use corners::{
    Corner, CornerSettings, Corners, Mass, MassTolerance, corners, largest_percent, mass_tolerances,
    wrong_masses,
};
pub use encoder::{CoarsestEncoder, EncoderSettings, coarser, coarsest_encoder};
pub use monte_carlo::{MonteCarlo, Spread, WorstCase, monte_carlo, sample, wilson};
pub use noise_runs::{Endurance, NoiseRun, endurance, noise_run};
pub use trial::{Disturbance, Horizon, Outcome, Unverifiable, trial};
