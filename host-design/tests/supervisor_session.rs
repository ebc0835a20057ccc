//! The whole firmware, from power-up to balancing, and back.

use host_design::design::design;
use host_design::rig::Rig;
use host_design::simulate::{Scenario, Session, SimulationError};
use host_design::table::{Gains, TableValues, WithSize, with_size};
use upright::supervisor::State;
use upright::table::Law;

fn rig(name: &str) -> Rig {
    Rig::from_path(format!("{}/../rigs/{name}.toml", env!("CARGO_MANIFEST_DIR")).as_ref()).unwrap()
}

fn table(rig: &Rig) -> TableValues {
    TableValues::of(rig, &design(rig).unwrap(), Gains::Sampled).unwrap()
}

struct Stands<'a>(&'a Rig, &'a TableValues, Scenario, u32);

impl WithSize for Stands<'_> {
    type Output = Result<(u32, State, Option<upright::fault::Cause>, u32), SimulationError>;

    fn run<const NX: usize, const NY: usize>(self) -> Self::Output {
        let Self(rig, values, scenario, ticks) = self;
        let table = values.table::<NX, NY>();
        let mut session = Session::new(rig, values, &table, &scenario)?;
        session.start(&mut ())?;
        let begun = session.number();
        for _ in 0..ticks {
            session.step(None, &mut ());
        }
        let firmware = session.firmware();
        Ok((begun, firmware.state(), firmware.cause(), firmware.statistics().rejected_samples))
    }
}

#[test]
fn every_rig_is_homed_checked_raised_and_balanced_by_hand() {
    for name in ["single-quanser-ip02", "double-quanser-dbpen", "triple-glueck-eder-kugi", "quadruple-paper"]
    {
        let rig = rig(name);
        let values = table(&rig);
        for law in [Law::Lqr, Law::PolePlacement] {
            let scenario = Scenario::at_rest(&rig, law);
            let outcome =
                with_size(values.states, values.sensors, Stands(&rig, &values, scenario, 10_000)).unwrap();
            let (begun, state, cause, rejected) = outcome.unwrap();
            println!("{name} {law:?}: begun after {begun} ticks, {rejected} rejected");
            assert_eq!((state, cause), (State::Balancing, None), "{name} {law:?}");
        }
    }
}
