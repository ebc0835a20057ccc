//! How far each link may be pushed at each moment of a motion.

use serde::Serialize;

use super::SwingUpError;
use super::closed_loop::{LOST_RAD, Trial, run_from};
use super::motion::Motion;
use super::setting::Setting;
use super::way::Way;
use crate::parallel;
use crate::rig::Rig;

/// Halvings of the range in which a margin is looked for: to 0.3°.
const HALVINGS: u32 = 6;

/// Margins at one moment of a motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Margin {
    /// Time since the beginning (s).
    pub at_s: f64,
    /// For each link: the largest turn to either side after which the motion still arrives (rad).
    pub links_rad: Vec<f64>,
}

/// Margins of one of the motions of `rig` at so many moments, evenly from its beginning on; `done` is called after each.
///
/// The machine is the rig of the file, without noise. At a moment it is where the plan wants it, with one link turned and
/// all others as they were, and the filter has followed; encoders, filter and law do the rest. A run arrives as in the
/// judgement, so no margin is larger than the 0.35 rad at which a link counts as lost.
///
/// # Errors
/// [`SwingUpError`] if the chain cannot be simulated.
pub fn margins(
    rig: &Rig,
    motion: &Motion,
    way: Way,
    moments: usize,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Margin>, SwingUpError> {
    let setting = Setting::of(rig)?;
    let at = |moment: usize| -> Result<Margin, SwingUpError> {
        let tick = moment * motion.steps() / moments;
        let links = 0..setting.chain.links.len();
        let of_link = |link| margin(&setting, motion, way, tick, link);
        let links_rad = links.map(of_link).collect::<Result<_, _>>()?;
        done();
        Ok(Margin { at_s: tick as f64 * motion.tick_s, links_rad })
    };
    parallel::try_map(0..moments, at)
}

/// The smaller of the margins to both sides (rad).
fn margin(
    setting: &Setting<'_>,
    motion: &Motion,
    way: Way,
    tick: usize,
    link: usize,
) -> Result<f64, SwingUpError> {
    let arrives = |turn_rad: f64| -> Result<bool, SwingUpError> {
        let mut trial = Trial { counts: true, ..Trial::ideal(setting, motion) };
        trial.start.clone_from(&motion.x[tick]);
        // The angle of a joint is that of its link less that of the link below.
        trial.start[2 + 2 * link] += turn_rad;
        if let Some(above) = trial.start.get_mut(4 + 2 * link) {
            *above -= turn_rad;
        }
        Ok(run_from(setting, motion, way, &trial, tick, &trial.start)?.stood)
    };
    let mut least = LOST_RAD;
    for side in [1.0, -1.0] {
        let (mut stands, mut falls) = (0.0, LOST_RAD);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (stands + falls);
            if arrives(side * middle)? { stands = middle } else { falls = middle }
        }
        least = least.min(stands);
    }
    Ok(least)
}
