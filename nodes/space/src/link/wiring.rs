//! The link node's topics.

use std::time::Duration;

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use swath_mission::link::channel::Channel;
use swath_mission::link::radio::{Direction, Radio};
use swath_msgs::swath_msgs as msg;
use swath_node::lifecycle::{self, LifecycleNode};
use swath_node::node::MissionNode;
use swath_node::program::Program;
use swath_ros::{Publisher, Subscription, graph};
use swath_sim::time::Tick;

use super::logic::LinkLogic;
use super::messages;
use crate::journal::Journal;

/// The node as a program.
const PROGRAM: Program = Program {
    node: graph::LINK,
    name: "swath-link",
    about: "The radio between ground and satellite, in missions with [link]",
    parameters: &[],
};

/// How long an end that does not answer waits before it is told again.
const AGAIN_AFTER: Duration = Duration::from_millis(300);
/// The file in which the link keeps what both ends have sent.
const KEPT: &str = "link.journal";

/// Runs the link node until it is asked to end.
///
/// # Errors
/// When the node cannot come up, the mission has no `[link]`, or DDS fails.
pub fn run() -> Result<()> {
    let base = MissionNode::start(&PROGRAM)?;
    base.node.parameters().check_given()?;
    lifecycle::run(base, LinkNode::new)
}

/// What an end has sent, as it is kept.
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    up: bool,
    sent: msg::RadioSent,
}

struct LinkNode {
    logic: LinkLogic,
    /// There is one where somebody would start the node again.
    journal: Option<Journal<Kept>>,
    from_ground: Subscription<msg::RadioSent>,
    from_satellite: Subscription<msg::RadioSent>,
    to_ground: Publisher<msg::RadioTurn>,
    to_satellite: Publisher<msg::RadioTurn>,
    /// Ticks of which the satellite and the ground were told last.
    told: [Option<Tick>; 2],
    base: MissionNode,
}

impl LinkNode {
    fn new(base: MissionNode) -> Result<Self> {
        let radio = Radio::of(&base.mission, &base.model)?.context("the mission has no [link]: it needs no radio")?;
        let mut logic = LinkLogic::new(Channel::new(radio), base.horizon);
        let (mut journal, mut kept) = (None, Vec::new());
        if let Some(path) = base.keeps(KEPT) {
            let (opened, before) = Journal::open(&path, base.goes_on())?;
            (journal, kept) = (Some(opened), before);
        }
        for Kept { up, sent } in &kept {
            logic.on_sent(direction(*up), Tick(sent.tick), messages::sent(sent));
        }
        Ok(Self {
            logic,
            journal,
            from_ground: base.node.subscription(&graph::GROUND_SENT)?,
            from_satellite: base.node.subscription(&graph::SATELLITE_SENT)?,
            to_ground: base.node.publisher(&graph::GROUND_TURN)?,
            to_satellite: base.node.publisher(&graph::SATELLITE_TURN)?,
            told: [None; 2],
            base,
        })
    }

    fn work(&mut self) -> Result<()> {
        while let Some(sent) = self.from_satellite.take()? {
            self.take(false, sent)?;
        }
        while let Some(sent) = self.from_ground.take()? {
            self.take(true, sent)?;
        }
        self.tell()?;
        if !self.base.wait(AGAIN_AFTER)? {
            self.told = [None; 2];
        }
        Ok(())
    }

    fn take(&mut self, up: bool, sent: msg::RadioSent) -> Result<()> {
        let (direction, tick) = (direction(up), Tick(sent.tick));
        if !self.logic.awaits(direction, tick) {
            return Ok(());
        }
        if self.base.take_fault_orders()? {
            self.logic.disturb(&self.base.mission.faults);
        }
        // Both ends say again what is not kept here.
        if self.base.strikes_at().is_some_and(|at| tick >= at) {
            self.base.strike();
        }
        let kept = Kept { up, sent };
        if let Some(journal) = &mut self.journal {
            journal.add(&kept)?;
        }
        self.logic.on_sent(direction, tick, messages::sent(&kept.sent));
        self.base.set_now(tick);
        Ok(())
    }

    /// Tells both ends what they hear, unless they were just told.
    fn tell(&mut self) -> Result<()> {
        for (at, direction) in [Direction::Up, Direction::Down].into_iter().enumerate() {
            let Some(turn) = self.logic.turn(direction) else { continue };
            if self.told[at].replace(turn.tick) == Some(turn.tick) {
                continue;
            }
            let topic = if direction == Direction::Up { &self.to_satellite } else { &self.to_ground };
            topic.publish(&messages::radio_turn(&self.base.stamper, &turn))?;
        }
        Ok(())
    }
}

impl LifecycleNode for LinkNode {
    fn base(&self) -> &MissionNode {
        &self.base
    }

    fn deactivate(&mut self) -> Result<()> {
        bail!(
            "without the radio neither ground nor satellite knows that time passes: a link that drops all is a fault by order"
        )
    }

    fn turn(&mut self) -> Result<()> {
        self.work()
    }

    /// It has not been activated yet: nobody is told anything.
    fn rest(&mut self) -> Result<()> {
        self.base.wait(AGAIN_AFTER)?;
        Ok(())
    }

    fn end(self) -> Result<MissionNode> {
        Ok(self.base)
    }
}

fn direction(up: bool) -> Direction {
    if up { Direction::Up } else { Direction::Down }
}
