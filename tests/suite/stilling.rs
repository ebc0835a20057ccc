//! The whole firmware stills links that tumble, from a command on.

use std::path::Path;

use upright::board::Output;
use upright::control::actuator::Drive;
use upright::protocol::message::{Answer, Request};
use upright::supervision::fault::Fault;
use upright::supervision::inhibits::Inhibits;
use upright::supervision::jog::MotorSign;
use upright::supervision::sign_check::Signs;
use upright::supervision::supervisor::State;
use upright::table::TableError;
use upright_closed_loop::harness::{BeforeMotion, HarnessError, Target, World, until, with_firmware};
use upright_design::design::{NoStilling, Stilling, design};
use upright_design::rig::{LinkEncoder, Rig, Tolerances};
use upright_design::simulate::Scenario;
use upright_design::study::Study;
use upright_design::table::{Gains, TableValues};
use upright_plan::{Stilled, Stored, Tumbling, designed_table, motions, quantile_s, recovered, stilled};
use upright_test_support::repository;

/// A rig of `rigs/`, whose file knows the dry friction of a typical cart, if it has a force.
fn rig(name: &str) -> Rig {
    let path = repository().join(format!("rigs/{name}.toml"));
    let rig = Rig::from_path(&path).unwrap();
    if rig.actuator.pulses().is_some() {
        return rig;
    }
    let typical = Tolerances::typical(rig.chain().unwrap());
    let known = format!("\n[friction]\ncart_n = {}\n", typical.cart_friction_n);
    Rig::from_toml(&(std::fs::read_to_string(&path).unwrap() + &known), Path::new(name)).unwrap()
}

fn table(rig: &Rig) -> TableValues {
    TableValues::of(rig, &design(rig).unwrap(), Gains::Sampled).unwrap()
}

fn runs(rig: &Rig, table: &TableValues, energies: f64, runs: u64) -> Vec<Stilled> {
    let tumbling = Tumbling { energies, has_dry_friction: true };
    stilled(rig, table, tumbling, (1, runs), &Study::whole()).unwrap()
}

/// Runs with once and twice the energy of upright links: all are still, 95 % of them within `within_s`, and none has
/// touched an end of the rail.
fn all_are_still(name: &str, within_s: f64) {
    let rig = rig(name);
    let table = table(&rig);
    for energies in [1.0, 2.0] {
        let runs = runs(&rig, &table, energies, 24);
        assert!(runs.iter().all(|run| run.time_s.is_finite() && run.fault.is_none()), "{name}: {runs:?}");
        assert!(runs.iter().all(|run| !run.is_at_end), "{name}: {runs:?}");
        let most_s = quantile_s(&runs, 0.95);
        assert!(most_s <= within_s, "{name}, {energies} energies: {most_s} s");
    }
}

#[test]
fn single_links_are_still_within_5_s() {
    all_are_still("single-quanser-ip02", 5.0);
}

#[test]
fn double_links_are_still_within_7_s() {
    all_are_still("double-quanser-dbpen", 7.0);
}

#[test]
fn triple_links_are_still_within_12_s() {
    all_are_still("triple-glueck-eder-kugi", 12.0);
}

#[test]
fn quadruple_links_are_still_within_5_s() {
    all_are_still("quadruple-paper", 5.0);
}

#[test]
fn links_on_steppers_and_at_the_voltage_of_a_motor_are_still_within_6_s() {
    for name in ["single-stepper", "double-stepper", "single-absolute", "double-multiarm"] {
        all_are_still(name, 6.0);
    }
}

#[test]
fn gains_that_would_add_energy_are_refused_and_others_that_do_not_still_are_found() {
    let rig = rig("single-quanser-ip02");
    let good = table(&rig);
    let changed = |change: &dyn Fn(&mut TableValues)| {
        let mut changed = good.clone();
        change(&mut changed);
        changed
    };
    for reversed in [
        changed(&|table| table.stilling.as_mut().unwrap().damping *= -1.0),
        changed(&|table| table.stilling.as_mut().unwrap().stiffness *= -1.0),
        changed(&|table| table.stilling.as_mut().unwrap().imitated.as_mut().unwrap().taken[0] *= -1.0),
    ] {
        let started = with_firmware(&reversed, |_| ());
        assert!(matches!(started, Err(HarnessError::Table(TableError::Value))), "{started:?}");
    }
    // Nothing but viscous friction brings them to rest.
    let weak = changed(&|table| {
        let stilling = table.stilling.as_mut().unwrap();
        (stilling.imitated, stilling.most_n) = (None, [1e-3; 2]);
    });
    assert!(runs(&rig, &weak, 1.0, 4).iter().all(|run| run.time_s.is_infinite()), "a weak spring");
}

/// The fault that ends the stilling of four links of which the first swings far, by a motor whose force is this
/// multiple of what it should be.
fn fault_with(force: f32) -> Option<Fault> {
    let rig = rig("quadruple-paper");
    let table = table(&rig);
    let scenario = Scenario::swing_up(&rig, 0.0, None);
    let stills = |target: &mut dyn Target| -> Result<Option<Fault>, HarnessError> {
        let mut world = World::new(&rig, &table, &scenario, target)?;
        world.by_hand_until(|status| {
            (status.state, status.motor) == (State::Calibrated, MotorSign::Checked)
                && status.signs == Signs::Checked
        })?;
        let mut start = scenario.start.clone();
        (start[0], start[2]) = (0.05, start[2] + 2.0);
        world.hand.hold_in(&start);
        assert_eq!(world.ask(Request::Still)?, Answer::Done);
        // Its telemetry comes a tick later.
        let _ = world.tick(&mut [])?;
        world.let_go();
        let mut changed = BeforeMotion(|world: &mut World<'_>, output: &mut Output| {
            if let Drive::Force(force_n) = &mut output.drive {
                *force_n *= force;
            }
            until(world.session.status().state != State::Stilling)
        });
        world.run(21_000, &mut [&mut changed])?;
        Ok(world.session.fault())
    };
    with_firmware(&table, stills).unwrap().unwrap()
}

#[test]
fn a_motor_that_pushes_the_wrong_way_is_stopped() {
    assert_eq!(fault_with(-1.0), Some(Fault::Motor));
    // Half of the force only takes longer.
    assert_eq!([1.0, 0.5].map(fault_with), [None; 2]);
}

#[test]
fn a_rig_without_stilling_says_why_and_refuses_the_command() {
    let mut potentiometer = rig("single-absolute");
    assert!(Stilling::of(&potentiometer).is_ok());
    potentiometer.chain_mut().unwrap().links[0].encoder =
        Some(LinkEncoder::Absolute { bits: 12, travel_rad: Some(5.93), zero_counts: 2048, noise_rad: 1e-3 });
    assert_eq!(Stilling::of(&potentiometer).map(|_| ()), Err(NoStilling::DeadBand));
    let mut unmeasured = rig("single-absolute");
    unmeasured.kalman = None;
    assert_eq!(Stilling::of(&unmeasured).map(|_| ()), Err(NoStilling::NotMeasured));
    let model = Rig::from_path(&repository().join("rigs/quadruple-paper-printed.toml")).unwrap();
    assert_eq!(Stilling::of(&model).map(|_| ()), Err(NoStilling::Model));
    let no_limit = Rig::from_toml(
        &std::fs::read_to_string(repository().join("rigs/quadruple-paper.toml"))
            .unwrap()
            .replace("force_limit_n = 20", "# force_limit_n = 20"),
        Path::new("no limit"),
    )
    .unwrap();
    assert_eq!(Stilling::of(&no_limit).map(|_| ()), Err(NoStilling::NoLimit));
    let mut without = table(&rig("single-quanser-ip02"));
    without.stilling = None;
    let (rig, mut answer) = (rig("single-quanser-ip02"), None);
    let asks = |target: &mut dyn Target| {
        let mut world = World::new(&rig, &without, &Scenario::swing_up(&rig, 0.0, None), target).unwrap();
        answer = Some(world.ask(Request::Still).unwrap());
    };
    with_firmware(&without, asks).unwrap();
    assert!(matches!(answer, Some(Answer::NotNow(inhibits)) if inhibits.contains(Inhibits::NO_STILLING)));
}

/// A rig of `rigs/` with its stored motions, whose motor stills the links for so long after a fall (s).
fn with_motions(name: &str, stilling_s: f64) -> (Rig, TableValues) {
    let path = repository().join(format!("rigs/{name}.toml"));
    let rig = Rig::from_path(&path).unwrap();
    let motions = motions(&rig, &Stored::beside(&path).unwrap()).unwrap();
    let mut table = designed_table(&rig, &motions).unwrap();
    table.stilling.as_mut().unwrap().after_fall_ticks = (stilling_s / rig.tick.period_s) as u32;
    (rig, table)
}

#[test]
fn a_rig_that_falls_is_stilled_and_raised_again() {
    for (name, runs) in [
        ("single-quanser-ip02", 8),
        ("double-quanser-dbpen", 6),
        ("triple-glueck-eder-kugi", 4),
        ("quadruple-paper", 4),
        ("double-stepper", 4),
    ] {
        let (rig, table) = with_motions(name, 20.0);
        let all = recovered(&rig, &table, (1, runs), &Study::whole()).unwrap();
        assert!(all.iter().all(|run| run.fall.is_some() && run.upright_s.is_some()), "{name}: {all:?}");
    }
}

#[test]
fn a_motor_that_may_not_still_the_links_goes_off_after_a_fall() {
    let (rig, table) = with_motions("single-quanser-ip02", 0.0);
    for run in recovered(&rig, &table, (1, 3), &Study::whole()).unwrap() {
        assert!(run.fall.is_some() && run.still_s.is_none() && run.upright_s.is_none(), "{run:?}");
    }
}

#[test]
fn the_rig_file_says_for_how_long_the_links_are_stilled_after_a_fall() {
    let text = std::fs::read_to_string(repository().join("rigs/single-quanser-ip02.toml")).unwrap();
    let ticks = |limits: &str| {
        let text = text.replace("\n[limits]\n", &format!("\n[limits]\n{limits}\n"));
        table(&Rig::from_toml(&text, Path::new("rig")).unwrap()).stilling.unwrap().after_fall_ticks
    };
    assert_eq!([ticks(""), ticks("stilling_s = 3")], [0, 1500]);
    assert!(
        Rig::from_toml(&text.replace("\n[limits]\n", "\n[limits]\nstilling_s = 61\n"), Path::new("rig"))
            .is_err()
    );
}
