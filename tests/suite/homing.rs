//! Homing of links that hang still and of links whose swinging decays, with joints that stick.

use core::f64::consts::{PI, TAU};

use crate::published::table;
use crate::supervised::rig;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use upright::control::actuator::Drive;
use upright::protocol::message::{Answer, Request};
use upright::supervision::inhibits::Inhibits;
use upright::supervision::supervisor::State;
use upright::table::Law;
use upright_closed_loop::harness::{World, with_firmware};
use upright_design::rig::{PerJoint, Rig};
use upright_design::simulate::Scenario;

/// A machine, and what a person does with it, starting from hanging.
struct Case {
    rig: Rig,
    /// Angle of the whole chain from hanging when it is let go, and the largest angle of each joint added to it (rad).
    lift_rad: [f64; 2],
    /// Torque of a hand that pulls the outermost link to one side for 5 s, lets go for 5 s, and so on (N·m).
    pull_n_m: f64,
    longest_s: f64,
}

/// Result of a run.
#[derive(Debug)]
struct Homed {
    /// Time at which homing was done (s); none if it never was.
    at_s: Option<f64>,
    /// Largest error of a joint's zero (rad).
    error_rad: f64,
    /// All reasons for which homing was refused before.
    refused: Inhibits,
}

impl Case {
    fn new(name: &str, joint_friction_n_m: f64, lift_rad: [f64; 2]) -> Self {
        let mut rig = rig(name);
        rig.reality.friction.joint_friction_n_m = PerJoint::all(joint_friction_n_m);
        Self { rig, lift_rad, pull_n_m: 0.0, longest_s: 60.0 }
    }

    /// Lets go of the links and requests homing every 0.05 s until it is done. The zero of each encoder is at a random
    /// phase within a count.
    fn home(&self, seed: u64) -> Homed {
        let mut rig = self.rig.clone();
        let mut random = Pcg64::seed_from_u64(seed);
        let steps: Vec<f64> = rig.sensors().iter().skip(1).map(|sensor| sensor.step()).collect();
        let phases: Vec<f64> = steps.iter().map(|step| step * random.random_range(-0.5..0.5)).collect();
        rig.reality.sensors.homing_error_rad = PerJoint::each(phases.clone());
        let mut start = vec![0.0; rig.states()];
        start[2] = PI;
        for angle in start[2..].iter_mut().step_by(2) {
            *angle += self.lift_rad[1] * random.random_range(-1.0..1.0);
        }
        start[2] += self.lift_rad[0];
        let values = table(&rig);
        let scenario = Scenario { seed, ..Scenario::at_rest(&rig, Law::Lqr) };
        let run = with_firmware(&values, |target| {
            let mut world = World::new(&rig, &values, &scenario, target).unwrap();
            world.bench.hold(&start);
            self.ask(&rig, &mut world, &phases, &steps)
        });
        run.unwrap()
    }

    fn ask(&self, rig: &Rig, world: &mut World<'_>, phases: &[f64], steps: &[f64]) -> Homed {
        let period_s = rig.tick.period_s;
        let (ask_ticks, window) = ((0.05 / period_s) as u32, (5.0 / period_s) as u32);
        let mut pull = vec![0.0; steps.len()];
        let mut refused = Inhibits::NONE;
        for tick in 1..=(self.longest_s / period_s) as u32 {
            if let Some(pull) = pull.last_mut() {
                *pull = if (tick / window).is_multiple_of(2) { self.pull_n_m } else { 0.0 };
            }
            world.bench.pull(0.0, &pull);
            world.bench.tick(Drive::Force(0.0));
            if tick.is_multiple_of(ask_ticks) {
                world.session.send(Request::Home);
            }
            let inputs = world.inputs();
            world.session.tick(&inputs).unwrap();
            while let Some((_, answer)) = world.session.next_reply() {
                if let Answer::NotNow(inhibits) = answer {
                    refused = refused.union(inhibits);
                }
            }
            if world.session.status().state == State::Calibrated {
                let error_rad = self.error_rad(world, phases, steps);
                return Homed { at_s: Some(f64::from(tick) * period_s), error_rad, refused };
            }
        }
        Homed { at_s: None, error_rad: 0.0, refused }
    }

    /// Largest error of a joint's zero (rad), from the counts of a tick in which nothing moves.
    fn error_rad(&self, world: &mut World<'_>, phases: &[f64], steps: &[f64]) -> f64 {
        let inputs = world.inputs();
        for _ in 0..4 {
            world.session.tick(&inputs).unwrap();
        }
        let last = std::iter::from_fn(|| world.session.next_telemetry()).last().unwrap();
        let errors = (0..steps.len()).map(|joint| {
            let read = ((world.bench.state()[2 + 2 * joint] + phases[joint]) / steps[joint]).round();
            let error = (f64::from(last.counts[joint + 1]) - read) * steps[joint] + phases[joint];
            // A link may have made whole turns.
            error - (error / TAU).round() * TAU
        });
        errors.fold(0.0, |largest, error| f64::max(largest, error.abs()))
    }
}

/// Links that are let go near hanging and stick at once, and links that swing.
const HANGS: [f64; 2] = [0.0, 0.01];
const SWINGS: [f64; 2] = [0.5, 0.2];

/// Errors of the runs that were homed.
#[derive(Debug)]
struct Errors {
    runs: usize,
    rms_rad: f64,
    largest_rad: f64,
    longest_s: f64,
}

impl Errors {
    fn of(case: &Case, seeds: u64) -> Self {
        let runs: Vec<Homed> =
            (0..seeds).map(|seed| case.home(seed)).filter(|run| run.at_s.is_some()).collect();
        let largest = |values: &dyn Fn(&Homed) -> f64| runs.iter().map(values).fold(0.0, f64::max);
        let squares: f64 = runs.iter().map(|run| run.error_rad * run.error_rad).sum();
        Self {
            runs: runs.len(),
            rms_rad: (squares / runs.len() as f64).sqrt(),
            largest_rad: largest(&|run| run.error_rad),
            longest_s: largest(&|run| run.at_s.unwrap_or_default()),
        }
    }
}

#[test]
fn joints_that_stick_are_homed_better_while_they_swing() {
    let case = |lift_rad| Case::new("quadruple-paper", 3e-4, lift_rad);
    let (hanging, swinging) = (Errors::of(&case(HANGS), 6), Errors::of(&case(SWINGS), 6));
    println!("let go near hanging: {hanging:?}\nswinging: {swinging:?}");
    assert!(hanging.runs == 6 && hanging.largest_rad > 0.003, "{hanging:?}");
    assert!(swinging.runs == 6 && swinging.largest_rad < 0.002 && swinging.longest_s < 30.0, "{swinging:?}");
    assert!(swinging.rms_rad < 0.4 * hanging.rms_rad, "{swinging:?} {hanging:?}");
}

#[test]
fn zeros_that_contradict_each_other_are_refused() {
    let free = Case { longest_s: 15.1, ..Case::new("quadruple-paper", 0.0, [0.0, 0.2]) };
    let pulled = Case { pull_n_m: 1e-3, longest_s: 40.0, ..Case::new("quadruple-paper", 0.0, [0.0, 0.2]) };
    for seed in 0..3 {
        let (free, pulled) = (free.home(seed), pulled.home(seed));
        assert!(free.at_s.is_some() && free.error_rad < 0.002, "{seed}: {free:?}");
        assert!(pulled.at_s.is_none() && pulled.refused.contains(Inhibits::ZEROS), "{seed}: {pulled:?}");
    }
}
