//! Writes messages in postcard's format. Postcard's own serializer would make the image 1.8 kB larger, because it is
//! compiled again for each field that holds a number.
//!
//! Messages are read with postcard; the tests compare the two serializers byte by byte.

use core::fmt::Display;

use serde::Serialize;
use serde::ser::{
    self, Impossible, SerializeSeq, SerializeStruct, SerializeStructVariant, SerializeTuple,
    SerializeTupleStruct, SerializeTupleVariant,
};

use super::frame::FrameError;

/// Writes `message` to the beginning of `out`; returns its length (bytes).
///
/// # Errors
/// [`FrameError::Long`] if `out` is too small, [`FrameError::Message`] if the message holds a map or a single `char`.
pub(super) fn encode<T: Serialize>(message: &T, out: &mut [u8]) -> Result<usize, FrameError> {
    let mut encoder = Encoder { out, length: 0 };
    message.serialize(&mut encoder)?;
    if encoder.length <= encoder.out.len() { Ok(encoder.length) } else { Err(FrameError::Long) }
}

struct Encoder<'a> {
    out: &'a mut [u8],
    /// Number of bytes so far. Bytes that do not fit are only counted: then one check at the end is enough.
    length: usize,
}

impl Encoder<'_> {
    #[inline(never)]
    fn push(&mut self, byte: u8) {
        if let Some(place) = self.out.get_mut(self.length) {
            *place = byte;
        }
        self.length = self.length.saturating_add(1);
    }

    /// Writes an integer of variable length: seven bits in each byte, the low ones first; the eighth bit says that
    /// more follow.
    #[inline(never)]
    fn number(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.push(value as u8);
    }

    #[inline(never)]
    fn bytes(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.push(byte);
        }
    }

    /// Writes a signed integer: 0, -1, 1, -2 … become 0, 1, 2, 3 …, so that small numbers of both signs stay short.
    fn signed(&mut self, value: i64) {
        self.number(((value << 1) ^ (value >> 63)) as u64);
    }
}

/// Methods that write one number.
macro_rules! numbers {
    ($($method:ident($type:ty): $write:ident as $wide:ty;)*) => {
        $(fn $method(self, value: $type) -> Result<(), FrameError> {
            self.$write(value as $wide);
            Ok(())
        })*
    };
}

impl ser::Serializer for &mut Encoder<'_> {
    type Ok = ();
    type Error = FrameError;
    type SerializeSeq = Self;
    type SerializeTuple = Self;
    type SerializeTupleStruct = Self;
    type SerializeTupleVariant = Self;
    type SerializeMap = Impossible<(), FrameError>;
    type SerializeStruct = Self;
    type SerializeStructVariant = Self;

    numbers! {
        serialize_bool(bool): push as u8;
        serialize_u8(u8): push as u8;
        serialize_i8(i8): push as u8;
        serialize_u16(u16): number as u64;
        serialize_u32(u32): number as u64;
        serialize_u64(u64): number as u64;
        serialize_i16(i16): signed as i64;
        serialize_i32(i32): signed as i64;
        serialize_i64(i64): signed as i64;
    }

    fn serialize_f32(self, value: f32) -> Result<(), FrameError> {
        self.bytes(&value.to_le_bytes());
        Ok(())
    }

    fn serialize_f64(self, value: f64) -> Result<(), FrameError> {
        self.bytes(&value.to_le_bytes());
        Ok(())
    }

    fn serialize_char(self, _: char) -> Result<(), FrameError> {
        Err(FrameError::Message)
    }

    fn serialize_str(self, text: &str) -> Result<(), FrameError> {
        self.serialize_bytes(text.as_bytes())
    }

    fn serialize_bytes(self, bytes: &[u8]) -> Result<(), FrameError> {
        self.number(bytes.len() as u64);
        self.bytes(bytes);
        Ok(())
    }

    fn collect_str<T: Display + ?Sized>(self, _: &T) -> Result<(), FrameError> {
        Err(FrameError::Message)
    }

    fn serialize_none(self) -> Result<(), FrameError> {
        self.serialize_bool(false)
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), FrameError> {
        self.push(1);
        value.serialize(self)
    }

    fn serialize_unit(self) -> Result<(), FrameError> {
        Ok(())
    }

    fn serialize_unit_struct(self, _: &'static str) -> Result<(), FrameError> {
        Ok(())
    }

    fn serialize_unit_variant(self, _: &'static str, index: u32, _: &'static str) -> Result<(), FrameError> {
        self.serialize_u32(index)
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        value: &T,
    ) -> Result<(), FrameError> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        index: u32,
        _: &'static str,
        value: &T,
    ) -> Result<(), FrameError> {
        self.number(index.into());
        value.serialize(self)
    }

    fn serialize_seq(self, length: Option<usize>) -> Result<Self, FrameError> {
        self.number(length.ok_or(FrameError::Message)? as u64);
        Ok(self)
    }

    fn serialize_tuple(self, _: usize) -> Result<Self, FrameError> {
        Ok(self)
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Self, FrameError> {
        Ok(self)
    }

    fn serialize_tuple_variant(
        self,
        _: &'static str,
        index: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self, FrameError> {
        self.number(index.into());
        Ok(self)
    }

    fn serialize_map(self, _: Option<usize>) -> Result<Self::SerializeMap, FrameError> {
        Err(FrameError::Message)
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Self, FrameError> {
        Ok(self)
    }

    fn serialize_struct_variant(
        self,
        name: &'static str,
        index: u32,
        variant: &'static str,
        length: usize,
    ) -> Result<Self, FrameError> {
        self.serialize_tuple_variant(name, index, variant, length)
    }

    fn is_human_readable(&self) -> bool {
        false
    }
}

/// Implements a trait for compound values, whose contents are written one after the other.
macro_rules! contents {
    ($($trait:ident::$method:ident($($name:ty)?);)*) => {
        $(impl $trait for &mut Encoder<'_> {
            type Ok = ();
            type Error = FrameError;

            fn $method<T: Serialize + ?Sized>(&mut self, $(_: $name,)? value: &T) -> Result<(), FrameError> {
                value.serialize(&mut **self)
            }

            fn end(self) -> Result<(), FrameError> {
                Ok(())
            }
        })*
    };
}

contents! {
    SerializeSeq::serialize_element();
    SerializeTuple::serialize_element();
    SerializeTupleStruct::serialize_field();
    SerializeTupleVariant::serialize_field();
    SerializeStruct::serialize_field(&'static str);
    SerializeStructVariant::serialize_field(&'static str);
}

impl ser::Error for FrameError {
    fn custom<T: Display>(_: T) -> Self {
        Self::Message
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use heapless::Vec;
    use proptest::prelude::*;

    /// Every kind of value that a message can hold.
    #[derive(Debug, Serialize)]
    struct Values {
        numbers: (u8, i8, u16, i16, u32, i32, u64, i64),
        floats: (f32, f64),
        options: [Option<bool>; 2],
        list: Vec<i32, 4>,
        text: &'static str,
        unit: (),
        named: Named,
        kinds: [Kind; 4],
    }

    #[derive(Debug, Serialize)]
    struct Named(u32, i32);

    #[derive(Debug, Serialize)]
    enum Kind {
        Unit,
        Newtype(u32),
        Tuple(u8, i16),
        Struct { wide: u64 },
    }

    fn values() -> impl Strategy<Value = Values> {
        let lists = proptest::collection::vec(any::<i32>(), 0..=4);
        (any::<(u8, i8, u16, i16, u32, i32, u64, i64)>(), any::<(f32, f64, Option<bool>)>(), lists).prop_map(
            |(numbers, (single, double, option), list)| Values {
                numbers,
                floats: (single, double),
                options: [option, None],
                list: Vec::from_slice(&list).unwrap(),
                text: "µ",
                unit: (),
                named: Named(numbers.4, numbers.5),
                kinds: [
                    Kind::Unit,
                    Kind::Newtype(numbers.4),
                    Kind::Tuple(numbers.0, numbers.3),
                    Kind::Struct { wide: numbers.6 },
                ],
            },
        )
    }

    proptest! {
        #[test]
        fn the_bytes_are_those_of_postcard(values in values()) {
            let (mut ours, mut reference) = ([0; 160], [0; 160]);
            let length = encode(&values, &mut ours).unwrap();
            prop_assert_eq!(&ours[..length], postcard::to_slice(&values, &mut reference).unwrap());
        }

        #[test]
        fn a_buffer_that_is_too_small_is_refused_and_one_that_fits_is_not(values in values()) {
            let length = encode(&values, &mut [0; 160]).unwrap();
            for size in 0..length {
                prop_assert_eq!(encode(&values, &mut [0; 160][..size]), Err(FrameError::Long));
            }
            prop_assert_eq!(encode(&values, &mut [0; 160][..length]), Ok(length));
        }
    }

    #[test]
    fn the_ends_of_the_ranges_are_those_of_postcard() {
        let ends = (u64::MAX, i64::MIN, i64::MAX, i32::MIN, i16::MIN, 127u32, 128u32, -64i32, 64i32);
        let (mut ours, mut reference) = ([0; 64], [0; 64]);
        let length = encode(&ends, &mut ours).unwrap();
        assert_eq!(&ours[..length], postcard::to_slice(&ends, &mut reference).unwrap());
    }

    #[test]
    fn what_no_message_holds_is_refused() {
        assert_eq!(encode(&'a', &mut [0; 8]), Err(FrameError::Message));
        assert_eq!(encode(&std::collections::HashMap::from([(1, 2)]), &mut [0; 8]), Err(FrameError::Message));
    }
}
