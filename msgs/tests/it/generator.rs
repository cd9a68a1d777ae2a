//! The generator: what it reads, what it refuses, and the hashes it computes.

use crate::describe::{self, Catalogue};
use crate::model::{Base, Primitive, Shape, Value};
use crate::{emit, parse};

fn catalogue(files: &[(&str, &str, &str)]) -> Catalogue {
    files
        .iter()
        .map(|(package, name, text)| parse::message(package, name, text).unwrap())
        .map(|message| (message.type_name(), message))
        .collect()
}

#[test]
fn every_kind_of_member_is_read() {
    let text = "# About it.\n\n# First.\nfloat64[3] a [1, 2.5, -3]\nstring<=5 b 'x#y' # Second.\n\
                # Third.\nThing[<=2] c\n# Fourth.\nother/Part[] d\n# Fifth.\nuint8 LIMIT=0x10\n\
                string NAME = \"a b\" # Sixth.\nbool e true # Seventh.\n";
    let message = parse::message("pkg", "Whole", text).unwrap();
    assert_eq!(message.doc, "About it.");
    let fields: Vec<_> =
        message.fields.iter().map(|f| (f.name.as_str(), &f.base, f.shape, f.default.clone(), f.doc.as_str())).collect();
    let nested = |package: &str, name: &str| Base::Nested { package: package.to_owned(), name: name.to_owned() };
    let list = Value::List(vec![Value::Float(1.0), Value::Float(2.5), Value::Float(-3.0)]);
    let text_base = Base::Primitive(Primitive::String { bound: Some(5) });
    assert_eq!(
        fields,
        [
            ("a", &Base::Primitive(Primitive::Float64), Shape::Array(3), Some(list), "First."),
            ("b", &text_base, Shape::Scalar, Some(Value::Text("x#y".to_owned())), "Second."),
            ("c", &nested("pkg", "Thing"), Shape::Bounded(2), None, "Third."),
            ("d", &nested("other", "Part"), Shape::Unbounded, None, "Fourth."),
            ("e", &Base::Primitive(Primitive::Bool), Shape::Scalar, Some(Value::Bool(true)), "Seventh."),
        ]
    );
    let constants: Vec<_> = message.constants.iter().map(|c| (c.name.as_str(), c.value.clone())).collect();
    assert_eq!(constants, [("LIMIT", Value::Int(16)), ("NAME", Value::Text("a b".to_owned()))]);
}

#[test]
fn bad_definitions_are_refused_with_line_and_reason() {
    let refused = |text: &str| parse::message("pkg", "Bad", text).unwrap_err();
    for (line, reason) in [
        ("wstring a # A.", "line 1: `wstring` is not supported: use `string`"),
        ("float64 a", "line 1: `a` has no comment that says what it is"),
        ("float64[99] a # A.", "line 1: `float64[99]` is longer than the 32 elements that are supported"),
        ("float64[0] a # A.", "line 1: `float64[0]` has no positive array size"),
        ("float64[3 a # A.", "line 1: `float64[3` is not a type"),
        ("uint8 a 256 # A.", "line 1: `256` is not a value of Uint8"),
        ("uint8 A = -1 # A.", "line 1: `-1` is not a value of Uint8"),
        ("float64 a NaN # A.", "line 1: `NaN` is not a value of Float64"),
        ("bool a maybe # A.", "line 1: `maybe` is not a value of Bool"),
        ("string<=2 a abc # A.", "line 1: `abc` is not a value of String { bound: Some(2) }"),
        ("string<=x a # A.", "line 1: `string<=x` has no bound that is a number"),
        ("int32[2] a [1] # A.", "line 1: the default has 1 values for 2"),
        ("int32[] a 1 # A.", "line 1: the default `1` is not a list"),
        ("Thing a 1 # A.", "line 1: a nested type cannot have the default `1`"),
        ("Thing A = 1 # A.", "line 1: the constant `A` is not of a primitive type"),
        ("float64 Upper # A.", "line 1: `Upper` is not a name for a field"),
        ("float64 a__b # A.", "line 1: `a__b` is not a name for a field"),
        ("uint8 lower=1 # A.", "line 1: `lower` is not a name for a constant"),
        ("a/b/c/d x # A.", "line 1: `a/b/c/d` is not a type"),
        ("lonely # A.", "line 1: `lonely` has no name"),
        ("int8 a # A.\nint8 a # B.", "line 2: `a` is defined twice"),
    ] {
        assert_eq!(refused(line), reason);
    }
    assert_eq!(parse::message("pkg", "bad_name", "").unwrap_err(), "`bad_name` is not a name for a type");
    assert_eq!(parse::service("pkg", "Call", "int8 a # A.").unwrap_err(), "a service needs exactly one line `---`");
    assert_eq!(
        parse::service("pkg", "Call", "int8 a # A.\n---\nint8 b").unwrap_err(),
        "line 3: `b` has no comment that says what it is"
    );
}

#[test]
fn unknown_and_circular_types_are_refused() {
    let known = catalogue(&[
        ("pkg", "Loose", "Missing m # M."),
        ("pkg", "Ring", "Link l # L."),
        ("pkg", "Link", "Ring[] r # R."),
    ]);
    assert_eq!(
        describe::message_hash(&known, &known["pkg/msg/Loose"]).unwrap_err(),
        "pkg/msg/Loose: the type pkg/msg/Missing is not known"
    );
    assert_eq!(emit::source(&known, &[]).unwrap_err(), "pkg/msg/Link contains itself");
}

#[test]
fn an_empty_half_of_a_service_gets_the_placeholder_member() {
    let service = parse::service("pkg", "Trigger", "---\nbool ok # Whether.").unwrap();
    assert_eq!(service.request.type_name(), "pkg/srv/Trigger_Request");
    assert_eq!(service.request.fields[0].name, "structure_needs_at_least_one_member");
    assert_eq!(service.response.fields[0].name, "ok");
}

/// Against the hashes that the ROS 2 tools print for example_interfaces/srv/AddTwoInts.
#[test]
fn service_hashes_are_those_of_ros_2() {
    let known = catalogue(&[
        ("builtin_interfaces", "Time", include_str!("../../standard/builtin_interfaces/msg/Time.msg")),
        ("service_msgs", "ServiceEventInfo", include_str!("../../standard/service_msgs/msg/ServiceEventInfo.msg")),
    ]);
    let text = "int64 a # A.\nint64 b # B.\n---\nint64 sum # Sum.\n";
    let service = parse::service("example_interfaces", "AddTwoInts", text).unwrap();
    assert_eq!(
        describe::service_hash(&known, &service).unwrap(),
        "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
    );
    assert_eq!(
        describe::message_hash(&known, &service.request).unwrap(),
        "RIHS01_000c5fd92d6b2e1a05949348f584d6d652adea1e92d691792011ac2273508302"
    );
    assert_eq!(
        describe::message_hash(&known, &service.response).unwrap(),
        "RIHS01_de5c030d4af33cba2749310b249737b631594703f9300495f48bffb2b44dcc2f"
    );
}

#[test]
fn emitted_defaults_constants_and_bounds_are_rust() {
    let known = catalogue(&[(
        "pkg",
        "Whole",
        "float32[2] a [1, 2] # A.\nstring[<=2] b ['x', 'y'] # B.\nstring<=3 type # C.\nstring D=d # D.",
    )]);
    let source = emit::source(&known, &[]).unwrap();
    for expected in [
        "r#a: [1.0, 2.0],",
        "r#b: vec![\"x\".to_owned(), \"y\".to_owned()],",
        "#[serde(with = \"crate::bounded::Sequence::<2>\")]",
        "#[serde(with = \"crate::bounded::Text::<3>\")]\npub r#type: ::std::string::String,",
        "pub const D: &'static str = \"d\";",
    ] {
        assert!(source.contains(expected), "{expected} is missing in\n{source}");
    }
}
