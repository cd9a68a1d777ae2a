//! The house rules for interface files on top of the grammar, and values of the types that they have.

use std::collections::BTreeSet;

use crate::definition::{self, Base, Definition, PLACEHOLDER, Primitive, Shape};
use crate::model::{Constant, Field, Message, Service, Value};

/// Serde has array implementations up to this length.
const LONGEST_ARRAY: usize = 32;

/// Parses a `.msg` file; errors name the line.
pub fn message(package: &str, name: &str, text: &str) -> Result<Message, String> {
    check_type_name(name)?;
    let definition = definition::message(package, text, 1).map_err(|error| error.to_string())?;
    checked(package, name.to_owned(), "msg", text, definition)
}

/// Parses a `.srv` file; errors name the line.
pub fn service(package: &str, name: &str, text: &str) -> Result<Service, String> {
    check_type_name(name)?;
    let [request, response] = &definition::parts(text, 1)[..] else {
        return Err("a service needs exactly one line `---`".to_owned());
    };
    let half = |(line, text): &(usize, String), suffix| {
        let definition = definition::message(package, text, *line).map_err(|error| error.to_string())?;
        checked(package, format!("{name}_{suffix}"), "srv", text, definition)
    };
    let (request, response) = (half(request, "Request")?, half(response, "Response")?);
    Ok(Service { package: package.to_owned(), name: name.to_owned(), doc: request.doc.clone(), request, response })
}

/// A definition that keeps the house rules.
fn checked(
    package: &str,
    name: String,
    kind: &'static str,
    text: &str,
    definition: Definition,
) -> Result<Message, String> {
    let mut fields = Vec::new();
    for field in &definition.fields {
        let checked = checked_field(package, field);
        fields.push(checked.map_err(|error| format!("line {}: {error}", field.line))?);
    }
    let mut constants = Vec::new();
    for constant in &definition.constants {
        let checked = checked_constant(package, constant);
        constants.push(checked.map_err(|error| format!("line {}: {error}", constant.line))?);
    }
    check_names(&definition)?;
    if fields.is_empty() {
        fields.push(placeholder());
    }
    let (package, text) = (package.to_owned(), text.to_owned());
    Ok(Message { package, name, kind, doc: definition.doc, fields, constants, text })
}

fn checked_field(package: &str, field: &definition::Field) -> Result<Field, String> {
    let definition::Field { name, base, shape, doc, .. } = field.clone();
    check_base(package, &base)?;
    if let Shape::Array(length) = shape
        && length > LONGEST_ARRAY
    {
        let text = format!("{}[{length}]", base_text(package, &base));
        return Err(format!("`{text}` is longer than the {LONGEST_ARRAY} elements that are supported"));
    }
    check_comment(&name, &doc)?;
    check_field_name(&name)?;
    let default = field.default.as_ref().map(|text| default_value(&base, shape, text)).transpose()?;
    Ok(Field { name, base, shape, default, doc })
}

fn checked_constant(package: &str, constant: &definition::Constant) -> Result<Constant, String> {
    let definition::Constant { name, base, shape, value, doc, .. } = constant.clone();
    check_base(package, &base)?;
    check_comment(&name, &doc)?;
    check_constant_name(&name)?;
    let (Base::Primitive(primitive), Shape::Scalar) = (base, shape) else {
        return Err(format!("the constant `{name}` is not of a primitive type"));
    };
    let value = scalar(primitive, &value)?;
    Ok(Constant { name, primitive, value, doc })
}

fn check_base(package: &str, base: &Base) -> Result<(), String> {
    match base {
        Base::Primitive(Primitive::WString { .. }) => Err("`wstring` is not supported: use `string`".to_owned()),
        Base::Primitive(_) => Ok(()),
        Base::Nested { name, .. } => {
            check_type_name(name).map_err(|_| format!("`{}` is not a type", base_text(package, base)))
        }
    }
}

/// A type as an interface file writes it.
fn base_text(own: &str, base: &Base) -> String {
    match base {
        Base::Nested { package, name } if package == own => name.clone(),
        Base::Nested { package, name } => format!("{package}/{name}"),
        Base::Primitive(primitive) => format!("{primitive:?}").to_lowercase(),
    }
}

fn check_comment(name: &str, doc: &str) -> Result<(), String> {
    if doc.is_empty() { Err(format!("`{name}` has no comment that says what it is")) } else { Ok(()) }
}

/// No name stands twice.
fn check_names(definition: &Definition) -> Result<(), String> {
    let fields = definition.fields.iter().map(|field| (field.line, &field.name));
    let constants = definition.constants.iter().map(|constant| (constant.line, &constant.name));
    let mut all: Vec<_> = fields.chain(constants).collect();
    all.sort_unstable();
    let mut names = BTreeSet::new();
    match all.into_iter().find(|(_, name)| !names.insert(*name)) {
        Some((line, name)) => Err(format!("line {line}: `{name}` is defined twice")),
        None => Ok(()),
    }
}

/// The member that ROS 2 gives to a message without fields.
fn placeholder() -> Field {
    Field {
        name: PLACEHOLDER.to_owned(),
        base: Base::Primitive(Primitive::Uint8),
        shape: Shape::Scalar,
        default: None,
        doc: "Always 0.".to_owned(),
    }
}

fn default_value(base: &Base, shape: Shape, text: &str) -> Result<Value, String> {
    let Base::Primitive(primitive) = *base else {
        return Err(format!("a nested type cannot have the default `{text}`"));
    };
    if shape == Shape::Scalar {
        return scalar(primitive, text);
    }
    let inner = text
        .strip_prefix('[')
        .and_then(|text| text.strip_suffix(']'))
        .ok_or_else(|| format!("the default `{text}` is not a list"))?;
    let values = inner
        .split(',')
        .filter(|item| !item.trim().is_empty())
        .map(|item| scalar(primitive, item.trim()))
        .collect::<Result<Vec<_>, _>>()?;
    match shape {
        Shape::Array(length) if values.len() != length => {
            Err(format!("the default has {} values for {length}", values.len()))
        }
        Shape::Bounded(bound) if values.len() > bound => {
            Err(format!("the default has {} values for at most {bound}", values.len()))
        }
        _ => Ok(Value::List(values)),
    }
}

fn scalar(primitive: Primitive, text: &str) -> Result<Value, String> {
    let refused = || format!("`{text}` is not a value of {primitive:?}");
    let range = match primitive {
        Primitive::Bool => {
            return match text {
                "true" | "True" | "1" => Ok(Value::Bool(true)),
                "false" | "False" | "0" => Ok(Value::Bool(false)),
                _ => Err(refused()),
            };
        }
        Primitive::Float32 | Primitive::Float64 => {
            return match text.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(Value::Float(value)),
                _ => Err(refused()),
            };
        }
        Primitive::String { bound } | Primitive::WString { bound } => {
            let text = unquoted(text);
            return match bound {
                Some(bound) if text.len() > bound => Err(refused()),
                _ => Ok(Value::Text(text.to_owned())),
            };
        }
        Primitive::Int8 => i128::from(i8::MIN)..=i128::from(i8::MAX),
        Primitive::Int16 => i128::from(i16::MIN)..=i128::from(i16::MAX),
        Primitive::Int32 => i128::from(i32::MIN)..=i128::from(i32::MAX),
        Primitive::Int64 => i128::from(i64::MIN)..=i128::from(i64::MAX),
        Primitive::Byte | Primitive::Char | Primitive::Uint8 => 0..=i128::from(u8::MAX),
        Primitive::Uint16 => 0..=i128::from(u16::MAX),
        Primitive::Uint32 => 0..=i128::from(u32::MAX),
        Primitive::Uint64 => 0..=i128::from(u64::MAX),
    };
    match integer(text) {
        Some(value) if range.contains(&value) => Ok(Value::Int(value)),
        _ => Err(refused()),
    }
}

fn integer(text: &str) -> Option<i128> {
    match text.strip_prefix("0x") {
        Some(digits) => i128::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

fn unquoted(text: &str) -> &str {
    for quote in ['"', '\''] {
        if let Some(inner) = text.strip_prefix(quote).and_then(|text| text.strip_suffix(quote)) {
            return inner;
        }
    }
    text
}

fn check_type_name(name: &str) -> Result<(), String> {
    let valid = name.starts_with(|c: char| c.is_ascii_uppercase()) && name.chars().all(|c| c.is_ascii_alphanumeric());
    if valid { Ok(()) } else { Err(format!("`{name}` is not a name for a type")) }
}

fn check_field_name(name: &str) -> Result<(), String> {
    let valid = name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
        && !name.contains("__")
        && !name.ends_with('_');
    if valid { Ok(()) } else { Err(format!("`{name}` is not a name for a field")) }
}

fn check_constant_name(name: &str) -> Result<(), String> {
    let valid = name.starts_with(|c: char| c.is_ascii_uppercase())
        && name.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_')
        && !name.contains("__")
        && !name.ends_with('_');
    if valid { Ok(()) } else { Err(format!("`{name}` is not a name for a constant")) }
}
