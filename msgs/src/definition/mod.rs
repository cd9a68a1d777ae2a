//! Parser of ROS 2 interface definitions: `.msg` and `.srv` texts, the texts that bags carry, and the IDL of either.
//!
//! It is the only one of its kind here: the generator of this crate includes it, and readers of bags use it. It knows
//! the grammar; what a reader asks beyond that, such as a comment on every member, the reader checks.

mod bundle;
mod idl;

use std::fmt;

pub use bundle::definitions;

/// A type that is not made of others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Primitive {
    /// `bool`
    Bool,
    /// `byte`
    Byte,
    /// `char`, an unsigned byte in ROS 2
    Char,
    /// `int8`
    Int8,
    /// `uint8`
    Uint8,
    /// `int16`
    Int16,
    /// `uint16`
    Uint16,
    /// `int32`
    Int32,
    /// `uint32`
    Uint32,
    /// `int64`
    Int64,
    /// `uint64`
    Uint64,
    /// `float32`
    Float32,
    /// `float64`
    Float64,
    /// `string`
    String {
        /// The most bytes it may have.
        bound: Option<usize>,
    },
    /// `wstring`
    WString {
        /// The most UTF-16 units it may have.
        bound: Option<usize>,
    },
}

/// The type of a field without its array part.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Base {
    /// A type that is not made of others.
    Primitive(Primitive),
    /// A message.
    Nested {
        /// The package that defines it.
        package: String,
        /// Its name there.
        name: String,
    },
}

/// The array part of a field's type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One value.
    Scalar,
    /// So many.
    Array(usize),
    /// At most so many.
    Bounded(usize),
    /// Any number.
    Unbounded,
}

/// A field of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Field {
    /// Line of the text that defines it, from 1.
    pub line: usize,
    /// Its name.
    pub name: String,
    /// Its type without the array part.
    pub base: Base,
    /// How many values it has.
    pub shape: Shape,
    /// Its default, as written.
    pub default: Option<String>,
    /// The comment on it.
    pub doc: String,
}

/// A named value that goes with a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Constant {
    /// Line of the text that defines it, from 1.
    pub line: usize,
    /// Its name.
    pub name: String,
    /// Its type without the array part.
    pub base: Base,
    /// How many values its type has.
    pub shape: Shape,
    /// Its value, as written.
    pub value: String,
    /// The comment on it.
    pub doc: String,
}

/// A message, or half a service.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Definition {
    /// The comment at its start.
    pub doc: String,
    /// Its fields, in order.
    pub fields: Vec<Field>,
    /// Its constants, in order.
    pub constants: Vec<Constant>,
}

/// A definition under its name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    /// `package/Name`.
    pub name: String,
    /// What it is.
    pub definition: Definition,
}

/// What is wrong with a definition, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DefinitionError {
    /// Line of the text, from 1.
    pub line: usize,
    /// What is wrong there.
    pub reason: String,
}

impl fmt::Display for DefinitionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.reason)
    }
}

impl std::error::Error for DefinitionError {}

/// The name of the member that ROS 2 gives to a message without fields.
pub const PLACEHOLDER: &str = "structure_needs_at_least_one_member";

/// Parses a `.msg` text of a package, or half a `.srv` text, whose first line has the number `first_line`.
///
/// # Errors
/// [`DefinitionError`] when a line is not of the grammar.
pub fn message(package: &str, text: &str, first_line: usize) -> Result<Definition, DefinitionError> {
    let mut message = Definition::default();
    let mut comment = Vec::new();
    for (line, text) in (first_line..).zip(text.lines()) {
        let (code, remark) = split_comment(text);
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
        member(&mut message, package, line, code, doc).map_err(|reason| DefinitionError { line, reason })?;
    }
    Ok(message)
}

/// Splits a `.srv` or `.action` text at its lines `---`: each part with the number of its first line.
#[must_use]
pub fn parts(text: &str, first_line: usize) -> Vec<(usize, String)> {
    let mut parts = vec![(first_line, String::new())];
    for (line, text) in (first_line..).zip(text.lines()) {
        if text.trim() == "---" {
            parts.push((line + 1, String::new()));
        } else if let Some((_, part)) = parts.last_mut() {
            part.push_str(text);
            part.push('\n');
        }
    }
    parts
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

/// Parses `TYPE NAME`, `TYPE NAME DEFAULT` or `TYPE NAME=VALUE`.
fn member(message: &mut Definition, package: &str, line: usize, code: &str, doc: String) -> Result<(), String> {
    let (type_text, rest) = code.split_once(char::is_whitespace).ok_or_else(|| format!("`{code}` has no name"))?;
    let (base, shape) = field_type(package, type_text)?;
    let rest = rest.trim();
    let name_length = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
    let (name, behind) = (rest[..name_length].to_owned(), &rest[name_length..]);
    let tail = behind.trim_start();
    if name.is_empty() || !(tail.starts_with('=') || tail.len() < behind.len() || tail.is_empty()) {
        return Err(format!("`{rest}` is not a name"));
    }
    if let Some(value) = tail.strip_prefix('=') {
        let value = value.trim().to_owned();
        message.constants.push(Constant { line, name, base, shape, value, doc });
    } else {
        let default = Some(tail.to_owned()).filter(|tail| !tail.is_empty());
        message.fields.push(Field { line, name, base, shape, default, doc });
    }
    Ok(())
}

/// Parses a type with its array part.
fn field_type(package: &str, text: &str) -> Result<(Base, Shape), String> {
    let (base, shape) = match text.split_once('[') {
        None => (text, Shape::Scalar),
        Some((base, bracket)) => (base, array_shape(text, bracket)?),
    };
    Ok((base_type(package, base)?, shape))
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
        None => Ok(Shape::Array(positive(size)?)),
    }
}

fn base_type(package: &str, text: &str) -> Result<Base, String> {
    let (name, bound) = match text.split_once("<=") {
        None => (text, None),
        Some((name, bound)) => {
            let bound = bound.parse().map_err(|_| format!("`{text}` has no bound that is a number"))?;
            (name, Some(bound))
        }
    };
    let primitive = match name {
        "string" => Some(Primitive::String { bound }),
        "wstring" => Some(Primitive::WString { bound }),
        _ if bound.is_some() => return Err(format!("`{text}` is not a type")),
        _ => number(name),
    };
    match primitive {
        Some(primitive) => Ok(Base::Primitive(primitive)),
        None => nested(package, text),
    }
}

fn number(name: &str) -> Option<Primitive> {
    Some(match name {
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
        _ => return None,
    })
}

fn nested(package: &str, text: &str) -> Result<Base, String> {
    let parts: Vec<&str> = text.split('/').collect();
    let (package, name) = match parts[..] {
        [name] => (package, name),
        [package, name] | [package, "msg" | "srv" | "action", name] => (package, name),
        _ => return Err(format!("`{text}` is not a type")),
    };
    let is_name = |text: &str| !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if (is_name(package) || parts.len() == 1) && is_name(name) {
        Ok(Base::Nested { package: package.to_owned(), name: name.to_owned() })
    } else {
        Err(format!("`{text}` is not a type"))
    }
}
