//! The states of rest of a chain: each link stands up or hangs down.

#[cfg(feature = "firmware")]
use serde::{Deserialize, Serialize};

/// Which links are up and which are down, all at rest: each of the first eight, and all further ones together (up
/// to 31).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
#[cfg_attr(feature = "firmware", derive(Serialize, Deserialize))]
pub struct Equilibrium(u8);

impl Equilibrium {
    /// All links are up.
    pub const UPRIGHT: Self = Self(0);

    /// All links are down, however many there are: see [`of_links`](Self::of_links).
    pub const HANGING: Self = Self(u8::MAX);

    /// All of `links` links are down.
    pub const fn hanging(links: usize) -> Self {
        Self::HANGING.of_links(links)
    }

    /// The same equilibrium for a chain of `links` links: what it says about further links is dropped.
    #[must_use]
    pub const fn of_links(self, links: usize) -> Self {
        Self((self.0 as u32 & ((1 << links) - 1)) as u8)
    }

    /// The equilibrium with these bits: bit 0 is set if link 1 is down, bit 1 if link 2 is, and so on.
    pub const fn of_bits(bits: u32) -> Self {
        Self(bits as u8)
    }

    /// The bits, as in [`of_bits`](Self::of_bits).
    pub const fn bits(self) -> u32 {
        self.0 as u32
    }

    /// Whether this link is down; the first one has number 0.
    pub const fn is_down(self, link: usize) -> bool {
        // Sign-extended: links beyond the eighth are like the eighth, so that all of them hang in `HANGING`.
        (self.0 as i8 as i32) >> link & 1 != 0
    }

    /// Half turns of this joint relative to the link before it, -1, 0 or 1; the first one has number 0.
    pub const fn half_turns(self, joint: usize) -> i32 {
        let before = joint > 0 && self.is_down(joint - 1);
        self.is_down(joint) as i32 - before as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_joints_turn_where_a_link_differs_from_the_one_before() {
        let turns = |bits| [0, 1, 2].map(|joint| Equilibrium::of_bits(bits).half_turns(joint));
        assert_eq!(turns(0), [0, 0, 0]);
        assert_eq!(turns(0b111), [1, 0, 0]);
        assert_eq!(turns(0b010), [0, 1, -1]);
        assert_eq!(turns(0b101), [1, -1, 1]);
        assert_eq!(Equilibrium::hanging(3), Equilibrium::of_bits(0b111));
    }
}
