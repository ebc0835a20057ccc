//! Time of one derivative of the nonlinear plant, for chains of 1 to 8 links, and of one second of simulation:
//! `cargo bench -p upright-design --bench plant`.

#![allow(missing_docs)] // criterion's macro generates a public function without documentation

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main, measurement::WallTime};
use upright_design::plant::{ChainPlant, WideChainState, chain_plant};
use upright_design::rig::{Cart, Chain, Link};

/// Uniform rods like the paper's, with friction, so that no term vanishes.
fn rods(links: usize) -> Chain {
    let link = |i: usize| Link {
        mass_kg: 0.1,
        length_m: 0.03 + 0.02 * i as f64,
        centre_of_mass_m: None,
        inertia_kg_m2: None,
        friction_n_m_s_per_rad: 1e-5,
        encoder: None,
    };
    Chain {
        cart: Cart { mass_kg: 0.1, friction_n_s_per_m: 0.1, travel_m: [-1.0, 1.0], encoder_step_m: None },
        links: (0..links).map(link).collect(),
        gravity_m_per_s2: 9.81,
    }
}

fn bent<const N: usize>() -> WideChainState<N> {
    WideChainState {
        x: 0.1,
        xdot: -0.3,
        phi: core::array::from_fn(|i| 0.2 - 0.9 * i as f64),
        phidot: core::array::from_fn(|i| 1.0 + 0.5 * i as f64),
    }
}

fn derivative<const N: usize>(group: &mut BenchmarkGroup<'_, WallTime>) {
    let plant = ChainPlant::<N>::of(&rods(N)).expect("N links");
    let (state, torques) = (bent::<N>(), [1e-3; N]);
    group.bench_function(N.to_string(), |bencher| {
        bencher.iter(|| plant.derivative(black_box(&state), black_box(0.5), black_box(&torques)));
    });
}

/// One second in ticks of 1 ms with four Runge–Kutta steps each, as a closed-loop simulation runs it.
fn simulated_second(group: &mut BenchmarkGroup<'_, WallTime>, links: usize) {
    let mut plant = chain_plant(&rods(links)).expect("a supported size");
    let torques = vec![0.0; links];
    let mut start = vec![0.0; plant.states()];
    start[2] = core::f64::consts::PI + 0.5;
    group.bench_function(links.to_string(), |bencher| {
        bencher.iter(|| {
            plant.set_state(&start);
            for _ in 0..1000 {
                plant.advance(black_box(0.01), black_box(&torques), 1e-3, 4);
            }
        });
    });
}

fn plant(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("derivative, by number of links");
    derivative::<1>(&mut group);
    derivative::<2>(&mut group);
    derivative::<3>(&mut group);
    derivative::<4>(&mut group);
    derivative::<5>(&mut group);
    derivative::<6>(&mut group);
    derivative::<7>(&mut group);
    derivative::<8>(&mut group);
    group.finish();
    let mut group = criterion.benchmark_group("simulated second, by number of links");
    for links in [1, 2, 4, 8, 14] {
        simulated_second(&mut group, links);
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().warm_up_time(Duration::from_millis(300)).measurement_time(Duration::from_secs(1));
    targets = plant
}
criterion_main!(benches);
