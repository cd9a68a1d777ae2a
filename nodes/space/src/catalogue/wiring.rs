//! The on-board catalogue's topics, and its memory.

use std::time::Duration;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use swath_mission::alarms::conditions::of_ground;
use swath_mission::link::catalogue::Catalogue;
use swath_mission::link::radio::Radio;
use swath_mission::requests::logic::RequestLogic;
use swath_msgs::swath_msgs as msg;
use swath_node::lifecycle::{self, LifecycleNode};
use swath_node::messages::upcoming::upcoming_strips;
use swath_node::node::{MissionNode, Severity};
use swath_node::program::Program;
use swath_ros::{Publisher, Subscription, graph};
use swath_sim::task::TaskRecord;
use swath_sim::time::Tick;

use super::logic::{CatalogueLogic, Effect};
use super::messages;
use crate::journal::Journal;
use crate::link::messages::{radio_sent, turn};

/// The node as a program.
const PROGRAM: Program = Program {
    node: graph::CATALOGUE,
    name: "swath-catalogue",
    about: "The on-board catalogue: keeps the strips that were uplinked, and what became of them",
    parameters: &[],
};

/// How long nothing comes before what was said last is said again.
const AGAIN_AFTER: Duration = Duration::from_millis(500);
/// The file in which the catalogue keeps all that it has taken in.
const KEPT: &str = "catalogue.journal";

/// Runs the catalogue until it is asked to end.
///
/// # Errors
/// When the node cannot come up, the mission has no `[link]`, what was kept cannot be read, or DDS fails.
pub fn run() -> Result<()> {
    let base = MissionNode::start(&PROGRAM)?;
    base.node.parameters().check_given()?;
    lifecycle::run(base, CatalogueNode::new)
}

/// What the catalogue takes in: all that it knows follows from it.
#[derive(Clone, Debug, Serialize, Deserialize)]
enum Taken {
    Turn(msg::RadioTurn),
    Reached(msg::GuidanceReached),
    Point(Box<msg::DecisionPoint>),
}

impl Taken {
    fn tick(&self) -> Tick {
        match self {
            Self::Turn(turn) => Tick(turn.tick),
            Self::Reached(reached) => Tick(reached.tick),
            Self::Point(point) => Tick(point.tick),
        }
    }
}

/// What was said last.
#[derive(Default)]
struct Said {
    heard: Option<msg::CatalogueHeard>,
    sent: Option<msg::RadioSent>,
    offer: Option<msg::UpcomingStrips>,
    settled: Option<msg::TaskResult>,
}

struct CatalogueNode {
    logic: CatalogueLogic,
    said: Said,
    /// There is one where somebody would start the node again.
    journal: Option<Journal<Taken>>,
    turns: Subscription<msg::RadioTurn>,
    points: Subscription<msg::DecisionPoint>,
    reached: Subscription<msg::GuidanceReached>,
    heard: Publisher<msg::CatalogueHeard>,
    sent: Publisher<msg::RadioSent>,
    upcoming: Publisher<msg::UpcomingStrips>,
    results: Publisher<msg::TaskResult>,
    /// Whether the ground was silent when it was told last.
    silent: bool,
    /// One who rests offers nothing; guidance asks again.
    offers: bool,
    base: MissionNode,
}

impl CatalogueNode {
    fn new(base: MissionNode) -> Result<Self> {
        let radio =
            Radio::of(&base.mission, &base.model)?.context("the mission has no [link]: it needs no catalogue")?;
        let requests =
            RequestLogic::new((*base.model).clone(), &base.mission.initial(), base.horizon, base.mission.rules());
        let catalogue = Catalogue::new(requests, radio.rates().1, radio.config(), base.model.period);
        let (mut journal, mut kept) = (None, Vec::new());
        if let Some(path) = base.keeps(KEPT) {
            let (opened, before) = Journal::open(&path, base.goes_on())?;
            (journal, kept) = (Some(opened), before);
        }
        let mut node = Self {
            logic: CatalogueLogic::new(catalogue),
            said: Said::default(),
            journal,
            turns: base.node.subscription(&graph::SATELLITE_TURN)?,
            points: base.node.subscription(&graph::DECISION_POINT)?,
            reached: base.node.subscription(&graph::GUIDANCE_REACHED)?,
            heard: base.node.publisher(&graph::CATALOGUE_HEARD)?,
            sent: base.node.publisher(&graph::SATELLITE_SENT)?,
            upcoming: base.node.publisher(&graph::UPCOMING_STRIPS)?,
            results: base.node.publisher(&graph::TASK_RESULTS)?,
            // What the one before has told may be over.
            silent: base.goes_on(),
            offers: false,
            base,
        };
        node.take_up(&kept)?;
        Ok(node)
    }

    /// Goes through what the one before has taken in; what that one has said last is said again.
    fn take_up(&mut self, kept: &[Taken]) -> Result<()> {
        for taken in kept {
            for effect in self.apply(taken)? {
                self.note(taken, &effect);
            }
        }
        if !kept.is_empty() {
            tracing::info!("{} requests are on board", self.logic.catalogue().requests().len());
        }
        Ok(())
    }

    fn work(&mut self) -> Result<()> {
        while let Some(message) = self.turns.take()? {
            match turn(&message, self.base.horizon) {
                Ok(turn) if self.logic.awaits_turn(turn.tick) => self.take(Taken::Turn(message))?,
                // What was said may have been lost, to the radio or to guidance.
                Ok(_) => self.say_again()?,
                Err(error) => self.base.alarm(Severity::Error, "radio refused", &error.to_string())?,
            }
        }
        while let Some(message) = self.points.take()? {
            let last = self.said.offer.as_ref().filter(|last| last.task == message.task && !message.mission_over);
            if let Some(last) = last {
                // The question again: the answer may have been lost.
                if self.offers {
                    self.upcoming.publish(last)?;
                }
            } else if let Err(error) = self.base.tick(message.tick).and_then(|_| messages::point(&message)) {
                self.base.alarm(Severity::Error, "decision point refused", &error.to_string())?;
            } else if self.logic.awaits_point(message.task) {
                self.take(Taken::Point(Box::new(message)))?;
            }
        }
        while let Some(message) = self.reached.take()? {
            if let Err(error) = self.base.tick(message.tick) {
                self.base.alarm(Severity::Error, "state of guidance refused", &error.to_string())?;
            } else if self.logic.awaits_reached(&messages::reached(&message)) {
                self.take(Taken::Reached(message))?;
            }
        }
        if !self.base.wait(AGAIN_AFTER)? {
            self.say_again()?;
        }
        Ok(())
    }

    /// Takes something in: first it is kept, then what follows is said.
    fn take(&mut self, taken: Taken) -> Result<()> {
        self.base.take_fault_orders()?;
        // What is not kept here is told again.
        if self.base.strikes_at().is_some_and(|at| taken.tick() >= at) {
            self.base.strike();
        }
        if let Some(journal) = &mut self.journal {
            journal.add(&taken)?;
        }
        let over = matches!(&taken, Taken::Point(point) if point.mission_over);
        for effect in self.apply(&taken)? {
            self.note(&taken, &effect);
            match effect {
                Effect::Heard(_) => self.heard.publish(self.said.heard.as_ref().context("nothing was heard")?)?,
                Effect::Sent(..) => self.sent.publish(self.said.sent.as_ref().context("nothing was sent")?)?,
                Effect::Offer(_) if over || !self.offers => {}
                Effect::Offer(_) => self.upcoming.publish(self.said.offer.as_ref().context("there is no offer")?)?,
                Effect::Settled(..) => {
                    self.results.publish(self.said.settled.as_ref().context("nothing is settled")?)?
                }
            }
        }
        for contradiction in self.logic.catalogue_mut().take_contradictions() {
            self.base.alarm(Severity::Error, "contradiction", &contradiction.to_string())?;
        }
        match &taken {
            Taken::Point(point) => self.report_ground(Tick(point.tick)),
            _ => Ok(()),
        }
    }

    fn apply(&mut self, taken: &Taken) -> Result<Vec<Effect>> {
        Ok(match taken {
            Taken::Turn(message) => self.logic.on_turn(turn(message, self.base.horizon)?),
            Taken::Reached(message) => self.logic.on_reached(messages::reached(message)),
            Taken::Point(message) => {
                self.base.set_now(Tick(message.tick));
                self.logic.on_point(&messages::point(message)?)
            }
        })
    }

    fn note(&mut self, taken: &Taken, effect: &Effect) {
        let stamper = &self.base.stamper;
        match effect {
            Effect::Heard(heard) => self.said.heard = Some(messages::catalogue_heard(stamper, heard)),
            Effect::Sent(tick, sent) => self.said.sent = Some(radio_sent(stamper, *tick, sent)),
            Effect::Offer(offer) => {
                let requests = self.logic.catalogue().requests();
                let order = |id| requests.request(id).map(|request| &request.order);
                self.said.offer = Some(upcoming_strips(stamper, offer, |candidate| order(candidate.id)));
            }
            Effect::Settled(record, reward) => self.said.settled = result_of(taken, record, *reward),
        }
    }

    fn say_again(&self) -> Result<()> {
        self.said.settled.iter().try_for_each(|result| self.results.publish(result))?;
        self.said.heard.iter().try_for_each(|heard| self.heard.publish(heard))?;
        Ok(self.said.sent.iter().try_for_each(|sent| self.sent.publish(sent))?)
    }

    /// Tells whether the ground is silent, when that has changed.
    fn report_ground(&mut self, now: Tick) -> Result<()> {
        let silent = self.logic.catalogue().command_lost(now);
        if std::mem::replace(&mut self.silent, silent) == silent {
            return Ok(());
        }
        self.base.condition(&of_ground(now, self.logic.catalogue().heard(), silent))
    }
}

impl LifecycleNode for CatalogueNode {
    fn base(&self) -> &MissionNode {
        &self.base
    }

    fn activate(&mut self) -> Result<()> {
        self.offers = true;
        self.say_again()
    }

    fn deactivate(&mut self) -> Result<()> {
        self.offers = false;
        Ok(())
    }

    fn turn(&mut self) -> Result<()> {
        self.work()
    }

    /// What comes over the radio and what ends is still taken in.
    fn rest(&mut self) -> Result<()> {
        self.work()
    }

    fn end(self) -> Result<MissionNode> {
        Ok(self.base)
    }
}

/// The message of how a task went, with its reward.
fn result_of(taken: &Taken, record: &TaskRecord, reward: f64) -> Option<msg::TaskResult> {
    let Taken::Point(point) = taken else { return None };
    let ended = point.last_imaging.iter().chain(&point.result).find(|result| result.task == record.task)?;
    Some(msg::TaskResult { reward, ..ended.clone() })
}
