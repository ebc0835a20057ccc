//! The structs and enums of words that make up a gain table, each declared once by [`part!`].
//!
//! The declaration generates the type and everything that visits all of its fields: the checksum, the check for
//! infinities and NaN, the writer of the source and the change of size. Exhaustive destructuring makes the compiler
//! reject a forgotten field.

use nalgebra::SMatrix;

use crate::table::columns::columns;

/// Consecutive words of a table, all of one type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Words<'a> {
    /// Floating-point numbers.
    F32(&'a [f32]),
    /// Unsigned integers.
    U32(&'a [u32]),
    /// Signed integers.
    I32(&'a [i32]),
    /// Signed integers of 16 bits, two in a word, the first one in its low half.
    I16(&'a [i16]),
    /// Two words, the low one first.
    U64(&'a u64),
}

impl Words<'_> {
    /// The bits of word `index`; `None` past the end.
    #[inline]
    pub fn get(&self, index: usize) -> Option<u32> {
        match self {
            Words::F32(values) => values.get(index).map(|value| value.to_bits()),
            Words::U32(values) => values.get(index).copied(),
            Words::I32(values) => values.get(index).map(|&value| value as u32),
            Words::I16(values) => {
                let half = |at: usize| values.get(at).map(|&value| u32::from(value as u16));
                Some(half(2 * index)? | half(2 * index + 1).unwrap_or(0) << 16)
            }
            Words::U64(value) => match index {
                0 => Some(**value as u32),
                1 => Some((**value >> 32) as u32),
                _ => None,
            },
        }
    }

    /// Whether none of them is an infinity or NaN.
    fn are_finite(&self) -> bool {
        match self {
            Words::F32(values) => values.iter().all(|value| value.is_finite()),
            _ => true,
        }
    }
}

/// The same words as [`Words`], mutable, with which tests damage a table.
#[cfg(test)]
#[derive(Debug, PartialEq)]
pub enum WordsMut<'a> {
    /// Floating-point numbers.
    F32(&'a mut [f32]),
    /// Unsigned integers.
    U32(&'a mut [u32]),
    /// Signed integers.
    I32(&'a mut [i32]),
    /// Two words, the low one first.
    U64(&'a mut u64),
    /// Words that cannot be changed here: which variant of an enum it is, and those of a shared slice.
    Fixed,
}

/// How the words of a field are arranged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A single value.
    Value,
    /// An array.
    List,
    /// A list whose length is not part of its type.
    Slice,
    /// A matrix, column by column; a vector is one column.
    Columns {
        /// Number of entries in each column.
        rows: usize,
    },
}

/// A variant of an enum, or of an optional part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Variant {
    /// What it is called in Rust, with the name of its enum.
    pub name: &'static str,
    /// Its number in the words of a table.
    pub number: u32,
    /// Whether it holds a part.
    pub has_value: bool,
}

impl Variant {
    /// What it is called, without the name of its enum.
    pub fn last_name(&self) -> &'static str {
        self.name.rsplit(':').next().unwrap_or(self.name)
    }
}

/// A table or a part of one.
pub trait Part {
    /// The words of leaf `at`, counted in the order of declaration. A part with fewer leaves subtracts their number
    /// from `at` and returns `None`. An enum is one word, the number of its variant, followed by what that holds; an
    /// optional part is 1 and the part, or 0.
    fn part(&self, at: &mut usize) -> Option<Words<'_>>;

    /// The same as [`part`](Self::part), mutable.
    #[cfg(test)]
    fn part_mut(&mut self, at: &mut usize) -> Option<WordsMut<'_>>;

    /// Passes all names, documentation and values to `reader`, in the order of declaration.
    fn read(&self, reader: &mut dyn Reader);

    /// [`part`](Self::part) of an array: numbers are one leaf together, others follow one after the other.
    fn part_of_list<'l>(list: &'l [Self], at: &mut usize) -> Option<Words<'l>>
    where
        Self: Sized,
    {
        list.iter().find_map(|part| part.part(at))
    }

    /// The same, mutable.
    #[cfg(test)]
    fn part_of_list_mut<'l>(list: &'l mut [Self], at: &mut usize) -> Option<WordsMut<'l>>
    where
        Self: Sized,
    {
        list.iter_mut().find_map(|part| part.part_mut(at))
    }

    /// [`read`](Self::read) of an array.
    fn read_list(list: &[Self], reader: &mut dyn Reader)
    where
        Self: Sized,
    {
        reader.list(list.len(), Shape::List);
        list.iter().for_each(|part| part.read(reader));
    }
}

impl<P: Part, const N: usize> Part for [P; N] {
    #[inline]
    fn part(&self, at: &mut usize) -> Option<Words<'_>> {
        P::part_of_list(self, at)
    }

    #[cfg(test)]
    fn part_mut(&mut self, at: &mut usize) -> Option<WordsMut<'_>> {
        P::part_of_list_mut(self, at)
    }

    fn read(&self, reader: &mut dyn Reader) {
        P::read_list(self, reader);
    }
}

impl<P: Copy + Default, const N: usize, const M: usize> Resize<[P; M]> for [P; N] {
    fn resized(&self) -> [P; M] {
        let mut resized = [P::default(); M];
        copy(self, &mut resized);
        resized
    }
}

/// Receives the fields of a table with names, documentation and values.
pub trait Reader {
    /// Start of a struct with this name.
    fn begin(&mut self, name: &'static str);

    /// A field of the struct, with its documentation line by line; its value follows.
    fn field(&mut self, name: &'static str, documentation: &[&'static str]);

    /// The value of a field.
    fn words(&mut self, words: Words<'_>, shape: Shape);

    /// The value of a field is this variant. If it has a value, that follows.
    fn variant(&mut self, variant: Variant);

    /// The value of a field is a list of `length` structs, which follow: an array, or a slice.
    fn list(&mut self, length: usize, shape: Shape);

    /// End of the struct.
    fn end(&mut self);
}

/// Converts a part to another number of states and sensors: surplus entries are dropped, new ones are 0.
pub trait Resize<To> {
    /// The part in the new size.
    fn resized(&self) -> To;
}

macro_rules! words {
    ($kind:ident, $type:ty) => {
        impl Part for $type {
            #[inline]
            fn part(&self, at: &mut usize) -> Option<Words<'_>> {
                leaf(at, Words::$kind(core::slice::from_ref(self)))
            }

            #[cfg(test)]
            fn part_mut(&mut self, at: &mut usize) -> Option<WordsMut<'_>> {
                leaf(at, WordsMut::$kind(core::slice::from_mut(self)))
            }

            fn read(&self, reader: &mut dyn Reader) {
                reader.words(Words::$kind(core::slice::from_ref(self)), Shape::Value);
            }

            #[inline]
            fn part_of_list<'l>(list: &'l [Self], at: &mut usize) -> Option<Words<'l>> {
                leaf(at, Words::$kind(list))
            }

            #[cfg(test)]
            fn part_of_list_mut<'l>(list: &'l mut [Self], at: &mut usize) -> Option<WordsMut<'l>> {
                leaf(at, WordsMut::$kind(list))
            }

            fn read_list(list: &[Self], reader: &mut dyn Reader) {
                reader.words(Words::$kind(list), Shape::List);
            }
        }

        impl Resize<$type> for $type {
            fn resized(&self) -> Self {
                *self
            }
        }
    };
}

words!(F32, f32);
words!(U32, u32);
words!(I32, i32);

impl Part for u64 {
    #[inline]
    fn part(&self, at: &mut usize) -> Option<Words<'_>> {
        leaf(at, Words::U64(self))
    }

    #[cfg(test)]
    fn part_mut(&mut self, at: &mut usize) -> Option<WordsMut<'_>> {
        leaf(at, WordsMut::U64(self))
    }

    fn read(&self, reader: &mut dyn Reader) {
        reader.words(Words::U64(self), Shape::Value);
    }
}

impl Resize<u64> for u64 {
    fn resized(&self) -> Self {
        *self
    }
}

/// Copies as many entries as both slices have.
fn copy<T: Copy>(from: &[T], to: &mut [T]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
}

/// Implements [`Part`] for a slice, whose values are stored outside the struct.
macro_rules! slice {
    ($kind:ident, $type:ty) => {
        impl Part for &[$type] {
            #[inline]
            fn part(&self, at: &mut usize) -> Option<Words<'_>> {
                leaf(at, Words::$kind(self))
            }

            #[cfg(test)]
            fn part_mut(&mut self, at: &mut usize) -> Option<WordsMut<'_>> {
                leaf(at, WordsMut::Fixed)
            }

            fn read(&self, reader: &mut dyn Reader) {
                reader.words(Words::$kind(self), Shape::Slice);
            }
        }

        impl<'t> Resize<&'t [$type]> for &'t [$type] {
            fn resized(&self) -> &'t [$type] {
                self
            }
        }
    };
}

slice!(F32, f32);
slice!(I16, i16);

impl<const R: usize, const C: usize> Part for SMatrix<f32, R, C> {
    #[inline]
    fn part(&self, at: &mut usize) -> Option<Words<'_>> {
        leaf(at, Words::F32(self.as_slice()))
    }

    #[cfg(test)]
    fn part_mut(&mut self, at: &mut usize) -> Option<WordsMut<'_>> {
        leaf(at, WordsMut::F32(self.as_mut_slice()))
    }

    fn read(&self, reader: &mut dyn Reader) {
        reader.words(Words::F32(self.as_slice()), Shape::Columns { rows: R });
    }
}

impl<const R: usize, const C: usize, const S: usize, const D: usize> Resize<SMatrix<f32, S, D>>
    for SMatrix<f32, R, C>
{
    fn resized(&self) -> SMatrix<f32, S, D> {
        let mut resized = [[0.0; S]; D];
        for (to, from) in resized.iter_mut().zip(&self.data.0) {
            copy(from, to);
        }
        columns(resized)
    }
}

impl<P: Part> Part for Option<P> {
    #[inline]
    fn part(&self, at: &mut usize) -> Option<Words<'_>> {
        let presence: &[u32] = if self.is_some() { &[1] } else { &[0] };
        match (leaf(at, Words::U32(presence)), self) {
            (None, Some(part)) => part.part(at),
            (words, _) => words,
        }
    }

    #[cfg(test)]
    fn part_mut(&mut self, at: &mut usize) -> Option<WordsMut<'_>> {
        match (leaf(at, WordsMut::Fixed), self) {
            (None, Some(part)) => part.part_mut(at),
            (words, _) => words,
        }
    }

    fn read(&self, reader: &mut dyn Reader) {
        match self {
            None => reader.variant(Variant { name: "None", number: 0, has_value: false }),
            Some(part) => {
                reader.variant(Variant { name: "Some", number: 1, has_value: true });
                part.read(reader);
            }
        }
    }
}

impl<P: Resize<Q>, Q> Resize<Option<Q>> for Option<P> {
    fn resized(&self) -> Option<Q> {
        self.as_ref().map(Resize::resized)
    }
}

/// Whether a part is free of infinities and NaN.
pub(crate) fn is_finite(part: &impl Part) -> bool {
    let mut leaf = 0;
    while let Some(words) = part.part(&mut { leaf }) {
        if !words.are_finite() {
            return false;
        }
        leaf += 1;
    }
    true
}

/// `words` if `at` is 0; otherwise counts `at` down by this leaf.
#[inline(always)]
pub(crate) fn leaf<W>(at: &mut usize, words: W) -> Option<W> {
    match at.checked_sub(1) {
        None => Some(words),
        Some(further) => {
            *at = further;
            None
        }
    }
}

/// Declares a struct of a gain table: `pub struct Name<'t, SIZE to OTHER, …; SCALAR> { … }`. `SIZE` is a number of
/// states, sensors or links and `OTHER` its name in the result of [`Resize`]. `SCALAR` is given if the host also uses
/// the struct in another precision, `'t` if it holds slices. Every field needs documentation. A last field `sealed by
/// NAME` is the checksum of the others.
///
/// `pub enum Name<SCALAR> { Variant(name: Part) = NUMBER, … }` declares a part of several kinds, of which each has a
/// number in the table's words and may hold a part.
macro_rules! part {
    (
        $(#[$attribute:meta])*
        pub struct $name:ident<$($life:lifetime,)? $($size:ident to $other:ident),*; $($scalar:ident)?> {
            $($(#[doc = $doc:literal])+ pub $field:ident: $type:ty,)+
            $(sealed by $(#[$seal_attribute:meta])+ pub $seal:ident,)?
        }
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, PartialEq)]
        pub struct $name<$($life,)? $(const $size: usize,)* $($scalar: $crate::table::Number = f32)?> {
            $($(#[doc = $doc])+ pub $field: $type,)+
            $($(#[$seal_attribute])+ pub $seal: u32,)?
        }

        impl<$($life,)? $(const $size: usize),*> $crate::table::part::Part for $name<$($life,)? $($size),*> {
            fn part(&self, at: &mut usize) -> Option<$crate::table::part::Words<'_>> {
                let Self { $($field,)+ $($seal: _)? } = self;
                $(if let Some(words) = $crate::table::part::Part::part($field, at) {
                    return Some(words);
                })+
                None
            }

            #[cfg(test)]
            fn part_mut(&mut self, at: &mut usize) -> Option<$crate::table::part::WordsMut<'_>> {
                let Self { $($field,)+ $($seal: _)? } = self;
                $(if let Some(words) = $crate::table::part::Part::part_mut($field, at) {
                    return Some(words);
                })+
                None
            }

            fn read(&self, reader: &mut dyn $crate::table::part::Reader) {
                let Self { $($field,)+ $($seal: _)? } = self;
                reader.begin(stringify!($name));
                $(
                    reader.field(stringify!($field), &[$($doc),+]);
                    $crate::table::part::Part::read($field, reader);
                )+
                reader.end();
            }
        }

        #[cfg(feature = "firmware")]
        impl<'words, $($life,)? $(const $size: usize),*> $crate::table::Fill<'words>
            for $name<$($life,)? $($size),*>
        where
            $('words: $life,)?
        {
            const EMPTY: Self =
                Self { $($field: $crate::table::Fill::EMPTY,)+ $($seal: 0)? };

            fn fill(&mut self, words: &mut $crate::table::WordReader<'words>) {
                let Self { $($field,)+ $($seal)? } = self;
                $($crate::table::Fill::fill($field, words);)+
                $(*$seal = words.word();)?
            }
        }

        impl<$($life,)? $(const $size: usize, const $other: usize),*>
            $crate::table::part::Resize<$name<$($life,)? $($other),*>> for $name<$($life,)? $($size),*>
        {
            fn resized(&self) -> $name<$($life,)? $($other),*> {
                let Self { $($field,)+ $($seal)? } = self;
                $name {
                    $($field: $crate::table::part::Resize::resized($field),)+
                    $($seal: *$seal)?
                }
            }
        }
    };
    (
        $(#[$attribute:meta])*
        pub enum $name:ident<$($scalar:ident)?> {
            $($(#[doc = $doc:literal])+ $variant:ident $(($part:ident: $type:ty))? = $number:literal,)+
        }
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum $name<$($scalar: $crate::table::Number = f32)?> {
            $($(#[doc = $doc])+ $variant $(($type))?,)+
        }

        impl $crate::table::part::Part for $name {
            fn part(&self, at: &mut usize) -> Option<$crate::table::part::Words<'_>> {
                match self {
                    $(Self::$variant $(($part))? => {
                        $crate::table::part::leaf(at, $crate::table::part::Words::U32(&[$number]))
                            $(.or_else(|| $crate::table::part::Part::part($part, at)))?
                    })+
                }
            }

            #[cfg(test)]
            fn part_mut(&mut self, at: &mut usize) -> Option<$crate::table::part::WordsMut<'_>> {
                match self {
                    $(Self::$variant $(($part))? => {
                        $crate::table::part::leaf(at, $crate::table::part::WordsMut::Fixed)
                            $(.or_else(|| $crate::table::part::Part::part_mut($part, at)))?
                    })+
                }
            }

            fn read(&self, reader: &mut dyn $crate::table::part::Reader) {
                match self {
                    $(Self::$variant $(($part))? => {
                        let held: &[&dyn Fn(&mut dyn $crate::table::part::Reader)] =
                            &[$(&|reader| $crate::table::part::Part::read($part, reader))?];
                        reader.variant($crate::table::part::Variant {
                            name: concat!(stringify!($name), "::", stringify!($variant)),
                            number: $number,
                            has_value: !held.is_empty(),
                        });
                        held.iter().for_each(|read| read(reader));
                    })+
                }
            }
        }

        #[cfg(feature = "firmware")]
        impl<'words> $crate::table::Fill<'words> for $name {
            const EMPTY: Self = $(if $number == 0 {
                Self::$variant $(({ let $part = $crate::table::Fill::EMPTY; $part }))?
            } else)+ {
                panic!("no variant has the number 0")
            };

            fn fill(&mut self, words: &mut $crate::table::WordReader<'words>) {
                match words.word() {
                    $($number => {
                        *self = Self::$variant $(({
                            let $part = words.part();
                            $part
                        }))?;
                    })+
                    _ => words.refuse(),
                }
            }
        }

        impl $crate::table::part::Resize<Self> for $name {
            fn resized(&self) -> Self {
                *self
            }
        }
    };
}

pub(crate) use part;
