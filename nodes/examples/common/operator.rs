//! An operator who asks for strips as long as a mission flies, and notes what is acknowledged.

use std::collections::BTreeMap;
use std::time::Duration;

use anyhow::{Result, ensure};
use swath_msgs::swath_msgs as msg;
use swath_ros::{Client, Environment, Node, RosArgs, graph};

use super::request::request;

/// How long an answer may take before the call is made again.
const PATIENCE: Duration = Duration::from_millis(500);
/// Who asks.
pub const SUBMITTER: &str = "chaos";
/// Requests of a call.
const BATCH: u64 = 5;

/// What was acknowledged, and how long the mission took.
pub struct Acknowledged {
    /// Numbers by reference.
    pub requests: BTreeMap<String, u64>,
    /// Wall time [s].
    pub seconds: f64,
}

/// The operator.
pub struct Operator {
    client: Client<msg::SubmitStrips>,
    next: u64,
    /// Numbers by reference of what was acknowledged.
    pub acknowledged: BTreeMap<String, u64>,
    _node: Node,
}

impl Operator {
    /// Comes up in a domain.
    pub fn start(domain: u16) -> Result<Self> {
        Self::start_in(Environment { domain, localhost_only: true, ..Environment::read()? })
    }

    /// Comes up in an environment.
    pub fn start_in(environment: Environment) -> Result<Self> {
        let node = Node::start_in(environment, "chaos_operator", &RosArgs::default())?;
        let client = node.client(&graph::SUBMIT_STRIPS)?;
        Ok(Self { client, next: 0, acknowledged: BTreeMap::new(), _node: node })
    }

    /// Asks for some strips; without an answer, for the same ones the next time.
    pub fn turn(&mut self) -> Result<()> {
        let requests: Vec<_> = (self.next..self.next + BATCH).map(|number| request(SUBMITTER, number)).collect();
        let call = msg::SubmitStripsRequest { requests: requests.clone() };
        let Ok(answer) = self.client.call(call, PATIENCE) else { return Ok(()) };
        if answer.reason_code != 0 {
            // There is no room for them: they are asked for again.
            std::thread::sleep(Duration::from_millis(50));
            return Ok(());
        }
        for (request, result) in requests.iter().zip(&answer.results).filter(|(_, result)| result.accepted) {
            let id = *self.acknowledged.entry(request.client_ref.clone()).or_insert(result.id);
            ensure!(id == result.id, "{} was acknowledged as {id} and as {}", request.client_ref, result.id);
        }
        self.next += BATCH;
        std::thread::sleep(Duration::from_millis(20));
        Ok(())
    }
}
