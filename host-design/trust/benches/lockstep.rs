//! How fast the whole loop of the paper's quadruple runs alone and in lockstep, on one core: `cargo bench -p
//! upright-design --bench lockstep`. Fails if lockstep is not worth it.

use std::time::Instant;

use upright::table::Law;
use upright_design::plant::LANES;
use upright_design::simulate::{Job, Sample, run, run_all};
use upright_test_support::published::{rig, table};
use upright_trust::verify::{Spread, sample};

/// So many times as fast as alone lockstep has to be. Measured with AVX-512: 2.3 times.
const LEAST_GAIN: f64 = 1.3;

fn main() {
    let rig = rig("quadruple-paper");
    let table = table(&rig);
    // Short runs, so that some of them are not interrupted by other programs.
    let spread = Spread { duration_s: 0.5, ..Spread::of(&rig) };
    let cases: Vec<_> = (0..LANES as u64).map(|seed| sample(&rig, Law::Lqr, &spread, seed)).collect();
    let simulated_s: f64 = cases.iter().map(|(_, scenario)| scenario.duration_s).sum();
    let (mut alone, mut in_lockstep) = (0.0f64, 0.0f64);
    for _ in 0..300 {
        let start = Instant::now();
        for (rig, scenario) in &cases {
            run(rig, &table, scenario, &mut |_| ()).unwrap();
        }
        alone = alone.max(simulated_s / start.elapsed().as_secs_f64());
        let mut observers = vec![|_: &Sample<&[f64]>| (); cases.len()];
        let jobs = observers.iter_mut().zip(&cases);
        let mut jobs: Vec<Job<'_>> =
            jobs.map(|(observe, (rig, scenario))| Job { table: &table, rig, scenario, observe }).collect();
        let start = Instant::now();
        run_all(&mut jobs).unwrap();
        in_lockstep = in_lockstep.max(simulated_s / start.elapsed().as_secs_f64());
    }
    let gain = in_lockstep / alone;
    println!(
        "simulated seconds per second and core: alone {alone:.0}, in lockstep {in_lockstep:.0}, {gain:.2} times"
    );
    assert!(gain >= LEAST_GAIN, "less than {LEAST_GAIN} times");
}
