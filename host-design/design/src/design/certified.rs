//! Certification that every gain is the correctly rounded exact answer.

use super::error::DesignError;
use super::loops::DesignPoles;
use super::synthesis::{Design, Laws, continuous_plant};
use crate::numerics::{Wide, with_precision};
use crate::parallel;
use crate::rig::Rig;
use upright::table::Law;

/// A design whose numbers all round to the same values at two precisions.
///
/// The `f64` values of the rig file state the problem. It is solved with at least 256 bits, then again with twice as
/// many. If any entry rounds to a different `f64` or `f32`, the precision is doubled, and so on.
#[derive(Debug, Clone, PartialEq)]
pub struct Certified {
    /// Every value rounded once to `f64`.
    pub double: Design<f64>,
    /// Every value rounded once to `f32` (not by way of `f64`): what goes into the table.
    pub single: Design<f32>,
    /// The two precisions that agreed (bits).
    pub bits: [usize; 2],
    /// The design at the higher of them.
    exact: Design<Wide>,
}

impl Certified {
    /// Poles of the closed loops of this design for `rig`. They take as long as the design, so they are computed only
    /// for whoever looks at them.
    ///
    /// # Errors
    /// [`DesignError::Poles`] if the eigenvalue iteration fails.
    pub fn poles(&self, rig: &Rig) -> Result<DesignPoles, DesignError> {
        with_precision(self.bits[1], || self.exact.poles(rig))
    }
}

/// A design at one precision, rounded like a certified one but not certified: for ranking designs and for trials.
/// Those for trials have no gains for continuous time.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertified {
    /// Rounded to f64.
    pub double: Design<f64>,
    /// Rounded to f32, as in the table.
    pub single: Design<f32>,
}

impl Uncertified {
    /// The gains for the tick, at the first of the precisions that [`design`] compares.
    pub fn sampled_alone(rig: &Rig) -> Result<Self, DesignError> {
        with_precision(FIRST_BITS, || {
            let plant = continuous_plant::<Wide>(rig)?;
            Ok(Self::rounded(&Design::sampled_alone(rig, plant, &mut Vec::new())?))
        })
    }

    fn rounded(design: &Design<Wide>) -> Self {
        Self { double: design.rounded(Wide::round_to_f64), single: design.rounded(Wide::round_to_f32) }
    }

    /// This design with `law` taken from `other`, a design for the same plant.
    pub fn with_law_of(mut self, law: Law, other: &Self) -> Self {
        self.double.sampled.exchange(law, &other.double.sampled);
        self.single.sampled.exchange(law, &other.single.sampled);
        self
    }
}

impl From<Certified> for Uncertified {
    fn from(Certified { double, single, .. }: Certified) -> Self {
        Self { double, single }
    }
}

impl<T: Clone> Laws<T> {
    /// Takes `law` from `other`.
    fn exchange(&mut self, law: Law, other: &Self) {
        match law {
            Law::Lqr => (self.lqr, self.integral) = (other.lqr.clone(), other.integral.clone()),
            Law::PolePlacement => self.pole_placement = other.pole_placement.clone(),
        }
    }
}

/// The first precision that is tried (bits).
const FIRST_BITS: usize = 256;

/// A design at one precision, rounded and as it is.
type Attempt = Result<(Uncertified, Design<Wide>), DesignError>;

fn attempt(rig: &Rig, bits: usize) -> Attempt {
    with_precision(bits, || {
        let design = Design::<Wide>::of(rig)?;
        Ok((Uncertified::rounded(&design), design))
    })
}

fn certified((rounded, exact): (Uncertified, Design<Wide>), bits: usize) -> Certified {
    Certified { double: rounded.double, single: rounded.single, bits: [bits / 2, bits], exact }
}

/// Designs what `rig` asks for and certifies it.
///
/// # Errors
/// [`DesignError`] with the reason on which two precisions agree; [`DesignError::Disagreement`] if even the two
/// highest precisions give different gains.
#[doc(alias = "lqr")]
#[doc(alias = "dlqr")]
#[doc(alias = "acker")]
#[doc(alias = "kalman")]
pub fn design(rig: &Rig) -> Result<Certified, DesignError> {
    let (mut first, second) = parallel::beside(
        1,
        &|_| attempt(rig, FIRST_BITS).map(|(design, _)| design), //
        || attempt(rig, 2 * FIRST_BITS),
    );
    let first = first.swap_remove(0);
    if agree(&first, &second) {
        return second.map(|second| certified(second, 2 * FIRST_BITS));
    }
    let mut before = second;
    for bits in [1024, 2048, 4096] {
        let after = attempt(rig, bits);
        if agree(&before.map(|(design, _)| design), &after) {
            return after.map(|after| certified(after, bits));
        }
        before = after;
    }
    Err(before.err().unwrap_or(DesignError::Disagreement(2048, 4096)))
}

fn agree(low: &Result<Uncertified, DesignError>, high: &Attempt) -> bool {
    match (low, high) {
        (Ok(low), Ok((high, _))) => low == high,
        // A failure to resolve the problem does not count as agreement: more bits may help.
        (_, Err(DesignError::Unresolved { .. } | DesignError::NoKalman { .. })) => false,
        (Err(low), Err(high)) => core::mem::discriminant(low) == core::mem::discriminant(high),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn the_first_precision_has_the_certified_numbers_of_the_rigs_here() {
        for name in
            ["single-quanser-ip02", "double-quanser-dbpen", "triple-glueck-eder-kugi", "quadruple-paper"]
        {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../rigs/{name}.toml"));
            let rig = Rig::from_path(&file).unwrap();
            let (quick, certified) = (Uncertified::sampled_alone(&rig).unwrap(), design(&rig).unwrap());
            let Design { sampled, kalman, .. } = quick.double;
            assert!(sampled == certified.double.sampled && kalman == certified.double.kalman, "{name}");
            let Design { sampled, kalman, .. } = quick.single;
            assert!(sampled == certified.single.sampled && kalman == certified.single.kalman, "{name}");
        }
    }

    #[test]
    fn a_design_in_double_precision_has_other_numbers() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs/quadruple-paper.toml");
        let rig = Rig::from_path(&file).unwrap();
        let double = Design::<f64>::of(&rig);
        assert!(double.map_or(true, |double| double != design(&rig).unwrap().double));
    }
}
