//! The mission's services, called for clients.

use std::sync::Mutex;
use std::sync::PoisonError;
use std::time::Duration;

use anyhow::{Context as _, Result, ensure};
use foxglove::Schema;
use foxglove::websocket::service::{Service, ServiceSchema};
use swath_bags::schema::{Schema as Definition, to_little_endian};
use swath_msgs::{RosMessage, RosService};
use swath_ros::{Cdr, Node, decode, encode, graph};

/// How long an answer may take.
const TIMEOUT: Duration = Duration::from_secs(10);

/// Every service of the table.
///
/// # Errors
/// When DDS cannot be used.
pub fn all(node: &Node) -> Result<Vec<Service>> {
    Ok(vec![
        offer(node, &graph::SUBMIT_STRIPS)?,
        offer(node, &graph::CANCEL_STRIPS)?,
        offer(node, &graph::REPLACE_STRIP)?,
        offer(node, &graph::REVIEW_STRIPS)?,
        offer(node, &graph::GET_STRIP)?,
        offer(node, &graph::LIST_STRIPS)?,
        offer(node, &graph::LIST_HISTORY)?,
        offer(node, &graph::PREVIEW_STRIP)?,
        offer(node, &graph::LIST_WAYS)?,
        offer(node, &graph::GET_LIMITS)?,
        offer(node, &graph::SET_PLANNER_MODE)?,
        offer(node, &graph::REVIEW_PROPOSAL)?,
        offer(node, &graph::ACKNOWLEDGE_ALARM)?,
        offer(node, &graph::SHELVE_ALARM)?,
        offer(node, &graph::UNSHELVE_ALARM)?,
        offer(node, &graph::LIST_ALARMS)?,
        offer(node, &graph::ORDER_FAULT)?,
    ])
}

fn offer<S: RosService>(node: &Node, service: &graph::Service<S>) -> Result<Service> {
    let name = node.names().resolve(service.entry.name)?;
    // One call at a time: an answer to another one would be taken for this one's and dropped.
    let client = Mutex::new(node.client(service)?);
    let call = move |cdr: &[u8]| -> Result<Vec<u8>> {
        let definition = Definition::parse(S::Request::TYPE_NAME, S::Request::SCHEMA)?;
        let request: S::Request = decode(&Cdr::from_bytes(to_little_endian(&definition, cdr)?))?;
        let client = client.lock().unwrap_or_else(PoisonError::into_inner);
        ensure!(client.matched(), "nobody serves {}", client.service());
        let answer = client.call(request, TIMEOUT).context("no answer")?;
        Ok(encode(&answer)?.as_bytes().to_vec())
    };
    let schema = ServiceSchema::new(S::TYPE_NAME)
        .with_request("cdr", schema::<S::Request>())
        .with_response("cdr", schema::<S::Response>());
    Ok(Service::builder(name, schema)
        .blocking_handler_fn(move |request| call(request.payload()).map_err(|error| format!("{error:#}"))))
}

fn schema<M: RosMessage>() -> Schema {
    Schema::new(M::TYPE_NAME, "ros2msg", M::SCHEMA.as_bytes())
}
