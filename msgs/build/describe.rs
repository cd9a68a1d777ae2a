//! RIHS01 type hashes (REP 2016) and the schema texts of bags.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use sha2::{Digest, Sha256};

use crate::model::{Base, Field, Message, Primitive, Service, Shape, Value};

/// All messages known, by type name; services' halves included.
pub type Catalogue = BTreeMap<String, Message>;

/// The line that a bag's schema text has before each dependency.
const RULE: &str = "================================================================================";

/// Names of the types that the message is made of, itself not included, at any depth.
pub fn dependencies(catalogue: &Catalogue, message: &Message) -> Result<BTreeSet<String>, String> {
    let mut found = BTreeSet::new();
    let mut open = vec![(message, vec![message.type_name()])];
    while let Some((message, path)) = open.pop() {
        for field in &message.fields {
            let Base::Nested { package, name } = &field.base else {
                continue;
            };
            let nested_name = nested_type_name(package, name);
            let nested = catalogue
                .get(&nested_name)
                .ok_or_else(|| format!("{}: the type {nested_name} is not known", message.type_name()))?;
            if path.contains(&nested_name) {
                return Err(format!("{nested_name} contains itself"));
            }
            found.insert(nested_name.clone());
            let mut path = path.clone();
            path.push(nested_name);
            open.push((nested, path));
        }
    }
    Ok(found)
}

/// The definition as rosbag2 stores it: the text, then the text of each dependency.
pub fn schema(catalogue: &Catalogue, message: &Message) -> Result<String, String> {
    let mut schema = with_newline(&message.text);
    for dependency in dependencies(catalogue, message)? {
        let dependency = &catalogue[&dependency];
        let _ = write!(
            schema,
            "{RULE}\nMSG: {}/{}\n{}",
            dependency.package,
            dependency.name,
            with_newline(&dependency.text)
        );
    }
    Ok(schema)
}

/// Type hash of a message.
pub fn message_hash(catalogue: &Catalogue, message: &Message) -> Result<String, String> {
    let referenced: BTreeMap<String, String> = dependencies(catalogue, message)?
        .into_iter()
        .map(|name| {
            let description = description(&name, &catalogue[&name].fields);
            (name, description)
        })
        .collect();
    Ok(hash(&description(&message.type_name(), &message.fields), &referenced))
}

/// The message and all that it is made of, as type_description_interfaces/msg/TypeDescription has it, in JSON.
pub fn message_description(catalogue: &Catalogue, message: &Message) -> Result<String, String> {
    let full = |message: &Message| {
        let member = |field: &Field| {
            let (name, kind, default) = (&field.name, type_json(field), field.default.as_ref().map(default_text));
            format!(r#"{{"name": "{name}", "type": {kind}, "default_value": {:?}}}"#, default.unwrap_or_default())
        };
        let members: Vec<String> = message.fields.iter().map(member).collect();
        description_of_members(&message.type_name(), &members)
    };
    let referenced: Vec<String> = dependencies(catalogue, message)?.iter().map(|name| full(&catalogue[name])).collect();
    Ok(whole(&full(message), &referenced.iter().map(String::as_str).collect::<Vec<_>>()))
}

/// A default as ROS's own generators write it, in Python's words.
fn default_text(value: &Value) -> String {
    match value {
        Value::Bool(true) => "True".to_owned(),
        Value::Bool(false) => "False".to_owned(),
        Value::Int(value) => value.to_string(),
        Value::Float(value) => format!("{value:?}"),
        Value::Text(text) => text.clone(),
        Value::List(values) => format!("[{}]", values.iter().map(default_text).collect::<Vec<_>>().join(", ")),
    }
}

/// Type hash of a service, which covers its request, response and event types.
pub fn service_hash(catalogue: &Catalogue, service: &Service) -> Result<String, String> {
    let name = format!("{}/srv/{}", service.package, service.name);
    let half = |suffix| nested_json(&format!("{name}_{suffix}"));
    let member = |field: &str, type_json: &str| format!(r#"{{"name": "{field}", "type": {type_json}}}"#);
    let event_info = "service_msgs/msg/ServiceEventInfo";
    let event = [
        member("info", &nested_json(event_info)(1, 0)),
        member("request", &half("Request")(97, 1)),
        member("response", &half("Response")(97, 1)),
    ];
    let whole = [
        member("request_message", &half("Request")(1, 0)),
        member("response_message", &half("Response")(1, 0)),
        member("event_message", &half("Event")(1, 0)),
    ];
    let info = catalogue.get(event_info).ok_or_else(|| format!("{name}: the type {event_info} is not known"))?;
    let mut referenced = BTreeMap::new();
    for message in [&service.request, &service.response, info] {
        referenced.insert(message.type_name(), description(&message.type_name(), &message.fields));
        for dependency in dependencies(catalogue, message)? {
            let description = description(&dependency, &catalogue[&dependency].fields);
            referenced.insert(dependency, description);
        }
    }
    let event_name = format!("{name}_Event");
    referenced.insert(event_name.clone(), description_of_members(&event_name, &event));
    Ok(hash(&description_of_members(&name, &whole), &referenced))
}

fn nested_type_name(package: &str, name: &str) -> String {
    format!("{package}/msg/{name}")
}

fn with_newline(text: &str) -> String {
    format!("{}\n", text.trim_end_matches('\n'))
}

fn hash(description: &str, referenced: &BTreeMap<String, String>) -> String {
    let referenced: Vec<&str> = referenced.values().map(String::as_str).collect();
    let json = whole(description, &referenced);
    let mut hash = "RIHS01_".to_owned();
    for byte in Sha256::digest(json) {
        let _ = write!(hash, "{byte:02x}");
    }
    hash
}

fn whole(description: &str, referenced: &[&str]) -> String {
    format!(r#"{{"type_description": {description}, "referenced_type_descriptions": [{}]}}"#, referenced.join(", "))
}

fn description(type_name: &str, fields: &[Field]) -> String {
    let members: Vec<String> =
        fields.iter().map(|field| format!(r#"{{"name": "{}", "type": {}}}"#, field.name, type_json(field))).collect();
    description_of_members(type_name, &members)
}

fn description_of_members(type_name: &str, members: &[String]) -> String {
    format!(r#"{{"type_name": "{type_name}", "fields": [{}]}}"#, members.join(", "))
}

fn nested_json(type_name: &str) -> impl Fn(u8, usize) -> String + use<> {
    let type_name = type_name.to_owned();
    move |type_id, capacity| {
        format!(
            r#"{{"type_id": {type_id}, "capacity": {capacity}, "string_capacity": 0, "nested_type_name": "{type_name}"}}"#
        )
    }
}

/// The type of a field, numbered as type_description_interfaces/msg/FieldType does.
fn type_json(field: &Field) -> String {
    let (shape_offset, capacity) = match field.shape {
        Shape::Scalar => (0, 0),
        Shape::Array(length) => (48, length),
        Shape::Bounded(bound) => (96, bound),
        Shape::Unbounded => (144, 0),
    };
    let (base_id, string_capacity, nested) = match &field.base {
        Base::Nested { package, name } => (1, 0, nested_type_name(package, name)),
        Base::Primitive(Primitive::String { bound: Some(bound) }) => (21, *bound, String::new()),
        Base::Primitive(primitive) => (primitive_id(*primitive), 0, String::new()),
    };
    format!(
        r#"{{"type_id": {}, "capacity": {capacity}, "string_capacity": {string_capacity}, "nested_type_name": "{nested}"}}"#,
        base_id + shape_offset
    )
}

fn primitive_id(primitive: Primitive) -> u8 {
    match primitive {
        Primitive::Int8 => 2,
        // A `char` of a .msg file is an unsigned byte.
        Primitive::Uint8 | Primitive::Char => 3,
        Primitive::Int16 => 4,
        Primitive::Uint16 => 5,
        Primitive::Int32 => 6,
        Primitive::Uint32 => 7,
        Primitive::Int64 => 8,
        Primitive::Uint64 => 9,
        Primitive::Float32 => 10,
        Primitive::Float64 => 11,
        Primitive::Bool => 15,
        Primitive::Byte => 16,
        Primitive::String { .. } => 17,
        Primitive::WString { .. } => 18,
    }
}
