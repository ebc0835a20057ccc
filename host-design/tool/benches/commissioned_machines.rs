//! How many random machines balance with the identified file, with their true parameters, and with the original ones:
//! `cargo bench -p upright-tool --bench commissioned_machines`. Fails if the identified file does clearly worse than
//! the true parameters. `UPRIGHT_MACHINES` says how many, `UPRIGHT_RIG` of which rigs (names with spaces between them);
//! it takes minutes. Prints a table, after a line for each machine that was not commissioned; every machine's result
//! goes to stderr.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use upright::table::Law;
use upright_closed_loop::harness::{record, with_firmware};
use upright_design::design::design;
use upright_design::reality::real_chain;
use upright_design::rig::{PerJoint, PlantDescription, Rig};
use upright_design::simulate::{Disturbance, Scenario};
use upright_design::table::{Gains, TableValues};
use upright_tool::commission::{CommissionPlan, CommissionRecord, Commissioning, Journal, Simulated};

use upright_test_support::published::rig_path;

/// The machine number `number`: masses, lengths and inertias off by up to 10 %, dry friction up to 0.8 % of the weight
/// at the cart and 0.2 % of each link's largest moment, zeros off by up to 0.3°, latency up to 0.3 ticks.
fn machine(rig: &Rig, number: u8) -> Rig {
    let mut random = Pcg64::seed_from_u64(number.into());
    let mut machine = rig.clone();
    let chain = rig.chain().unwrap();
    let reality = &mut machine.reality;
    reality.parameters.parameter_spread_percent = 10.0;
    reality.parameters.parameter_seed = number;
    let gravity = chain.gravity_m_per_s2;
    reality.friction.cart_friction_n = random.random_range(0.0..0.008) * chain.total_mass_kg() * gravity;
    let moment = |mass_kg: f64, length_m: f64| 0.5 * mass_kg * length_m * gravity;
    let frictions =
        chain.links.iter().map(|link| random.random_range(0.0..0.002) * moment(link.mass_kg, link.length_m));
    reality.friction.joint_friction_n_m = PerJoint::each(frictions.collect());
    let zeros = chain.links.iter().map(|_| random.random_range(-0.005..0.005));
    reality.sensors.homing_error_rad = PerJoint::each(zeros.collect());
    reality.driver.latency_s = random.random_range(0.0..0.3) * rig.tick.period_s;
    machine
}

/// Whether the machine balances for 10 s with the whole firmware and the gains of `file`.
fn survives(machine: &Rig, file: &Rig) -> bool {
    let Ok(certified) = design(file) else { return false };
    let table = TableValues::of(file, &certified, Gains::Sampled).unwrap();
    let disturbance = Disturbance::of(machine);
    let scenario = Scenario {
        force_noise_n: disturbance.force_n,
        torque_noise_n_m: disturbance.torque_n_m,
        ..Scenario::at_rest(machine, Law::Lqr)
    };
    let recording = with_firmware(&table, |target| record(machine, &table, &scenario, target)).unwrap();
    recording.is_ok_and(|recording| recording.fault.is_none() && recording.summary.fall.is_none())
}

/// `file` with the weights, poles and tolerances of `chosen`.
fn with_weights_of(file: &Rig, chosen: &Rig) -> Rig {
    Rig {
        lqr: chosen.lqr.clone(),
        pole_placement: chosen.pole_placement.clone(),
        kalman: chosen.kalman.clone(),
        robust: chosen.robust.clone(),
        ..file.clone()
    }
}

/// Commissions machine number `number`; returns whether it balances with the identified file, with the true parameters
/// and with the original ones, all with the weights that were chosen for it, and with the original file as it was.
fn one(name: &str, number: u8) -> [bool; 4] {
    let path = rig_path(name);
    let text = std::fs::read_to_string(&path).unwrap();
    let rig = Rig::from_path(&path).unwrap();
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    let machine = machine(&rig, number);
    let mut journal = Journal::new(CommissionRecord::new(&rig, "this computer"), None, Box::new(|_| ()));
    let seed = number.into();
    let plan = CommissionPlan { rig: &rig, table: &table, file: &path, text: &text, seconds: 20.0, seed };
    let designed = with_firmware(&table, |target| {
        let mut simulated = Simulated::new(&machine, &table, None, target, seed).unwrap();
        Commissioning::first(plan, &mut simulated, &mut journal)
    });
    let designed = match designed.unwrap() {
        Ok(designed) => Some(designed.rig),
        Err(stop) => {
            println!(
                "{name}, machine {number}: {}: {stop}",
                journal.record.steps.last().unwrap().step.name()
            );
            None
        }
    };
    let chosen = designed.as_ref().unwrap_or(&rig);
    let chain = rig.chain().unwrap();
    let truth = Rig {
        plant: PlantDescription::Chain(real_chain(chain, &machine.reality.parameters)),
        ..with_weights_of(&rig, chosen)
    };
    [
        designed.as_ref().is_some_and(|found| survives(&machine, found)),
        survives(&machine, &truth),
        survives(&machine, &with_weights_of(&rig, chosen)),
        survives(&machine, &rig),
    ]
}

fn main() {
    let names = std::env::var("UPRIGHT_RIG").unwrap_or_else(|_| "single-quanser-ip02".to_owned());
    let machines = std::env::var("UPRIGHT_MACHINES").map_or(12, |number| number.parse().unwrap());
    let mut counts = Vec::new();
    for name in names.split_whitespace() {
        let mut count = [0; 4];
        for number in 1..=machines {
            let survived = one(name, number);
            count.iter_mut().zip(survived).for_each(|(count, survived)| *count += u32::from(survived));
            eprintln!("{name}, machine {number}: identified, true, original, unchanged: {survived:?}");
        }
        counts.push((name, count));
    }
    println!("{:26}machines  identified  true  original  unchanged", "");
    for (name, [identified, truth, original, unchanged]) in &counts {
        println!("{name:26}{machines:>8}{identified:>12}{truth:>6}{original:>10}{unchanged:>11}");
    }
    for (name, count) in counts {
        assert!(count[0] + 1 >= count[1], "{name}: {count:?}");
    }
}
