//! Evidence for each gain: residual, agreeing precisions, condition.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::Serialize;
use upright::table::{Law, PerLaw};

use super::VerifyError;
use upright_design::design::{Certified, Design, Laws, OBSERVER, Pole, Task, continuous_plant, wanted_poles};
use upright_design::numerics::{Matrix, Real, Wide, eigenvalues, with_precision};
use upright_design::parallel;
use upright_design::plant::LinearModel;
use upright_design::rig::Rig;

/// Evidence for one gain of the table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Certificate {
    /// Which gain.
    pub gain: String,
    /// The two precisions (bits) that gave the same `f32` and `f64`.
    pub bits: [usize; 2],
    /// Of an LQR or Kalman gain: residual of the solution in its Riccati equation, relative to the
    /// sum of the norms of the terms. Of a pole placement: the largest distance of a requested pole from the
    /// nearest pole of the loop; of an observer with chosen poles: the relative error of the equation that they state.
    pub residual: f64,
    /// Largest relative change of the gain per relative change of the plant: `max |ΔK| / max |K| / 1e-20` for
    /// independent random changes up to 1e-20 (relative) of every entry of A and B that is neither 0 nor 1, the worst
    /// of three draws. An estimate from below.
    pub condition: f64,
}

/// A design and the residual of each of its Riccati equations.
type Solved = (Design<Wide>, Vec<(String, f64)>);
const DRAWS: u64 = 3;
const CHANGE: f64 = 1e-20;

/// Certificates of all gains that the rig asks for, by law: those of LQR, of pole placement, and of the observer.
pub(super) struct Certificates {
    laws: PerLaw<Option<Certificate>>,
    observer: Option<Certificate>,
}

impl Certificates {
    /// Solves again at the lower of the two precisions that agreed.
    pub(super) fn of(rig: &Rig, certified: &Certified) -> Result<Self, VerifyError> {
        with_precision(certified.bits[0], || Self::at_working_precision(rig, certified))
    }

    fn at_working_precision(rig: &Rig, certified: &Certified) -> Result<Self, VerifyError> {
        let solve = |draw: Option<u64>| -> Result<Solved, VerifyError> {
            let mut plant = continuous_plant::<Wide>(rig)?;
            if let Some(seed) = draw {
                disturb(&mut plant, seed);
            }
            let mut residuals = Vec::new();
            Ok((Design::sampled_alone(rig, plant, &mut residuals)?, residuals))
        };
        // A new thread starts at the usual precision.
        let draw = |seed| with_precision(certified.bits[0], || solve(Some(seed)));
        let (disturbed, solved) = parallel::beside(DRAWS, &draw, || solve(None));
        let (nominal, residuals) = solved?;
        let disturbed: Vec<Design<Wide>> =
            disturbed.into_iter().map(|d| d.map(|(design, _)| design)).collect::<Result<_, _>>()?;
        let certificate = |gain: String, residual: f64, k: &dyn Fn(&Design<Wide>) -> Option<Matrix<Wide>>| {
            let base = k(&nominal)?;
            let changes = disturbed.iter().filter_map(k).map(|changed| {
                (&changed - &base).largest_entry().to_f64() / base.largest_entry().to_f64() / CHANGE
            });
            let condition = changes.fold(0.0, f64::max);
            Some(Certificate { gain, bits: certified.bits, residual, condition })
        };
        let residual = |name: &str| residuals.iter().find(|(n, _)| n == name).map_or(f64::NAN, |(_, r)| *r);
        let in_table = |law: Law| move |d: &Design<Wide>| d.sampled.in_table()[law].map(|law| law.k.clone());
        let task = if nominal.sampled.integral.is_some() { Task::SampledIntegral } else { Task::SampledLqr };
        Ok(Self {
            laws: PerLaw {
                lqr: certificate(task.to_string(), residual(&task.to_string()), &in_table(Law::Lqr)),
                pole_placement: certificate(
                    Task::SampledPlacement.to_string(),
                    pole_error(rig, &nominal)?,
                    &in_table(Law::PolePlacement),
                ),
            },
            observer: certificate(OBSERVER.to_owned(), residual(OBSERVER), &|d| {
                d.kalman.as_ref().map(|kalman| kalman.l_filter.clone())
            }),
        })
    }

    /// Certificates of the gains used with `law`.
    pub(super) fn of_law(&self, law: Law) -> Vec<Certificate> {
        self.laws[law].iter().chain(&self.observer).cloned().collect()
    }
}

fn disturb<R: Real>(plant: &mut LinearModel<R>, seed: u64) {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut change = |entry: &R| {
        let factor: f64 = random.random_range(-1.0..1.0);
        let kept = entry.is_zero() || *entry == R::one();
        if kept { entry.clone() } else { entry.clone() * &(R::one() + &R::from_f64(factor * CHANGE)) }
    };
    plant.a = plant.a.map(&mut change);
    plant.b = plant.b.map(&mut change);
}

fn pole_error<R: Real>(rig: &Rig, design: &Design<R>) -> Result<f64, VerifyError> {
    let Laws { pole_placement: Some(law), .. } = &design.sampled else { return Ok(f64::NAN) };
    let Some(placement) = &rig.pole_placement else { return Ok(f64::NAN) };
    let period = R::from_f64(rig.tick.period_s);
    let found = eigenvalues(&design.sampled_loop(rig, law)).map_err(|_| VerifyError::Poles)?;
    let mut worst = 0.0f64;
    for pole in wanted_poles::<R>(placement, rig)? {
        let (re, im) = match pole.sampled(&period) {
            Pole::Real(re) => (re, R::zero()),
            Pole::Pair(p) => (p.re, p.im),
        };
        let distance = |p: &upright_design::numerics::Complex<R>| {
            upright_design::numerics::Complex { re: p.re.clone() - &re, im: p.im.clone() - &im }
                .modulus()
                .to_f64()
        };
        worst = worst.max(found.iter().map(distance).fold(f64::INFINITY, f64::min));
    }
    Ok(worst)
}
