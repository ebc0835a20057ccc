//! The table's values for stilling.

use upright::table::{ChainModel, ImitatedBase, StillingGains};

use super::any_size::MAX_SENSORS;
use super::error::{NoTable, finite};
use super::swing_up::narrow;
use crate::design::Stilling;
use crate::plant::{ChainParameters, ChainPlant, WithLinks, with_links};
use crate::rig::{Rig, defaults};

/// The values for `rig`, whose soft limits of the rail are `soft_m` (m); none if its motor cannot still its links.
///
/// # Errors
/// [`NoTable::Range`] if a value does not fit.
pub(super) fn gains(rig: &Rig, soft_m: [f32; 2]) -> Result<Option<StillingGains<MAX_SENSORS>>, NoTable> {
    let (Ok(stilling), Some(chain)) = (Stilling::of(rig), rig.chain()) else { return Ok(None) };
    let longest_s = rig.limits.stilling_s.unwrap_or(defaults::STILLING_S);
    let number = |value: f64| finite("a value of the stilling", value as f32);
    let [spring_n, damper_n] = stilling.most_n;
    Ok(Some(StillingGains {
        after_fall_ticks: (longest_s / rig.tick.period_s).round() as u32,
        stiffness: number(stilling.stiffness)?,
        damping: number(stilling.damping)?,
        most_n: [number(spring_n)?, number(damper_n)?],
        friction_n: number(stilling.friction_n)?,
        imitated: imitated(&stilling),
        braking_m_per_s2: number(stilling.braking_m_per_s2)?,
        speed_m_per_s: number(stilling.speed_m_per_s)?,
        rail_m: chain.rail_in_motion_m(soft_m),
    }))
}

fn imitated(stilling: &Stilling) -> Option<ImitatedBase<MAX_SENSORS>> {
    let chain = &stilling.imitated;
    // The firmware's model has a link for each sensor, one more than there are.
    let model = with_links(chain.links(), WithoutCoupling(chain)).ok()??;
    Some(ImitatedBase { taken: stilling.taken.map(|taken| taken as f32), model })
}

/// Makes the firmware's model of a chain, with further links of inertia 1 that nothing moves.
struct WithoutCoupling<'a>(&'a ChainParameters<f64>);

impl WithLinks for WithoutCoupling<'_> {
    type Output = Option<ChainModel<MAX_SENSORS>>;

    fn run<const N: usize>(self) -> Self::Output {
        let mut model: ChainModel<MAX_SENSORS> =
            upright::table::Resize::resized(&narrow(ChainPlant::<N>::new(self.0).ok()?.model()));
        for link in N..MAX_SENSORS {
            (model.b[(link, link)], model.b_reduced[(link, link)]) = (1.0, 1.0);
        }
        Some(model)
    }
}
