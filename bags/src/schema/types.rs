//! A message type with all types that it is made of.

use crate::error::{BagError, Result};
use crate::topic::Topic;

/// A type that fits one CDR value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Primitive {
    /// `bool`
    Bool,
    /// `int8`
    I8,
    /// `uint8`, `byte`, `char`
    U8,
    /// `int16`
    I16,
    /// `uint16`
    U16,
    /// `int32`
    I32,
    /// `uint32`
    U32,
    /// `int64`
    I64,
    /// `uint64`
    U64,
    /// `float32`
    F32,
    /// `float64`
    F64,
    /// `string`
    String,
    /// `wstring`
    WString,
}

impl Primitive {
    /// Size and alignment in CDR [bytes]; of a string, its length's.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::Bool | Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 | Self::String | Self::WString => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }
}

/// The type of one element of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Element {
    /// A primitive, with the bound of a bounded string.
    Primitive(Primitive, Option<usize>),
    /// A message, by index in its [`Schema`].
    Struct(usize),
}

/// How many elements a field has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Count {
    /// One, no array.
    One,
    /// An array of fixed length.
    Fixed(usize),
    /// A sequence, with its bound.
    Sequence(Option<usize>),
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// What its elements are.
    pub element: Element,
    /// How many there are.
    pub count: Count,
}

/// A message definition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Struct {
    /// `pkg/Type`.
    pub name: String,
    /// Fields in order; constants are left out.
    pub fields: Vec<Field>,
}

/// A message type with all types that it is made of.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Schema {
    /// `pkg/msg/Type`.
    pub type_name: String,
    /// Definitions; the type itself is the first.
    pub structs: Vec<Struct>,
}

impl Schema {
    /// The schema of a topic.
    ///
    /// # Errors
    /// [`BagError::Schema`] as for [`parse`](Self::parse), and when the schema is no text or of an encoding that is not
    /// known.
    pub fn of(topic: &Topic) -> Result<Self> {
        let refuse = |reason: String| BagError::Schema { type_name: topic.type_name.clone(), line: 1, reason };
        match topic.schema_encoding() {
            // Of a type whose parts it did not find, rosbag2 does not say what its text is.
            "ros2msg" | "ros2idl" | "unknown" => {}
            "" => return Err(refuse("no schema is known".to_owned())),
            other => return Err(refuse(format!("schema encoding {other:?} is not read"))),
        }
        let text = std::str::from_utf8(topic.schema()).map_err(|_| refuse("the schema is no UTF-8 text".to_owned()))?;
        if topic.schema_encoding() == "unknown" && text.trim().is_empty() {
            return Err(refuse("no schema is known".to_owned()));
        }
        Self::parse(&topic.full_type_name(), text)
    }
}
