//! Texts of several definitions, as bags carry them: the type's own, then its dependencies behind lines of `=`.

use super::{Base, Definition, DefinitionError, Field, Named, Primitive, Shape, idl, message, parts};

/// Part of a bundle: the definitions of one file.
struct Section {
    kind: Kind,
    /// As it stands behind the line of `=`; the type's own name at the start.
    name: String,
    first_line: usize,
    text: String,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// `.msg`, or what the type's name says at the start of a bundle.
    Msg,
    Srv,
    Action,
    Idl,
}

/// Parses a bundle; the type of that name is among the definitions, if the text has it.
///
/// A service or an action defines all the types that ROS 2 makes of it: requests, responses, events.
///
/// # Errors
/// [`DefinitionError`] when a line is not of the grammar.
pub fn definitions(type_name: &str, text: &str) -> Result<Vec<Named>, DefinitionError> {
    // Some editors put a byte order mark before a text.
    let text = text.trim_start_matches('\u{feff}');
    let mut all = Vec::new();
    for section in sections(type_name, text)? {
        // A name without a package is one that no ROS 2 gave.
        let package = section.name.split_once('/').map_or("", |(package, _)| package);
        if section.kind == Kind::Idl {
            all.extend(idl::definitions(&section.text, section.first_line)?);
            continue;
        }
        let parts = parts(&section.text, section.first_line);
        let parsed = parts.iter().map(|(line, text)| message(package, text, *line));
        let parsed: Vec<Definition> = parsed.collect::<Result<_, _>>()?;
        let whole = base_name(&section.name, type_name, parsed.len());
        match <[Definition; 3]>::try_from(parsed) {
            Ok(parsed) => all.extend(action(package, &whole, parsed)),
            Err(parsed) => match <[Definition; 2]>::try_from(parsed) {
                Ok(parsed) => all.extend(service(package, &whole, parsed)),
                Err(parsed) => {
                    let name = if package.is_empty() { whole } else { format!("{package}/{whole}") };
                    all.extend(parsed.into_iter().map(|definition| Named { name: name.clone(), definition }));
                }
            },
        }
    }
    Ok(all)
}

/// The parts of a bundle; one that begins with a line of `=` names its first, too.
fn sections(type_name: &str, text: &str) -> Result<Vec<Section>, DefinitionError> {
    let start = Section { kind: Kind::Msg, name: type_name.to_owned(), first_line: 1, text: String::new() };
    let mut sections = vec![start];
    let mut awaiting_name = false;
    for (line, text) in (1..).zip(text.lines()) {
        let code = text.trim();
        if is_separator(code) {
            awaiting_name = true;
        } else if awaiting_name && !code.is_empty() {
            awaiting_name = false;
            let (kind, name) = header(code).ok_or_else(|| {
                let reason = "a line of = is not followed by MSG:, SRV:, ACTION: or IDL:".to_owned();
                DefinitionError { line, reason }
            })?;
            sections.push(Section { kind, name: name.to_owned(), first_line: line + 1, text: String::new() });
        } else if let Some(section) = sections.last_mut() {
            section.text.push_str(text);
            section.text.push('\n');
        }
    }
    let named = sections.iter().skip(1).any(|section| short_name(&section.name) == short_name(type_name));
    let is_empty = sections.first().is_some_and(|start| start.text.trim().is_empty());
    if is_empty && sections.len() > 1 && (named || sections.iter().skip(1).all(|s| s.kind != Kind::Msg)) {
        sections.remove(0);
    }
    Ok(sections)
}

fn header(line: &str) -> Option<(Kind, &str)> {
    let kinds = [("MSG:", Kind::Msg), ("SRV:", Kind::Srv), ("ACTION:", Kind::Action), ("IDL:", Kind::Idl)];
    kinds.iter().find_map(|(word, kind)| Some((*kind, line.strip_prefix(word)?.trim())))
}

fn is_separator(line: &str) -> bool {
    line.len() >= 3 && line.bytes().all(|byte| byte == b'=')
}

/// `Name` of `package/msg/Name` and the like; of a service or an action without what ROS 2 appends to it.
fn base_name(name: &str, type_name: &str, parts: usize) -> String {
    let name = name.rsplit('/').next().unwrap_or_default();
    let own = type_name.rsplit('/').next() == Some(name);
    let endings: &[&str] = match parts {
        2 if own => &["_Request", "_Response", "_Event"],
        3 if own => &["_SendGoal_Event", "_GetResult_Event", "_FeedbackMessage", "_Goal", "_Result", "_Feedback"],
        _ => &[],
    };
    endings.iter().find_map(|ending| name.strip_suffix(ending)).unwrap_or(name).to_owned()
}

/// `package/Name` of `package/msg/Name` and of `package/Name`.
fn short_name(name: &str) -> String {
    match (name.split_once('/'), name.rsplit_once('/')) {
        (Some((package, _)), Some((_, last))) => format!("{package}/{last}"),
        _ => name.to_owned(),
    }
}

fn field(name: &str, base: Base, shape: Shape) -> Field {
    Field { line: 1, name: name.to_owned(), base, shape, default: None, doc: String::new() }
}

fn nested(package: &str, name: &str) -> Base {
    Base::Nested { package: package.to_owned(), name: name.to_owned() }
}

fn named(package: &str, name: &str, fields: Vec<Field>) -> Named {
    let definition = Definition { fields, ..Definition::default() };
    Named { name: format!("{package}/{name}"), definition }
}

/// Request, response, and the event with which service introspection tells of both.
fn service(package: &str, name: &str, [request, response]: [Definition; 2]) -> Vec<Named> {
    let (request_name, response_name) = (format!("{name}_Request"), format!("{name}_Response"));
    let mut all = event(package, name, &request_name, &response_name);
    all.push(Named { name: format!("{package}/{request_name}"), definition: request });
    all.push(Named { name: format!("{package}/{response_name}"), definition: response });
    all
}

fn event(package: &str, name: &str, request: &str, response: &str) -> Vec<Named> {
    let primitive = Base::Primitive;
    let mut all = vec![named(
        package,
        &format!("{name}_Event"),
        vec![
            field("info", nested("service_msgs", "ServiceEventInfo"), Shape::Scalar),
            field("request", nested(package, request), Shape::Bounded(1)),
            field("response", nested(package, response), Shape::Bounded(1)),
        ],
    )];
    all.push(named(
        "service_msgs",
        "ServiceEventInfo",
        vec![
            field("event_type", primitive(Primitive::Uint8), Shape::Scalar),
            field("stamp", nested("builtin_interfaces", "Time"), Shape::Scalar),
            field("client_gid", primitive(Primitive::Char), Shape::Array(16)),
            field("sequence_number", primitive(Primitive::Int64), Shape::Scalar),
        ],
    ));
    all.push(time());
    all
}

fn time() -> Named {
    let (sec, nanosec) = (Base::Primitive(Primitive::Int32), Base::Primitive(Primitive::Uint32));
    let fields = vec![field("sec", sec, Shape::Scalar), field("nanosec", nanosec, Shape::Scalar)];
    named("builtin_interfaces", "Time", fields)
}

/// Goal, result and feedback, and the messages that carry them.
fn action(package: &str, name: &str, [goal, result, feedback]: [Definition; 3]) -> Vec<Named> {
    let of = |part: &str| format!("{name}_{part}");
    let primitive = |kind| Base::Primitive(kind);
    let id = || field("goal_id", nested("unique_identifier_msgs", "UUID"), Shape::Scalar);
    let own = |member: &str, part: &str| field(member, nested(package, &of(part)), Shape::Scalar);
    let mut all = vec![named(package, &of("FeedbackMessage"), vec![id(), own("feedback", "Feedback")])];
    for call in ["SendGoal", "GetResult"] {
        let (request, response) = (of(&format!("{call}_Request")), of(&format!("{call}_Response")));
        all.extend(event(package, &of(call), &request, &response));
    }
    all.push(named(package, &of("SendGoal_Request"), vec![id(), own("goal", "Goal")]));
    let accepted = field("accepted", primitive(Primitive::Bool), Shape::Scalar);
    let stamp = field("stamp", nested("builtin_interfaces", "Time"), Shape::Scalar);
    all.push(named(package, &of("SendGoal_Response"), vec![accepted, stamp]));
    all.push(named(package, &of("GetResult_Request"), vec![id()]));
    let status = field("status", primitive(Primitive::Int8), Shape::Scalar);
    all.push(named(package, &of("GetResult_Response"), vec![status, own("result", "Result")]));
    let uuid = field("uuid", primitive(Primitive::Uint8), Shape::Array(16));
    all.push(named("unique_identifier_msgs", "UUID", vec![uuid]));
    for (part, definition) in [("Goal", goal), ("Result", result), ("Feedback", feedback)] {
        all.push(Named { name: format!("{package}/{}", of(part)), definition });
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(type_name: &str, text: &str) -> Vec<String> {
        definitions(type_name, text).unwrap().into_iter().map(|named| named.name).collect()
    }

    #[test]
    fn messages_services_and_actions_define_what_ros_2_makes_of_them() {
        let rule = "=".repeat(80);
        assert_eq!(names("a/msg/B", &format!("C c\n{rule}\nMSG: a/C\nint8 x\n")), ["a/B", "a/C"]);
        assert_eq!(names("a/msg/B", &format!("{rule}\nMSG: a/msg/B\nint8 x\n")), ["a/B"], "a header at the start");
        let service = ["a/S_Event", "service_msgs/ServiceEventInfo", "builtin_interfaces/Time"];
        let service = [&service[..], &["a/S_Request", "a/S_Response"]].concat();
        assert_eq!(names("a/srv/S_Event", "int8 x\n---\nint8 y\n"), service);
        assert_eq!(names("a/srv/S_Event", &format!("{rule}\nSRV: a/srv/S\nint8 x\n---\nint8 y\n")), service);
        assert!(names("a/action/F_FeedbackMessage", "---\n---\nint8 z\n").contains(&"a/F_FeedbackMessage".to_owned()));
        assert_eq!(names("a/msg/E", ""), ["a/E"], "a message without fields");
        assert_eq!(names("E", "int8 x\nF f\n"), ["E"], "a name without a package");
        assert_eq!(names("a/msg/B", "\u{feff}int8 x\r\n"), ["a/B"], "as some editors write it");
    }
}
