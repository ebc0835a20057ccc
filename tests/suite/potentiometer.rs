//! A potentiometer at the joint of a single pendulum: what its dead band allows, and what it refuses.

use core::f64::consts::PI;

use upright::supervision::fault::Fault;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_closed_loop::harness::{World, record, with_firmware};
use upright_design::motion::Transition;
use upright_design::rig::{LinkEncoder, Rig};
use upright_design::simulate::Scenario;
use upright_plan::{Stored, SwingUpError, hangs, refined, up_and_down, with_motions};

use crate::published::{rig, rig_path, table};
use crate::supervised::cause;

/// Travel of a potentiometer that turns without end: 340°.
const TRAVEL_RAD: f64 = 5.934;

/// The single pendulum with a potentiometer that reads this while the link hangs.
fn potentiometer(zero_counts: u32) -> Rig {
    let mut rig = rig("single-absolute");
    rig.chain_mut().unwrap().links[0].encoder =
        Some(LinkEncoder::Absolute { bits: 12, travel_rad: Some(TRAVEL_RAD), zero_counts, noise_rad: 1e-3 });
    rig
}

#[test]
fn a_link_with_a_potentiometer_is_raised_by_hand_and_balances_if_the_hand_keeps_out_of_the_dead_band() {
    let run = |zero_counts| {
        let rig = potentiometer(zero_counts);
        let values = table(&rig);
        let scenario = Scenario { duration_s: 5.0, ..Scenario::at_rest(&rig, Law::Lqr) };
        with_firmware(&values, |firmware| record(&rig, &values, &scenario, firmware)).unwrap()
    };
    // From 3100 the reading falls by 2168 counts while the hand turns the link from pi to 0; from 1000 the hand turns
    // it the other way, or the reading would fall below the lowest.
    for zero_counts in [1000, 2500, 3100, 3800] {
        let run = run(zero_counts).unwrap();
        assert!(run.fault.is_none() && run.summary.survives(), "{zero_counts}: {:?}", run.fault);
    }
}

#[test]
fn a_link_in_the_dead_band_of_its_potentiometer_is_a_fault_of_that_sensor_with_the_motor_off_too() {
    let rig = potentiometer(3000);
    let (values, scenario) = (table(&rig), Scenario::at_rest(&rig, Law::Lqr));
    // 3000 counts below hanging is the end; the last 64 are not used.
    let end_rad = 2936.0 * TRAVEL_RAD / 4096.0;
    let held_at = |away_rad: f64| {
        let run = with_firmware(&values, |target| {
            let mut world = World::new(&rig, &values, &scenario, target).unwrap();
            for _ in 0..300 {
                world.bench.hold(&[0.0, 0.0, PI + away_rad, 0.0]);
                let inputs = world.inputs();
                world.session.tick(&inputs).unwrap();
            }
            (world.session.status().state, cause(&mut world).map(|cause| (cause.fault, cause.sensor)))
        });
        run.unwrap()
    };
    assert_eq!(held_at(0.01 - end_rad), (State::Disarmed, None));
    let fault = (State::Fault, Some((Fault::Encoder, Some(1))));
    assert_eq!(held_at(-0.01 - end_rad), fault);
    assert_eq!(held_at(-0.3 - end_rad), fault);
    // On the other side of it.
    assert_eq!(held_at(1032.0 * TRAVEL_RAD / 4096.0 - 0.01), (State::Disarmed, None));
    assert_eq!(held_at(1032.0 * TRAVEL_RAD / 4096.0 + 0.01), fault);
}

#[test]
fn a_motion_into_the_dead_band_is_refused_with_the_zeros_that_keep_out_of_it_and_those_raise_the_link() {
    let stored = Stored::beside(&rig_path("single-absolute")).unwrap();
    let refused = |zero_counts| refined(&potentiometer(zero_counts), &stored).map(|_| ()).unwrap_err();
    // Upright and hanging are in the travel, but the link swings 1.4 rad beyond hanging.
    for (zero_counts, transition) in [(3800, Transition::Up), (400, Transition::Up)] {
        let SwingUpError::DeadBand { transition: found, link, zeros, at_s } = refused(zero_counts) else {
            panic!("{zero_counts}: {}", refused(zero_counts))
        };
        assert_eq!((found, link), (transition, 1), "{at_s}");
        let [low, high] = zeros.unwrap();
        assert!((2230..2300).contains(&low) && (3000..3100).contains(&high), "{low} {high}");
    }
    let text = refused(3800).to_string();
    assert!(text.contains("link 1") && text.contains("sensor_zero_counts"), "{text}");

    let rig = potentiometer(2600);
    let motions = refined(&rig, &stored).unwrap();
    let values = with_motions(&rig, table(&rig), &motions, &[]).unwrap();
    let scenario = up_and_down(&rig, &values, 0.5).unwrap();
    let run = with_firmware(&values, |firmware| record(&rig, &values, &scenario, firmware)).unwrap().unwrap();
    assert!(hangs(&run), "{:?}", run.fault);
}
