//! The whole firmware, from power-up to balancing.

use crate::published::table;
use crate::supervised::{ALL_RIGS, balancing, cause, rejected, rig, tick};
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_closed_loop::harness::{FirmwareTick, record, with_firmware};
use upright_design::simulate::Scenario;

#[test]
fn every_rig_is_homed_checked_raised_and_balanced_by_hand() {
    for name in ALL_RIGS {
        let rig = rig(name);
        let values = table(&rig);
        for law in [Law::Lqr, Law::PolePlacement] {
            let scenario = Scenario::at_rest(&rig, law);
            let outcome = balancing(&rig, &values, &scenario, |harness| {
                for _ in 0..10_000 {
                    tick(harness);
                }
                (cause(harness), rejected(harness), harness.session.status().state)
            });
            assert_eq!(outcome.unwrap(), (None, 0, State::Balancing), "{name} {law:?}");
        }
    }
}

#[test]
fn counters_that_wrap_on_the_way_change_no_bit() {
    let rig = rig("double-quanser-dbpen");
    let values = table(&rig);
    // What the firmware decided in every tick from the first tick of balancing on, as bits.
    let bits = |counter_start: u32, tilt: f64| -> Vec<FirmwareTick> {
        let mut scenario =
            Scenario { counter_start, force_noise_n: 0.3, ..Scenario::at_rest(&rig, Law::Lqr) };
        scenario.start[2] = tilt;
        scenario.duration_s = 3000.0 * rig.tick.period_s;
        let recording = with_firmware(&values, |target| record(&rig, &values, &scenario, target));
        recording.unwrap().unwrap().ticks
    };
    let plain = bits(0, 0.01);
    assert!(plain.len() > 3000 && plain.iter().all(|tick| tick.state == State::Balancing));
    for counter_start in [u32::MAX, u32::MAX - 60_000, 0x7fff_ffff, 0x7ff0, 1] {
        assert!(bits(counter_start, 0.01) == plain, "counters from {counter_start:#x}");
    }
    assert!(bits(0, 0.012) != plain, "another start is another run");
}
