//! Message definitions as bags carry them (`ros2msg` texts), and decoding CDR by them.

mod adapt;
mod decode;
mod json;
mod parse;
mod turn;
mod types;

pub use adapt::adapt;
pub use decode::{Scalar, Visitor, decode};
pub use json::to_json;
pub(crate) use turn::is_sendable;
pub use turn::to_little_endian;
pub use types::{Count, Element, Field, Primitive, Schema, Struct};
