//! What a ROS 2 interface file holds, once parsed.

pub use crate::definition::{Base, Primitive, Shape};

/// A default or a constant's value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Bool(bool),
    Int(i128),
    Float(f64),
    Text(String),
    List(Vec<Self>),
}

/// A field of a message.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    pub name: String,
    pub base: Base,
    pub shape: Shape,
    pub default: Option<Value>,
    pub doc: String,
}

/// A named value that goes with a message.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    pub name: String,
    pub primitive: Primitive,
    pub value: Value,
    pub doc: String,
}

/// A message, or the request or response of a service.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    pub package: String,
    /// Name within the package; `Name_Request` or `Name_Response` for the halves of a service.
    pub name: String,
    /// Folder of the file that defines it: `msg` or `srv`.
    pub kind: &'static str,
    pub doc: String,
    pub fields: Vec<Field>,
    pub constants: Vec<Constant>,
    /// The definition as it is written in the file.
    pub text: String,
}

impl Message {
    /// Name as ROS 2 writes it: `package/msg/Name`.
    pub fn type_name(&self) -> String {
        format!("{}/{}/{}", self.package, self.kind, self.name)
    }
}

/// A service.
#[derive(Clone, Debug, PartialEq)]
pub struct Service {
    pub package: String,
    pub name: String,
    pub doc: String,
    pub request: Message,
    pub response: Message,
}
