//! Gaps and misprints of the paper, each with the readings tried and how many printed numbers each reading reproduces.

use serde::Serialize;

use super::designs::{gain_rows, plant_rows};
use super::rigs::chain;
use super::{ComparedValue, PaperDesigns, PaperRigs, ReproduceError, published};
use upright_design::design::{Certified, Feedback, Laws, continuous_plant, design};
use upright_design::numerics::Wide;
use upright_design::plant::chain_plant;
use upright_design::plant::reference::{Tolerance, integrate};
use upright_design::rig::{PolePlacement, Rig};

/// One erratum or gap.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Erratum {
    /// What is wrong or missing.
    pub what: &'static str,
    /// The correction.
    pub instead: &'static str,
    /// The evidence.
    pub evidence: Vec<Evidence>,
}

/// One reading of the paper and its result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evidence {
    /// The reading.
    pub reading: String,
    /// How many printed numbers it reproduces, or another finding.
    pub outcome: String,
    /// Printed numbers that come out to the last digit, and how many there are; none where it is not about numbers.
    pub agree: Option<[usize; 2]>,
}

/// All errata and gaps, with the evidence for each.
///
/// # Errors
/// [`ReproduceError`] if a design fails that should exist.
pub fn errata(rigs: &PaperRigs, designed: &PaperDesigns) -> Result<Vec<Erratum>, ReproduceError> {
    let (exact, printed) = ((&rigs.exact, &designed.exact), (&rigs.printed, &designed.printed));
    Ok(vec![
        weights(printed)?,
        cart_mass(&rigs.exact)?,
        far_poles(printed)?,
        rate_for_position(&rigs.exact)?,
        rounded_matrices(exact, printed)?,
    ])
}

fn counted(reading: impl Into<String>, rows: &[ComparedValue], of: &str) -> Evidence {
    let agree = [rows.iter().filter(|row| row.is_exact()).count(), rows.len()];
    let outcome = format!("{} of {} printed numbers of {of} come out to the last digit", agree[0], agree[1]);
    Evidence { reading: reading.into(), outcome, agree: Some(agree) }
}

/// A rig file and its design.
type DesignOfPaper<'a> = (&'a Rig, &'a Certified);

fn weights(printed: DesignOfPaper<'_>) -> Result<Erratum, ReproduceError> {
    let mut evidence = Vec::new();
    let pattern: Vec<f64> = [10.0, 1.0].repeat(5);
    let q = published::Q_DIAGONAL;
    for (reading, weights) in [
        ("10 for each position, 1 for each rate", pattern),
        ("the first ten entries as printed", q[..10].to_vec()),
        ("the last ten entries as printed", q[5..].to_vec()),
    ] {
        let mut rig = printed.0.clone();
        if let Some(lqr) = &mut rig.lqr {
            lqr.state_weights = weights;
        }
        let law = lqr_of(&rig, printed)?;
        let rows = gain_rows("LQR", "", &law, &published::LQR_K, published::LQR_N);
        evidence.push(counted(reading, &rows, "K and N"));
    }
    Ok(Erratum {
        what: "Q of the LQR is printed with 15 entries on its diagonal; there are 10 states.",
        instead: "Q = diag(10, 1, 10, 1, 10, 1, 10, 1, 10, 1), R = 1.",
        evidence,
    })
}

fn cart_mass(exact: &Rig) -> Result<Erratum, ReproduceError> {
    let mut evidence = Vec::new();
    for (reading, mass_kg, rods) in [
        ("cart of 0.1 kg, uniform rods", 0.1, true),
        ("cart of 0.0999 kg, uniform rods", 0.0999, true),
        ("cart of 0.1001 kg, uniform rods", 0.1001, true),
        ("cart of 0.1 kg, each mass in the middle of its rod", 0.1, false),
    ] {
        let mut rig = exact.clone();
        if let Some(chain) = rig.chain_mut() {
            chain.cart.mass_kg = Some(mass_kg);
            for link in &mut chain.links {
                link.inertia_kg_m2 = if rods { None } else { Some(0.0) };
            }
        }
        let plant = continuous_plant::<Wide>(&rig)?;
        let rows = plant_rows(&plant.a.rounded(Wide::round_to_f64), &plant.b.rounded(Wide::round_to_f64));
        evidence.push(counted(reading, &rows, "A and B"));
    }
    Ok(Erratum {
        what: "Table 1 lacks the mass of the cart and the inertia of the rods.",
        instead: "A cart of 0.1 kg, and uniform rods: I = m l²/12 about their middle.",
        evidence,
    })
}

fn far_poles(printed: DesignOfPaper<'_>) -> Result<Erratum, ReproduceError> {
    let mut evidence = Vec::new();
    let real = -4.0 / published::SETTLING_TIME_S;
    let imaginary = upright_design::design::dominant_pair::<f64>(
        published::OVERSHOOT_PERCENT,
        published::SETTLING_TIME_S,
    )
    .im;
    let pair = [[10.0 * real, 10.0 * imaginary], [10.0 * real, -10.0 * imaginary]];
    let literal = [[[real, imaginary], [real, -imaginary]].to_vec(), pair.repeat(4)].concat();
    let far = |poles: Vec<f64>| PolePlacement::Response {
        overshoot_percent: published::OVERSHOOT_PERCENT,
        settling_time_s: published::SETTLING_TIME_S,
        far_poles: poles,
    };
    for (reading, placement) in [
        ("-40, -41, … -47", far((40..48).map(|pole| -f64::from(pole)).collect())),
        (
            "-40, -41, … -46, -48",
            far([(40..47).collect(), vec![48]].concat().iter().map(|&pole: &i32| -f64::from(pole)).collect()),
        ),
        ("eight times ten times the real part, -6.67", far(vec![10.0 * real; 8])),
        ("four times the pair of ten times s1 and s2", PolePlacement::Poles(literal)),
    ] {
        let rig = Rig { pole_placement: Some(placement), ..printed.0.clone() };
        let law = placement_of(&rig, printed)?;
        let rows = gain_rows("", "", &law, &published::PLACEMENT_K, published::PLACEMENT_N);
        let mut found = counted(reading, &rows, "K and N");
        let sizes = law.k.entries().iter().map(|gain| gain.abs());
        let [least, most] = [sizes.clone().fold(f64::INFINITY, f64::min), sizes.fold(0.0, f64::max)];
        found.outcome.push_str(&format!("; sizes in K from {least:.1e} to {most:.1e}"));
        evidence.push(found);
    }
    Ok(Erratum {
        what: "The eight far poles are given only as ten times as far as the dominant pair.",
        instead: "They are -40, -41, -42, -43, -44, -45, -46 and -47 1/s.",
        evidence,
    })
}

fn rate_for_position(exact: &Rig) -> Result<Erratum, ReproduceError> {
    let chain = chain(exact)?;
    let mut plant = chain_plant(chain)?;
    let mut state = vec![0.0; plant.states()];
    for (joint, angle) in [(1, 2.0), (2, -0.5), (3, 0.7), (4, 0.3)] {
        state[2 * joint] = angle;
        state[2 * joint + 1] = -angle;
    }
    let mut energy = |state: &[f64]| {
        plant.set_state(state);
        plant.energy().map_or(f64::NAN, |energy| energy.kinetic + energy.potential)
    };
    let before = energy(&state);
    let still = chain_plant(chain)?;
    let tolerance = Tolerance { relative: 1e-12, absolute: 1e-13 };
    let after = energy(&integrate(&*still, &state, |_, _| 0.0, &[0.0; 4], 1.0, tolerance)?);
    let drift = ((after - before) / before).abs();
    Ok(Erratum {
        what: "In the equation solved for q'', the bracket (C + D) multiplies q.",
        instead: "It has to multiply q', as in the equation of motion just before it.",
        evidence: vec![
            Evidence {
                reading: "units".to_owned(),
                outcome: "D in N·m·s/rad times an angle is no torque, and C, linear in the rates, times an angle is none"
                    .to_owned(),
                agree: None,
            },
            Evidence {
                reading: "q', no force, no friction, 1 s of tumbling".to_owned(),
                outcome: format!("the energy changes by {drift:.0e} of itself"),
                agree: None,
            },
            Evidence {
                reading: "either, at rest and upright".to_owned(),
                outcome: "C is 0 there and D is 0 throughout: A, B, K and N are not affected".to_owned(),
                agree: None,
            },
        ],
    })
}

fn rounded_matrices(exact: DesignOfPaper<'_>, printed: DesignOfPaper<'_>) -> Result<Erratum, ReproduceError> {
    let mut evidence = Vec::new();
    for (reading, known) in [("the printed, rounded matrices", printed), ("the exact model", exact)] {
        let lqr = lqr_of(known.0, known)?;
        let mut rows = gain_rows("LQR", "", &lqr, &published::LQR_K, published::LQR_N);
        let placement = placement_of(known.0, known)?;
        rows.extend(gain_rows("", "", &placement, &published::PLACEMENT_K, published::PLACEMENT_N));
        evidence.push(counted(reading, &rows, "both K and N"));
    }
    Ok(Erratum {
        what: "K and N follow from A and B as printed, rounded to six digits.",
        instead: "From the exact model, some of their last digits differ.",
        evidence,
    })
}

/// The LQR of `rig`.
fn lqr_of(rig: &Rig, known: DesignOfPaper<'_>) -> Result<Feedback<f64>, ReproduceError> {
    let alone = Rig { pole_placement: None, kalman: None, ..rig.clone() };
    laws(rig, &alone, known)?.lqr.ok_or(ReproduceError::OneLaw(alone.name))
}

/// The pole placement of `rig`.
fn placement_of(rig: &Rig, known: DesignOfPaper<'_>) -> Result<Feedback<f64>, ReproduceError> {
    let alone = Rig { lqr: None, kalman: None, ..rig.clone() };
    laws(rig, &alone, known)?.pole_placement.ok_or(ReproduceError::OneLaw(alone.name))
}

/// The continuous gains of the known design, if it is that of `rig`; otherwise those of a rig with one law alone.
fn laws(rig: &Rig, alone: &Rig, (known, designed): DesignOfPaper<'_>) -> Result<Laws<f64>, ReproduceError> {
    if rig == known {
        return Ok(designed.double.continuous.clone());
    }
    Ok(design(alone)?.double.continuous)
}
