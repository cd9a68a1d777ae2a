//! Parser of ROS 2 interface files, `.msg` and `.srv`.

use std::collections::BTreeSet;

use crate::model::{Base, Constant, Field, Message, Primitive, Service, Shape, Value};

/// Serde has array implementations up to this length.
const LONGEST_ARRAY: usize = 32;

/// Parses a `.msg` file; errors name the line.
pub fn message(package: &str, name: &str, text: &str) -> Result<Message, String> {
    check_type_name(name)?;
    let mut message = definition(package, text, 0)?;
    message.name = name.to_owned();
    Ok(message)
}

/// Parses a `.srv` file; errors name the line.
pub fn service(package: &str, name: &str, text: &str) -> Result<Service, String> {
    check_type_name(name)?;
    let lines: Vec<&str> = text.lines().collect();
    let mut rules = lines.iter().enumerate().filter(|(_, line)| line.trim() == "---");
    let (Some((rule, _)), None) = (rules.next(), rules.next()) else {
        return Err("a service needs exactly one line `---`".to_owned());
    };
    let half = |lines: &[&str], first_line, suffix| {
        let text: String = lines.iter().flat_map(|line| [line, "\n"]).collect();
        definition(package, &text, first_line).map(|mut half| {
            half.name = format!("{name}_{suffix}");
            half.kind = "srv";
            half
        })
    };
    let request = half(&lines[..rule], 0, "Request")?;
    let response = half(&lines[rule + 1..], rule + 1, "Response")?;
    Ok(Service { package: package.to_owned(), name: name.to_owned(), doc: request.doc.clone(), request, response })
}

fn definition(package: &str, text: &str, lines_before: usize) -> Result<Message, String> {
    let mut message = Message {
        package: package.to_owned(),
        name: String::new(),
        kind: "msg",
        doc: String::new(),
        fields: Vec::new(),
        constants: Vec::new(),
        text: text.to_owned(),
    };
    let mut names = BTreeSet::new();
    let mut comment = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let (code, remark) = split_comment(line);
        let remark = remark.map(|remark| remark.trim().to_owned());
        let code = code.trim();
        if code.is_empty() {
            match remark {
                Some(remark) => comment.push(remark),
                None if message.doc.is_empty() && message.fields.is_empty() => {
                    message.doc = std::mem::take(&mut comment).join(" ");
                }
                None => comment.clear(),
            }
            continue;
        }
        comment.extend(remark);
        let doc = std::mem::take(&mut comment).join(" ");
        let name =
            member(&mut message, code, doc).map_err(|error| format!("line {}: {error}", lines_before + index + 1))?;
        if !names.insert(name.clone()) {
            return Err(format!("line {}: `{name}` is defined twice", lines_before + index + 1));
        }
    }
    if message.fields.is_empty() {
        message.fields.push(placeholder());
    }
    Ok(message)
}

/// The member that ROS 2 gives to a message without fields.
fn placeholder() -> Field {
    Field {
        name: "structure_needs_at_least_one_member".to_owned(),
        base: Base::Primitive(Primitive::Uint8),
        shape: Shape::Scalar,
        default: None,
        doc: "Always 0.".to_owned(),
    }
}

/// Splits a line at the `#` that opens a comment, which is not inside quotes.
fn split_comment(line: &str) -> (&str, Option<&str>) {
    let mut quote = None;
    for (at, character) in line.char_indices() {
        match (quote, character) {
            (None, '#') => return (&line[..at], Some(&line[at + 1..])),
            (None, '\'' | '"') => quote = Some(character),
            (Some(open), _) if open == character => quote = None,
            _ => {}
        }
    }
    (line, None)
}

/// Parses `TYPE NAME`, `TYPE NAME DEFAULT` or `TYPE NAME=VALUE` and returns the name.
fn member(message: &mut Message, code: &str, doc: String) -> Result<String, String> {
    let (type_text, rest) = code.split_once(char::is_whitespace).ok_or_else(|| format!("`{code}` has no name"))?;
    let (base, shape) = field_type(&message.package, type_text)?;
    let rest = rest.trim();
    let name_length = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
    let (name, tail) = (rest[..name_length].to_owned(), rest[name_length..].trim_start());
    if doc.is_empty() {
        return Err(format!("`{name}` has no comment that says what it is"));
    }
    if let Some(value_text) = tail.strip_prefix('=') {
        check_constant_name(&name)?;
        let (Base::Primitive(primitive), Shape::Scalar) = (base, shape) else {
            return Err(format!("the constant `{name}` is not of a primitive type"));
        };
        let value = scalar(primitive, value_text.trim())?;
        message.constants.push(Constant { name: name.clone(), primitive, value, doc });
    } else {
        check_field_name(&name)?;
        let default = match tail {
            "" => None,
            text => Some(default_value(&base, shape, text)?),
        };
        message.fields.push(Field { name: name.clone(), base, shape, default, doc });
    }
    Ok(name)
}

fn field_type(package: &str, text: &str) -> Result<(Base, Shape), String> {
    let (base_text, shape) = match text.split_once('[') {
        None => (text, Shape::Scalar),
        Some((base, bracket)) => (base, array_shape(text, bracket)?),
    };
    let base = match primitive(base_text)? {
        Some(primitive) => Base::Primitive(primitive),
        None => nested(package, base_text)?,
    };
    Ok((base, shape))
}

fn array_shape(text: &str, bracket: &str) -> Result<Shape, String> {
    let size = bracket.strip_suffix(']').ok_or_else(|| format!("`{text}` is not a type"))?;
    let positive = |digits: &str| match digits.parse::<usize>() {
        Ok(size) if size > 0 => Ok(size),
        _ => Err(format!("`{text}` has no positive array size")),
    };
    match size.strip_prefix("<=") {
        _ if size.is_empty() => Ok(Shape::Unbounded),
        Some(bound) => Ok(Shape::Bounded(positive(bound)?)),
        None => match positive(size)? {
            length if length > LONGEST_ARRAY => {
                Err(format!("`{text}` is longer than the {LONGEST_ARRAY} elements that are supported"))
            }
            length => Ok(Shape::Array(length)),
        },
    }
}

fn primitive(text: &str) -> Result<Option<Primitive>, String> {
    Ok(Some(match text {
        "bool" => Primitive::Bool,
        "byte" => Primitive::Byte,
        "char" => Primitive::Char,
        "int8" => Primitive::Int8,
        "uint8" => Primitive::Uint8,
        "int16" => Primitive::Int16,
        "uint16" => Primitive::Uint16,
        "int32" => Primitive::Int32,
        "uint32" => Primitive::Uint32,
        "int64" => Primitive::Int64,
        "uint64" => Primitive::Uint64,
        "float32" => Primitive::Float32,
        "float64" => Primitive::Float64,
        "string" => Primitive::String { bound: None },
        _ if text.starts_with("wstring") => {
            return Err("`wstring` is not supported: use `string`".to_owned());
        }
        _ => match text.strip_prefix("string<=") {
            Some(bound) => Primitive::String {
                bound: Some(bound.parse().map_err(|_| format!("`{text}` has no bound that is a number"))?),
            },
            None => return Ok(None),
        },
    }))
}

fn nested(package: &str, text: &str) -> Result<Base, String> {
    let parts: Vec<&str> = text.split('/').collect();
    let (package, name) = match parts[..] {
        [name] => (package, name),
        [package, name] | [package, "msg", name] => (package, name),
        _ => return Err(format!("`{text}` is not a type")),
    };
    check_type_name(name)?;
    Ok(Base::Nested { package: package.to_owned(), name: name.to_owned() })
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
        Primitive::String { bound } => {
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
