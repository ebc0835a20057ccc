//! A gain table as words, as an image in flash carries it.
//!
//! The words are those of which [`GainTable::checksum`](super::GainTable::checksum) is the checksum, in the same
//! order; before the values of a list whose length is not part of its type comes their number. The checksum follows.
//! So the words do not depend on the compiler, and the same code serves every rig of a size.

use bytemuck::AnyBitPattern;
use nalgebra::SMatrix;

use crate::table::columns::columns;

/// A part that can be filled from the words of a table.
pub trait Fill<'words>: Sized {
    /// All numbers 0, all lists empty.
    const EMPTY: Self;

    /// Takes the values from the next words.
    fn fill(&mut self, words: &mut WordReader<'words>);
}

/// Gives the words of a table, one after the other. Where words are missing, or are no table, everything after them is
/// 0: such a table has the wrong format or checksum, and [`check`](super::GainTable::check) refuses it.
#[derive(Debug, Clone)]
pub struct WordReader<'words> {
    words: &'words [u32],
    skipped: &'words [u32],
}

impl<'words> WordReader<'words> {
    /// Begins with the first of these words.
    pub fn new(words: &'words [u32]) -> Self {
        Self { words, skipped: &[] }
    }

    /// The next word; 0 after the last one.
    pub fn word(&mut self) -> u32 {
        let (first, rest) = self.words.split_first().unwrap_or((&0, &[]));
        self.words = rest;
        *first
    }

    /// Takes everything that follows as 0.
    pub fn refuse(&mut self) {
        self.words = &[];
    }

    /// The next part.
    pub fn part<P: Fill<'words>>(&mut self) -> P {
        let mut part = P::EMPTY;
        part.fill(self);
        part
    }

    /// Skips a list of parts with its length before it: they need room that a table does not have. They are read again
    /// from [`skipped`](Self::skipped).
    pub fn skip_list<P: Fill<'words>>(&mut self) {
        self.skipped = self.words;
        let length = self.word();
        for _ in 0..length {
            if self.words.is_empty() {
                return;
            }
            self.part::<P>();
        }
    }

    /// A reader of the list that was skipped, its length first.
    pub fn skipped(&self) -> Self {
        Self::new(self.skipped)
    }

    /// A list of numbers with its length before it.
    fn slice<P: AnyBitPattern>(&mut self) -> &'words [P] {
        let length = self.word() as usize;
        let words = length.checked_mul(size_of::<P>()).map_or(usize::MAX, |bytes| bytes.div_ceil(4));
        let Some((list, rest)) = self.words.split_at_checked(words) else {
            self.refuse();
            return &[];
        };
        self.words = rest;
        bytemuck::try_cast_slice(list).ok().and_then(|list| list.get(..length)).unwrap_or_default()
    }
}

macro_rules! number {
    ($type:ty, $from_bits:expr) => {
        impl Fill<'_> for $type {
            const EMPTY: Self = 0 as $type;

            fn fill(&mut self, words: &mut WordReader<'_>) {
                *self = $from_bits(words.word());
            }
        }
    };
}

number!(f32, f32::from_bits);
number!(u32, core::convert::identity);
number!(i32, u32::cast_signed);

impl Fill<'_> for u64 {
    const EMPTY: Self = 0;

    fn fill(&mut self, words: &mut WordReader<'_>) {
        let low = words.word();
        *self = u64::from(words.word()) << 32 | u64::from(low);
    }
}

impl<'t, 'words: 't, P: AnyBitPattern> Fill<'words> for &'t [P] {
    const EMPTY: Self = &[];

    fn fill(&mut self, words: &mut WordReader<'words>) {
        *self = words.slice();
    }
}

impl<'words, P: Fill<'words>, const N: usize> Fill<'words> for [P; N] {
    const EMPTY: Self = [P::EMPTY; N];

    fn fill(&mut self, words: &mut WordReader<'words>) {
        self.iter_mut().for_each(|part| part.fill(words));
    }
}

impl<const R: usize, const C: usize> Fill<'_> for SMatrix<f32, R, C> {
    const EMPTY: Self = columns([[0.0; R]; C]);

    fn fill(&mut self, words: &mut WordReader<'_>) {
        self.data.0.fill(words);
    }
}

impl<'words, P: Fill<'words>> Fill<'words> for Option<P> {
    const EMPTY: Self = None;

    fn fill(&mut self, words: &mut WordReader<'words>) {
        match words.word() {
            0 => *self = None,
            1 => self.insert(P::EMPTY).fill(words),
            _ => words.refuse(),
        }
    }
}
