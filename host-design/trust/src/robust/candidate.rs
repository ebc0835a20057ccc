//! The candidates: multiples of the numbers in the rig file.

use serde::Serialize;
use upright::table::Law;

use upright_design::design::{DesignError, continuous_plant};
use upright_design::number::rounded;
use upright_design::numerics::{Complex, eigenvalues};
use upright_design::rig::{Lqr, PolePlacement, Rig};

const FORCE: [f64; 4] = [1.0, 10.0, 100.0, 1000.0];
const ANGLES: [f64; 4] = [1.0, 10.0, 100.0, 1000.0];
const FAR: [f64; 9] = [1.0, 0.5, 0.6, 0.7, 0.8, 0.9, 1.1, 1.2, 1.4];
const NOISE: [f64; 9] = [1.0, 1.0 / 30.0, 0.1, 1.0 / 3.0, 3.0, 10.0, 30.0, 100.0, 300.0];
/// Digits of a chosen number: the number written into a file is exactly the one that was designed for.
const DIGITS: usize = 6;

/// Candidate numbers for one control law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Candidate {
    /// How the numbers differ from the rig file, in words.
    pub name: String,
    /// The numbers.
    pub numbers: LawNumbers,
}

/// The section of a rig file for a control law.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub enum LawNumbers {
    /// `[lqr]`
    Weights(Lqr),
    /// `[pole_placement]`
    Poles(PolePlacement),
}

impl Candidate {
    /// `rig` with these numbers.
    pub fn applied(&self, rig: &Rig) -> Rig {
        let mut rig = rig.clone();
        match &self.numbers {
            LawNumbers::Weights(weights) => rig.lqr = Some(weights.clone()),
            LawNumbers::Poles(poles) => rig.pole_placement = Some(poles.clone()),
        }
        rig
    }
}

/// The candidates for a law that the rig asks for, the rig's own numbers first.
pub(super) fn candidates(rig: &Rig, law: Law) -> Result<Vec<Candidate>, DesignError> {
    match (law, &rig.lqr, &rig.pole_placement) {
        (Law::Lqr, Some(weights), _) => Ok(weighted(weights, rig.actuator.input().weight_key())),
        (Law::PolePlacement, _, Some(poles)) => placed(rig, poles),
        _ => Ok(Vec::new()),
    }
}

fn weighted(own: &Lqr, weight_key: &str) -> Vec<Candidate> {
    let pairs = FORCE.iter().flat_map(|&force| ANGLES.iter().map(move |&angles| (force, angles)));
    let candidate = |(force, angles): (f64, f64)| {
        let mut state_weights = own.state_weights.clone();
        // x, its rate, θ1, its rate, …
        for weight in state_weights.iter_mut().skip(2).step_by(2) {
            *weight = rounded(angles * *weight, DIGITS);
        }
        let name = match (force, angles) {
            (1.0, 1.0) => "as in the file".to_owned(),
            _ => format!("angle weights × {angles}, {weight_key} × {force}"),
        };
        let force_weight = rounded(force * own.force_weight, DIGITS);
        Candidate { name, numbers: LawNumbers::Weights(Lqr { state_weights, force_weight, ..own.clone() }) }
    };
    pairs.map(candidate).collect()
}

/// Poles given one by one are not changed.
fn placed(rig: &Rig, own: &PolePlacement) -> Result<Vec<Candidate>, DesignError> {
    let as_in_file = Candidate { name: "as in the file".to_owned(), numbers: LawNumbers::Poles(own.clone()) };
    let PolePlacement::Response { overshoot_percent, settling_time_s, far_poles } = own else {
        return Ok(vec![as_in_file]);
    };
    let with = |name: String, far_poles: Vec<f64>| Candidate {
        name,
        numbers: LawNumbers::Poles(PolePlacement::Response {
            overshoot_percent: *overshoot_percent,
            settling_time_s: *settling_time_s,
            far_poles,
        }),
    };
    let mut all = vec![as_in_file];
    for factor in FAR.into_iter().skip(1) {
        let poles = far_poles.iter().map(|pole| rounded(factor * pole, DIGITS)).collect();
        all.push(with(format!("far poles × {factor}"), poles));
    }
    all.push(with("far poles at the plant's own, mirrored".to_owned(), mirrored(rig)?));
    Ok(all)
}

/// The plant's own poles without the two of the cart, the unstable ones mirrored: the limit of an LQR with a large
/// force weight.
fn mirrored(rig: &Rig) -> Result<Vec<f64>, DesignError> {
    let plant = continuous_plant::<f64>(rig)?;
    let poles = eigenvalues(&plant.a).map_err(|_| DesignError::Poles)?;
    let mut distances: Vec<f64> = poles.iter().map(|pole| rounded(Complex::modulus(pole), 4)).collect();
    distances.sort_by(f64::total_cmp);
    Ok(distances.into_iter().skip(2).map(|distance| -distance).collect())
}

/// Multiples of the joint noise, with their factors, the rig's own first; only that if it is zero.
pub(super) fn joint_noises(own: &[f64]) -> Vec<(f64, Vec<f64>)> {
    let factors = if own.iter().all(|&noise| noise == 0.0) { &NOISE[..1] } else { &NOISE[..] };
    let scaled = |&factor: &f64| (factor, own.iter().map(|noise| rounded(factor * noise, DIGITS)).collect());
    factors.iter().map(scaled).collect()
}
