//! The set-point governor: any position may be requested at any time, and nothing leaves its limits on the way.
//!
//! The criterion: in the linear model, no path of the governed set-point takes the force, or a link's angle from the
//! vertical, beyond half of its limit.

use crate::bench::*;
use nalgebra::SVector;
use proptest::prelude::*;
use std::sync::LazyLock;
use upright::control::controller::Controller;
use upright::control::encoder::CounterWidth;
use upright::table::Law;
use upright_design::rig::{PolePlacement, Rig};
use upright_design::simulate::{Bench, Scenario, Sensing, simulate};
use upright_design::table::TableValues;

/// The criterion holds for the linear model: at half of the limit, 0.175 rad, sin θ and cos θ differ from their linear
/// approximations by up to 1.5 %.
const NONLINEAR: f64 = 1.03;

/// The paper's rig with the settling time at which its pole placement falls on a step of 1 m.
static FAST: LazyLock<(Rig, TableValues)> = LazyLock::new(|| {
    let mut rig = rig("quadruple-paper");
    let Some(PolePlacement::Response { settling_time_s, .. }) = &mut rig.pole_placement else {
        panic!("{rig:?}")
    };
    *settling_time_s = 3.0;
    let table = table(&rig);
    (rig, table)
});

/// Largest angle from the vertical (rad) and force (N).
#[derive(Debug, Default, Clone, Copy)]
struct Peaks {
    angle: f64,
    force: f64,
}

impl Peaks {
    fn see(&mut self, state: &[f64], force: f64) {
        let mut angle = 0.0f64;
        for joint in state[2..].chunks_exact(2) {
            angle += joint[0];
            self.angle = self.angle.max(angle.abs());
        }
        self.force = self.force.max(force.abs());
    }

    /// Both peaks as shares of what the criterion allows.
    fn shares(self, rig: &Rig) -> [f64; 2] {
        [
            self.angle / (0.5 * rig.limits.angle_rad.unwrap()),
            self.force / (0.5 * rig.actuator.largest_force_n().unwrap()),
        ]
    }

    fn within_limits(self, rig: &Rig) -> bool {
        self.shares(rig).iter().all(|&share| share <= NONLINEAR)
    }
}

fn step(rig: &Rig, law: Law, step_m: f64, duration_s: f64) -> Scenario {
    Scenario { step_m, duration_s, ..at_rest(rig, law) }
}

#[test]
fn the_metre_step_that_falls_without_governor_is_reached_through_it_within_half_of_every_limit() {
    let (rig, table) = &*FAST;
    let raw = table.clone().without_governor();
    let lost = run(rig, &raw, &step(rig, Law::PolePlacement, 1.0, 20.0));
    assert!(!lost.survives(), "{lost}");
    for law in LAWS {
        for step_m in [1.0, -1.0, 0.1, -0.5, 1.9] {
            let (trace, summary) = simulate(rig, table, &step(rig, law, step_m, 40.0)).unwrap();
            let mut peaks = Peaks::default();
            trace.samples().for_each(|sample| peaks.see(sample.state, sample.force));
            assert!(summary.settled && summary.final_error_m.abs() < 1e-4, "{law:?} {step_m}: {summary}");
            assert!(peaks.within_limits(rig), "{law:?} {step_m}: {peaks:?} {:?}", peaks.shares(rig));
        }
        // Negative control: this check finds a step that goes too far.
        let (trace, _) = simulate(rig, &raw, &step(rig, law, 1.9, 10.0)).unwrap();
        let mut peaks = Peaks::default();
        trace.samples().for_each(|sample| peaks.see(sample.state, sample.force));
        assert!(!peaks.within_limits(rig), "{law:?}: {peaks:?}");
    }
}

#[test]
fn the_metre_step_is_reached_from_encoders_and_with_delay() {
    for delay_ticks in [0, 1] {
        let mut rig = FAST.0.clone();
        rig.tick.delay_ticks = delay_ticks;
        let table = table(&rig);
        for law in LAWS {
            let scenario =
                Scenario { sensing: Sensing::Encoders, force_noise_n: 0.1, ..step(&rig, law, 1.0, 40.0) };
            let summary = run(&rig, &table, &scenario);
            assert!(
                summary.survives() && summary.final_error_m.abs() < 0.05,
                "{law:?} {delay_ticks}: {summary}"
            );
        }
    }
}

#[test]
fn the_governed_set_point_is_monotone_and_arrives_exactly() {
    let (rig, table) = &*FAST;
    for law in LAWS {
        for step_m in [1.0, -0.37, 1.9] {
            let (trace, _) = simulate(rig, table, &step(rig, law, step_m, 40.0)).unwrap();
            let path: Vec<f64> = trace.samples().map(|sample| sample.setpoint).collect();
            assert!(path.windows(2).all(|pair| (pair[1] - pair[0]) * step_m >= 0.0), "{law:?} {step_m}");
            assert_eq!(path.last(), Some(&f64::from(step_m as f32)), "{law:?}");
            // The set-point moves gradually: no tick moves it further than the step in the table.
            let largest = f64::from(table.law(law).unwrap().setpoint_step);
            assert!(largest < 0.1, "{largest}");
            assert!(
                path.windows(2).all(|pair| (pair[1] - pair[0]).abs() < largest * 1.001 + 1e-6),
                "{law:?} {step_m}"
            );
        }
    }
}

/// Runs a list of requests, each held for its number of ticks; `None` if a link fell.
fn requests(rig: &Rig, values: &TableValues, law: Law, requests: &[(f32, u32)]) -> Option<Peaks> {
    let table = values.table::<10, 5>();
    let mut controller = Controller::new(&table, [CounterWidth::Bits32; 5]).unwrap();
    controller.select(law).unwrap();
    let scenario = Scenario { substeps: 1, ..at_rest(rig, law) };
    let mut bench = Bench::new(rig, &scenario).unwrap();
    controller.start_in_state(&SVector::zeros());
    let mut peaks = Peaks::default();
    for &(target, ticks) in requests {
        controller.set_setpoint(target).unwrap();
        for _ in 0..ticks {
            let x = SVector::from_fn(|i, _| bench.state()[i] as f32);
            let drive = controller.control_from_state(&x).drive;
            let before: Vec<f64> = bench.state().to_vec();
            let force = bench.tick(drive);
            peaks.see(&before, force);
            controller.predict();
            if before[0].abs() > 2.0 || peaks.angle > 1.5 {
                return None;
            }
        }
    }
    Some(peaks)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_sequence_of_requests_leaves_the_limits(
        sequence in prop::collection::vec((-1.8f32..1.8, 20u32..1500), 5..20),
        law in prop::sample::select(LAWS.to_vec()),
    ) {
        let (rig, table) = &*FAST;
        let peaks = requests(rig, table, law, &sequence);
        prop_assert!(peaks.is_some_and(|peaks| peaks.within_limits(rig)), "{:?}", peaks);
    }
}

#[test]
fn to_and_fro_at_any_pace_stays_within_the_limits_and_does_not_without_governor() {
    let (rig, table) = &*FAST;
    let raw = table.clone().without_governor();
    for law in LAWS {
        let (mut largest, mut unshaped_leaves) = (0.0f64, false);
        for half_period in [50, 150, 400, 1000] {
            let sequence: Vec<(f32, u32)> =
                (0..8000 / half_period).map(|i| (if i % 2 == 0 { 1.5 } else { -1.5 }, half_period)).collect();
            let peaks = requests(rig, table, law, &sequence).unwrap();
            assert!(peaks.within_limits(rig), "{law:?} {half_period}: {peaks:?}");
            largest = peaks.shares(rig).into_iter().fold(largest, f64::max);
            let unshaped = requests(rig, &raw, law, &sequence);
            unshaped_leaves |= !unshaped.is_some_and(|peaks| peaks.within_limits(rig));
        }
        assert!(unshaped_leaves, "{law:?}");
        // The bound is not too wide to be useful: the runs use more than half of what it allows.
        assert!(largest > 0.5, "{law:?}: {largest}");
    }
}

#[test]
fn integral_action_is_governed_too() {
    let mut rig = FAST.0.clone();
    rig.integral = Some(upright_design::rig::Integral { position_weight: 10.0, setpoint_weight: 1.0 });
    let table = table(&rig);
    let (trace, summary) = simulate(&rig, &table, &step(&rig, Law::Lqr, 1.0, 40.0)).unwrap();
    assert!(table.laws.lqr.as_ref().unwrap().setpoint_step < 0.1);
    let mut peaks = Peaks::default();
    trace.samples().for_each(|sample| peaks.see(sample.state, sample.force));
    assert!(summary.settled && peaks.within_limits(&rig), "{summary} {peaks:?}");
}
