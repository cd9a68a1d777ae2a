//! What a node hears of faults that are ordered while a mission flies.

use anyhow::Result;
use swath_msgs::swath_msgs as msg;
use swath_ros::{Node, Subscription, graph};
use swath_sim::time::Tick;
use swath_sim::vehicle::faults::FOR_GOOD;

/// What a node knows of orders.
pub(crate) struct FaultOrders {
    /// There are none for the spacecraft, which takes them.
    pub(crate) messages: Option<Subscription<msg::FaultOrders>>,
    /// First tick whose state is told as it is, beside what is measured of it.
    pub(crate) truth_from: Tick,
}

impl FaultOrders {
    /// What a node of this name hears; `told` is whether the truth is told apart from the start.
    pub(crate) fn new(node: &Node, name: &str, told: bool) -> Result<Self> {
        let hears = graph::FAULT_ORDERS.entry.readers.contains(&name);
        Ok(Self {
            messages: hears.then(|| node.subscription(&graph::FAULT_ORDERS)).transpose()?,
            truth_from: if told { Tick(0) } else { FOR_GOOD },
        })
    }
}
