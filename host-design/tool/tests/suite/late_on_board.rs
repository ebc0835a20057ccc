//! A force and readings that are late, on the virtual board: the flashed image makes up for them with the bits of the
//! host.

use upright::boards::DEFAULT_BOARD;
use upright::table::Law;
use upright_board::{Conditions, Image};
use upright_design::design::design;
use upright_design::simulate::Scenario;
use upright_design::table::{Gains, TableValues};
use upright_tool::in_the_loop::{VirtualBoard, run_compared};

use crate::equipment::built_for;
use crate::published::rig_and_table;

#[test]
fn the_image_makes_up_for_a_late_force_and_old_readings_with_the_bits_of_the_host() {
    let mut force = rig_and_table("quadruple-paper").0.clone();
    force.actuator.force_mut().unwrap().lag_s = Some(0.002);
    let mut readings = rig_and_table("double-quanser-dbpen").0.clone();
    readings.chain_mut().unwrap().links.iter_mut().for_each(|link| link.sensor_delay_s = 0.002);
    let mut both = rig_and_table("single-quanser-ip02").0.clone();
    both.actuator.force_mut().unwrap().lag_s = Some(0.004);
    (both.tick.delay_ticks, both.swing_up) = (1, None);
    for rig in [force, readings, both] {
        let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
        let Some(elf) = built_for(DEFAULT_BOARD, &rig, &table) else { return };
        let image = Image::from_elf(&std::fs::read(elf).unwrap()).unwrap();
        let scenario = Scenario { duration_s: 2.0, step_m: 0.02, ..Scenario::at_rest(&rig, Law::Lqr) };
        let run = |table_of_host: &TableValues| {
            let mut board = VirtualBoard::start(&image, &Conditions::f405(1), &table).unwrap();
            run_compared(&rig, table_of_host, &scenario, &mut board)
        };
        let (recording, [ticks, messages]) = run(&table).unwrap();
        assert!(
            recording.fault.is_none() && recording.summary.survives(),
            "{}: {:?}",
            rig.name,
            recording.fault
        );
        assert!(messages > 100, "{ticks} {messages}");
        // Negative control: a host that takes the readings for older.
        let mut other = table.clone();
        other.sensors[1].delay_s += 1e-3;
        let Err(error) = run(&other) else { panic!("{}: the same bits", rig.name) };
        let error = error.to_string();
        assert!(error.contains("differ"), "{error}");
    }
}
