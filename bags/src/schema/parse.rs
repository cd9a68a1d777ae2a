//! Resolves the types of a bag's schema text: each member's type by its place among the definitions.

use std::collections::HashMap;

use swath_msgs::definition::{self, Base, Named, Shape};

use super::types::{Count, Element, Field, Primitive, Schema, Struct};
use crate::error::{BagError, Result};

/// Deepest nesting of messages that is accepted.
const MAX_DEPTH: usize = 64;

struct Parser<'a> {
    type_name: &'a str,
}

impl Schema {
    /// Parses the text of a `ros2msg` or `ros2idl` schema.
    ///
    /// # Errors
    /// [`BagError::Schema`] when the text is malformed, lacks a type or contains itself.
    pub fn parse(type_name: &str, text: &str) -> Result<Self> {
        let parser = Parser { type_name };
        let definitions = definition::definitions(type_name, text).map_err(|e| parser.error(e.line, e.reason))?;
        let schema = parser.resolve(definitions)?;
        let mut known = vec![Depth::Unknown; schema.structs.len()];
        parser.depth(&schema, 0, 0, &mut known)?;
        Ok(schema)
    }
}

impl Parser<'_> {
    fn error(&self, line: usize, reason: impl Into<String>) -> BagError {
        BagError::Schema { type_name: self.type_name.to_owned(), line, reason: reason.into() }
    }

    fn resolve(&self, mut definitions: Vec<Named>) -> Result<Schema> {
        let own = short_name(self.type_name);
        let Some(place) = definitions.iter().position(|named| named.name == own) else {
            return Err(self.error(1, format!("the text does not define {own}")));
        };
        definitions[..=place].rotate_right(1);
        let mut places = HashMap::new();
        for (index, named) in definitions.iter().enumerate() {
            places.entry(named.name.as_str()).or_insert(index);
        }
        let mut structs = Vec::new();
        for Named { name, definition } in &definitions {
            let fields = definition.fields.iter().map(|field| {
                let element = self.element(field, &places)?;
                Ok(Field { name: field.name.clone(), element, count: count(field.shape) })
            });
            structs.push(Struct { name: name.clone(), fields: fields.collect::<Result<_>>()? });
        }
        Ok(Schema { type_name: self.type_name.to_owned(), structs })
    }

    fn element(&self, field: &definition::Field, places: &HashMap<&str, usize>) -> Result<Element> {
        let (package, name) = match &field.base {
            Base::Primitive(kind) => {
                let (primitive, bound) = primitive(*kind);
                return Ok(Element::Primitive(primitive, bound));
            }
            Base::Nested { package, name } => (package, name),
        };
        let full = if package.is_empty() { name.clone() } else { format!("{package}/{name}") };
        // ROS 1 writes a header without its package.
        let header = || places.get("std_msgs/Header").filter(|_| name == "Header");
        let place = places.get(full.as_str()).or_else(header);
        place
            .map(|index| Element::Struct(*index))
            .ok_or_else(|| self.error(field.line, format!("type {full} is not defined in the schema")))
    }

    /// The depth of a definition; refuses types that contain themselves, and towers of types.
    fn depth(&self, schema: &Schema, index: usize, level: usize, known: &mut [Depth]) -> Result<usize> {
        match known[index] {
            Depth::Known(depth) => return Ok(depth),
            Depth::Open => {
                let name = &schema.structs[index].name;
                return Err(self.error(1, format!("{name} contains itself")));
            }
            Depth::Unknown => known[index] = Depth::Open,
        }
        let mut depth = 0;
        for field in &schema.structs[index].fields {
            if let Element::Struct(inner) = field.element {
                if level > MAX_DEPTH {
                    break;
                }
                depth = depth.max(1 + self.depth(schema, inner, level + 1, known)?);
            }
        }
        if level.max(depth) > MAX_DEPTH {
            return Err(self.error(1, format!("messages are nested deeper than {MAX_DEPTH}")));
        }
        known[index] = Depth::Known(depth);
        Ok(depth)
    }
}

/// How far [`Parser::depth`] has come with a definition.
#[derive(Clone, Copy)]
enum Depth {
    Unknown,
    Open,
    Known(usize),
}

/// `pkg/Type` of `pkg/msg/Type` and of `pkg/Type`.
fn short_name(name: &str) -> String {
    match (name.split_once('/'), name.rsplit_once('/')) {
        (Some((package, _)), Some((_, last))) => format!("{package}/{last}"),
        _ => name.to_owned(),
    }
}

fn count(shape: Shape) -> Count {
    match shape {
        Shape::Scalar => Count::One,
        Shape::Array(len) => Count::Fixed(len),
        Shape::Bounded(bound) => Count::Sequence(Some(bound)),
        Shape::Unbounded => Count::Sequence(None),
    }
}

fn primitive(kind: definition::Primitive) -> (Primitive, Option<usize>) {
    use definition::Primitive as Kind;
    let primitive = match kind {
        Kind::String { bound } => return (Primitive::String, bound),
        Kind::WString { bound } => return (Primitive::WString, bound),
        Kind::Bool => Primitive::Bool,
        Kind::Int8 => Primitive::I8,
        Kind::Uint8 | Kind::Byte | Kind::Char => Primitive::U8,
        Kind::Int16 => Primitive::I16,
        Kind::Uint16 => Primitive::U16,
        Kind::Int32 => Primitive::I32,
        Kind::Uint32 => Primitive::U32,
        Kind::Int64 => Primitive::I64,
        Kind::Uint64 => Primitive::U64,
        Kind::Float32 => Primitive::F32,
        Kind::Float64 => Primitive::F64,
    };
    (primitive, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
# A comment
uint8 OK=0
string NAME = \"a # b\"
Header header  # with a stamp
float64[3] sigma
string<=8[<=2] names
Inner[] inner 
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: a/Inner
int8 x 5
";

    #[test]
    fn fields_constants_arrays_and_dependencies() {
        let schema = Schema::parse("a/msg/Outer", TEXT).unwrap();
        let outer = &schema.structs[0];
        let names: Vec<_> = outer.fields.iter().map(|f| f.name.as_str()).collect();
        assert_eq!(names, ["header", "sigma", "names", "inner"]);
        assert_eq!(outer.fields[0].element, Element::Struct(1));
        assert_eq!(outer.fields[1].count, Count::Fixed(3));
        assert_eq!(outer.fields[2].element, Element::Primitive(Primitive::String, Some(8)));
        assert_eq!(outer.fields[2].count, Count::Sequence(Some(2)));
        assert_eq!(outer.fields[3].element, Element::Struct(3));
    }

    #[test]
    fn faults_name_their_line() {
        for (text, line) in [
            ("int32 x\nfloat y\n", 2),
            ("int32", 1),
            ("int32[x] y", 1),
            ("int32[ y", 1),
            ("int32[0] y", 1),
            ("string<=z y", 1),
            ("int32 -y", 1),
            ("===\nint32 x", 2),
            ("Outer again", 1),
        ] {
            let error = Schema::parse("a/msg/Outer", text).unwrap_err();
            assert!(matches!(error, BagError::Schema { line: l, .. } if l == line), "{error}");
        }
    }

    #[test]
    fn service_events_and_idl_are_read() {
        let schema = Schema::parse("a/srv/Add_Event", "int64 a\n---\nint64 sum\n").unwrap();
        let names: Vec<_> = schema.structs[0].fields.iter().map(|f| f.name.as_str()).collect();
        assert_eq!(names, ["info", "request", "response"]);
        let rule = "=".repeat(80);
        let idl = format!("{rule}\nIDL: a/msg/P\nmodule a {{ module msg {{ struct P {{ double x; }}; }}; }};\n");
        let schema = Schema::parse("a/msg/P", &idl).unwrap();
        assert_eq!(schema.structs[0].fields[0].element, Element::Primitive(Primitive::F64, None));
        let error = Schema::parse("a/msg/Q", &idl).unwrap_err().to_string();
        assert!(error.ends_with("the text does not define a/Q"), "{error}");
    }

    #[test]
    fn a_tower_of_messages_is_refused() {
        let mut text = "T1 a\nT1 b\n".to_owned();
        for n in 1..10_000 {
            text += &format!("===\nMSG: a/T{n}\nT{} a\nT{} b\n", n + 1, n + 1);
        }
        text += "===\nMSG: a/T10000\nint8 x\n";
        let error = Schema::parse("a/msg/Outer", &text).unwrap_err().to_string();
        assert!(error.contains("nested deeper"), "{error}");
    }

    #[test]
    fn every_shipped_schema_parses() {
        for interface in swath_msgs::Interface::all() {
            let schema = Schema::parse(interface.type_name, interface.schema).unwrap();
            assert_eq!(schema.type_name, interface.type_name);
        }
    }
}
