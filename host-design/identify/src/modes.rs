//! The modes of a hanging chain.

use core::f64::consts::TAU;

use upright::table::Equilibrium;
use upright_design::numerics::{Complex, eigenvalues};
use upright_design::plant::{ChainParameters, linearise};
use upright_design::rig::Chain;

use crate::error::IdentifyError;

/// Mass of a cart that cannot move, as a multiple of that of the links.
const CLAMPED: f64 = 1e9;

/// The lowest and the highest frequency of the hanging links (Hz).
pub(crate) fn hanging_modes(chain: &Chain) -> Result<[f64; 2], IdentifyError> {
    let failed = || IdentifyError::Undetermined("the hanging links have no modes");
    let mut chain = chain.clone();
    chain.cart.friction_n_s_per_m = 0.0;
    chain.links.iter_mut().for_each(|link| link.friction_n_m_s_per_rad = 0.0);
    let linear =
        linearise(&ChainParameters::<f64>::of(&chain), Equilibrium::HANGING).map_err(|_| failed())?;
    let values = eigenvalues(&linear.a).map_err(|_| failed())?;
    let frequencies = values.iter().map(|Complex { im, .. }: &Complex<f64>| im.abs() / TAU);
    let all: Vec<f64> = frequencies.collect();
    let highest = all.iter().copied().fold(0.0, f64::max);
    // The free cart has the frequency 0, up to rounding.
    let modes = all.iter().copied().filter(|&frequency| frequency > 1e-3 * highest);
    let lowest = modes.fold(f64::INFINITY, f64::min);
    if highest > 0.0 { Ok([lowest, highest]) } else { Err(failed()) }
}

/// Period (s) of the fastest hanging mode, with the cart clamped or free.
///
/// # Errors
/// [`IdentifyError`] if the modes cannot be computed.
pub(crate) fn fastest_period_s(chain: &Chain, is_clamped: bool) -> Result<f64, IdentifyError> {
    let mut chain = chain.clone();
    if is_clamped {
        let links_kg: f64 = chain.links.iter().map(|link| link.mass_kg).sum();
        chain.cart.mass_kg = Some(CLAMPED * links_kg);
    }
    let [_, highest] = hanging_modes(&chain)?;
    Ok(1.0 / highest)
}

#[cfg(test)]
mod tests {
    use upright_design::rig::Rig;

    use super::*;

    #[test]
    fn a_clamped_cart_leaves_the_links_the_modes_of_a_pendulum() {
        let rig = Rig::from_path("../../rigs/single-multiarm.toml".as_ref()).unwrap();
        let chain = rig.chain().unwrap();
        let constants = ChainParameters::<f64>::of(chain);
        let rate = (constants.a[0] * constants.gravity / constants.b[(0, 0)]).sqrt();
        let clamped = fastest_period_s(chain, true).unwrap();
        assert!((clamped * rate / TAU - 1.0).abs() < 1e-6, "{clamped}");
        // The negative control: a free cart makes the mode faster.
        assert!(fastest_period_s(chain, false).unwrap() < 0.99 * clamped);
    }
}
