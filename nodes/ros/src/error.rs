//! What can go wrong on the way to and from ROS.

use std::time::Duration;

/// An error of this crate.
#[derive(Debug, thiserror::Error)]
pub enum RosError {
    /// A word after `--ros-args` is not understood.
    #[error("ros argument `{argument}`: {reason}")]
    Argument {
        /// The word, or the option and its value.
        argument: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A parameter file cannot be used.
    #[error("parameter file {path}: {reason}")]
    ParameterFile {
        /// The file.
        path: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A parameter was given a value that it cannot have.
    #[error("parameter `{name}`: {reason}")]
    Parameter {
        /// The parameter.
        name: String,
        /// What is wrong with the value.
        reason: String,
    },
    /// An environment variable has a value that it cannot have.
    #[error("environment variable {name}=`{value}`: {reason}")]
    Environment {
        /// The variable.
        name: &'static str,
        /// Its value.
        value: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A name of a node, topic or service breaks the rules of ROS.
    #[error("`{name}` is not a valid name: {reason}")]
    Name {
        /// The name.
        name: String,
        /// The rule it breaks.
        reason: &'static str,
    },
    /// Another node has the same name.
    #[error(
        "a node named {node} is already running in domain {domain}: stop it, or use another name, namespace or ROS_DOMAIN_ID"
    )]
    DuplicateNode {
        /// Fully qualified name.
        node: String,
        /// The DDS domain.
        domain: u16,
    },
    /// It was taken for lost, and another one has taken its place.
    #[error("node {node} was taken for lost: the mission has started another one in its place, and this one ends")]
    Replaced {
        /// Fully qualified name.
        node: String,
    },
    /// RustDDS, inside this process, does not answer any more.
    #[error("node {node} neither hears nor speaks any more: its DDS has died; start it again")]
    Deaf {
        /// Fully qualified name.
        node: String,
    },
    /// The process was asked to end while it waited.
    #[error("asked to end")]
    Interrupted,
    /// Nodes that are needed did not come up.
    #[error("still missing after {} s: {}", .waited.as_secs_f64(), .missing.join(", "))]
    MissingPeers {
        /// How long was waited.
        waited: Duration,
        /// What is missing, in words.
        missing: Vec<String>,
    },
    /// DDS refused to create something.
    #[error("cannot create {what}: {reason}")]
    Create {
        /// The thing.
        what: String,
        /// What DDS says.
        reason: String,
    },
    /// A sample could not be sent.
    #[error("cannot send on {topic}: {reason}")]
    Send {
        /// Fully qualified name of the topic or service.
        topic: String,
        /// What DDS says.
        reason: String,
    },
    /// A sample could not be received.
    #[error("cannot receive on {topic}: {reason}")]
    Receive {
        /// Fully qualified name of the topic or service.
        topic: String,
        /// What DDS says.
        reason: String,
    },
    /// The bytes of a sample are not a message of the expected type.
    #[error("{type_name} of {length} bytes cannot be read: {reason}")]
    Decode {
        /// Name of the type.
        type_name: &'static str,
        /// Bytes that were received, encapsulation header included.
        length: usize,
        /// What is wrong with them.
        reason: String,
    },
    /// A message cannot be written as bytes.
    #[error("{type_name} cannot be written: {reason}")]
    Encode {
        /// Name of the type.
        type_name: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// A service did not answer.
    #[error("service {service} did not answer within {} s", .waited.as_secs_f64())]
    NoAnswer {
        /// Fully qualified name of the service.
        service: String,
        /// How long was waited.
        waited: Duration,
    },
    /// The operating system refused something.
    #[error("{what}")]
    System {
        /// What was tried.
        what: &'static str,
        /// Why it failed.
        #[source]
        source: std::io::Error,
    },
}
