//! Pushes by hand: from which force the controller falls, and from which the firmware turns the motor off.

use upright::supervision::fault::Fault;
use upright::table::Law;
use upright_design::simulate::FallKind;
use upright_trust::verify::pushes;

use crate::published::rig_and_table;

#[test]
fn the_firmware_ends_no_later_than_the_controller_falls_and_without_its_tests_by_a_limit() {
    let (rig, table) = rig_and_table("single-quanser-ip02");
    let by_firmware = pushes(rig, table, Law::Lqr).unwrap();
    assert_eq!(by_firmware.len(), 4, "two durations at the cart and at the end of the link");
    let untested = pushes(rig, &table.clone().without_tests(), Law::Lqr).unwrap();
    for (push, untested) in by_firmware.iter().zip(&untested) {
        let [falls, off, limited] =
            [push.falls_at_n, push.turned_off_at_n, untested.turned_off_at_n].map(Option::unwrap);
        assert!(off <= limited && limited <= 1.05 * falls, "{push:?} {untested:?}");
        let by_limit = [Fault::Angle, Fault::Rail, Fault::Speed, Fault::Saturated].map(FallKind::MotorOff);
        assert!(by_limit.contains(&untested.ended_by.unwrap()), "{untested:?}");
    }
    // A push ten times as long is survived with a smaller force; the cart, with a larger one than the link.
    let falls: Vec<f64> = by_firmware.iter().filter_map(|push| push.falls_at_n).collect();
    let [cart, cart_long, link, link_long] = falls[..] else { panic!("{falls:?}") };
    assert!(cart_long < cart && link_long < link && link < cart);
}

#[test]
fn a_firmware_without_limits_stays_on_as_long_as_its_controller() {
    let (rig, table) = rig_and_table("single-quanser-ip02");
    for push in pushes(rig, &table.clone().without_detection(), Law::Lqr).unwrap() {
        assert_eq!(push.turned_off_at_n, push.falls_at_n, "{push:?}");
    }
}
