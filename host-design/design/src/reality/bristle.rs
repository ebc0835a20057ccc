//! Dry friction with sticking: the elasto-plastic bristle.
//!
//! At a given speed the deflection is a function of the travel alone. It is computed exactly over the travel during a
//! step, not integrated over time (V. Hayward, B. Armstrong, F. Altpeter, P. Dupont, "Discrete-time elasto-plastic
//! friction estimation", IEEE Trans. Control Systems Technology 17, 2009), so a step has to resolve only the motion of
//! a stuck contact on its spring. With stiffness σ_i and mobility m_i (acceleration per force in contact i, all links
//! in line), no natural frequency exceeds `ω² = Σ σ_i m_i`, because the trace of a matrix bounds its largest
//! eigenvalue. A step is at most `0.25 / ω`.

use crate::rig::FrictionLaw;

/// Share of the Coulomb friction up to which the contact deforms elastically: 0.7169 in the example of Dupont et al.
const ELASTIC_SHARE: f64 = 0.7;

/// Travel over which the friction builds up, as a multiple of the deflection under the Coulomb friction: beyond z_e,
/// the parabola needs twice the remaining deflection.
pub const PRESLIDING_PER_DEFLECTION: f64 = 2.0 - ELASTIC_SHARE;

/// Damping ratio of a stuck contact: a bristle that is released rings down, as metal does.
const DAMPING_RATIO: f64 = 0.1;

/// Dry friction between two bodies as one bristle of deflection `z` (P. Dupont, V. Hayward, B. Armstrong, F. Altpeter,
/// "Single state elastoplastic friction models", IEEE Trans. Automatic Control 47(5), 2002):
///
/// ```text
/// F = σ0 z + σ1 ż,   ż = v (1 - α(z) sgn(v) z / z_ss(v)),   z_ss(v) = z_c (1 + b / (1 + (v / v_s)²))
/// ```
///
/// with `α = 0` up to the elastic limit `z_e`, where the contact sticks, and `α = 1` at `z_ss`, where it slides.
/// Between them, in the direction of motion, `1 - α z / z_ss = √((z_ss - z) / (z_ss - z_e))`: at constant `v` the
/// deflection then depends on the travel alone and is a parabola, so that it is integrated exactly over the travel and
/// not over time (as in V. Hayward et al., "Discrete-time elasto-plastic friction estimation", IEEE Trans. Control
/// Systems Technology 17(3), 2009). The curve z_ss is that of Hess and Soom (ASME Journal of Tribology 112, 1990).
/// Other laws are those of [`FrictionLaw`]; Dahl's has `α = 1` everywhere.
///
/// The friction is passive: `σ0 z ż <= σ0 z v` and `σ1 ż v >= 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bristle {
    /// σ0: force or torque per deflection (N/m or N·m/rad).
    pub stiffness: f64,
    /// σ1: force or torque per rate of deflection (N·s/m or N·m·s/rad).
    pub damping: f64,
    /// z_c: deflection under the Coulomb friction (m or rad).
    coulomb: f64,
    /// z_e: deflection up to which nothing slides (m or rad).
    elastic: f64,
    /// b: excess of the friction at rest, as a share of the Coulomb friction.
    excess: f64,
    /// v_s: speed at which half of the excess is left (m/s or rad/s).
    stribeck: f64,
    law: FrictionLaw,
}

/// The properties of a contact that define its bristle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Coulomb friction (N or N·m), above 0.
    pub coulomb: f64,
    /// Excess of the friction at rest (%).
    pub breakaway_percent: f64,
    /// Speed at which half of the excess is left (m/s or rad/s).
    pub stribeck: f64,
    /// Travel from rest over which the Coulomb friction builds up (m or rad).
    pub presliding: f64,
    /// Acceleration in this contact per force or torque in it, at rest (1/kg or 1/(kg·m²)).
    pub mobility: f64,
    /// How the friction depends on travel and speed.
    pub law: FrictionLaw,
}

/// A bristle after a travel.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Moved {
    deflection: f64,
    /// `1 - α z / z_ss`: 1 while it sticks, 0 while it slides.
    sticking: f64,
}

impl Bristle {
    /// The bristle of a contact with these properties.
    pub fn new(contact: &Contact) -> Self {
        let coulomb = contact.presliding / PRESLIDING_PER_DEFLECTION;
        let stiffness = contact.coulomb / coulomb;
        Self {
            stiffness,
            damping: 2.0 * DAMPING_RATIO * (stiffness / contact.mobility).sqrt(),
            coulomb,
            elastic: ELASTIC_SHARE * coulomb,
            excess: contact.breakaway_percent / 100.0,
            stribeck: contact.stribeck,
            law: contact.law,
        }
    }

    /// Force or torque against the motion, after `travel` (m or rad) from where the deflection was `deflection`, at
    /// `speed` (m/s or rad/s).
    #[inline]
    pub fn force(&self, deflection: f64, travel: f64, speed: f64) -> f64 {
        if self.law == FrictionLaw::Creeping {
            return self.stiffness * self.coulomb * libm::tanh(speed / self.stribeck);
        }
        let moved = self.moved(deflection, travel, speed);
        self.stiffness * moved.deflection + self.damping * moved.sticking * speed
    }

    /// The deflection after `travel` (m or rad) at `speed` (m/s or rad/s).
    #[inline]
    pub fn deflection(&self, deflection: f64, travel: f64, speed: f64) -> f64 {
        self.moved(deflection, travel, speed).deflection
    }

    /// Whether its force has a kink between two deflections with these speeds (m/s or rad/s): the contact passes the
    /// end of the elastic zone or the beginning of sliding, or turns round outside of the elastic zone.
    #[inline]
    pub fn has_passed_a_kink(&self, deflections: [f64; 2], speeds: [f64; 2]) -> bool {
        let zone = |at: usize| {
            let bent = deflections[at].abs();
            (bent < self.elastic, bent < self.sliding(speeds[at]))
        };
        zone(0) != zone(1) || (speeds[0] * speeds[1] < 0.0 && !zone(0).0)
    }

    /// z_ss: the deflection while the contact slides at this speed (m or rad).
    #[inline]
    fn sliding(&self, speed: f64) -> f64 {
        let ratio = speed / self.stribeck;
        self.coulomb * (1.0 + self.excess / (1.0 + ratio * ratio))
    }

    /// Elastic energy of the bent bristle (J).
    pub fn energy(&self, deflection: f64) -> f64 {
        0.5 * self.stiffness * deflection * deflection
    }

    #[inline]
    fn moved(&self, deflection: f64, travel: f64, speed: f64) -> Moved {
        let direction = 1f64.copysign(if travel == 0.0 { speed } else { travel });
        let sliding = self.sliding(speed);
        if self.law == FrictionLaw::Dahl {
            // dz/dx = 1 - z sgn(v) / z_ss, exactly.
            let off = (deflection - direction * sliding) * libm::exp(-travel.abs() / sliding);
            return Moved { deflection: direction * sliding + off, sticking: -direction * off / sliding };
        }
        // Deflection and travel in the direction of motion.
        let (before, travel) = (direction * deflection, travel.abs());
        let stuck = (self.elastic - before).max(0.0).min(travel);
        let plastic = travel - stuck;
        let bent = before + stuck;
        let length = sliding - self.elastic;
        let root = (((sliding - bent) / length).clamp(0.0, 1.0).sqrt() - plastic / (2.0 * length)).max(0.0);
        // Without plastic travel the deflection is used as it is, so that the parabola does not round it.
        let after = if plastic > 0.0 { sliding - length * root * root } else { bent.min(sliding) };
        Moved { deflection: direction * after, sticking: root }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CONTACT: Contact = Contact {
        coulomb: 2.0,
        breakaway_percent: 0.0,
        stribeck: 0.1,
        presliding: 1.3,
        mobility: 1.0,
        law: FrictionLaw::ElastoPlastic,
    };

    #[test]
    fn the_friction_builds_up_over_the_presliding_and_then_stays() {
        let bristle = Bristle::new(&CONTACT);
        let friction = |travel: f64| bristle.force(0.0, travel, 0.0);
        assert!((friction(0.35) - 0.7).abs() < 1e-15, "elastic at first");
        assert!(friction(1.299) < 2.0 && (friction(1.3) - 2.0).abs() < 1e-15);
        assert_eq!(friction(-50.0), -2.0);
        // In the plastic zone: z = z_ss - (z_ss - z_e) (1 - x / (2 (z_ss - z_e)))², x = 0.3 beyond z_e = 0.7.
        assert!((friction(1.0) - 2.0 * (1.0 - 0.3 * 0.25)).abs() < 1e-15);
    }

    #[test]
    fn the_friction_at_rest_falls_to_the_coulomb_friction_in_motion() {
        let bristle = Bristle::new(&Contact { breakaway_percent: 50.0, ..CONTACT });
        let sliding = |speed: f64| bristle.stiffness * bristle.deflection(0.0, 100.0, speed);
        assert!((sliding(0.0) - 3.0).abs() < 1e-15 && (sliding(0.1) - 2.5).abs() < 1e-15);
        assert!((sliding(100.0) - 2.0).abs() < 1e-5);
    }

    #[test]
    fn a_dahl_bristle_creeps_and_a_creeping_contact_has_no_memory() {
        let dahl = Bristle::new(&Contact { law: FrictionLaw::Dahl, ..CONTACT });
        // z = z_c (1 - e^(-x/z_c)), z_c = 1.
        assert!((dahl.force(0.0, 0.5, 0.0) - 2.0 * (1.0 - (-0.5f64).exp())).abs() < 1e-15);
        // To and fro within the elastic range of the other law, it does not come back to where it was.
        let to_and_fro = |bristle: &Bristle| bristle.deflection(bristle.deflection(0.5, 0.1, 0.0), -0.1, 0.0);
        assert!(to_and_fro(&dahl) < 0.495 && (to_and_fro(&Bristle::new(&CONTACT)) - 0.5).abs() < 1e-15);
        let creeping = Bristle::new(&Contact { law: FrictionLaw::Creeping, ..CONTACT });
        assert!((creeping.force(0.9, 0.1, 0.1) - 2.0 * 1f64.tanh()).abs() < 1e-15);
        assert_eq!(creeping.force(0.9, 0.1, 0.0), 0.0);
    }

    proptest! {
        /// A path that is cut into pieces ends as in one piece, and the work done on the bristle exceeds its energy.
        #[test]
        fn a_path_may_be_cut_and_never_gains_energy(
            path in prop::collection::vec((-1.0..1.0f64, 0.0..1.0f64), 1..30),
            breakaway_percent in 0.0..100.0f64,
        ) {
            let bristle = Bristle::new(&Contact { breakaway_percent, ..CONTACT });
            let (mut whole, mut cut, mut work) = (0.0, 0.0, 0.0);
            for (travel, share) in path {
                let before = whole;
                whole = bristle.deflection(whole, travel, 0.0);
                cut = bristle.deflection(cut, share * travel, 0.0);
                cut = bristle.deflection(cut, (1.0 - share) * travel, 0.0);
                prop_assert!((whole - cut).abs() < 1e-7, "{whole} {cut}");
                // Simpson's rule over many pieces of the travel.
                let at = |k: u32| bristle.stiffness * bristle.deflection(before, travel * f64::from(k) / 400.0, 0.0);
                work += (0..200u32).map(|k| at(2 * k) + 4.0 * at(2 * k + 1) + at(2 * k + 2)).sum::<f64>() * travel / 1200.0;
                prop_assert!(work - bristle.energy(whole) > -1e-5, "{work}");
            }
        }

        #[test]
        fn a_bristle_within_its_elastic_range_never_creeps(steps in prop::collection::vec(-0.7..0.7f64, 1..1000)) {
            let bristle = Bristle::new(&CONTACT);
            let (mut at, mut deflection) = (0.0, 0.0);
            for to in steps.into_iter().chain([0.0]) {
                deflection = bristle.deflection(deflection, to - at, 0.1);
                at = to;
            }
            prop_assert!(deflection.abs() < 1e-13, "{deflection}");
        }
    }
}
