//! Converts identified parameters to the numbers of a rig file.

use upright_design::reality::PRESLIDING_PER_DEFLECTION;
use upright_design::rig::{CartInput, Chain};

use crate::error::IdentifyError;
use crate::parameters::Layout;

/// The numbers of a rig file that an identification changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Realised {
    /// The cart; none if its drive imposes its motion, whatever its mass and friction are.
    pub cart: Option<RealisedCart>,
    /// The links, in their order from the cart.
    pub links: Vec<RealisedLink>,
    /// Slope of the rail (rad).
    pub tilt_rad: f64,
    /// Dead zone of the motor (V).
    pub dead_zone_v: f64,
    /// Factor on the winding resistance: 1, unless a weighing has fixed the scale of the force.
    pub resistance_factor: f64,
}

/// The numbers of the cart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RealisedCart {
    /// Mass (kg).
    pub mass_kg: f64,
    /// Viscous friction (N·s/m).
    pub viscous: f64,
    /// Dry friction (N).
    pub dry_n: f64,
}

/// The numbers of a link and of the joint at its lower end.
#[derive(Debug, Clone, PartialEq)]
pub struct RealisedLink {
    /// Mass (kg).
    pub mass_kg: f64,
    /// Length (m).
    pub length_m: f64,
    /// Distance of the centre of mass from the joint (m).
    pub centre_m: f64,
    /// Inertia about the centre of mass (kg·m²).
    pub inertia_kg_m2: f64,
    /// Viscous friction of the joint (N·m·s/rad).
    pub viscous: f64,
    /// Dry friction of the joint (N·m).
    pub dry_n_m: f64,
    /// Angle over which the dry friction builds up (rad).
    pub presliding_rad: f64,
    /// Air drag of the link (N·m·s²/rad²).
    pub air_drag: f64,
}

/// Relative margin of a mass above the least that its moments allow.
const SPARE: f64 = 1e-6;

/// Shares of the link masses of the file that are tried one after the other.
const SHARES: [f64; 8] = [1.0, 0.8, 0.6, 0.4, 0.3, 0.2, 0.1, 0.0];

/// The machine with the parameters `p` whose link masses are those of the file, or the largest share of them with which
/// it is physical: a link that carries too heavy ones would have no mass of its own. Only M_t, a_j, l_j and J_j are
/// identified, so each mass can be chosen, and centre of mass and inertia follow:
///
/// ```text
/// c_j = (a_j - l_j S_j) / m_j,   I_j = J_j - l_j² S_j - m_j c_j²,   S_j = m_{j+1} + … + m_n
/// ```
///
/// `weighed` is the first moment a_n of the last link (kg·m), if it was weighed: masses, friction and forces are then
/// scaled to it.
///
/// # Errors
/// [`IdentifyError::Physical`] if a link or the cart would have no positive mass.
pub(crate) fn realise(chain: &Chain, p: &[f64], weighed: Option<f64>) -> Result<Realised, IdentifyError> {
    let whole = with_masses(chain, p, weighed, SHARES[0]);
    whole.or_else(|error| {
        SHARES[1..].iter().find_map(|&share| with_masses(chain, p, weighed, share).ok()).ok_or(error)
    })
}

/// The machine with `share` of the link masses of the file, but none so small that its moments do not allow it.
fn with_masses(
    chain: &Chain,
    p: &[f64],
    weighed: Option<f64>,
    share: f64,
) -> Result<Realised, IdentifyError> {
    let n = chain.links.len();
    let layout = Layout { links: n };
    let scale = weighed.map_or(1.0, |moment| moment / p[layout.first_moment(n - 1)]);
    let (mut outer, mut links) = (0.0, Vec::new());
    for j in (0..n).rev() {
        let length = if j + 1 < n { p[layout.length(j)] } else { chain.links[j].length_m };
        let carried = if j + 1 < n { outer } else { 0.0 };
        let moment = scale * p[layout.first_moment(j)] - length * carried;
        let second = scale * p[layout.second_moment(j)] - length * length * carried;
        // Written so that NaN is refused, too.
        let is_physical = moment > 0.0 && second > 0.0;
        if !is_physical {
            return Err(IdentifyError::Physical(format!(
                "link {} would have no mass of its own: the fit is not physical; is length_m or mass_kg of a link in the file \
                 far off?",
                j + 1
            )));
        }
        // I_j >= 0, and the centre of mass at most 9.9 lengths from the joint.
        let least = (moment * moment / second).max(moment / (9.9 * length));
        let mass_kg = (share * chain.links[j].mass_kg).max(least * (1.0 + SPARE));
        let centre_m = moment / mass_kg;
        links.push(RealisedLink {
            mass_kg,
            length_m: length,
            centre_m,
            inertia_kg_m2: second - mass_kg * centre_m * centre_m,
            viscous: (scale * p[layout.viscous(j + 1)]).max(0.0),
            dry_n_m: (scale * p[layout.dry(j + 1)]).max(0.0),
            presliding_rad: PRESLIDING_PER_DEFLECTION * p[layout.presliding(j)],
            air_drag: (scale * p[layout.drag(j)]).max(0.0),
        });
        outer += mass_kg;
    }
    links.reverse();
    Ok(Realised {
        cart: cart(chain, p, scale, outer)?,
        links,
        tilt_rad: p[layout.tilt()],
        dead_zone_v: p[layout.dead_zone()].max(0.0),
        resistance_factor: 1.0 / scale,
    })
}

/// The cart under links of `links_kg`; none if its drive imposes its motion.
fn cart(chain: &Chain, p: &[f64], scale: f64, links_kg: f64) -> Result<Option<RealisedCart>, IdentifyError> {
    if chain.input == CartInput::Acceleration {
        return Ok(None);
    }
    let layout = Layout { links: chain.links.len() };
    let mass_kg = scale * p[Layout::TOTAL_MASS] - links_kg;
    if mass_kg <= 0.0 {
        return Err(IdentifyError::Physical(
            "the cart would have no mass: the links of the file are too heavy, or the force is smaller than the file says"
                .to_owned(),
        ));
    }
    let [viscous, dry_n] = [layout.viscous(0), layout.dry(0)].map(|index| (scale * p[index]).max(0.0));
    Ok(Some(RealisedCart { mass_kg, viscous, dry_n }))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use upright_design::plant::ChainParameters;
    use upright_design::rig::Rig;

    use super::*;
    use crate::parameters::priors;

    fn chain_and_values(name: &str) -> (Chain, Vec<f64>) {
        let rig = Rig::from_path(&Path::new("../../rigs").join(name)).unwrap();
        let chain = rig.chain().unwrap();
        (chain.clone(), priors(&rig, chain, false).iter().map(|prior| prior.value).collect())
    }

    #[test]
    fn the_realised_machine_has_the_identified_numbers() {
        for name in ["double-quanser-dbpen.toml", "triple-glueck-eder-kugi.toml", "quadruple-paper.toml"] {
            let (chain, mut p) = chain_and_values(name);
            let n = chain.links.len();
            let layout = Layout { links: n };
            for (i, value) in p[..3 * n].iter_mut().enumerate() {
                *value *= 1.0 + 0.03 * libm::sin(i as f64);
            }
            let found = realise(&chain, &p, None).unwrap();
            let mut other = chain.clone();
            other.cart.mass_kg = found.cart.map(|cart| cart.mass_kg);
            for (link, found) in other.links.iter_mut().zip(&found.links) {
                (link.mass_kg, link.length_m) = (found.mass_kg, found.length_m);
                (link.centre_of_mass_m, link.inertia_kg_m2) =
                    (Some(found.centre_m), Some(found.inertia_kg_m2));
                assert!(found.inertia_kg_m2 >= 0.0);
            }
            let constants = ChainParameters::<f64>::of(&other);
            let close =
                |found: f64, wanted: f64| assert!((found / wanted - 1.0).abs() < 1e-12, "{found} {wanted}");
            close(constants.total_mass, p[0]);
            for j in 0..n {
                close(constants.a[j], p[layout.first_moment(j)]);
                close(constants.b[(j, j)], p[layout.second_moment(j)]);
            }
        }
    }

    /// A link of the file that is heavier than what its own joint carries can be made lighter.
    #[test]
    fn heavy_links_of_the_file_are_made_lighter() {
        let (mut chain, p) = chain_and_values("double-quanser-dbpen.toml");
        chain.links[1].mass_kg *= 4.0;
        let layout = Layout { links: 2 };
        assert!(chain.links[1].mass_kg * p[layout.length(0)] > p[layout.first_moment(0)]);
        let found = realise(&chain, &p, None).unwrap();
        let [first, second] = [&found.links[0], &found.links[1]];
        let close =
            |found: f64, wanted: f64| assert!((found / wanted - 1.0).abs() < 1e-12, "{found} {wanted}");
        close(second.mass_kg * second.centre_m, p[layout.first_moment(1)]);
        let moment = first.mass_kg * first.centre_m + second.mass_kg * first.length_m;
        close(moment, p[layout.first_moment(0)]);
        assert!(found.links.iter().all(|link| link.inertia_kg_m2 >= 0.0 && link.centre_m > 0.0), "{found:?}");
    }

    #[test]
    fn a_weighing_scales_everything() {
        let (chain, p) = chain_and_values("double-quanser-dbpen.toml");
        let moment = p[Layout { links: 2 }.first_moment(1)];
        let found = realise(&chain, &p, Some(1.1 * moment)).unwrap();
        let total = found.cart.unwrap().mass_kg + found.links.iter().map(|link| link.mass_kg).sum::<f64>();
        assert!((total / p[0] - 1.1).abs() < 1e-12 && (found.resistance_factor * 1.1 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_physical_is_refused() {
        let (chain, mut p) = chain_and_values("double-quanser-dbpen.toml");
        p[Layout { links: 2 }.second_moment(0)] *= 0.1;
        assert!(matches!(realise(&chain, &p, None), Err(IdentifyError::Physical(_))));
        let (chain, mut p) = chain_and_values("double-quanser-dbpen.toml");
        p[0] *= 0.3;
        assert!(matches!(realise(&chain, &p, None), Err(IdentifyError::Physical(_))));
    }
}
