//! The request manager's topics where there is a radio: what the ground hears and sends, tick by tick.

use anyhow::Result;
use swath_mission::link::end::Sent;
use swath_mission::link::passes::Pass;
use swath_msgs::rosgraph_msgs::Clock;
use swath_msgs::swath_msgs as msg;
use swath_node::node::{MissionNode, Severity};
use swath_node::stamp::EARTH_FRAME;
use swath_ros::{Publisher, Subscription, graph};
use swath_sim::time::Tick;

use super::ground_end::GroundEnd;
use super::ways::{all_passes, plan, status};

/// Time between two reports of a radio that is open [s].
const STATUS_S: f64 = 60.0;

/// The topics of the radio.
pub(super) struct RadioSide {
    turns: Subscription<msg::RadioTurn>,
    sent: Publisher<msg::RadioSent>,
    clock: Subscription<Clock>,
    status: Publisher<msg::LinkStatus>,
    plan: Publisher<msg::PredictedPlan>,
    /// How often flight and prediction have parted, as it was told last.
    parted: usize,
    passes: Vec<Pass>,
    open: bool,
    /// When and how the radio was told of last: tick, whether it was open, and what waited.
    told: Option<(Tick, bool, u64)>,
    begun: bool,
}

impl RadioSide {
    pub(super) fn new(base: &MissionNode) -> Result<Self> {
        Ok(Self {
            turns: base.node.subscription(&graph::GROUND_TURN)?,
            sent: base.node.publisher(&graph::GROUND_SENT)?,
            clock: base.node.subscription(&graph::CLOCK)?,
            status: base.node.publisher(&graph::LINK_STATUS)?,
            plan: base.node.publisher(&graph::PREDICTED_PLAN)?,
            parted: 0,
            passes: all_passes(&base.mission, &base.model),
            open: false,
            told: None,
            begun: false,
        })
    }

    /// Whether the mission has begun.
    pub(super) fn begun(&self) -> bool {
        self.begun
    }

    /// The next tick of the radio that is news, once its frames are heard, unless the ground is deaf; what is sent
    /// follows.
    pub(super) fn take(&mut self, end: &mut GroundEnd, base: &MissionNode, deaf: bool) -> Result<Option<(Tick, bool)>> {
        while let Some(clock) = self.clock.take()? {
            end.at(base.stamper.tick_from(&clock.clock));
        }
        while let Some(turn) = self.turns.take()? {
            if base.strikes_at().is_some_and(|at| Tick(turn.tick) >= at) {
                base.strike();
            }
            let tick = match base.tick(turn.tick) {
                Ok(tick) => tick,
                Err(error) => {
                    base.alarm(Severity::Error, "radio refused", &error.to_string())?;
                    continue;
                }
            };
            base.set_now(tick);
            let frames = turn.frames.iter().filter(|_| !deaf).map(|frame| frame.data.to_vec()).collect();
            if end.hear(tick, Tick(turn.next), frames) {
                self.open = turn.open;
                return Ok(Some((tick, turn.open)));
            }
            // The answer may have been lost.
            if let Some(sent) = end.sent_at(tick) {
                self.send(&message(base, tick, sent))?;
            }
        }
        Ok(None)
    }

    /// Tells how the radio stands: whenever it opens or closes, every minute while it is open, and when more waits.
    pub(super) fn tell_status(&mut self, end: &GroundEnd, base: &MissionNode) -> Result<()> {
        let (now, waiting) = (end.now(), end.ground().waiting());
        let every = i64::from(base.model.period.ticks_ceil(STATUS_S));
        let same = |(tick, open, waited): (Tick, bool, u64)| {
            open == self.open && if open { now.since(tick) < every } else { waited == waiting }
        };
        if self.told.is_some_and(same) {
            return Ok(());
        }
        self.told = Some((now, self.open, waiting));
        Ok(self.status.publish(&status(end.ground(), &base.stamper, now, self.open, &self.passes))?)
    }

    /// Tells what the satellite is going to do, when the mirror has said so.
    pub(super) fn tell_plan(&mut self, end: &mut GroundEnd, base: &MissionNode) -> Result<()> {
        let Some(foresight) = end.foresight_mut() else { return Ok(()) };
        match foresight.take() {
            Ok(None) => {}
            Ok(Some(foreseen)) => {
                let plan = plan(&base.stamper, &foreseen);
                let partings = foreseen.score.partings.len();
                if std::mem::replace(&mut self.parted, partings) < partings {
                    tracing::info!("flight and prediction have parted: {}", plan.parted_reason);
                }
                self.plan.publish(&plan)?;
            }
            Err(error) => {
                end.end_foresight();
                base.alarm(Severity::Warn, "no prediction", &error.to_string())?;
            }
        }
        Ok(())
    }

    pub(super) fn send(&mut self, sent: &msg::RadioSent) -> Result<()> {
        self.begun = true;
        Ok(self.sent.publish(sent)?)
    }
}

/// What the ground sends at a tick.
pub(super) fn message(base: &MissionNode, tick: Tick, sent: Vec<Sent>) -> msg::RadioSent {
    let frame = |sent: Sent| msg::RadioFrame { data: sent.bytes, air_ticks: sent.air_ticks };
    msg::RadioSent {
        header: base.stamper.header(tick, EARTH_FRAME),
        tick: tick.0,
        frames: sent.into_iter().map(frame).collect::<Vec<_>>(),
    }
}
