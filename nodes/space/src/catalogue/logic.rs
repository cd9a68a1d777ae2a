//! The on-board catalogue as a node, without ROS: what the radio brings, what guidance flies, and what is sent, tick by
//! tick in the order in which a mission in one process has them.

use swath_mission::link::catalogue::Catalogue;
use swath_mission::link::end::Sent;
use swath_mission::requests::journal::InFlight;
use swath_mission::requests::lifecycle::State;
use swath_mission::requests::logic::{Abort, Offer};
use swath_sim::task::TaskRecord;
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::Situation;

use crate::link::logic::Turn;

/// How far guidance has flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reached {
    /// The last tick with a command.
    pub tick: Tick,
    /// The task in hand, if it images a strip.
    pub flown: Option<InFlight>,
}

/// A task is wanted, or the mission is over.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Number of the task wanted.
    pub task: u64,
    /// What is known of the satellite.
    pub situation: Situation,
    /// Tasks that have ended, also ones that are known.
    pub results: Vec<TaskRecord>,
}

/// What guidance must know.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Heard {
    /// Up to this tick nothing more is heard.
    pub through: Tick,
    /// A task that is no longer wanted, and why.
    pub abort: Option<(u64, String)>,
    /// A task that is not given out: nothing was heard of the ground for too long.
    pub hold: Option<u64>,
}

/// What follows.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Guidance may go on.
    Heard(Heard),
    /// Frames leave at a tick.
    Sent(Tick, Vec<Sent>),
    /// The planner chooses among these.
    Offer(Offer),
    /// A task has ended, with its reward.
    Settled(TaskRecord, f64),
}

/// The on-board catalogue.
#[derive(Clone, Debug)]
pub struct CatalogueLogic {
    catalogue: Catalogue,
    /// What the radio brings next, for which guidance has not flown far enough.
    coming: Option<Turn>,
    /// The radio's tick that was heard last, and whether something may still be sent at it.
    heard: Option<(Tick, bool)>,
    /// The last tick with a command of guidance.
    reached: Option<Tick>,
    /// The task in hand, and when its imaging begins, until it has.
    flown: Option<InFlight>,
    imaging: Option<Tick>,
    /// Tasks below this number are settled.
    settled: u64,
    /// The last task that was wanted.
    wanted: Option<u64>,
    told: Heard,
}

impl CatalogueLogic {
    /// The node around a catalogue.
    #[must_use]
    pub fn new(catalogue: Catalogue) -> Self {
        Self {
            catalogue,
            coming: None,
            heard: None,
            reached: None,
            flown: None,
            imaging: None,
            settled: 0,
            wanted: None,
            told: Heard::default(),
        }
    }

    /// The catalogue.
    #[must_use]
    pub fn catalogue(&self) -> &Catalogue {
        &self.catalogue
    }

    /// The same, for what it reports.
    pub fn catalogue_mut(&mut self) -> &mut Catalogue {
        &mut self.catalogue
    }

    /// Whether a tick of the radio is news.
    #[must_use]
    pub fn awaits_turn(&self, tick: Tick) -> bool {
        let last = self.coming.as_ref().map(|turn| turn.tick).or(self.heard.map(|(tick, _)| tick));
        last.is_none_or(|last| tick > last)
    }

    /// Whether it is news that guidance has flown so far.
    #[must_use]
    pub fn awaits_reached(&self, reached: &Reached) -> bool {
        self.reached.is_none_or(|before| reached.tick > before)
    }

    /// Whether it is news that a task is wanted.
    #[must_use]
    pub fn awaits_point(&self, task: u64) -> bool {
        self.wanted.is_none_or(|wanted| task > wanted)
    }

    /// The radio comes to a tick.
    pub fn on_turn(&mut self, turn: Turn) -> Vec<Effect> {
        let mut effects = Vec::new();
        if self.awaits_turn(turn.tick) {
            self.coming = Some(turn);
            self.hear(&mut effects);
        }
        effects
    }

    /// Guidance has flown up to a tick.
    pub fn on_reached(&mut self, reached: Reached) -> Vec<Effect> {
        let mut effects = Vec::new();
        if self.awaits_reached(&reached) {
            self.reached = Some(reached.tick);
            if let Some(flown) = reached.flown {
                self.fly(flown);
            }
            self.image_until(reached.tick.after(1));
            self.send_up_to(reached.tick, &mut effects);
            self.hear(&mut effects);
        }
        effects
    }

    /// A task is wanted: what has ended counts, then what was to be sent leaves, then the planner may choose.
    pub fn on_point(&mut self, point: &Point) -> Vec<Effect> {
        let mut effects = Vec::new();
        if !self.awaits_point(point.task) {
            return effects;
        }
        self.wanted = Some(point.task);
        let now = point.situation.now;
        self.send_up_to(Tick(now.0.saturating_sub(1)), &mut effects);
        for record in point.results.iter().filter(|record| record.task < point.task) {
            self.settle(record, &mut effects);
        }
        self.send_up_to(now, &mut effects);
        let holds = self.catalogue.holds(now);
        let offer = self.catalogue.on_decision_point(point.task, &point.situation);
        if holds {
            self.told.hold = Some(point.task);
            effects.push(Effect::Heard(self.told.clone()));
        } else {
            effects.push(Effect::Offer(offer));
        }
        effects
    }

    fn settle(&mut self, record: &TaskRecord, effects: &mut Vec<Effect>) {
        if record.task < self.settled {
            return;
        }
        self.settled = record.task + 1;
        if let Some(id) = record.strip {
            let TaskRecord { task, start, t_pre, t_acq, .. } = *record;
            self.fly(InFlight { task, id, start, t_pre, t_acq });
            self.image_until(record.end);
        }
        (self.flown, self.imaging) = (None, None);
        effects.push(Effect::Settled(record.clone(), self.catalogue.on_result(record)));
    }

    /// A task is in hand, of which guidance or its result may tell first.
    fn fly(&mut self, flown: InFlight) {
        if flown.task < self.settled || self.flown.is_some_and(|known| known.task >= flown.task) {
            return;
        }
        self.flown = Some(flown);
        self.imaging = Some(flown.start.after(flown.t_pre));
        self.catalogue.on_task(flown);
    }

    /// Imaging has begun if it begins before a tick.
    fn image_until(&mut self, end: Tick) {
        if let (Some(flown), Some(imaging)) = (self.flown, self.imaging.take_if(|imaging| *imaging < end)) {
            self.catalogue.on_imaging(flown.task, imaging);
        }
    }

    /// What was to be sent up to a tick leaves.
    fn send_up_to(&mut self, tick: Tick, effects: &mut Vec<Effect>) {
        if let Some((heard, sends)) = &mut self.heard
            && *heard <= tick
            && std::mem::take(sends)
        {
            effects.push(Effect::Sent(*heard, self.catalogue.transmit(*heard)));
        }
    }

    /// Hears what the radio brings once guidance has flown up to there and all before is sent.
    fn hear(&mut self, effects: &mut Vec<Effect>) {
        let flown = |turn: &mut Turn| self.reached.map_or(Tick(0), |reached| reached.after(1)) >= turn.tick;
        if self.heard.is_some_and(|(_, sends)| sends) {
            return;
        }
        let Some(turn) = self.coming.take_if(flown) else { return };
        self.image_until(turn.tick);
        for frame in &turn.frames {
            self.catalogue.hear(turn.tick, frame);
        }
        self.heard = Some((turn.tick, turn.open));
        let through = if turn.open { turn.tick } else { Tick(turn.next.0.saturating_sub(1)) };
        let in_hand = self.flown.map(|flown| flown.task);
        let abort = self.catalogue.take_aborts().into_iter().find(|abort| Some(abort.task) == in_hand);
        let abort = abort.map(|abort| (abort.task, self.reason(abort)));
        self.told = Heard { through, abort, hold: None };
        effects.push(Effect::Heard(self.told.clone()));
        if !turn.open {
            effects.push(Effect::Sent(turn.tick, Vec::new()));
        }
    }

    fn reason(&self, abort: Abort) -> String {
        let state = self.catalogue.requests().state(abort.id).map_or("unknown", State::name);
        format!("request {} is {state}", abort.id.0)
    }
}
