//! The ends of the range of set-points: what is accepted is survived, and what is nearer to the end of the rail is
//! refused.

use upright::control::controller::Rejected;
use upright::protocol::message::Request;
use upright::supervision::fault::Fault;
use upright::table::Law;
use upright_closed_loop::harness::{World, record, with_firmware};
use upright_design::parallel;
use upright_design::rig::Rig;
use upright_design::simulate::{Scenario, simulate};
use upright_design::table::TableValues;
use upright_trust::verify::at_rest_disturbed;

use crate::published::{rig as rig_of_file, rig_and_table};

/// Every rig file that the firmware balances.
fn names() -> Vec<&'static str> {
    let files = std::fs::read_dir(upright_test_support::repository().join("rigs")).unwrap();
    let name = |path: &std::path::Path| {
        let is_rig = path.extension().is_some_and(|extension| extension == "toml");
        is_rig.then(|| path.file_stem().unwrap().to_str().unwrap().to_owned())
    };
    let mut names: Vec<String> = files.filter_map(|file| name(&file.unwrap().path())).collect();
    names.retain(|name| rig_of_file(name).kalman.is_some());
    names.sort();
    names.into_iter().map(|name| &*name.leak()).collect()
}

/// The fault, if any, of 20 s at this set-point with the disturbances that the file expects; it is reached from 0.
fn fault_at(rig: &Rig, table: &TableValues, law: Law, setpoint_m: f64) -> Option<Fault> {
    let scenario =
        Scenario { duration_s: 20.0, step_m: setpoint_m, step_at_s: 1.0, ..at_rest_disturbed(rig, law, 1) };
    let run = with_firmware(table, |firmware| record(rig, table, &scenario, firmware)).unwrap().unwrap();
    run.fault.or((!run.summary.survives()).then_some(Fault::Angle))
}

// 20 s of 13 rigs, with up to two laws and two ends each: a slow loop has arrived by then, and noise has moved the cart
// to and fro. It takes longer than other tests.
#[test]
fn every_rig_stays_on_its_rail_at_the_ends_of_the_accepted_set_points() {
    let names = names();
    assert!(names.len() >= 13, "{names:?}");
    let faults = parallel::map(&names, |name| {
        let (rig, table) = rig_and_table(name);
        let [low, high] = table.limits.setpoints_m().map(f64::from);
        let laws = table.laws.present().map(|(law, _)| law);
        laws.flat_map(|law| [low, high].map(|end| (law, end, fault_at(rig, table, law, end))))
            .filter_map(|(law, end, fault)| fault.map(|fault| format!("{name} {law} {end}: {fault:?}")))
            .collect::<Vec<_>>()
    });
    let faults: Vec<String> = faults.into_iter().flatten().collect();
    assert_eq!(faults, [""; 0]);
}

#[test]
fn a_set_point_nearer_to_an_end_of_the_rail_is_refused_with_the_reason() {
    assert!(Rejected::Setpoint.to_string().contains("within a tenth of the usable rail"));
    for name in ["single-quanser-ip02", "quadruple-paper", "single-stepper"] {
        let (rig, table) = rig_and_table(name);
        let scenario = Scenario::at_rest(rig, Law::Lqr);
        let refused = with_firmware(table, |target| {
            let mut world = World::new(rig, table, &scenario, target).unwrap();
            world.raise(None).unwrap();
            let [low, high] = table.limits.setpoints_m();
            let mut ask = |position_m: f32| {
                let inputs = world.inputs();
                world.session.ask(Request::Setpoint(position_m), &inputs).map_err(|error| error.to_string())
            };
            assert!(ask(low).is_ok() && ask(high).is_ok(), "{name}");
            [low.next_down(), high.next_up(), table.limits.rail_m[1]]
                .map(|position| ask(position).unwrap_err())
        });
        for reason in refused.unwrap() {
            assert!(reason.contains("Rejected(Controller(Setpoint))"), "{name}: {reason}");
        }
    }
}

/// What the margin is for: at the soft limit itself, the motor goes off.
#[test]
fn a_set_point_at_the_soft_limit_would_turn_the_motor_off() {
    for name in ["single-quanser-ip02", "quadruple-paper", "single-stepper"] {
        let (rig, table) = rig_and_table(name);
        let end = f64::from(table.limits.rail_m[1]);
        let still = at_rest_disturbed(rig, Law::Lqr, 1);
        let run = |step_m| Scenario { step_m, duration_s: 20.0, is_supervised: true, ..still.clone() };
        let fall = |step_m| simulate(rig, table, &run(step_m)).unwrap().1.fall;
        assert!(fall(end).is_some(), "{name}");
        assert!(fall(table.limits.setpoints_m()[1].into()).is_none(), "{name}");
    }
}
