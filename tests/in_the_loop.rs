//! The whole firmware in closed loop: the same bits in a simulation of the controller alone, with all tasks on the host,
//! and as an image in QEMU.

use std::path::Path;

use host_design::design::design;
use host_design::in_the_loop::{Link, Recording, Where, run};
use host_design::rig::Rig;
use host_design::simulate::{Scenario, simulate};
use host_design::table::{Gains, TableValues};
use upright::table::Law;

fn quadruple() -> (Rig, TableValues) {
    let rig = Rig::from_path(Path::new("rigs/quadruple-paper.toml")).unwrap();
    let table = TableValues::of(&rig, &design(&rig).unwrap(), Gains::Sampled).unwrap();
    (rig, table)
}

fn scenarios(rig: &Rig) -> Vec<Scenario> {
    let mut scenarios = Vec::new();
    for law in [Law::Lqr, Law::PolePlacement] {
        let rest = Scenario { duration_s: 2.0, counter_start: 65_000, ..Scenario::at_rest(rig, law) };
        let noise = Scenario { force_noise_n: 0.1, torque_noise_n_m: 3e-5, seed: 7, ..rest.clone() };
        let mut tilt = noise.clone();
        tilt.start[2] = 0.004;
        scenarios.extend([
            Scenario { step_m: 0.3, step_at_s: 0.1, ..noise.clone() },
            tilt,
            Scenario { step_m: -0.2, ..rest },
        ]);
    }
    scenarios
}

fn bits(recording: &Recording) -> Vec<(f64, f64, Vec<f64>)> {
    recording.trace.samples().map(|s| (s.requested, s.force, s.estimate.to_vec())).collect()
}

#[test]
fn all_tasks_together_give_the_bits_of_the_controller_alone() {
    let (rig, table) = quadruple();
    for scenario in scenarios(&rig) {
        let (alone, summary) = simulate(&rig, &table, &scenario).unwrap();
        let together = run(&rig, &table, &scenario, Where::Host).unwrap();
        assert_eq!(together.fault, None);
        assert_eq!(together.summary, summary);
        assert!(alone.samples().map(|s| (s.requested, s.force, s.estimate.to_vec())).eq(bits(&together)));
    }
}

#[test]
fn the_image_in_qemu_gives_the_bits_of_the_host() {
    let (rig, table) = quadruple();
    let image = std::env::var("IMAGE").unwrap();
    for scenario in scenarios(&rig) {
        let begin = std::time::Instant::now();
        let place = Where::Qemu { image: Path::new(&image), link: Link::Files };
        let qemu = run(&rig, &table, &scenario, place).unwrap();
        println!("{:?} {}", begin.elapsed(), qemu.worst_cycles);
        let host = run(&rig, &table, &scenario, Where::Host).unwrap();
        assert_eq!(qemu.ticks, host.ticks);
        assert!(qemu.summary.stands(), "{:?}", qemu.fault);
    }
}
