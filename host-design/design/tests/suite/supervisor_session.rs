//! The whole firmware, from power-up to balancing.

use crate::supervised::{ALL_RIGS, Supervised, rig, run, table};
use upright::supervision::fault::Cause;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_design::simulate::{Scenario, Session, SimulationError};

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

/// What the firmware decided in every tick from the first of balancing on, as bits.
struct Bits {
    ticks: u32,
}

impl Supervised for Bits {
    type Output = Vec<(State, u32, u32)>;

    fn balancing<const NX: usize, const NY: usize>(self, mut session: Session<'_, NX, NY>) -> Self::Output {
        let tick = |session: &mut Session<'_, NX, NY>| {
            session.step(None, &mut ());
            let controller = session.firmware().controller();
            (session.firmware().state(), controller.acting().to_bits(), controller.estimate()[2].to_bits())
        };
        (0..self.ticks).map(|_| tick(&mut session)).collect()
    }
}

#[test]
fn counters_that_wrap_on_the_way_change_no_bit() {
    let rig = rig("double-quanser-dbpen");
    let values = table(&rig);
    let bits = |counter_start: u32, tilt: f64| {
        let mut scenario =
            Scenario { counter_start, force_noise_n: 0.3, ..Scenario::at_rest(&rig, Law::Lqr) };
        scenario.start[2] = tilt;
        run(&rig, &values, &scenario, Bits { ticks: 3000 }).unwrap()
    };
    let plain = bits(0, 0.01);
    assert!(plain.iter().all(|(state, ..)| *state == State::Balancing));
    for counter_start in [u32::MAX, u32::MAX - 60_000, 0x7fff_ffff, 0x7ff0, 1] {
        assert!(bits(counter_start, 0.01) == plain, "counters from {counter_start:#x}");
    }
    assert!(bits(0, 0.012) != plain, "another start is another run");
}
