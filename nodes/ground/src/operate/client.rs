//! Calls to the nodes of a flying mission.

use std::time::Duration;

use anyhow::{Context, Result, bail};
use swath_msgs::RosService;
use swath_ros::{Node, RosArgs, graph};

/// How long to wait for a node to be there, and for an answer.
const TIMEOUT: Duration = Duration::from_secs(10);
/// How long an answer may take before the call is made again: the first one after a match may be lost.
const ONE_TRY: Duration = Duration::from_secs(2);

/// An operator's node.
pub struct Operator {
    /// The ROS node.
    pub node: Node,
}

/// A service that answers.
pub struct Desk<S> {
    client: swath_ros::Client<S>,
}

impl Operator {
    /// Comes up under a name of its own.
    ///
    /// # Errors
    /// When DDS cannot be used.
    pub fn start(ros: &RosArgs) -> Result<Self> {
        Ok(Self { node: Node::start(&format!("operator_{}", std::process::id()), ros)? })
    }

    /// Finds a service.
    ///
    /// # Errors
    /// When nobody serves it.
    pub fn desk<S: RosService>(&self, service: &graph::Service<S>) -> Result<Desk<S>> {
        self.desk_within(service, TIMEOUT)
    }

    /// Finds a service that is there within some time.
    ///
    /// # Errors
    /// When nobody serves it.
    pub fn desk_within<S: RosService>(&self, service: &graph::Service<S>, patience: Duration) -> Result<Desk<S>> {
        let client = self.node.client(service)?;
        let node = service.entry.writers.first().unwrap_or(&"node");
        self.node
            .wait_for_service(&client, patience)
            .with_context(|| format!("no {} is flying in this domain", node.replace('_', " ")))?;
        Ok(Desk { client })
    }
}

impl<S: RosService> Desk<S> {
    /// Calls it, again and again until there is an answer: only for calls that do no harm when they come twice.
    ///
    /// # Errors
    /// When no answer comes in time.
    pub fn call(&self, request: S::Request) -> Result<S::Response> {
        Ok(self.client.call_repeatedly(request, ONE_TRY, TIMEOUT)?)
    }

    /// Calls it once, after `harmless` has been answered.
    ///
    /// # Errors
    /// When no answer comes in time.
    pub fn call_once(&self, harmless: S::Request, request: S::Request) -> Result<S::Response> {
        self.call(harmless)?;
        Ok(self.client.call(request, TIMEOUT)?)
    }
}

/// Fails with the reason of a call that was refused as a whole.
///
/// # Errors
/// When there is a reason.
pub fn check(reason_code: u16, reason: &str) -> Result<()> {
    if reason_code != 0 {
        bail!("{reason} (reason {reason_code})");
    }
    Ok(())
}
