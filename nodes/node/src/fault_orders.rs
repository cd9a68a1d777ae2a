//! Faults that are ordered while a mission flies, as every node of it knows them.

use anyhow::{Context, Result};
use swath_mission::faults::orders::Ordered;
use swath_msgs::swath_msgs as msg;
use swath_ros::Subscription;
use swath_sim::time::Tick;
use swath_sim::vehicle::faults::FOR_GOOD;

use crate::node::MissionNode;
use crate::patient::keep;
use crate::stamp::Stamper;

/// The file in which the spacecraft keeps what was ordered, for all nodes that are started again.
const KEPT: &str = "fault_orders.json";

impl MissionNode {
    /// Adds what was ordered before this node was started again to its mission, and returns it.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn take_up_fault_orders(&mut self) -> Result<Vec<Ordered>> {
        let Some(text) = self.kept(KEPT)? else { return Ok(Vec::new()) };
        let orders: Vec<Ordered> = serde_json::from_str(&text).with_context(|| format!("{KEPT} is damaged"))?;
        orders.iter().for_each(|order| _ = self.add_fault(order));
        Ok(orders)
    }

    /// Keeps all that was ordered for nodes that are started again; tells whether there was room for it.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn keep_fault_orders(&self, orders: &[Ordered]) -> Result<bool> {
        let Some(path) = self.keeps(KEPT) else { return Ok(true) };
        keep(&path, &serde_json::to_string(orders)?)
    }

    /// Takes in what was ordered; returns whether there was anything new.
    ///
    /// Orders have come before the first state at which they act: whoever calls this once a message has come that follows
    /// from such a state misses none.
    ///
    /// # Errors
    /// When DDS fails.
    pub fn take_fault_orders(&mut self) -> Result<bool> {
        let mut new = false;
        while let Some(message) = self.fault_orders.messages.as_ref().map_or(Ok(None), Subscription::take)? {
            for order in ordered(&message) {
                new |= self.add_fault(&order);
            }
        }
        Ok(new)
    }

    /// Adds a fault to the mission; returns whether it is new.
    pub fn add_fault(&mut self, order: &Ordered) -> bool {
        let period = self.model.period;
        let new = self.mission.faults.add(order.fault);
        if self.fault_orders.truth_from == FOR_GOOD && self.mission.tells_truth_apart(period) {
            self.fault_orders.truth_from = order.tick.after(1);
        }
        self.mind_own_faults();
        new
    }

    /// First tick whose state is told as it is, beside what is measured of it.
    #[must_use]
    pub fn truth_from(&self) -> Tick {
        self.fault_orders.truth_from
    }
}

/// The orders of a message; what is no fault is left out and told.
#[must_use]
pub fn ordered(message: &msg::FaultOrders) -> Vec<Ordered> {
    let read = |order: &msg::FaultOrder| match order.fault.parse() {
        Ok(fault) => Some(Ordered { tick: Tick(order.tick), actor: order.actor.clone(), fault }),
        Err(error) => {
            tracing::warn!("an order is passed over: {error}");
            None
        }
    };
    message.orders.iter().filter_map(read).collect()
}

/// Orders as a message.
#[must_use]
pub fn fault_orders(stamper: &Stamper, orders: &[Ordered]) -> msg::FaultOrders {
    let order = |order: &Ordered| msg::FaultOrder {
        ordered: stamper.time(order.tick),
        tick: order.tick.0,
        actor: order.actor.clone(),
        fault: order.fault.to_string(),
    };
    let last = orders.last().map_or(Tick(0), |order| order.tick);
    msg::FaultOrders { header: stamper.header(last, ""), orders: orders.iter().map(order).collect::<Vec<_>>() }
}

#[cfg(test)]
mod tests {
    use swath_sim::time::TickPeriod;

    use super::*;

    #[test]
    fn orders_are_read_as_they_were_told() {
        let stamper = Stamper::new(0, TickPeriod::from_frequency(2.0).unwrap());
        let order =
            |tick, fault: &str| Ordered { tick: Tick(tick), actor: "ana".into(), fault: fault.parse().unwrap() };
        let orders = [order(4, "wheel2:weak 33.3%@2.5s+60s"), order(9, "guidance:kill@7s")];
        let mut message = fault_orders(&stamper, &orders);
        assert_eq!(message.header.stamp, stamper.time(Tick(9)));
        assert_eq!(ordered(&message), orders);
        message.orders[0].fault = "wheel9:dead".to_owned();
        assert_eq!(ordered(&message), orders[1..]);
    }
}
