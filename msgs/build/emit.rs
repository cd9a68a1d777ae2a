//! Rust source text of the interfaces.

use std::fmt::Write as _;

use crate::describe::{self, Catalogue};
use crate::model::{Base, Constant, Field, Message, Primitive, Service, Shape, Value};

/// The whole generated file: a module for each package, then the table of messages.
pub fn source(catalogue: &Catalogue, services: &[Service]) -> Result<String, String> {
    let mut out = String::new();
    let mut packages: Vec<&str> = catalogue.values().map(|m| m.package.as_str()).collect();
    packages.dedup();
    for package in packages {
        let _ = writeln!(out, "/// The interfaces of the ROS 2 package `{package}`.\npub mod {package} {{");
        for message in catalogue.values().filter(|m| m.package == package) {
            emit_message(&mut out, catalogue, message)?;
        }
        for service in services.iter().filter(|s| s.package == package) {
            emit_service(&mut out, catalogue, service)?;
        }
        out.push_str("}\n");
    }
    out.push_str("pub(crate) static MESSAGES: &[crate::Interface] = &[\n");
    for message in catalogue.values().filter(|m| m.kind == "msg") {
        let path = rust_path(&message.package, &message.name);
        let _ = writeln!(out, "crate::Interface::of::<{path}>(),");
    }
    out.push_str("];\n");
    emit_every_type(&mut out, catalogue);
    Ok(out)
}

/// A macro with the names of all types, for what is done with each of them.
fn emit_every_type(out: &mut String, catalogue: &Catalogue) {
    out.push_str(
        "/// `every_type!(it)` is `it!(A, B, …)` with the path of every message, and of what services send and answer.
        #[macro_export]
        macro_rules! every_type { ($then:ident) => { $then!(",
    );
    for message in catalogue.values() {
        let _ = writeln!(out, "${},", rust_path(&message.package, &message.name));
    }
    out.push_str("); } }\n");
}

fn emit_message(out: &mut String, catalogue: &Catalogue, message: &Message) -> Result<(), String> {
    let name = rust_name(&message.name);
    let doc = if message.doc.is_empty() {
        format!("`{}`.", message.type_name())
    } else {
        format!("{}\n\n`{}`.", message.doc, message.type_name())
    };
    let has_defaults = message.fields.iter().any(|field| field.default.is_some());
    let copy = if is_copy(catalogue, message) { "Copy, " } else { "" };
    let default = if has_defaults { "" } else { "Default, " };
    let _ = writeln!(
        out,
        "#[doc = {:?}]\n#[derive(Clone, {copy}Debug, {default} PartialEq, serde::Serialize, serde::Deserialize)]\npub struct {name} {{",
        escaped(&doc)
    );
    for field in &message.fields {
        let _ = writeln!(out, "#[doc = {:?}]", escaped(&field.doc));
        if let Some(check) = bound_check(field) {
            let _ = writeln!(out, "#[serde(with = {check:?})]");
        }
        let _ = writeln!(out, "pub r#{}: {},", field.name, rust_type(field));
    }
    out.push_str("}\n");
    if has_defaults {
        emit_default(out, message);
    }
    emit_constants(out, &name, &message.constants);
    let _ = writeln!(
        out,
        "impl crate::RosMessage for {name} {{
            const PACKAGE: &'static str = {:?};
            const NAME: &'static str = {:?};
            const TYPE_NAME: &'static str = {:?};
            const TYPE_HASH: &'static str = {:?};
            const SCHEMA: &'static str = {:?};
            const DESCRIPTION: &'static str = {:?};
        }}",
        message.package,
        message.name,
        message.type_name(),
        describe::message_hash(catalogue, message)?,
        describe::schema(catalogue, message)?,
        describe::message_description(catalogue, message)?
    );
    Ok(())
}

fn emit_service(out: &mut String, catalogue: &Catalogue, service: &Service) -> Result<(), String> {
    let Service { package, name, doc, .. } = service;
    let _ = writeln!(
        out,
        "#[doc = {:?}]
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct {name};
        impl crate::RosService for {name} {{
            type Request = {name}Request;
            type Response = {name}Response;
            const PACKAGE: &'static str = {package:?};
            const NAME: &'static str = {name:?};
            const TYPE_NAME: &'static str = {:?};
            const TYPE_HASH: &'static str = {:?};
        }}",
        escaped(&format!("{doc}\n\n`{package}/srv/{name}`.")),
        format!("{package}/srv/{name}"),
        describe::service_hash(catalogue, service)?
    );
    Ok(())
}

fn emit_default(out: &mut String, message: &Message) {
    let _ = writeln!(out, "impl Default for {} {{ fn default() -> Self {{ Self {{", rust_name(&message.name));
    for field in &message.fields {
        let value = match &field.default {
            Some(value) => literal(value, field.shape),
            None => "Default::default()".to_owned(),
        };
        let _ = writeln!(out, "r#{}: {value},", field.name);
    }
    out.push_str("} } }\n");
}

fn emit_constants(out: &mut String, name: &str, constants: &[Constant]) {
    if constants.is_empty() {
        return;
    }
    let _ = writeln!(out, "impl {name} {{");
    for constant in constants {
        let (rust, value) = match &constant.value {
            Value::Text(text) => ("&'static str".to_owned(), format!("{text:?}")),
            value => {
                let base = Base::Primitive(constant.primitive);
                (base_type(&base), literal(value, Shape::Scalar))
            }
        };
        let _ = writeln!(out, "#[doc = {:?}]\npub const {}: {rust} = {value};", escaped(&constant.doc), constant.name);
    }
    out.push_str("}\n");
}

fn literal(value: &Value, shape: Shape) -> String {
    match value {
        Value::Bool(value) => value.to_string(),
        Value::Int(value) => value.to_string(),
        Value::Float(value) => format!("{value:?}"),
        Value::Text(text) => format!("{text:?}.to_owned()"),
        Value::List(values) => {
            let values: Vec<String> = values.iter().map(|value| literal(value, Shape::Scalar)).collect();
            let list = values.join(", ");
            match shape {
                Shape::Array(_) => format!("[{list}]"),
                _ => format!("vec![{list}]"),
            }
        }
    }
}

/// The serde adapter that refuses a text or sequence beyond its bound.
fn bound_check(field: &Field) -> Option<String> {
    match (field.shape, &field.base) {
        (Shape::Bounded(bound), _) => Some(format!("crate::bounded::Sequence::<{bound}>")),
        (Shape::Scalar, Base::Primitive(Primitive::String { bound: Some(bound) })) => {
            Some(format!("crate::bounded::Text::<{bound}>"))
        }
        _ => None,
    }
}

fn rust_type(field: &Field) -> String {
    let base = base_type(&field.base);
    match field.shape {
        Shape::Scalar => base,
        Shape::Array(length) => format!("[{base}; {length}]"),
        Shape::Bounded(_) | Shape::Unbounded => format!("Vec<{base}>"),
    }
}

fn base_type(base: &Base) -> String {
    let primitive = match base {
        Base::Nested { package, name } => return rust_path(package, name),
        Base::Primitive(primitive) => primitive,
    };
    match primitive {
        Primitive::Bool => "bool",
        Primitive::Byte | Primitive::Char | Primitive::Uint8 => "u8",
        Primitive::Int8 => "i8",
        Primitive::Int16 => "i16",
        Primitive::Uint16 => "u16",
        Primitive::Int32 => "i32",
        Primitive::Uint32 => "u32",
        Primitive::Int64 => "i64",
        Primitive::Uint64 => "u64",
        Primitive::Float32 => "f32",
        Primitive::Float64 => "f64",
        // A package may have a message called String.
        Primitive::String { .. } | Primitive::WString { .. } => "::std::string::String",
    }
    .to_owned()
}

fn is_copy(catalogue: &Catalogue, message: &Message) -> bool {
    message.fields.iter().all(|field| {
        matches!(field.shape, Shape::Scalar | Shape::Array(_))
            && match &field.base {
                Base::Primitive(primitive) => {
                    !matches!(primitive, Primitive::String { .. } | Primitive::WString { .. })
                }
                Base::Nested { package, name } => {
                    catalogue.get(&format!("{package}/msg/{name}")).is_some_and(|nested| is_copy(catalogue, nested))
                }
            }
    })
}

fn rust_path(package: &str, name: &str) -> String {
    format!("crate::{package}::{}", rust_name(name))
}

/// `Name_Request` is `NameRequest` in Rust.
fn rust_name(name: &str) -> String {
    name.replace('_', "")
}

/// Keeps rustdoc from reading units in brackets as links.
fn escaped(doc: &str) -> String {
    doc.replace('[', "\\[").replace(']', "\\]").replace('<', "\\<")
}
