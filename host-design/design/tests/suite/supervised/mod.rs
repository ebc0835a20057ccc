//! The rigs of `rigs/`, each with the firmware's types of its size, brought to balance.

// Each test program uses some of these.
#![allow(dead_code)]

use upright_design::design::design;
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, Session, SimulationError};
use upright_design::table::{Gains, TableValues};

pub(crate) const ALL_RIGS: [&str; 4] =
    ["single-quanser-ip02", "double-quanser-dbpen", "triple-glueck-eder-kugi", "quadruple-paper"];

pub(crate) fn rig(name: &str) -> Rig {
    Rig::from_path(format!("{}/../../rigs/{name}.toml", env!("CARGO_MANIFEST_DIR")).as_ref()).unwrap()
}

pub(crate) fn table(rig: &Rig) -> TableValues {
    TableValues::of(rig, &design(rig).unwrap(), Gains::Sampled).unwrap()
}

/// What is done with a rig that balances.
pub(crate) trait Supervised {
    type Output;

    fn balancing<const NX: usize, const NY: usize>(self, session: Session<'_, NX, NY>) -> Self::Output;
}

/// Brings the rig from hanging to balance at the start of `scenario`, then goes on with `what`.
pub(crate) fn run<S: Supervised>(
    rig: &Rig,
    values: &TableValues,
    scenario: &Scenario,
    what: S,
) -> Result<S::Output, SimulationError> {
    fn sized<S: Supervised, const NX: usize, const NY: usize>(
        rig: &Rig,
        values: &TableValues,
        scenario: &Scenario,
        what: S,
    ) -> Result<S::Output, SimulationError> {
        let table = values.table::<NX, NY>();
        let mut session = Session::new(rig, values, &table, scenario)?;
        session.start(&mut ())?;
        Ok(what.balancing(session))
    }
    match values.sensors {
        2 => sized::<S, 4, 2>(rig, values, scenario, what),
        3 => sized::<S, 6, 3>(rig, values, scenario, what),
        4 => sized::<S, 8, 4>(rig, values, scenario, what),
        _ => sized::<S, 10, 5>(rig, values, scenario, what),
    }
}
