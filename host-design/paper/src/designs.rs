//! A, B, K, N and poles, compared with the printed ones.

use serde::Serialize;

use upright::table::Law;

use super::comparison::{ComparedValue, Digits};
use super::{PaperDesigns, PaperRigs, ReproduceError, published};
use upright_design::design::{Feedback, continuous_plant, dominant_pair};
use upright_design::numerics::{Complex, Matrix, Wide, eigenvalues};
use upright_design::rig::Rig;

/// Comparison of the linear models and designs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Designs {
    /// Every number that the paper prints (entries of A that are 0 or 1 by definition are left out), and those that
    /// its formulas for the dominant poles give.
    pub rows: Vec<ComparedValue>,
    /// Poles. The paper prints none.
    pub poles: Vec<PoleSet>,
}

/// Poles of one loop.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PoleSet {
    /// Name of the loop.
    pub of: String,
    /// [re, im] (1/s), by real part.
    pub poles: Vec<[f64; 2]>,
}

const EXACT: &str = "exact model";
const PRINTED: &str = "printed A and B";

/// Compares both laws, designed from the exact model and from the printed matrices.
///
/// # Errors
/// [`ReproduceError`] if poles cannot be computed.
pub fn designs(
    rigs: &PaperRigs,
    PaperDesigns { exact, printed }: &PaperDesigns,
) -> Result<Designs, ReproduceError> {
    let mut rows = plant_rows(&exact.double.a, &exact.double.b);
    rows.extend(dominant_rows());
    for (from, certified) in [(PRINTED, printed), (EXACT, exact)] {
        let designed = certified.double.continuous.each();
        for (law, gains) in designed.present() {
            let (k, n) = published::gains(law);
            rows.extend(gain_rows(&law.to_string(), from, gains, k, n));
        }
    }

    let mut poles = vec![PoleSet { of: "open loop".to_owned(), poles: open_loop_poles(&rigs.exact)? }];
    for (law, found) in exact.poles(&rigs.exact)?.continuous.present() {
        poles.push(PoleSet { of: format!("{law}, exact gains"), poles: found.clone() });
    }
    for law in Law::ALL {
        let (k, _) = published::gains(law);
        let k = Matrix::from_fn(1, 10, |_, j| super::comparison::value_of(k[j]));
        let closed = &exact.double.a - &(&exact.double.b * &k);
        let found = eigenvalues(&closed).map_err(|_| upright_design::design::DesignError::Poles)?;
        let poles_found = found.iter().map(Complex::to_f64).collect();
        poles.push(PoleSet { of: format!("{law}, gains as printed (two decimals)"), poles: poles_found });
    }
    Ok(Designs { rows, poles })
}

/// Poles of the plant alone [re, im] (1/s), by real part; its two integrators exactly 0.
pub(crate) fn open_loop_poles(rig: &Rig) -> Result<Vec<[f64; 2]>, ReproduceError> {
    let a = continuous_plant::<Wide>(rig)?.a;
    let poles = eigenvalues(&a).map_err(|_| upright_design::design::DesignError::Poles)?;
    // A double pole is found with half of the bits.
    let clean = |part: f64| if part.abs() < 1e-30 { 0.0 } else { part };
    Ok(poles.iter().map(|pole| pole.to_f64().map(clean)).collect())
}

pub(crate) fn plant_rows(a: &Matrix<f64>, b: &Matrix<f64>) -> Vec<ComparedValue> {
    let six = Digits::Significant(6);
    let mut rows = Vec::new();
    for (i, entries) in published::A.iter().enumerate() {
        for (j, printed) in entries.iter().enumerate() {
            // Positions are integrals of rates: 0 and 1 by the order of the states.
            if i % 2 == 1 && (*printed != "0" || a[(i, j)] != 0.0) {
                let name = format!("A[{},{}]", i + 1, j + 1);
                rows.push(ComparedValue::printed(name, EXACT, printed, six, a[(i, j)]));
            }
        }
    }
    for (i, printed) in published::B.iter().enumerate().filter(|(i, _)| i % 2 == 1) {
        rows.push(ComparedValue::printed(format!("B[{}]", i + 1), EXACT, printed, six, b[(i, 0)]));
    }
    rows
}

pub(crate) fn gain_rows(
    law: &str,
    from: &'static str,
    ours: &Feedback<f64>,
    k: &[&'static str; 10],
    n: &'static str,
) -> Vec<ComparedValue> {
    let gains = k.iter().zip(ours.k.entries()).enumerate().map(|(i, (printed, &ours))| {
        ComparedValue::printed(format!("{law} K[{}]", i + 1), from, printed, Digits::Decimals(2), ours)
    });
    let mut rows: Vec<ComparedValue> = gains.collect();
    let ours = ours.n.unwrap_or(f64::NAN);
    rows.push(ComparedValue::printed(format!("{law} N"), from, n, Digits::Decimals(4), ours));
    rows
}

/// The paper's formulas for the dominant pair, with its 1 % and 6 s: it prints no result.
fn dominant_rows() -> Vec<ComparedValue> {
    let pair = dominant_pair::<Wide>(published::OVERSHOOT_PERCENT, published::SETTLING_TIME_S);
    let [natural, re, im] = [pair.modulus(), pair.re, pair.im].map(|part| part.round_to_f64());
    let from = "formulas";
    vec![
        ComparedValue::not_printed("damping ε of the dominant pair", from, -re / natural),
        ComparedValue::not_printed("natural frequency ωn (rad/s)", from, natural),
        ComparedValue::not_printed("real part of s1 and s2 (1/s)", from, re),
        ComparedValue::not_printed("imaginary part of s1, minus that of s2 (1/s)", from, im),
    ]
}
