//! Decodes CDR by a schema and tells a visitor what it finds.

use std::borrow::Cow;

use super::{Count, Element, Primitive, Schema};
use crate::error::{BagError, Result};

/// One decoded value.
#[derive(Debug, Clone, PartialEq)]
pub enum Scalar<'a> {
    /// `bool`
    Bool(bool),
    /// A signed integer of any width.
    Int(i64),
    /// An unsigned integer of any width.
    Uint(u64),
    /// `float32`
    F32(f32),
    /// `float64`
    F64(f64),
    /// `string` or `wstring`; what is no Unicode is replaced.
    Text(Cow<'a, str>),
}

/// Receives a message's parts in order. The default of each method does nothing.
pub trait Visitor {
    /// A message begins.
    fn begin_struct(&mut self) {}
    /// The value of a field follows; `first` in its message.
    fn field(&mut self, _name: &str, _first: bool) {}
    /// A message ends.
    fn end_struct(&mut self) {}
    /// An array or sequence of `len` elements begins.
    fn begin_array(&mut self, _len: usize) {}
    /// An element follows; `first` in its array.
    fn element(&mut self, _first: bool) {}
    /// An array or sequence ends.
    fn end_array(&mut self) {}
    /// A value.
    fn scalar(&mut self, _value: Scalar<'_>) {}
}

/// Decodes a whole message.
///
/// # Errors
/// [`BagError::Cdr`] when the bytes end early, a length, bound or text is impossible, or more
/// than padding is left.
pub fn decode(schema: &Schema, data: &[u8], visitor: &mut dyn Visitor) -> Result<()> {
    Decoder::new(schema, data, None).whole(visitor)
}

/// A number of more than one byte in a message.
#[derive(Debug, Clone, Copy)]
pub(super) struct Number {
    /// Offset of the padding before it, which may be none.
    pub padding: usize,
    /// Its offset.
    pub at: usize,
    /// Its size [bytes].
    pub size: usize,
}

/// Where the numbers of a message are that have more than one byte, in order.
///
/// # Errors
/// As [`decode`].
pub(super) fn numbers(schema: &Schema, data: &[u8]) -> Result<Vec<Number>> {
    struct Nothing;
    impl Visitor for Nothing {}
    let mut places = Vec::new();
    Decoder::new(schema, data, Some(&mut places)).whole(&mut Nothing)?;
    Ok(places)
}

/// The encapsulation header, which alignment does not count.
pub(super) const HEADER: usize = 4;

struct Decoder<'a> {
    schema: &'a Schema,
    data: &'a [u8],
    at: usize,
    little: bool,
    /// Greatest alignment: 8, and 4 in the second version of CDR.
    alignment: usize,
    /// Where the places of numbers are noted, if they are wanted.
    places: Option<&'a mut Vec<Number>>,
}

impl<'a> Decoder<'a> {
    fn new(schema: &'a Schema, data: &'a [u8], places: Option<&'a mut Vec<Number>>) -> Self {
        Self { schema, data, at: 0, little: true, alignment: 8, places }
    }

    fn whole(mut self, visitor: &mut dyn Visitor) -> Result<()> {
        self.encapsulation()?;
        self.structure(0, visitor)?;
        let left = self.data.len() - self.at;
        // Writers round payloads up to four bytes.
        if left > 3 {
            return Err(self.error(format!("{left} bytes are left behind the message")));
        }
        Ok(())
    }

    fn error(&self, reason: impl Into<String>) -> BagError {
        let type_name = self.schema.type_name.clone();
        BagError::Cdr { type_name, offset: self.at, reason: reason.into() }
    }

    fn encapsulation(&mut self) -> Result<()> {
        let header = self.take(HEADER)?;
        match header {
            [0, 0, ..] => self.little = false,
            [0, 1, ..] => self.little = true,
            [0, 6, ..] => (self.little, self.alignment) = (false, 4),
            [0, 7, ..] => (self.little, self.alignment) = (true, 4),
            [a, b, ..] => {
                self.at = 0;
                return Err(self.error(format!("encapsulation {a:#04x} {b:#04x} is not plain CDR")));
            }
            _ => return Err(self.error("no encapsulation header")),
        }
        Ok(())
    }

    fn take(&mut self, len: usize) -> Result<&'a [u8]> {
        let left = &self.data[self.at..];
        let Some(taken) = left.get(..len) else {
            return Err(self.error(format!("{len} bytes expected, {} left", left.len())));
        };
        self.at += len;
        Ok(taken)
    }

    fn take_array<const N: usize>(&mut self) -> Result<[u8; N]> {
        let (before, position) = (self.at, self.at - HEADER);
        let padding = position.next_multiple_of(N.min(self.alignment)) - position;
        self.take(padding)?;
        if let Some(places) = self.places.as_mut().filter(|_| N > 1) {
            places.push(Number { padding: before, at: self.at, size: N });
        }
        let mut bytes = [0; N];
        bytes.copy_from_slice(self.take(N)?);
        if !self.little {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn structure(&mut self, index: usize, visitor: &mut dyn Visitor) -> Result<()> {
        let schema = self.schema;
        visitor.begin_struct();
        let fields = &schema.structs[index].fields;
        if fields.is_empty() {
            // ROS gives an empty message one byte, since IDL knows no empty struct.
            self.take(1)?;
        }
        for (number, field) in fields.iter().enumerate() {
            visitor.field(&field.name, number == 0);
            match field.count {
                Count::One => self.element(field.element, visitor)?,
                Count::Fixed(len) => self.array(len, field.element, visitor)?,
                Count::Sequence(bound) => {
                    let len = u32::from_le_bytes(self.take_array()?) as usize;
                    self.check_length(len, bound, field.element)?;
                    self.array(len, field.element, visitor)?;
                }
            }
        }
        visitor.end_struct();
        Ok(())
    }

    /// Refuses a sequence that is beyond its bound or cannot fit into the bytes left.
    fn check_length(&self, len: usize, bound: Option<usize>, element: Element) -> Result<()> {
        if let Some(bound) = bound.filter(|bound| len > *bound) {
            return Err(self.error(format!("sequence of {len} elements, its bound is {bound}")));
        }
        let least = match element {
            Element::Primitive(primitive, _) => primitive.size(),
            Element::Struct(_) => 1,
        };
        let left = self.data.len() - self.at;
        if len.saturating_mul(least) > left {
            return Err(self.error(format!("sequence of {len} elements, {left} bytes left")));
        }
        Ok(())
    }

    fn array(&mut self, len: usize, element: Element, visitor: &mut dyn Visitor) -> Result<()> {
        visitor.begin_array(len);
        for number in 0..len {
            visitor.element(number == 0);
            self.element(element, visitor)?;
        }
        visitor.end_array();
        Ok(())
    }

    fn element(&mut self, element: Element, visitor: &mut dyn Visitor) -> Result<()> {
        match element {
            Element::Struct(index) => self.structure(index, visitor),
            Element::Primitive(primitive, bound) => {
                let value = self.primitive(primitive, bound)?;
                visitor.scalar(value);
                Ok(())
            }
        }
    }

    fn primitive(&mut self, primitive: Primitive, bound: Option<usize>) -> Result<Scalar<'a>> {
        Ok(match primitive {
            Primitive::Bool => match self.take(1)? {
                [0] => Scalar::Bool(false),
                [1] => Scalar::Bool(true),
                other => return Err(self.error(format!("{other:?} is no bool"))),
            },
            Primitive::I8 => Scalar::Int(i8::from_le_bytes(self.take_array()?).into()),
            Primitive::U8 => Scalar::Uint(u8::from_le_bytes(self.take_array()?).into()),
            Primitive::I16 => Scalar::Int(i16::from_le_bytes(self.take_array()?).into()),
            Primitive::U16 => Scalar::Uint(u16::from_le_bytes(self.take_array()?).into()),
            Primitive::I32 => Scalar::Int(i32::from_le_bytes(self.take_array()?).into()),
            Primitive::U32 => Scalar::Uint(u32::from_le_bytes(self.take_array()?).into()),
            Primitive::I64 => Scalar::Int(i64::from_le_bytes(self.take_array()?)),
            Primitive::U64 => Scalar::Uint(u64::from_le_bytes(self.take_array()?)),
            Primitive::F32 => Scalar::F32(f32::from_le_bytes(self.take_array()?)),
            Primitive::F64 => Scalar::F64(f64::from_le_bytes(self.take_array()?)),
            Primitive::String => Scalar::Text(self.string(bound)?),
            Primitive::WString => Scalar::Text(self.wide_string(bound)?),
        })
    }

    fn string(&mut self, bound: Option<usize>) -> Result<Cow<'a, str>> {
        let len = u32::from_le_bytes(self.take_array()?) as usize;
        // Some writers send an empty string without its terminator.
        let text = match self.take(len)? {
            [text @ .., 0] => text,
            [] => &[],
            _ => return Err(self.error("string without terminating zero")),
        };
        if let Some(bound) = bound.filter(|bound| text.len() > *bound) {
            return Err(self.error(format!("string of {} bytes, its bound is {bound}", text.len())));
        }
        Ok(String::from_utf8_lossy(text))
    }

    /// A `wstring`: its length in UTF-16 units, then the units.
    fn wide_string(&mut self, bound: Option<usize>) -> Result<Cow<'a, str>> {
        let len = u32::from_le_bytes(self.take_array()?) as usize;
        self.check_length(len, bound, Element::Primitive(Primitive::U16, None))?;
        let units = (0..len).map(|_| self.take_array().map(u16::from_le_bytes));
        let units = units.collect::<Result<Vec<u16>>>()?;
        Ok(Cow::Owned(String::from_utf16_lossy(&units)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    struct Nothing;
    impl Visitor for Nothing {}

    fn check(schema: &str, data: &[u8]) -> Result<()> {
        let schema = Schema::parse("a/msg/B", schema)?;
        decode(&schema, data, &mut Nothing)
    }

    #[test]
    fn the_second_version_of_cdr_aligns_to_four_bytes() {
        let schema = "uint8 a\nuint64 b\n";
        check(schema, &[0, 7, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]).unwrap();
        check(schema, &[0, 6, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]).unwrap();
        assert!(check(schema, &[0, 1, 0, 0, 7, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]).is_err());
    }

    #[test]
    fn both_byte_orders() {
        let schema = "uint8 a\nuint32 b\n";
        check(schema, &[0, 1, 0, 0, 7, 0, 0, 0, 5, 0, 0, 0]).unwrap();
        check(schema, &[0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 5]).unwrap();
    }

    #[test]
    fn faults() {
        let faulty: [(&str, &[u8], &str); 8] = [
            ("uint32 a", &[0, 1, 0, 0, 1, 2], "4 bytes expected, 2 left"),
            ("uint8 a", &[0, 1, 0, 0, 1, 0, 0, 0, 0], "4 bytes are left"),
            ("uint8 a", &[0, 3, 0, 0, 1], "is not plain CDR"),
            ("uint8 a", &[0], "4 bytes expected"),
            ("bool a", &[0, 1, 0, 0, 2], "is no bool"),
            ("uint8[] a", &[0, 1, 0, 0, 255, 255, 255, 255], "sequence of 4294967295"),
            ("uint8[<=1] a", &[0, 1, 0, 0, 2, 0, 0, 0, 1, 1], "its bound is 1"),
            ("string<=1 a", &[0, 1, 0, 0, 3, 0, 0, 0, 65, 65, 0], "its bound is 1"),
        ];
        for (schema, data, reason) in faulty {
            let error = check(schema, data).unwrap_err().to_string();
            assert!(error.contains(reason), "{error} lacks {reason:?}");
        }
    }

    #[test]
    fn empty_messages_have_one_byte() {
        check("# nothing", &[0, 1, 0, 0, 0]).unwrap();
        assert!(check("# nothing", &[0, 1, 0, 0]).is_err());
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(data in prop::collection::vec(any::<u8>(), 0..200)) {
            for interface in swath_msgs::Interface::all() {
                let schema = Schema::parse(interface.type_name, interface.schema).unwrap();
                let _ = decode(&schema, &data, &mut Nothing);
            }
        }
    }
}
