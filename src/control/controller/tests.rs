//! Tests of whole ticks of the controller.

use super::*;
use crate::table::{
    ForceMap, Late, Limits, ObserverGains, PerLaw, SensorRow, StepMap, TABLE_FORMAT, Thresholds, columns,
};
use nalgebra::{matrix, vector};

/// A drive with this largest force, of which so much is late.
fn force(limit_n: f32, acts: f32, stays: f32) -> DriveMap {
    DriveMap::Force(ForceMap { limit_n, late: Late { acts, stays } })
}

/// A cart of 2 kg without friction, held for half a second.
fn table() -> GainTable<2, 1> {
    let law =
        LawGains { k: columns([[1.0, 2.0]]), k_pending: 0.5, k_integral: 0.0, n: 1.0, setpoint_step: 10.0 };
    let mut table = GainTable {
        format: TABLE_FORMAT,
        dimensions: [2, 1],
        output: 0,
        rig_hash: 7,
        tick_s: 0.5,
        sensors: [SensorRow { step: 0.25, ..SensorRow::default() }],
        drive: force(5.0, 1.0, 0.0),
        laws: PerLaw { lqr: Some(law), pole_placement: None },
        observer: Some(ObserverGains {
            ad: matrix![1.0, 0.5; 0.0, 1.0],
            bd: vector![0.0625, 0.25],
            l: matrix![0.5; 1.0],
        }),
        friction: None,
        limits: Limits::none(),
        thresholds: Thresholds::none(),
        stilling: None,
        crc: 0,
    };
    table.crc = table.checksum();
    table
}

fn controller(table: &GainTable<2, 1>) -> Controller<'_, 2, 1> {
    let mut controller = Controller::new(table, [CounterWidth::Bits16]).unwrap();
    controller.start_in_state(&vector![0.0, 0.0]);
    controller
}

#[test]
fn the_pending_force_is_fed_back() {
    let table = table();
    let mut controller = controller(&table);
    let x = vector![-1.0, -1.0];
    assert_eq!(controller.control_from_state(&x).applied_n, 3.0);
    controller.predict();
    assert_eq!(controller.control_from_state(&x).applied_n, 1.5);
}

#[test]
fn the_pending_force_is_the_limited_one() {
    let table = table();
    let mut controller = controller(&table);
    let command = controller.control_from_state(&vector![-100.0, 0.0]);
    assert_eq!((command.requested_n, command.applied_n), (100.0, 5.0));
    controller.predict();
    assert_eq!(controller.control_from_state(&vector![0.0, 0.0]).requested_n, -2.5);
}

#[test]
fn the_estimate_uses_the_force_that_is_applied_in_the_tick() {
    let table = table();
    let mut controller = controller(&table);
    // 4 counts of 0.25 m: innovation 1, estimate (0.5, 1), request -(0.5 + 2).
    let command = controller.control(&[4]);
    assert_eq!(command.applied_n, -2.5);
    controller.predict();
    // With a delay of one tick, that force is still pending: the prediction is Ad x̂ alone.
    assert_eq!(controller.estimate(), &vector![1.0, 1.0]);
    controller.control(&[4]);
    controller.predict();
    assert_eq!(controller.estimate(), &vector![1.5 - 0.0625 * 2.5, 1.0 - 0.25 * 2.5]);
}

#[test]
fn positions_give_the_same_bits_as_the_counts_of_them() {
    let table = table();
    let (mut by_counts, mut by_positions) = (controller(&table), controller(&table));
    by_counts.start(&[3]).unwrap();
    by_positions.start_at(&[3.0 * 0.25]).unwrap();
    let bits = |command: MotorCommand| [command.requested_n, command.applied_n].map(f32::to_bits);
    for tick in 0..50u32 {
        let count = 3 + tick * tick % 7;
        let wanted = bits(by_counts.control(&[count]));
        assert_eq!(bits(by_positions.control_at(&[count as f32 * 0.25])), wanted, "{tick}");
        assert_eq!(by_positions.estimate(), by_counts.estimate());
        by_counts.predict();
        by_positions.predict();
    }
    // Negative control: another position gives another force.
    assert_ne!(bits(by_positions.control_at(&[0.26])), bits(by_counts.control(&[1])));
}

#[test]
fn a_stopped_controller_gives_no_force() {
    let table = table();
    let mut controller = controller(&table);
    controller.stop();
    assert_eq!(controller.control(&[400]), Controller::<2, 1>::off());
    assert_eq!(controller.control_from_state(&vector![9.0, 9.0]).drive, Drive::OFF);
}

#[test]
fn an_invalid_request_changes_nothing() {
    let table = table();
    let mut controller = controller(&table);
    controller.set_setpoint(0.25).unwrap();
    assert_eq!(controller.set_setpoint(f32::NAN), Err(Rejected::Setpoint));
    assert_eq!(controller.select(Law::Lqr), Err(Rejected::Running));
    controller.stop();
    assert_eq!(controller.select(Law::PolePlacement), Err(Rejected::NoSuchLaw));
    assert_eq!((controller.setpoint(), controller.law()), (0.25, Law::Lqr));
}

#[test]
fn a_table_that_does_not_fit_is_refused() {
    let refused = |change: &dyn Fn(&mut GainTable<2, 1>), sealed: bool| {
        let mut table = table();
        change(&mut table);
        if sealed {
            table.crc = table.checksum();
        }
        Controller::new(&table, [CounterWidth::Bits16]).err()
    };
    assert_eq!(refused(&|_| (), true), None);
    assert_eq!(refused(&|t| t.format += 1, true), Some(TableError::Format));
    assert_eq!(refused(&|t| t.dimensions[0] = 3, true), Some(TableError::Dimensions));
    assert_eq!(refused(&|t| t.dimensions[1] = 2, true), Some(TableError::Dimensions));
    assert_eq!(refused(&|t| t.sensors[0].state = 2, true), Some(TableError::Dimensions));
    assert_eq!(refused(&|t| t.output = 2, true), Some(TableError::Dimensions));
    assert_eq!(refused(&|t| t.drive = force(5.0, 2.0, 0.0), true), Some(TableError::Delay));
    assert_eq!(refused(&|t| t.drive = force(5.0, 1.0, -0.5), true), Some(TableError::Delay));
    assert_eq!(refused(&|t| t.drive = force(f32::NAN, 1.0, 0.0), true), Some(TableError::Value));
    assert_eq!(refused(&|t| t.laws.lqr = None, true), Some(TableError::NoLaw));
    assert_eq!(refused(&|t| t.drive = force(6.0, 1.0, 0.0), false), Some(TableError::Crc));
}

/// A cart on a drive that takes pulses, with a law that follows the set-point fast.
fn stepping() -> GainTable<2, 1> {
    let tick_s = 0.001f32;
    let law = LawGains {
        k: columns([[400.0, 40.0]]),
        k_pending: 0.0,
        k_integral: 0.0,
        n: 400.0,
        setpoint_step: 10.0,
    };
    let observer = ObserverGains {
        ad: matrix![1.0, tick_s; 0.0, 1.0],
        bd: vector![0.5 * tick_s * tick_s, tick_s],
        l: matrix![0.0; 0.0],
    };
    let steps = StepMap {
        step_m: 12.5e-6,
        acceleration_limit_m_per_s2: 60.0,
        speed_limit_m_per_s: 1.5,
        ..StepMap::ideal(tick_s)
    };
    let mut table = GainTable {
        tick_s,
        sensors: [SensorRow { step: 12.5e-6, ..SensorRow::default() }],
        drive: DriveMap::Pulses(steps),
        laws: PerLaw { lqr: Some(law), pole_placement: None },
        observer: Some(observer),
        ..table()
    };
    table.crc = table.checksum();
    table
}

/// Ten minutes of set-points that jump at random.
#[test]
fn every_pulse_is_counted_after_ten_minutes_at_100_khz() {
    let table = stepping();
    let step_m = f64::from(table.drive.pulses().unwrap().step_m);
    let mut controller = Controller::new(&table, [CounterWidth::Bits32]).unwrap();
    controller.start(&[0]).unwrap();
    let (mut count, mut without_carry, mut most, mut random) = (0i32, 0i32, 0, 1u32);
    for tick in 0..600_000 {
        if tick % 400 == 0 {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            controller.set_setpoint(0.3 * (random as i32 as f32 / i32::MAX as f32)).unwrap();
        }
        let command = controller.control(&[count as u32]);
        let Drive::Steps(pulses) = command.drive else { panic!("{command:?}") };
        let mean = controller.estimate()[1] + 0.5 * command.applied_n * table.tick_s;
        without_carry += (f64::from(mean * table.tick_s) / step_m).round() as i32;
        (count, most) = (count + pulses, most.max(pulses.abs()));
        controller.predict();
        let away = f64::from(count) - f64::from(controller.estimate()[0]) / step_m;
        assert!(away.abs() <= 1.0, "tick {tick}: {away}");
        assert!(controller.innovation()[0].abs() <= 13e-6);
    }
    assert!((100..=121).contains(&most), "{most} pulses in 1 ms");
    // Negative control: each tick rounded by itself loses its way.
    assert!((without_carry - count).abs() > 20, "{}", without_carry - count);
}

#[test]
fn pulses_need_a_state_that_is_a_number_and_no_measured_cart() {
    let table = stepping();
    let mut controller = Controller::new(&table, [CounterWidth::Bits32]).unwrap();
    controller.start_in_state(&vector![0.25, 0.0]);
    controller.set_setpoint(0.25).unwrap();
    assert_eq!(controller.control(&[20_000]).drive, Drive::Steps(0));
    controller.start_in_state(&vector![f32::NAN, 0.0]);
    assert_eq!(controller.control(&[20_000]).drive, Drive::Steps(0));
    assert_eq!(controller.control_from_state(&vector![0.1, 0.0]).drive, Drive::OFF);
}
