//! The nonlinear half of the trust report, with rigs that must pass and rigs that must fail.

use std::path::Path;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::published::table;
use upright::table::Law;
use upright_design::rig::{PlantDescription, Rig};
use upright_design::simulate::{Disturbance, run};
use upright_design::study::Study;
use upright_design::table::TableValues;
use upright_trust::verify::{
    AttractionSettings, CornerSettings, Effort, EncoderSettings, Horizon, MapAxis, Mass, Spread, attraction,
    attraction_map, coarser, coarsest_encoder, corner_noise, corners, endurance, largest_percent,
    mass_tolerances, monte_carlo, noise_run, sample, trial,
};

const LAWS: [Law; 2] = Law::ALL;
/// The disturbances in the paper: 0.1 N and 3.16e-5 N·m rms.
const PAPERS: Disturbance = Disturbance { force_n: 0.1, torque_n_m: 3.16e-5 };

fn rig(name: &str) -> Rig {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs");
    Rig::from_path(&folder.join(name)).unwrap()
}

fn with_force_limit(mut rig: Rig, limit_n: f64) -> Rig {
    rig.actuator.force_mut().unwrap().limit_n = Some(limit_n);
    rig
}

/// The paper's rig with a force limit of 5 N.
static PAPER: LazyLock<(Rig, TableValues)> = LazyLock::new(|| {
    let rig = with_force_limit(rig("quadruple-paper.toml"), 5.0);
    let table = table(&rig);
    (rig, table)
});
static SINGLE: LazyLock<(Rig, TableValues)> = LazyLock::new(|| {
    let rig = rig("single-quanser-ip02.toml");
    let table = table(&rig);
    (rig, table)
});

#[test]
fn the_edges_of_attraction_are_edges() {
    let (rig, table) = &*SINGLE;
    let settings = AttractionSettings::default();
    let found = attraction(rig, table, Law::Lqr, &settings).unwrap();
    let tilt = &found.tilts[0].edge;
    assert!(tilt.size > 0.05 && tilt.size < 1.0 && !tilt.at_largest_tried, "{found:?}");
    assert!(tilt.peak_force_n > 1.0);
    assert_eq!(found.worst.as_ref().unwrap().edge.size, tilt.size);
    assert!(found.raw_step.as_ref().unwrap().size > 0.05, "{found:?}");

    // The map agrees with the edge on both of its sides.
    let axis = |state, range| MapAxis { state, range, points: 2 };
    let axes = [axis(2, [0.9 * tilt.size, 1.1 * tilt.size]), axis(3, [0.0, 0.01])];
    let map = attraction_map(rig, table, Law::Lqr, axes, &settings.horizon, &|| ()).unwrap();
    assert!(map.settled_s[0][0].is_some() && map.settled_s[0][1].is_none(), "{map:?}");
    let outside = axis(4, [0.0, 1.0]);
    assert!(attraction_map(rig, table, Law::Lqr, [outside, axes[1]], &settings.horizon, &|| ()).is_err());
}

#[test]
fn a_map_of_which_half_is_run_is_the_whole_map() {
    let (rig, table) = &*SINGLE;
    let axis = |state, end: f64| MapAxis { state, range: [-end, end], points: 4 };
    let axes = [axis(2, 0.6), axis(3, 3.0)];
    let horizon = Horizon::default();
    let map =
        |axes: [MapAxis; 2]| attraction_map(rig, table, Law::Lqr, axes, &horizon, &|| ()).unwrap().settled_s;
    let whole = map(axes);
    let start = |axis: MapAxis, index: usize| {
        let value = axis.range[0] + 2.0 * axis.range[1] * index as f64 / 3.0;
        MapAxis { range: [value, value], points: 1, ..axis }
    };
    for (row, column) in [(0, 0), (1, 1), (1, 2), (2, 1), (2, 2), (2, 3), (3, 0), (3, 3)] {
        let alone = map([start(axes[0], column), start(axes[1], row)]);
        assert_eq!(whole[row][column], alone[0][0], "{row} {column}");
    }
    // Negative control: the map is not the same from right to left.
    let reversed = whole.iter().map(|row| row.iter().rev().copied().collect::<Vec<_>>());
    assert!(!reversed.eq(whole.iter().cloned()), "{whole:?}");
}

#[test]
fn links_that_lean_to_different_sides_are_worse() {
    let (rig, table) = &*PAPER;
    let settings = AttractionSettings { relative: 0.1, ..AttractionSettings::default() };
    let found = attraction(rig, table, Law::Lqr, &settings).unwrap();
    let worst = found.worst.unwrap();
    assert_eq!((found.tilts.len(), worst.tried), (4, 8));
    assert!(worst.edge.size > 0.0);
    assert!(found.tilts.iter().all(|tilt| tilt.edge.size >= worst.edge.size), "{:?} {worst:?}", found.tilts);
    assert!(worst.signs.windows(2).any(|pair| pair[0] != pair[1]), "{worst:?}");
}

#[test]
fn too_weak_a_motor_holds_less_and_finally_nothing() {
    let settings = AttractionSettings { relative: 0.1, ..AttractionSettings::default() };
    let (strong, strong_table) = &*SINGLE;
    let edge = |rig: &Rig, table: &TableValues| {
        attraction(rig, table, Law::Lqr, &settings).unwrap().tilts[0].edge.size
    };
    // A quarter of the supply, and a table for it: the edge is lower.
    let mut weak = strong.clone();
    weak.actuator.motor_mut().unwrap().supply_v /= 4.0;
    assert!(edge(&weak, &table(&weak)) < 0.7 * edge(strong, strong_table));

    let (paper, _) = &*PAPER;
    let feeble = with_force_limit(paper.clone(), 0.05);
    let found = endurance(&feeble, &table(&feeble), Law::Lqr, &PAPERS, 2, 5.0).unwrap();
    assert_eq!(found.survived, 0, "0.05 N against noise of 0.1 N");
    let noise = noise_run(&feeble, &table(&feeble), Law::Lqr, &PAPERS, 2, 5.0).unwrap();
    assert_eq!((noise.survived, noise.ripple), (0, None), "no figure is computed from runs that fall");
}

#[test]
fn the_papers_rig_survives_for_long_in_noise() {
    let (rig, table) = &*PAPER;
    for law in LAWS {
        let found = endurance(rig, table, law, &PAPERS, 4, 20.0).unwrap();
        assert_eq!((found.survived, found.fallen.len()), (4, 0), "{law:?}");
        let noise = noise_run(rig, table, law, &PAPERS, 4, 5.0).unwrap();
        assert_eq!(noise.survived, 4);
        // The force has to compensate the disturbances of the cart.
        let ripple = noise.ripple.as_ref().unwrap();
        assert!(ripple.force_rms_n > 0.1 && ripple.force_peak_n <= 5.0, "{ripple:?}");
        assert!(ripple.angle_rms_rad.iter().all(|&rms| rms > 1e-5 && rms < 0.05), "{ripple:?}");
    }
}

#[test]
fn every_corner_of_two_percent_wrong_masses_survives() {
    let (rig, table) = &*PAPER;
    for law in LAWS {
        let settings = CornerSettings { disturbance: PAPERS, ..CornerSettings::of(rig) };
        let found = corners(rig, table, law, 2.0, &settings).unwrap();
        assert_eq!((found.survived, found.corners), (32, 32), "{law:?}: {:?}", found.lost);
    }
}

#[test]
fn wrong_masses_and_friction_together_fell_a_loop_that_survives_each_alone() {
    let robust = rig("quadruple-robust.toml");
    let survived = |rig: &Rig| {
        corner_noise(rig, &table(rig), Law::PolePlacement, &PAPERS).map(|found| [found.survived, found.runs])
    };
    assert_eq!(survived(&robust).unwrap(), [32, 32]);
    // Less noise in the observer: enough for masses alone and for friction alone.
    let mut less = robust;
    less.kalman.as_mut().unwrap().joint_noise = vec![9e-11; 4];
    let [survives, all] = survived(&less).unwrap();
    assert!(survives < all, "{survives} of {all}");
    let mut alone = less.clone();
    alone.robust.as_mut().unwrap().joint_friction_n_m = 0.0;
    assert_eq!(survived(&alone).unwrap(), [32, 32]);
    let mut alone = less;
    alone.robust.as_mut().unwrap().mass_percent = 0.0;
    assert_eq!(survived(&alone).unwrap(), [32, 32]);
}

#[test]
fn masses_wrong_by_a_third_do_not_stand_and_the_weakest_is_named() {
    let (rig, table) = &*PAPER;
    let settings = CornerSettings { disturbance: PAPERS, ..CornerSettings::of(rig) };
    let found = corners(rig, table, Law::Lqr, 30.0, &settings).unwrap();
    assert!(found.survived < 24, "{}", found.survived);
    let first = |fall: &Option<upright_design::simulate::Fall>| fall.as_ref().unwrap().at_s;
    let at_s = first(&found.weakest.outcome.fall);
    let fallen = found.lost.iter().filter(|corner| corner.outcome.fall.is_some());
    assert!(fallen.map(|corner| first(&corner.outcome.fall)).all(|other| at_s <= other));

    let percent = largest_percent(rig, table, Law::Lqr, &settings, 1.0, 30.0).unwrap();
    assert!((2.0..30.0).contains(&percent), "{percent}");
    let tolerances = mass_tolerances(rig, table, Law::Lqr, &settings).unwrap();
    assert_eq!(tolerances.len(), 5);
    assert!(tolerances.windows(2).all(|pair| pair[0].percent() <= pair[1].percent()));
    assert!(tolerances[0].percent() >= percent, "all at once is worse than one alone: {tolerances:?}");
    assert!(tolerances.iter().any(|tolerance| tolerance.mass == Mass::Cart));
}

fn effort(seed: u64, runs: usize, study: &Study) -> Effort<'_> {
    Effort { runs, seed, late: 0.0, study }
}

#[test]
fn monte_carlo_does_not_depend_on_the_threads_and_its_worst_case_can_be_replayed() {
    let (rig, table) = &*PAPER;
    let mut spread = Spread { disturbance: PAPERS, ..Spread::of(rig) };
    spread.duration_s = 3.0;
    // Errors large enough that some runs fall.
    (spread.mass, spread.length, spread.inertia) = (0.15, 0.1, 0.15);
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let done = AtomicUsize::new(0);
        let count = || {
            done.fetch_add(1, Ordering::Relaxed);
        };
        let found = pool.install(|| {
            monte_carlo(rig, table, Law::Lqr, &spread, &effort(7, 60, &Study::whole()), &count).unwrap()
        });
        assert_eq!(done.into_inner(), 60);
        found
    };
    let found = with_threads(1);
    assert_eq!(found, with_threads(3));
    assert!(found.survived > 0 && found.survived < 60, "{found:?}");
    let [low, high] = found.interval;
    assert!(0.0 < low && low < found.success_rate && found.success_rate < high && high < 1.0);

    let worst = found.worst.unwrap();
    let (plant, scenario) = sample(rig, Law::Lqr, &spread, worst.seed);
    assert_eq!(run(&plant, table, &scenario, &mut |_| ()).unwrap(), worst.outcome.fall);
    assert_eq!(trial(&plant, table, &scenario, &Horizon::default()).unwrap(), worst.outcome);
}

#[test]
fn a_drawn_plant_is_within_its_spread() {
    let (rig, _) = &*PAPER;
    let spread = Spread { other_delay: 0.5, ..Spread::of(rig) };
    let masses = |rig: &Rig| match &rig.plant {
        PlantDescription::Chain(chain) => chain.links.iter().map(|link| link.mass_kg).collect::<Vec<_>>(),
        PlantDescription::Model(_) => Vec::new(),
    };
    let mut late = 0;
    for seed in 0..200 {
        let (plant, scenario) = sample(rig, Law::Lqr, &spread, seed);
        assert!(
            masses(&plant).iter().zip(masses(rig)).all(|(drawn, given)| (drawn / given - 1.0).abs() <= 0.02)
        );
        assert!(scenario.start[2].abs() <= spread.tilt_rad && scenario.seed == seed);
        late += plant.tick.delay_ticks;
    }
    assert!((60..140).contains(&late), "{late} of 200 late");
    let spread = Spread { mass: 1.5, ..spread };
    assert!(monte_carlo(rig, &PAPER.1, Law::Lqr, &spread, &effort(0, 1, &Study::whole()), &|| ()).is_err());
}

#[test]
fn too_coarse_an_encoder_falls_and_the_coarsest_is_found() {
    let (rig, _) = &*PAPER;
    let settings = EncoderSettings {
        duration_s: 5.0,
        disturbance: PAPERS,
        seeds: 2,
        largest_factor: 64.0,
        relative: 0.5,
    };
    let found = coarsest_encoder(rig, Law::Lqr, &settings).unwrap();
    let factor = found.factor.unwrap();
    assert!((1.0..64.0).contains(&factor) && !found.at_largest_tried, "{found:?}");
    let coarse = coarser(rig, 64.0);
    let found = endurance(&coarse, &table(&coarse), Law::Lqr, &PAPERS, 2, 5.0).unwrap();
    assert_eq!(found.survived, 0, "64 counts per revolution");
}

#[test]
fn a_model_has_no_masses() {
    let rig = rig("quadruple-paper-printed.toml");
    let table = table(&rig);
    let error = corners(&rig, &table, Law::Lqr, 2.0, &CornerSettings::of(&rig)).unwrap_err();
    assert!(error.to_string().contains("no masses"), "{error}");
    assert!(coarsest_encoder(&rig, Law::Lqr, &EncoderSettings::of(&rig)).is_err());
    let found = attraction(&rig, &table, Law::Lqr, &AttractionSettings::default()).unwrap();
    assert!(found.tilts.is_empty() && found.worst.is_none() && found.raw_step.unwrap().at_largest_tried);
}
