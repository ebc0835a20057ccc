//! What a report is made of.

use upright_design::design::Certified;
use upright_design::motion::Transition;
use upright_design::rig::Rig;
use upright_design::table::TableValues;
use upright_plan::{Demonstration, Margin};
use upright_trust::verify::{Imperfections, TrustReport};

/// Input of a report.
#[derive(Debug, Clone, Copy)]
pub struct ReportSource<'a> {
    /// The rig.
    pub rig: &'a Rig,
    /// Its design.
    pub certified: &'a Certified,
    /// The table that is simulated.
    pub table: &'a TableValues,
    /// The trust report of this table.
    pub trust: &'a TrustReport,
    /// How much of each imperfection each law survives; empty: the page has no such part.
    pub imperfections: &'a [Imperfections],
    /// Seed of the disturbances in the runs.
    pub seed: u64,
    /// A run of the swing-up, if the rig has stored motions.
    pub swing_up: Option<&'a Demonstration>,
    /// A run from equilibrium to equilibrium, if it is wanted.
    pub route: Option<&'a Demonstration>,
    /// How hard its links may be pushed during the stored motions; empty: the page has no such part.
    pub margins: &'a [(Transition, Vec<Margin>)],
    /// Initial states along each axis of the map of the region of attraction, at least 2; usually
    /// [`super::REGION_POINTS`].
    pub region_points: usize,
    /// The command line that makes this report, shown on the page.
    pub command: &'a str,
}
