//! ROS 2 interfaces of Swath: Rust types, schema texts and type hashes generated from the interface files.
//!
//! Each ROS package is a module: [`std_msgs::Header`], [`swath_msgs::SpacecraftState`],
//! [`swath_msgs::SubmitStrips`] with [`swath_msgs::SubmitStripsRequest`]. Constants of a message
//! are associated constants of its type.

mod bounded;
pub mod definition;

use std::fmt::Debug;

use serde::Serialize;
use serde::de::DeserializeOwned;

use generated::MESSAGES;
pub use generated::*;

#[expect(
    unused_qualifications,
    clippy::derivable_impls,
    reason = "the generator writes full paths and defaults whether they are needed or not"
)]
mod generated {
    include!(concat!(env!("OUT_DIR"), "/interfaces.rs"));
}

/// A ROS 2 message, or the request or response of a service.
pub trait RosMessage:
    Serialize + DeserializeOwned + Clone + Debug + Default + PartialEq + Send + Sync + 'static
{
    /// Package that defines it, such as `std_msgs`.
    const PACKAGE: &'static str;
    /// Name within the package, such as `Header`.
    const NAME: &'static str;
    /// Full name, such as `std_msgs/msg/Header`.
    const TYPE_NAME: &'static str;
    /// RIHS01 hash of the type (REP 2016).
    const TYPE_HASH: &'static str;
    /// Definition as bags store it: the text, then the text of each dependency.
    const SCHEMA: &'static str;
    /// The type as [`type_description_interfaces::TypeDescription`] has it, in JSON.
    const DESCRIPTION: &'static str;
}

/// A ROS 2 service.
pub trait RosService: Send + Sync + 'static {
    /// What a client sends.
    type Request: RosMessage;
    /// What the server answers.
    type Response: RosMessage;
    /// Package that defines it, such as `swath_msgs`.
    const PACKAGE: &'static str;
    /// Name within the package, such as `SubmitStrips`.
    const NAME: &'static str;
    /// Full name, such as `swath_msgs/srv/SubmitStrips`.
    const TYPE_NAME: &'static str;
    /// RIHS01 hash of the type (REP 2016).
    const TYPE_HASH: &'static str;
}

/// What is known of a message type at run time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interface {
    /// Full name, such as `std_msgs/msg/Header`.
    pub type_name: &'static str,
    /// RIHS01 hash of the type (REP 2016).
    pub type_hash: &'static str,
    /// Definition as bags store it: the text, then the text of each dependency.
    pub schema: &'static str,
    /// The type as [`type_description_interfaces::TypeDescription`] has it, in JSON.
    pub description: &'static str,
}

impl Interface {
    /// The interface of a message type.
    #[must_use]
    pub const fn of<M: RosMessage>() -> Self {
        Self { type_name: M::TYPE_NAME, type_hash: M::TYPE_HASH, schema: M::SCHEMA, description: M::DESCRIPTION }
    }

    /// The interface with this full name, such as `std_msgs/msg/Header`, if it is one of ours.
    #[must_use]
    pub fn find(type_name: &str) -> Option<&'static Self> {
        let index = MESSAGES.binary_search_by(|known| known.type_name.cmp(type_name)).ok()?;
        Some(&MESSAGES[index])
    }

    /// All message types, ordered by name.
    #[must_use]
    pub fn all() -> &'static [Self] {
        MESSAGES
    }
}

/// Definition of a message type as bags store it, if it is one of ours.
#[must_use]
pub fn schema_for(type_name: &str) -> Option<&'static str> {
    Interface::find(type_name).map(|interface| interface.schema)
}

/// RIHS01 hash of a message type, if it is one of ours.
#[must_use]
pub fn type_hash_for(type_name: &str) -> Option<&'static str> {
    Interface::find(type_name).map(|interface| interface.type_hash)
}
