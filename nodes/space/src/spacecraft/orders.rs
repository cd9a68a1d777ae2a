//! Faults that operators order while the spacecraft flies: it owns the clock, so it says from which tick on they act.

use std::time::Duration;

use anyhow::{Result, bail};
use swath_mission::faults::orders::Ordered;
use swath_msgs::swath_msgs as msg;
use swath_node::fault_orders::fault_orders;
use swath_node::node::MissionNode;
use swath_ros::{Publisher, Server, graph};
use swath_sim::time::Tick;

/// How long the other nodes may take to hear of an order before time goes on; less than after what a node counts as silent.
const FLUSH_TIMEOUT: Duration = Duration::from_millis(1500);

/// The service that takes orders, and the topic that tells of them.
pub(super) struct OrderDesk {
    server: Server<msg::OrderFault>,
    orders: Publisher<msg::FaultOrders>,
    taken: Vec<Ordered>,
}

impl OrderDesk {
    /// Opens service and topic, and tells what was ordered before this spacecraft was started again.
    pub(super) fn new(base: &mut MissionNode) -> Result<Self> {
        let taken = base.take_up_fault_orders()?;
        let server = base.node.server(&graph::ORDER_FAULT)?;
        let desk = Self { server, orders: base.node.publisher(&graph::FAULT_ORDERS)?, taken };
        if !desk.taken.is_empty() {
            desk.orders.publish(&fault_orders(&base.stamper, &desk.taken))?;
        }
        Ok(desk)
    }

    /// Takes the orders that have come; returns whether there were any.
    pub(super) fn take(&mut self, base: &mut MissionNode, now: Tick) -> Result<bool> {
        let before = self.taken.len();
        while let Some((id, call)) = self.server.take()? {
            let answer = match self.order(base, &call, now) {
                Ok(answer) => answer,
                Err(reason) => {
                    // Who orders nothing only looks whether somebody answers.
                    if !call.fault.is_empty() {
                        tracing::info!("{} orders {:?}, which is refused: {reason}", call.actor, call.fault);
                    }
                    msg::OrderFaultResponse { reason: reason.to_string(), ..Default::default() }
                }
            };
            self.server.respond(id, answer)?;
        }
        Ok(self.taken.len() > before)
    }

    /// An order counts once it is kept, and once every node has heard of it.
    fn order(
        &mut self,
        base: &mut MissionNode,
        call: &msg::OrderFaultRequest,
        now: Tick,
    ) -> Result<msg::OrderFaultResponse> {
        let (horizon, period) = (base.horizon, base.model.period);
        let mut plan = base.mission.faults.clone();
        let (order, scheduled) = plan.take_order(&call.fault, &call.actor, now, horizon, period)?;
        if base.mission.link.is_none() {
            plan.fits_no_radio()?;
        }
        let all: Vec<Ordered> = self.taken.iter().cloned().chain([order.clone()]).collect();
        if !base.keep_fault_orders(&all)? {
            bail!("there is no room to keep it, and what is not kept is not ordered");
        }
        self.taken = all;
        base.add_fault(&order);
        tracing::info!("{} orders {}", order.actor, order.fault);
        self.orders.publish(&fault_orders(&base.stamper, &self.taken))?;
        if !self.orders.flush(FLUSH_TIMEOUT) {
            tracing::warn!("not every node has heard of {}: it may act there later", order.fault);
        }
        Ok(msg::OrderFaultResponse {
            accepted: true,
            reason: String::new(),
            fault: order.fault.to_string(),
            tick: scheduled.from.0,
            begins: base.stamper.time(scheduled.from),
        })
    }
}
