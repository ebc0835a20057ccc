//! Machines that differ from their file, and how many of the stated intervals cover the truth.

use std::path::{Path, PathBuf};

use upright_design::rig::{FrictionLaw, Rig};
use upright_design::study::Study;
use upright_identify::{
    CoverageError, CoveredQuantity, Doubt, Drawn, DrawnMachine, Missed, ParameterKind, Settings,
    TrueFriction, coverage, identified, identify, shake,
};

fn rig(name: &str) -> Rig {
    Rig::from_path(Path::new(&format!("../../rigs/{name}.toml"))).unwrap()
}

const DRAWN: Drawn = Drawn {
    runs: 2,
    off_percent: 10.0,
    seconds: 8.0,
    friction: TrueFriction::OfFile,
    seed: 5,
    trust_wiring: true,
};

#[test]
fn a_machine_is_the_same_every_time_and_within_what_is_stated() {
    let file = rig("triple-glueck-eder-kugi");
    let draw = |off_percent: f64, number: u64| {
        DrawnMachine::draw(&file, off_percent, TrueFriction::OfFile, 5, number).unwrap()
    };
    for number in 0..20 {
        let machine = draw(10.0, number);
        let parameters = &machine.rig.reality.parameters;
        let of_links = [&parameters.link_mass_percent, &parameters.link_length_percent];
        assert!(
            of_links.iter().all(|each| (0..3).all(|link| each.of_joint(link).abs() <= 10.0)),
            "{parameters:?}"
        );
        let delay = machine.truth(ParameterKind::Delay).unwrap();
        assert!((0.0..1.0).contains(&delay), "{delay}");
        // The file has 10 N s/m and 1 % of the weight is 0.62 N.
        let [viscous, dry] =
            [ParameterKind::CartViscous, ParameterKind::CartDry].map(|kind| machine.truth(kind).unwrap());
        assert!((10.0 / 3.0..=30.0).contains(&viscous) && (0.2..=1.9).contains(&dry), "{viscous} {dry}");
    }
    assert_eq!(draw(10.0, 3), draw(10.0, 3));
    assert_ne!(draw(10.0, 3).rig, draw(10.0, 4).rig);
    // The file has the right masses and lengths here.
    let exact = draw(0.0, 3);
    assert_eq!(exact.truth(ParameterKind::Length(1)), Some(0.419));
    assert!((exact.truth(ParameterKind::TotalMass).unwrap() - 6.367).abs() < 1e-9);
}

#[test]
fn other_laws_of_friction_are_drawn_for_the_same_machines() {
    let file = rig("double-quanser-dbpen");
    let draw = |law: TrueFriction| DrawnMachine::draw(&file, 10.0, law, 5, 2).unwrap();
    let own = draw(TrueFriction::OfFile);
    for (law, expected) in [
        (TrueFriction::Stribeck, FrictionLaw::ElastoPlastic),
        (TrueFriction::Tanh, FrictionLaw::Creeping),
        (TrueFriction::Dahl, FrictionLaw::Dahl),
        (TrueFriction::LuGre, FrictionLaw::Dahl),
    ] {
        let other = draw(law);
        assert_eq!(other.rig.reality.friction_law, expected);
        // The friction in motion is the same; an excess at rest is there only where the law has one.
        let kinds = [ParameterKind::CartDry, ParameterKind::JointDry(1), ParameterKind::Delay];
        assert!(kinds.iter().all(|&kind| other.truth(kind) == own.truth(kind)));
        let excess = other.rig.reality.friction.breakaway_percent;
        let has_excess = matches!(law, TrueFriction::Stribeck | TrueFriction::LuGre);
        assert!(if has_excess { (20.0..=60.0).contains(&excess) } else { excess == 0.0 }, "{excess}");
    }
}

/// Its first fit weighs the channels so that an encoder with half the counts fits better.
#[test]
fn a_machine_whose_fit_is_slow_is_not_accused_of_its_wiring() {
    let drawn = Drawn { seconds: 20.0, seed: 1, trust_wiring: false, ..DRAWN };
    let found = identified(&rig("single-quanser-ip02"), &drawn, 38).unwrap();
    assert_eq!(found.refused, None);
}

#[test]
fn intervals_that_cover_the_truth_are_counted() {
    let file = rig("single-quanser-ip02");
    let found = coverage(&file, &DRAWN, &Study::whole(), &|| ()).unwrap();
    assert_eq!((found.machines, found.refused.len()), (2, 0), "{found:?}");
    let row = |quantity: CoveredQuantity| found.rows.iter().find(|row| row.quantity == quantity);
    // One link has no length that matters, and two moments.
    assert!(row(CoveredQuantity::Length).is_none());
    let (moments, scale) = (row(CoveredQuantity::Moment).unwrap(), row(CoveredQuantity::Scale).unwrap());
    assert_eq!((moments.count, scale.covered), (4, None));
    let [numbers, covered] = [|row: &_| count(row).0, |row: &_| count(row).1]
        .map(|of: fn(&upright_identify::CoverageRow) -> usize| found.rows.iter().map(of).sum::<usize>());
    assert!(covered * 10 >= numbers * 8, "{covered} of {numbers}: {found:?}");
    // Negative control: a hundredth of the deviations covers hardly anything.
    let missed = |missed: &&Missed| missed.deviation.is_some_and(|s| missed.error.abs() > 0.0196 * s);
    let one = identified(&file, &DRAWN, 0).unwrap();
    let outside = one.missed.iter().filter(missed).count();
    assert!(outside >= 7, "{outside} of {}: {one:?}", one.missed.len());
}

/// How many numbers have an interval, and how many of these intervals cover the truth.
fn count(row: &upright_identify::CoverageRow) -> (usize, usize) {
    row.covered.map_or((0, 0), |covered| (row.count, covered))
}

#[test]
fn a_rig_without_encoders_has_no_coverage() {
    let mut file = rig("single-quanser-ip02");
    if let Some(chain) = file.chain_mut() {
        chain.links[0].encoder = None;
    }
    let found = coverage(&file, &DRAWN, &Study::whole(), &|| ());
    assert!(matches!(found, Err(CoverageError::Identify(_))), "{found:?}");
}

/// What casts doubt on the identification of drawn machine `number` with this law of friction.
fn doubts(law: TrueFriction, number: u64) -> Vec<Doubt> {
    let file = rig("single-quanser-ip02");
    let machine = DrawnMachine::draw(&file, 10.0, law, 5, number).unwrap();
    let log = shake(&machine.rig, 12.0, number).unwrap();
    let settings = Settings { trust_wiring: true, ..Settings::default() };
    let mut doubts = identify(&file, &[(PathBuf::from("run.log"), log)], &settings, &|_| ()).unwrap().doubts;
    // A drawn machine has another travel per count than its file, which is told.
    doubts.retain(|doubt| !matches!(doubt, Doubt::Travel { .. }));
    doubts
}

#[test]
fn a_law_of_friction_that_is_not_that_of_the_file_is_named() {
    // The negative control: nothing is said of the law of the file.
    assert_eq!(doubts(TrueFriction::OfFile, 0), []);
    let never_sticks =
        |doubt: &Doubt| matches!(doubt, Doubt::NeverSticks(speed) if (0.001..0.02).contains(speed));
    let creeping = doubts(TrueFriction::Tanh, 0);
    assert!(creeping.iter().any(never_sticks), "{creeping:?}");
    for law in [TrueFriction::Stribeck, TrueFriction::LuGre] {
        let found = doubts(law, 0);
        assert!(matches!(found[..], [Doubt::LargerAtRest([cart, _])] if cart > 0.1), "{law:?}: {found:?}");
    }
}

#[test]
fn friction_that_falls_with_another_speed_than_usual_is_found() {
    let drawn = Drawn { friction: TrueFriction::LuGre, seconds: 20.0, seed: 1, ..DRAWN };
    let one = identified(&rig("single-quanser-ip02"), &drawn, 9).unwrap();
    for quantity in [CoveredQuantity::CartDry, CoveredQuantity::CartViscous] {
        let missed = one.missed.iter().find(|missed| missed.quantity == quantity).unwrap();
        let deviation = missed.deviation.unwrap();
        // With the usual speed, the errors are 3 and 2 deviations.
        assert!(missed.error.abs() < deviation, "{missed:?}");
        // The negative control: the interval is not so wide that it would cover anything.
        assert!(deviation < 0.03, "{missed:?}");
    }
}
