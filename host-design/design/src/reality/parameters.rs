//! Masses, lengths and inertias that differ from those in the file.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::rig::{Chain, ParameterErrors};

/// `chain` with the errors of `[reality]`.
pub fn real_chain(chain: &Chain, errors: &ParameterErrors) -> Chain {
    if *errors == (crate::rig::Reality::default().parameters) {
        return chain.clone();
    }
    let mut random = Pcg64::seed_from_u64(u64::from(errors.parameter_seed));
    let spread = errors.parameter_spread_percent / 100.0;
    let mut factor = |percent: f64| {
        let drawn = spread * random.random_range(-1.0..=1.0);
        (1.0 + percent / 100.0) * (1.0 + drawn)
    };
    let mut real = chain.clone();
    real.cart.mass_kg = real.cart.mass_kg.map(|mass| mass * factor(errors.cart_mass_percent));
    for (index, link) in real.links.iter_mut().enumerate() {
        let mass = factor(errors.link_mass_percent.of_joint(index));
        let length = factor(errors.link_length_percent.of_joint(index));
        link.scale(mass, length, factor(errors.link_inertia_percent.of_joint(index)));
    }
    real
}
