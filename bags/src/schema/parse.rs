//! Parses `ros2msg` texts: a definition, then its dependencies behind lines of `=`.

use std::collections::BTreeMap;

use super::{Count, Element, Field, Primitive, Schema, Struct};
use crate::error::{BagError, Result};

/// Deepest nesting of messages that is accepted.
const MAX_DEPTH: usize = 64;

/// A definition whose field types are still names.
struct Raw<'a> {
    name: String,
    fields: Vec<RawField<'a>>,
}

struct RawField<'a> {
    line: usize,
    base: &'a str,
    name: &'a str,
    count: Count,
}

struct Parser<'a> {
    type_name: &'a str,
}

pub(super) fn parse(type_name: &str, text: &str) -> Result<Schema> {
    let parser = Parser { type_name };
    let raw = parser.definitions(text)?;
    let schema = parser.resolve(&raw)?;
    let mut known = vec![Depth::Unknown; schema.structs.len()];
    parser.depth(&schema, 0, 0, &mut known)?;
    Ok(schema)
}

impl Parser<'_> {
    fn error(&self, line: usize, reason: impl Into<String>) -> BagError {
        BagError::Schema { type_name: self.type_name.to_owned(), line, reason: reason.into() }
    }

    fn definitions<'t>(&self, text: &'t str) -> Result<Vec<Raw<'t>>> {
        let mut all = vec![Raw { name: short_name(self.type_name), fields: Vec::new() }];
        let mut awaiting_name = false;
        for (number, line) in (1..).zip(text.lines()) {
            let line = line.split('#').next().unwrap_or("").trim();
            if is_separator(line) {
                awaiting_name = true;
            } else if awaiting_name && !line.is_empty() {
                let Some(name) = line.strip_prefix("MSG:") else {
                    return Err(self.error(number, "a line of = is not followed by MSG:"));
                };
                all.push(Raw { name: short_name(name.trim()), fields: Vec::new() });
                awaiting_name = false;
            } else if let Some(field) = self.field(number, line)?
                && let Some(last) = all.last_mut()
            {
                last.fields.push(field);
            }
        }
        Ok(all)
    }

    /// The field that a line defines; `None` for constants and empty lines.
    fn field<'t>(&self, line: usize, text: &'t str) -> Result<Option<RawField<'t>>> {
        let Some((kind, rest)) = text.split_once(char::is_whitespace) else {
            return match text {
                "" => Ok(None),
                _ => Err(self.error(line, format!("{text:?} has no name"))),
            };
        };
        let rest = rest.trim_start();
        let name_len = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        let (name, behind) = rest.split_at(name_len.unwrap_or(rest.len()));
        if name.is_empty() {
            return Err(self.error(line, format!("{rest:?} is no field name")));
        }
        if behind.trim_start().starts_with('=') {
            return Ok(None);
        }
        if !behind.is_empty() && !behind.starts_with(char::is_whitespace) {
            return Err(self.error(line, format!("{rest:?} is no field name")));
        }
        let (base, count) = self.split_array(line, kind)?;
        Ok(Some(RawField { line, base, name, count }))
    }

    /// Splits `T[<=3]` into `T` and how many.
    fn split_array<'t>(&self, line: usize, kind: &'t str) -> Result<(&'t str, Count)> {
        let Some(open) = kind.find('[') else { return Ok((kind, Count::One)) };
        let base = &kind[..open];
        let inside = kind[open + 1..].strip_suffix(']');
        let number = |digits: &str| digits.parse::<usize>().ok();
        let count = match inside {
            Some("") => Some(Count::Sequence(None)),
            Some(text) => match text.strip_prefix("<=") {
                Some(bound) => number(bound).map(|bound| Count::Sequence(Some(bound))),
                // Without an empty array, every message takes at least one byte: decoding ends.
                None => number(text).filter(|n| *n > 0).map(Count::Fixed),
            },
            None => None,
        };
        let count = count.ok_or_else(|| self.error(line, format!("{kind:?} is no array type")))?;
        Ok((base, count))
    }

    fn resolve(&self, raw: &[Raw<'_>]) -> Result<Schema> {
        let mut places = BTreeMap::new();
        for (index, definition) in raw.iter().enumerate() {
            places.entry(definition.name.as_str()).or_insert(index);
        }
        let mut structs = Vec::new();
        for definition in raw {
            let package = definition.name.split('/').next().unwrap_or("");
            let mut fields = Vec::new();
            for field in &definition.fields {
                let element = self.element(field, package, &places)?;
                fields.push(Field { name: field.name.to_owned(), element, count: field.count });
            }
            structs.push(Struct { name: definition.name.clone(), fields });
        }
        Ok(Schema { type_name: self.type_name.to_owned(), structs })
    }

    fn element(&self, field: &RawField<'_>, package: &str, places: &BTreeMap<&str, usize>) -> Result<Element> {
        let (base, bound) = match field.base.split_once("<=") {
            Some((base, bound)) => {
                let bad = || self.error(field.line, format!("{bound:?} is no bound"));
                (base, Some(bound.parse().map_err(|_| bad())?))
            }
            None => (field.base, None),
        };
        if let Some(primitive) = primitive(base) {
            return Ok(Element::Primitive(primitive, bound));
        }
        let name = match base.contains('/') {
            true => short_name(base),
            false if base == "Header" => "std_msgs/Header".to_owned(),
            false => format!("{package}/{base}"),
        };
        let place = places.get(name.as_str());
        place
            .map(|index| Element::Struct(*index))
            .ok_or_else(|| self.error(field.line, format!("type {name} is not defined in the schema")))
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

fn is_separator(line: &str) -> bool {
    line.len() >= 3 && line.bytes().all(|byte| byte == b'=')
}

/// `pkg/Type` of `pkg/msg/Type` and of `pkg/Type`.
fn short_name(name: &str) -> String {
    match (name.split_once('/'), name.rsplit_once('/')) {
        (Some((package, _)), Some((_, last))) => format!("{package}/{last}"),
        _ => name.to_owned(),
    }
}

fn primitive(name: &str) -> Option<Primitive> {
    Some(match name {
        "bool" => Primitive::Bool,
        "int8" => Primitive::I8,
        "uint8" | "byte" | "char" => Primitive::U8,
        "int16" => Primitive::I16,
        "uint16" => Primitive::U16,
        "int32" => Primitive::I32,
        "uint32" => Primitive::U32,
        "int64" => Primitive::I64,
        "uint64" => Primitive::U64,
        "float32" => Primitive::F32,
        "float64" => Primitive::F64,
        "string" => Primitive::String,
        "wstring" => Primitive::WString,
        _ => return None,
    })
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
