//! The whole firmware, from power-up to balancing.

mod supervised;

use host_design::simulate::{Scenario, Session, SimulationError};
use supervised::{ALL_RIGS, Supervised, rig, run, table};
use upright::fault::Cause;
use upright::supervisor::State;
use upright::table::Law;

struct Stands {
    ticks: u32,
}

impl Supervised for Stands {
    type Output = (u32, State, Option<Cause>, u32);

    fn balancing<const NX: usize, const NY: usize>(self, mut session: Session<'_, NX, NY>) -> Self::Output {
        let begun = session.number();
        for _ in 0..self.ticks {
            session.step(None, &mut ());
        }
        let firmware = session.firmware();
        (begun, firmware.state(), firmware.cause(), firmware.statistics().rejected_samples)
    }
}

#[test]
fn every_rig_is_homed_checked_raised_and_balanced_by_hand() {
    for name in ALL_RIGS {
        let rig = rig(name);
        let values = table(&rig);
        for law in [Law::Lqr, Law::PolePlacement] {
            let scenario = Scenario::at_rest(&rig, law);
            let outcome: Result<_, SimulationError> = run(&rig, &values, &scenario, Stands { ticks: 10_000 });
            let (_, state, cause, rejected) = outcome.unwrap();
            assert_eq!((state, cause, rejected), (State::Balancing, None, 0), "{name} {law:?}");
        }
    }
}
