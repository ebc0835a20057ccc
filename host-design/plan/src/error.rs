//! Why there is no swing-up.

use std::path::PathBuf;

use upright_design::design::DesignError;
use upright_design::motion::{MotionError, Transition};
use upright_design::numerics::Singular;
use upright_design::plant::PlantError;
use upright_design::simulate::SimulationError;
use upright_design::study::StudyError;
use upright_design::table::NoTable;

/// Why a rig cannot be raised or lowered.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SwingUpError {
    /// A given linear model has no hanging position.
    #[error("swing-up needs a chain of links: a given [model] holds only near its equilibrium")]
    NotAChain,
    /// Something in the rig file is missing.
    #[error("swing-up needs {0}: add it to the rig file")]
    Needs(&'static str),
    /// The rig has a delay, which the law along a motion does not allow for.
    #[error("swing-up is designed for delay_ticks = 0: set it to 0 for the rig that shall raise itself")]
    Delay,
    /// More links than the search is compiled for.
    #[error("swing-up is searched for 1 to 6 links, not for {0}")]
    Links(usize),
    /// The optimisation found a solution for none of the candidates.
    #[error("{transition}: none of {tried} candidates is solved; {help}")]
    NoTrajectory {
        /// Which motion.
        transition: Transition,
        /// Candidates tried.
        tried: u64,
        /// What would help.
        help: String,
    },
    /// So many runs cannot show the required share, even if all of them arrive.
    #[error(
        "success_percent in [swing_up]: {runs} random runs judge a motion, which are too few to show {needed} %: at least \
         {fewest} are needed; give at most {most:.1}"
    )]
    TooFewRuns {
        /// Lower end needed (%).
        needed: f64,
        /// Runs made.
        runs: usize,
        /// Runs with which it could be shown.
        fewest: usize,
        /// Largest lower end that the runs can show (%).
        most: f64,
    },
    /// Not enough random runs arrive.
    #[error(
        "{transition}: {arrived} of {runs} random runs arrive, and the lower end of the 95 % interval has to be {needed} \
         % (success_percent in [swing_up]); {help}"
    )]
    NotRobust {
        /// Which motion.
        transition: Transition,
        /// Runs that arrived.
        arrived: usize,
        /// Runs made.
        runs: usize,
        /// Lower end needed (%).
        needed: f64,
        /// What would help.
        help: String,
    },
    /// A motion does not pass the independent check.
    #[error("{transition}: {what}")]
    Broken {
        /// Which motion.
        transition: Transition,
        /// The condition that does not hold.
        what: String,
    },
    /// A motion comes into the dead band of a potentiometer.
    #[error(
        "{transition}: at {at_s:.2} s, link {link} comes into the dead band of its potentiometer; {}",
        what_zero(zeros)
    )]
    DeadBand {
        /// Which motion.
        transition: Transition,
        /// The link, from 1.
        link: usize,
        /// When (s).
        at_s: f64,
        /// The lowest and the highest `sensor_zero_counts` with which this motion does not; none if there is none.
        zeros: Option<[u32; 2]>,
    },
    /// There is no stored motion.
    #[error("{}: no such file; make it with `upright {command}`", file.display())]
    NoFile {
        /// The file.
        file: PathBuf,
        /// The command that writes it.
        command: &'static str,
    },
    /// The file of the stored motions cannot be used.
    #[error("{}: {reason}; make it again with `upright {command}`", file.display())]
    BadFile {
        /// The file.
        file: PathBuf,
        /// Why.
        reason: String,
        /// The command that writes it.
        command: &'static str,
    },
    /// The stored motions belong to other values of the rig file.
    #[error(
        "the stored motions do not belong to this rig file: run `upright swing-up` again, and `upright transitions` \
         for those between other equilibria"
    )]
    Outdated,
    /// The firmware cannot be run with the motions.
    #[error("the firmware does not run: {0}")]
    Firmware(String),
    /// The rig has no gains.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// The gain table has no motions.
    #[error("the table has no motions: make them with `upright swing-up`")]
    NoMotions,
    /// No route connects the motions.
    #[error("no route leads from hanging through all of these motions and back to hanging")]
    NoRoute,
    /// The chain cannot be simulated.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The filter along the motion has no gain.
    #[error("the filter along the motion is singular: every encoder needs a step above 0")]
    Filter(#[from] Singular),
    /// The motions do not fit the gain table.
    #[error(transparent)]
    Table(#[from] NoTable),
    /// The firmware's controller cannot be simulated with them.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The runs of another process cannot be used.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// The sizes of the parts of a motion do not agree.
    #[error(transparent)]
    Motion(#[from] MotionError),
}

fn what_zero(zeros: &Option<[u32; 2]>) -> String {
    match zeros {
        Some([low, high]) => format!(
            "it does not, if the potentiometer is turned so that it reads {low} to {high} while the links hang: \
             sensor_zero_counts"
        ),
        None => {
            "the link turns by more than sensor_travel_rad: use a magnetic sensor or an encoder".to_owned()
        }
    }
}

impl SwingUpError {
    /// Whether file and rig describe a problem, but it has no solution.
    pub fn is_without_solution(&self) -> bool {
        matches!(
            self,
            Self::NoTrajectory { .. } | Self::NotRobust { .. } | Self::Broken { .. } | Self::DeadBand { .. }
        )
    }
}
