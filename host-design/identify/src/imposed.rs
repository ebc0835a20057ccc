//! A cart whose motion is imposed: its drive goes where its pulses say, so that its path is the input of the model.
//!
//! Pulses are even within a tick: the cart has a constant speed there, which jumps from tick to tick. A jump within a
//! step of the integration is replaced by jumps at both ends of the step and a constant acceleration between, with
//! the same moments of order 0 to 2: for a jump at the share s of the step
//!
//! ```text
//! α + β + γ = 1,   β/2 + γ = s,   β/3 + γ = s²
//! ```
//!
//! with the parts α and γ at the beginning and the end, and β between. A jump at the beginning of a step stays as it
//! is, and the path is exact at every end.
//!
//! The links do not feel the cart's mass and friction, and a common factor of their masses and frictions changes no
//! motion. So cart and first moment of the last link are those of the file.

use std::path::Path;

use upright::protocol::tick_log::OFF;

use crate::cart_force::CartForce;
use crate::error::IdentifyError;
use crate::log::{DriveScale, Log};
use crate::parameters::{Layout, Prior};

/// Share of the pulses that counts may miss: a board may count those of a tick a little later.
const MISCOUNTED: f64 = 0.25;

/// Inputs of the steps of `stride` ticks, each `step_s` long, on the path with these positions at the ticks (m) times
/// `travel`.
pub(crate) fn inputs(path: &[Option<f64>], stride: usize, step_s: f64, travel: f64) -> Vec<CartForce> {
    let tick_s = step_s / stride as f64;
    let at = |tick: usize| path[tick].unwrap_or_default();
    let speed = |tick: usize| {
        let from = tick.min(path.len().saturating_sub(2));
        (at((from + 1).min(path.len() - 1)) - at(from)) / tick_s
    };
    let mut inputs = Vec::with_capacity(path.len().div_ceil(stride));
    // What the jumps of a step leave for the beginning of the next one.
    let mut left = 0.0;
    for first in (0..path.len()).step_by(stride) {
        let mut input = CartForce { jump: core::mem::take(&mut left), ..CartForce::default() };
        for (index, tick) in (first..(first + stride).min(path.len())).enumerate() {
            let jump = travel * (speed(tick) - speed(tick.saturating_sub(1)));
            let share = index as f64 / stride as f64;
            let [begin, between, end] = parts(share);
            input.jump += begin * jump;
            input.force += between * jump / step_s;
            left += end * jump;
        }
        inputs.push(input);
    }
    inputs
}

/// α, β and γ of a jump at `share` of a step.
fn parts(share: f64) -> [f64; 3] {
    let between = 6.0 * share * (1.0 - share);
    let end = share - 0.5 * between;
    [1.0 - between - end, between, end]
}

/// Checks that the first counts of a log follow the pulses of its ticks.
///
/// # Errors
/// [`IdentifyError::Pulses`] if they do not.
pub(crate) fn counts_its_pulses(log: &Log, file: &Path) -> Result<(), IdentifyError> {
    if !matches!(log.header.drive, DriveScale::Steps(_)) {
        return Ok(());
    }
    let (mut all, mut off, mut off_if_reversed) = (0u64, 0u64, 0u64);
    for (index, pair) in log.ticks().windows(2).enumerate() {
        if pair[1].number != pair[0].number + 1 || pair.iter().any(|tick| tick.drive == OFF) {
            continue;
        }
        let counted = i32::from(log.counts(index + 1)[0].wrapping_sub(log.counts(index)[0]) as i16);
        let given = i32::from(pair[0].drive);
        all += u64::from(given.unsigned_abs());
        off += u64::from((counted - given).unsigned_abs());
        off_if_reversed += u64::from((counted + given).unsigned_abs());
    }
    let most = (MISCOUNTED * all as f64) as u64;
    if off <= most {
        return Ok(());
    }
    let found = match off_if_reversed <= most {
        true => "its counts run against its pulses".to_owned(),
        false => format!("{off} of {all} pulses are not counted, or counted too often"),
    };
    Err(IdentifyError::Pulses { file: file.to_owned(), found })
}

/// Fixes what the links do not show at the values of the file.
pub(crate) fn known(layout: Layout, priors: &mut [Prior]) {
    let cart = [Layout::TOTAL_MASS, layout.viscous(0), layout.dry(0)];
    let others = [layout.first_moment(layout.links - 1), layout.dead_zone()];
    cart.into_iter().chain(others).for_each(|index| priors[index].deviation = 0.0);
    // The pulses of a tick begin in that tick.
    priors[layout.delay()] = Prior { value: 0.0, deviation: 0.0 };
}

#[cfg(test)]
mod tests {
    use upright_design::rig::Rig;

    use super::*;
    use crate::channel::chain_of;
    use crate::excite::shake;
    use crate::parameters::priors;
    use crate::record::Record;
    use crate::shooting::{Shooting, WINDOW_S};

    #[test]
    fn the_parts_of_a_jump_have_its_moments() {
        for share in [0.0, 0.2, 0.5, 0.9] {
            let [begin, between, end] = parts(share);
            let moments = [begin + between + end, 0.5 * between + end, between / 3.0 + end];
            for (found, wanted) in moments.into_iter().zip([1.0, share, share * share]) {
                assert!((found - wanted).abs() < 1e-15, "{share}: {found} {wanted}");
            }
        }
        assert_eq!(parts(0.0), [1.0, 0.0, 0.0]);
    }
    /// Errors (rms, in steps of the encoders) of predictions over 0.25 s with the true parameters, where two ticks make
    /// a step of the integration; and the same with a path that is a tick late.
    fn errors() -> [f64; 2] {
        let rig = Rig::from_path("../../rigs/quadruple-stepper.toml".as_ref()).unwrap();
        let chain = chain_of(&rig).unwrap();
        let record = Record::of(&rig, &[shake(&rig, 6.0, 1).unwrap()], 2);
        let model = record.model(chain.gravity_m_per_s2);
        let mut priors = priors(&rig, chain, false);
        let layout = model.layout;
        (0..=layout.links).for_each(|contact| priors[layout.dry(contact)].value = 0.0);
        known(layout, &mut priors);
        let p: Vec<f64> = priors.iter().map(|prior| prior.value).collect();
        let worst = |record: &Record| {
            let shooting = Shooting { model: &model, record, priors: &priors, free: false };
            let rms = shooting.fit(&p, WINDOW_S, 10, 3).rms;
            rms.iter().zip(&record.steps).skip(1).map(|(rms, step)| rms / step).fold(0.0, f64::max)
        };
        let mut late = record.clone();
        late.pieces.iter_mut().for_each(|piece| piece.drive.rotate_right(1));
        [worst(&record), worst(&late)]
    }

    #[test]
    fn the_path_within_a_step_is_accurate_to_the_steps_of_the_encoders() {
        let [found, late] = errors();
        println!("{found:.3} of a step, {late:.3} with a path that is a tick late");
        // Quantisation alone is 0.289.
        assert!(found < 0.295, "{found}");
        assert!(late > 0.35, "the negative control: {late}");
    }
}
