//! Certification that every gain is the correctly rounded exact answer.

use super::error::DesignError;
use super::loops::DesignPoles;
use super::synthesis::{Design, Laws};
use crate::numerics::{Wide, with_precision};
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
    /// Poles of the closed loops.
    pub poles: DesignPoles,
    /// The two precisions that agreed (bits).
    pub bits: [usize; 2],
}

impl Certified {
    /// This design with the law `law` of `other`, a design for the same plant: every number stays a certified one.
    pub(crate) fn with_law_of(mut self, law: Law, other: &Self) -> Self {
        fn exchange<T: Clone>(laws: &mut Laws<T>, law: Law, other: &Laws<T>) {
            match law {
                Law::Lqr => (laws.lqr, laws.integral) = (other.lqr.clone(), other.integral.clone()),
                Law::PolePlacement => laws.pole_placement = other.pole_placement.clone(),
            }
        }
        exchange(&mut self.double.continuous, law, &other.double.continuous);
        exchange(&mut self.double.sampled, law, &other.double.sampled);
        exchange(&mut self.single.continuous, law, &other.single.continuous);
        exchange(&mut self.single.sampled, law, &other.single.sampled);
        self.poles.continuous[law] = other.poles.continuous[law].clone();
        self.poles.sampled[law] = other.poles.sampled[law].clone();
        if law == Law::Lqr {
            self.poles.integral = other.poles.integral.clone();
        }
        self
    }
}

type Attempt = Result<Certified, DesignError>;

fn attempt(rig: &Rig, bits: usize) -> Attempt {
    with_precision(bits, || {
        let design = Design::<Wide>::of(rig)?;
        Ok(Certified {
            double: design.rounded(Wide::round_to_f64),
            single: design.rounded(Wide::round_to_f32),
            poles: design.poles(rig)?,
            bits: [bits / 2, bits],
        })
    })
}

/// Designs what `rig` asks for and certifies it.
///
/// # Errors
/// [`DesignError`] with a reason on which two precisions agree; [`DesignError::Disagreement`] if even the two highest
/// precisions give different gains.
#[doc(alias = "lqr")]
#[doc(alias = "dlqr")]
#[doc(alias = "acker")]
#[doc(alias = "kalman")]
pub fn design(rig: &Rig) -> Result<Certified, DesignError> {
    let (first, second) = std::thread::scope(|scope| {
        let first = scope.spawn(|| attempt(rig, 256));
        let second = attempt(rig, 512);
        (first.join(), second)
    });
    let first = first.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    if agree(&first, &second) {
        return second;
    }
    let mut before = second;
    for bits in [1024, 2048, 4096] {
        let after = attempt(rig, bits);
        if agree(&before, &after) {
            return after;
        }
        before = after;
    }
    Err(before.err().unwrap_or(DesignError::Disagreement(2048, 4096)))
}

fn agree(low: &Attempt, high: &Attempt) -> bool {
    match (low, high) {
        (Ok(low), Ok(high)) => low.double == high.double && low.single == high.single,
        // A failure to resolve the problem is no agreement: more bits may help.
        (_, Err(DesignError::Unresolved { .. } | DesignError::NoKalman { .. })) => false,
        (Err(low), Err(high)) => core::mem::discriminant(low) == core::mem::discriminant(high),
        _ => false,
    }
}
