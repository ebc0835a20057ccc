//! How the motor stills links that tumble or swing.

use crate::table::chain_model::ChainModel;
use crate::table::part::part;

part! {
    /// Gains and limits with which the motor stills the links of a rig with `NY` sensors: see
    /// [`stilling`](crate::supervision::stilling).
    #[derive(Copy)]
    pub struct StillingGains<NY to MY;> {
        /// Longest time for which the links are stilled after a fall (ticks); 0: the motor goes off instead.
        pub after_fall_ticks: u32,
        /// Stiffness of the spring that pulls the base to the middle (N/m).
        pub stiffness: f32,
        /// Constant of the damper on the base (N s/m).
        pub damping: f32,
        /// Largest forces of spring and damper (N).
        pub most_n: [f32; 2],
        /// Dry friction of the base that the motor makes up for (N).
        pub friction_n: f32,
        /// The lighter base that the motor imitates; none: it is only spring and damper.
        pub imitated: Option<ImitatedBase<NY>>,
        /// Deceleration of the base by the motor's largest force that is counted on near an end of the rail (m/s²).
        pub braking_m_per_s2: f32,
        /// Largest speed of the base (m/s): no stilling from the energy that it is for is faster.
        pub speed_m_per_s: f32,
        /// Lowest and highest position of the base (m).
        pub rail_m: [f32; 2],
    }
}

part! {
    /// A base that is lighter than the real one.
    #[derive(Copy)]
    pub struct ImitatedBase<NY to MY;> {
        /// Mass that the motor takes away (kg), and viscous friction (N s/m); 0 for a drive that imposes the base's
        /// acceleration.
        pub taken: [f32; 2],
        /// The links on this base. One link more than there are, of inertia 1 and without weight, is at rest.
        pub model: ChainModel<NY>,
    }
}

impl<const NY: usize> StillingGains<NY> {
    /// Whether every value is one with which the energy falls.
    pub(crate) fn is_sound(&self) -> bool {
        let [low, high] = self.rail_m;
        let positive = [self.stiffness, self.damping, self.braking_m_per_s2, self.speed_m_per_s];
        let lightest = self
            .imitated
            .as_ref()
            .is_none_or(|base| base.taken.iter().all(|taken| *taken >= 0.0) && base.model.inverse_mass > 0.0);
        low < high
            && lightest
            && self.friction_n >= 0.0
            && positive.into_iter().chain(self.most_n).all(|value| value > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gains::TABLE;

    #[test]
    fn a_law_that_would_add_energy_is_found() {
        let sound = TABLE.stilling.unwrap();
        assert!(sound.is_sound());
        let mut heavier = sound;
        heavier.imitated.as_mut().unwrap().taken[0] = -1.0;
        for unsound in [
            StillingGains { stiffness: -1.0, ..sound },
            StillingGains { damping: -sound.damping, ..sound },
            StillingGains { most_n: [1.0, f32::NAN], ..sound },
            StillingGains { friction_n: -0.1, ..sound },
            StillingGains { rail_m: [1.0, -1.0], ..sound },
            StillingGains { speed_m_per_s: 0.0, ..sound },
            heavier,
        ] {
            assert!(!unsound.is_sound(), "{unsound:?}");
        }
    }
}
