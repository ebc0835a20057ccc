//! The control laws that a table can hold, and their gains.

use core::fmt;
use core::ops::{Index, IndexMut};

use nalgebra::SVector;
#[cfg(feature = "firmware")]
use serde::{Deserialize, Serialize};

#[cfg(feature = "firmware")]
use crate::table::columns::columns;
#[cfg(test)]
use crate::table::part::WordsMut;
use crate::table::part::{Part, Reader, Resize, Words, part};
#[cfg(feature = "firmware")]
use crate::table::words::{Fill, WordReader};

/// A control law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "firmware", derive(Serialize, Deserialize))]
#[cfg_attr(feature = "firmware", serde(rename_all = "snake_case"))]
pub enum Law {
    /// Linear quadratic regulator.
    Lqr,
    /// Pole placement.
    PolePlacement,
}

impl Law {
    /// All laws. A controller starts with the first one that its table holds.
    pub const ALL: [Self; 2] = [Self::Lqr, Self::PolePlacement];

    /// Name in rig files and JSON, and as a field of [`PerLaw`].
    pub const fn key(self) -> &'static str {
        match self {
            Law::Lqr => "lqr",
            Law::PolePlacement => "pole_placement",
        }
    }

    /// Name in commands and file names: the key with hyphens.
    pub const fn option(self) -> &'static str {
        match self {
            Law::Lqr => "lqr",
            Law::PolePlacement => "pole-placement",
        }
    }

    /// Name in headings: "LQR", "Pole placement".
    pub const fn title(self) -> &'static str {
        match self {
            Law::Lqr => "LQR",
            Law::PolePlacement => "Pole placement",
        }
    }

    /// The law with this [`option`](Self::option) name, if any.
    pub fn from_option(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|law| law.option() == name)
    }
}

/// Name within a sentence: "LQR", "pole placement".
impl fmt::Display for Law {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Law::Lqr => "LQR",
            Law::PolePlacement => "pole placement",
        })
    }
}

/// One value of `T` for each law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PerLaw<T> {
    /// Value for [`Law::Lqr`].
    pub lqr: T,
    /// Value for [`Law::PolePlacement`].
    pub pole_placement: T,
}

impl<T> PerLaw<T> {
    /// Calls `make` for each law.
    pub fn from_fn(mut make: impl FnMut(Law) -> T) -> Self {
        Self { lqr: make(Law::Lqr), pole_placement: make(Law::PolePlacement) }
    }

    /// A reference to each value.
    pub fn as_ref(&self) -> PerLaw<&T> {
        PerLaw::from_fn(|law| &self[law])
    }

    /// The values in the order of [`Law::ALL`].
    pub fn into_array(self) -> [T; 2] {
        [self.lqr, self.pole_placement]
    }

    /// Applies `change` to each value.
    pub fn map<U>(self, mut change: impl FnMut(T) -> U) -> PerLaw<U> {
        PerLaw { lqr: change(self.lqr), pole_placement: change(self.pole_placement) }
    }

    /// Iterates over the values with their laws, in the order of [`Law::ALL`].
    pub fn iter(&self) -> impl Iterator<Item = (Law, &T)> {
        Law::ALL.into_iter().map(|law| (law, &self[law]))
    }
}

impl<T> PerLaw<Option<T>> {
    /// Iterates over the values that are present, with their laws.
    pub fn present(&self) -> impl Iterator<Item = (Law, &T)> {
        self.iter().filter_map(|(law, value)| Some((law, value.as_ref()?)))
    }

    /// Iterates over the values that are present, mutably.
    pub fn present_mut(&mut self) -> impl Iterator<Item = &mut T> {
        [&mut self.lqr, &mut self.pole_placement].into_iter().flatten()
    }
}

impl<T, E> PerLaw<Result<T, E>> {
    /// All values, or an error.
    ///
    /// # Errors
    /// The first error in the order of [`Law::ALL`].
    pub fn transpose(self) -> Result<PerLaw<T>, E> {
        Ok(PerLaw { lqr: self.lqr?, pole_placement: self.pole_placement? })
    }
}

impl<T> Index<Law> for PerLaw<T> {
    type Output = T;

    fn index(&self, law: Law) -> &T {
        match law {
            Law::Lqr => &self.lqr,
            Law::PolePlacement => &self.pole_placement,
        }
    }
}

impl<T> IndexMut<Law> for PerLaw<T> {
    fn index_mut(&mut self, law: Law) -> &mut T {
        match law {
            Law::Lqr => &mut self.lqr,
            Law::PolePlacement => &mut self.pole_placement,
        }
    }
}

impl<P: Part> Part for PerLaw<P> {
    #[inline]
    fn part(&self, at: &mut usize) -> Option<Words<'_>> {
        self.lqr.part(at).or_else(|| self.pole_placement.part(at))
    }

    #[cfg(test)]
    fn part_mut(&mut self, at: &mut usize) -> Option<WordsMut<'_>> {
        match self.lqr.part_mut(at) {
            Some(words) => Some(words),
            None => self.pole_placement.part_mut(at),
        }
    }

    fn read(&self, reader: &mut dyn Reader) {
        reader.begin("PerLaw");
        for law in Law::ALL {
            reader.field(
                law.key(),
                &[match law {
                    Law::Lqr => "Gains of the linear quadratic regulator, if designed.",
                    Law::PolePlacement => "Gains of the pole placement, if designed.",
                }],
            );
            self[law].read(reader);
        }
        reader.end();
    }
}

#[cfg(feature = "firmware")]
impl<'words, P: Fill<'words>> Fill<'words> for PerLaw<P> {
    const EMPTY: Self = Self { lqr: P::EMPTY, pole_placement: P::EMPTY };

    fn fill(&mut self, words: &mut WordReader<'words>) {
        self.lqr.fill(words);
        self.pole_placement.fill(words);
    }
}

impl<P: Resize<Q>, Q> Resize<PerLaw<Q>> for PerLaw<P> {
    fn resized(&self) -> PerLaw<Q> {
        self.as_ref().map(Resize::resized)
    }
}

part! {
    /// Gains of one control law `u = N r - K x - k_pending u_pending - k_integral z`.
    #[derive(Copy)]
    pub struct LawGains<NX to MX; T> {
        /// K, one gain per state (N/m, N s/m, N/rad, N s/rad …).
        pub k: SVector<T, NX>,
        /// Gain on the pending force (1); 0 without delay or lag.
        pub k_pending: T,
        /// Gain on the integrated position error (N/(m s)); 0 without integral action.
        pub k_integral: T,
        /// N, the precompensation gain on the set-point (N/m).
        pub n: T,
        /// Largest change of the governed set-point in one tick (m).
        pub setpoint_step: T,
    }
}

impl<const NX: usize> LawGains<NX> {
    /// No gains, no force.
    #[cfg(feature = "firmware")]
    pub(crate) const NONE: Self =
        Self { k: columns([[0.0; NX]]), k_pending: 0.0, k_integral: 0.0, n: 0.0, setpoint_step: 0.0 };

    /// Whether the largest step lets the governor move the set-point.
    pub(crate) fn is_sound(&self) -> bool {
        self.setpoint_step > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_law_has_its_own_value_and_its_own_names() {
        let mut per_law = PerLaw::from_fn(Law::key);
        for law in Law::ALL {
            assert_eq!(per_law[law], law.key());
            assert_eq!(Law::from_option(law.option()), Some(law));
        }
        per_law[Law::PolePlacement] = "changed";
        assert_eq!((per_law.lqr, per_law.pole_placement), ("lqr", "changed"));
        assert_eq!(Law::from_option("pole placement"), None);
    }
}
