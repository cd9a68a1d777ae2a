//! Brings messages that were recorded with one version of a type into another version of it.

use super::decode::HEADER;
use super::{Count, Element, Primitive, Scalar, Schema, Visitor, decode};
use crate::error::{BagError, Result};

/// A message recorded as `recorded` says, as little-endian CDR of version 1 of the type as `wanted` says.
///
/// Fields go by their names: those that the recording does not have are zero, false or empty, those that are no longer
/// wanted are left out.
///
/// # Errors
/// [`BagError::Cdr`] when its bytes do not fit its type, or a field has become something else.
pub fn adapt(recorded: &Schema, wanted: &Schema, data: &[u8]) -> Result<Vec<u8>> {
    let mut tree = Tree { open: vec![Value::Array(Vec::new())] };
    decode(recorded, data, &mut tree)?;
    let message = match tree.open.pop() {
        Some(Value::Array(mut only)) => only.pop(),
        _ => None,
    };
    let mut writer = Writer { schema: wanted, out: vec![0, 1, 0, 0] };
    writer.structure(0, message.as_ref())?;
    Ok(writer.out)
}

/// A decoded value.
enum Value {
    Bool(bool),
    Int(i128),
    Float(f64),
    Text(String),
    Array(Vec<Self>),
    /// Fields with their names.
    Struct(Vec<(String, Self)>),
}

/// Collects what is decoded; the values that are not complete yet, outermost first.
struct Tree {
    open: Vec<Value>,
}

impl Tree {
    fn put(&mut self, value: Value) {
        match self.open.last_mut() {
            Some(Value::Array(elements)) => elements.push(value),
            Some(Value::Struct(fields)) => {
                if let Some((_, last)) = fields.last_mut() {
                    *last = value;
                }
            }
            _ => {}
        }
    }

    fn close(&mut self) {
        if let Some(value) = self.open.pop() {
            self.put(value);
        }
    }
}

impl Visitor for Tree {
    fn begin_struct(&mut self) {
        self.open.push(Value::Struct(Vec::new()));
    }

    fn field(&mut self, name: &str, _first: bool) {
        if let Some(Value::Struct(fields)) = self.open.last_mut() {
            fields.push((name.to_owned(), Value::Bool(false)));
        }
    }

    fn end_struct(&mut self) {
        self.close();
    }

    fn begin_array(&mut self, _len: usize) {
        self.open.push(Value::Array(Vec::new()));
    }

    fn end_array(&mut self) {
        self.close();
    }

    fn scalar(&mut self, value: Scalar<'_>) {
        self.put(match value {
            Scalar::Bool(value) => Value::Bool(value),
            Scalar::Int(value) => Value::Int(value.into()),
            Scalar::Uint(value) => Value::Int(value.into()),
            Scalar::F32(value) => Value::Float(value.into()),
            Scalar::F64(value) => Value::Float(value),
            Scalar::Text(text) => Value::Text(text.into_owned()),
        });
    }
}

struct Writer<'a> {
    schema: &'a Schema,
    out: Vec<u8>,
}

impl Writer<'_> {
    fn error(&self, reason: impl Into<String>) -> BagError {
        let type_name = self.schema.type_name.clone();
        BagError::Cdr { type_name, offset: self.out.len(), reason: reason.into() }
    }

    fn structure(&mut self, index: usize, value: Option<&Value>) -> Result<()> {
        let fields = match value {
            None => &[][..],
            Some(Value::Struct(fields)) => fields,
            Some(_) => return Err(self.error("a message was recorded as something else")),
        };
        let schema = self.schema;
        if schema.structs[index].fields.is_empty() {
            self.out.push(0);
        }
        for field in &schema.structs[index].fields {
            let value = fields.iter().find(|(name, _)| *name == field.name).map(|(_, value)| value);
            let elements = match (field.count, value) {
                (Count::One, value) => {
                    self.element(field.element, value).map_err(|error| named(error, &field.name))?;
                    continue;
                }
                (_, None) => &[][..],
                (_, Some(Value::Array(elements))) => elements,
                (_, Some(_)) => return Err(self.error(format!("field {} was no array", field.name))),
            };
            let count = match field.count {
                Count::Fixed(len) => len,
                _ => elements.len(),
            };
            if let Count::Sequence(bound) = field.count {
                if bound.is_some_and(|bound| count > bound) {
                    return Err(self.error(format!("field {} has {count} elements, beyond its bound", field.name)));
                }
                self.put((count as u32).to_le_bytes());
            }
            for i in 0..count {
                self.element(field.element, elements.get(i)).map_err(|error| named(error, &field.name))?;
            }
        }
        Ok(())
    }

    fn element(&mut self, element: Element, value: Option<&Value>) -> Result<()> {
        match element {
            Element::Struct(index) => self.structure(index, value),
            Element::Primitive(primitive, _) => self.primitive(primitive, value),
        }
    }

    fn primitive(&mut self, primitive: Primitive, value: Option<&Value>) -> Result<()> {
        let other = || self.error("it was recorded as something else");
        let int = match value {
            None => Some(0),
            Some(Value::Int(int)) => Some(*int),
            Some(Value::Bool(value)) => Some(i128::from(*value)),
            Some(_) => None,
        };
        let float = match value {
            None => Some(0.0),
            Some(Value::Float(float)) => Some(*float),
            Some(_) => None,
        };
        let text = match value {
            None => Some(""),
            Some(Value::Text(text)) => Some(text.as_str()),
            Some(_) => None,
        };
        // A number that no longer fits is refused, not cut.
        macro_rules! put {
            ($type:ty) => {{
                let number = int.and_then(|int| <$type>::try_from(int).ok()).ok_or_else(other)?;
                self.put(number.to_le_bytes())
            }};
        }
        match primitive {
            Primitive::Bool => self.put([u8::from(int.ok_or_else(other)? != 0)]),
            Primitive::I8 => put!(i8),
            Primitive::U8 => put!(u8),
            Primitive::I16 => put!(i16),
            Primitive::U16 => put!(u16),
            Primitive::I32 => put!(i32),
            Primitive::U32 => put!(u32),
            Primitive::I64 => put!(i64),
            Primitive::U64 => put!(u64),
            Primitive::F32 => self.put((float.ok_or_else(other)? as f32).to_le_bytes()),
            Primitive::F64 => self.put(float.ok_or_else(other)?.to_le_bytes()),
            Primitive::String => {
                let text = text.ok_or_else(other)?;
                self.put((text.len() as u32 + 1).to_le_bytes());
                self.out.extend_from_slice(text.as_bytes());
                self.out.push(0);
            }
            Primitive::WString => {
                let units: Vec<u16> = text.ok_or_else(other)?.encode_utf16().collect();
                self.put((units.len() as u32).to_le_bytes());
                self.out.extend(units.into_iter().flat_map(u16::to_le_bytes));
            }
        }
        Ok(())
    }

    /// Appends a number at its alignment.
    fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        let position = self.out.len() - HEADER;
        self.out.resize(HEADER + position.next_multiple_of(N), 0);
        self.out.extend_from_slice(&bytes);
    }
}

/// The error of a field, with its name.
fn named(error: BagError, field: &str) -> BagError {
    match error {
        BagError::Cdr { type_name, offset, reason } => {
            BagError::Cdr { type_name, offset, reason: format!("field {field}: {reason}") }
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PART: &str = "\n================================================================================\nMSG: a/P\n";

    fn json(schema: &Schema, data: &[u8]) -> String {
        let mut text = Vec::new();
        super::super::to_json(schema, data, &mut text).unwrap();
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn fields_go_by_name_and_new_ones_are_empty() {
        let old = Schema::parse("a/msg/B", &format!("uint8 gone\nP[] p\nstring s{PART}float64 x\n")).unwrap();
        let new = format!("string s\nP[] p\nuint64 n\nstring t\nP q\nint16[2] f{PART}uint64 id\nfloat64 x\nbool b\n");
        let new = Schema::parse("a/msg/B", &new).unwrap();
        let mut data = vec![0, 1, 0, 0, 7, 0, 0, 0, 2, 0, 0, 0];
        data.extend([1.5f64, -2.0].into_iter().flat_map(f64::to_le_bytes));
        data.extend([3, 0, 0, 0, b'h', b'i', 0]);
        let adapted = adapt(&old, &new, &data).unwrap();
        let parts = r#"[{"id":0,"x":1.5,"b":false},{"id":0,"x":-2.0,"b":false}]"#;
        let rest = r#""n":0,"t":"","q":{"id":0,"x":0.0,"b":false},"f":[0,0]"#;
        assert_eq!(json(&new, &adapted), format!(r#"{{"s":"hi","p":{parts},{rest}}}"#));
        assert!(adapt(&old, &new, &data[..20]).is_err(), "the recording is cut short");
        let other = Schema::parse("a/msg/B", "float64 s").unwrap();
        let error = adapt(&old, &other, &data).unwrap_err().to_string();
        assert!(error.contains("field s: it was recorded as something else"), "{error}");
    }

    #[test]
    fn every_message_of_ours_adapted_to_itself_is_itself() {
        for interface in swath_msgs::Interface::all() {
            let schema = Schema::parse(interface.type_name, interface.schema).unwrap();
            let nothing = Schema::parse(interface.type_name, "uint8 nothing_of_it").unwrap();
            let empty = adapt(&nothing, &schema, &[0, 1, 0, 0, 0]).unwrap();
            assert_eq!(adapt(&schema, &schema, &empty).unwrap(), empty, "{}", interface.type_name);
        }
    }
}
