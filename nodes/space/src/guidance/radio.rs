//! Where there is a radio: guidance looks at a state once the radio has been heard up to its tick.

use std::time::{Duration, Instant};

use anyhow::Result;
use swath_mission::file::PACED_PATIENCE;
use swath_mission::requests::journal::InFlight;
use swath_msgs::swath_msgs as msg;
use swath_node::node::MissionNode;
use swath_ros::{Publisher, Subscription, graph};
use swath_sim::time::Tick;

use crate::catalogue::messages::guidance_reached;

/// How long guidance waits for the catalogue before it says again how far it has flown.
const AGAIN_AFTER: Duration = Duration::from_millis(300);

/// What guidance knows of the radio.
pub(super) struct RadioGate {
    heard: Subscription<msg::CatalogueHeard>,
    reached: Publisher<msg::GuidanceReached>,
    /// Up to this tick nothing more is heard; nothing before the catalogue has said anything.
    through: Option<Tick>,
    /// The last tick that the catalogue was told of.
    told: Option<Tick>,
    /// A state that waits, since when, and when the catalogue was told last.
    waits: Option<(Tick, Instant, Instant)>,
    paced: bool,
}

impl RadioGate {
    /// The gate of a mission; none without a radio.
    pub(super) fn new(base: &MissionNode, pace: f64) -> Result<Option<Self>> {
        if base.mission.link.is_none() {
            return Ok(None);
        }
        Ok(Some(Self {
            heard: base.node.subscription(&graph::CATALOGUE_HEARD)?,
            reached: base.node.publisher(&graph::GUIDANCE_REACHED)?,
            through: None,
            told: None,
            waits: None,
            paced: pace > 0.0,
        }))
    }

    /// What the catalogue says next.
    pub(super) fn take(&mut self) -> Result<Option<msg::CatalogueHeard>> {
        let heard = self.heard.take()?;
        if let Some(heard) = &heard {
            self.through = self.through.max(Some(Tick(heard.through)));
        }
        Ok(heard)
    }

    /// Whether guidance may look at a state; `flown` is the task in hand, and nothing where one is wanted. In a paced
    /// mission it does not wait for ever: what is heard later counts later.
    pub(super) fn may_look(&mut self, base: &MissionNode, tick: Tick, flown: Option<Option<InFlight>>) -> Result<bool> {
        if self.through.is_some_and(|through| tick <= through) {
            self.waits = None;
            return Ok(true);
        }
        let now = Instant::now();
        let (since, told) = match self.waits {
            Some((waiting, since, told)) if waiting == tick => (since, told),
            _ => (now, now),
        };
        if self.paced && since.elapsed() >= PACED_PATIENCE {
            return Ok(true);
        }
        self.waits = Some((tick, since, told));
        // Nobody else will tell the catalogue of states that were never looked at.
        let before = tick.0.checked_sub(1).map(Tick);
        if let (Some(before), Some(flown)) = (before, flown)
            && (self.told < Some(before) || told.elapsed() >= AGAIN_AFTER)
        {
            self.waits = Some((tick, since, now));
            self.tell(base, before, flown)?;
        }
        Ok(false)
    }

    /// Guidance has answered a state: the catalogue is told where it waits for that.
    pub(super) fn answered(&mut self, base: &MissionNode, tick: Tick, flown: Option<InFlight>) -> Result<()> {
        match self.through.is_none_or(|through| tick >= through) {
            true => self.tell(base, tick, flown),
            false => Ok(()),
        }
    }

    fn tell(&mut self, base: &MissionNode, tick: Tick, flown: Option<InFlight>) -> Result<()> {
        self.told = self.told.max(Some(tick));
        Ok(self.reached.publish(&guidance_reached(&base.stamper, tick, flown))?)
    }

    /// How long a state that waits may wait until it is looked at again.
    pub(super) fn patience(&self) -> Option<Duration> {
        self.waits.map(|_| if self.paced { PACED_PATIENCE / 4 } else { AGAIN_AFTER })
    }
}
