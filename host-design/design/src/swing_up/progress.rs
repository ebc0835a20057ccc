//! How a search reports what it is trying.

use crate::motion::Transition;

/// Progress of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SearchStep {
    /// A stage of this many steps begins.
    Stage {
        /// Which motion.
        transition: Transition,
        /// What each step does.
        what: &'static str,
        /// Number of steps.
        steps: u64,
    },
    /// A step is done.
    Step {
        /// Fragility of the candidate; none if it was not solved.
        score: Option<f64>,
    },
}

/// Called with what is being tried, from any thread.
pub type SearchProgress<'a> = &'a (dyn Fn(SearchStep) + Sync);
