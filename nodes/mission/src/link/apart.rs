//! Ground, radio and satellite of a mission in one process.

use std::collections::VecDeque;

use swath_sim::mission::RequestKeeper;
use swath_sim::requests::catalogue::Candidate;
use swath_sim::task::TaskRecord;
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::Situation;

use super::catalogue::Catalogue;
use super::channel::Channel;
use super::ground::Ground;
use super::radio::{Direction, Radio};
use super::told::{Answer, Told};
use crate::absences::{Absences, Presence};
use crate::orders::action::Action;
use crate::requests::journal::InFlight;
use crate::requests::refusal::Refusal;

/// Ground and satellite apart, and the radio between them.
///
/// Within a tick, frames arrive first, on board and on the ground; then comes what happens there; then both send.
#[derive(Clone, Debug)]
pub struct Apart {
    ground: Ground,
    space: Catalogue,
    channel: Channel,
    /// The last tick at which frames have arrived, and the last at which both have sent.
    begun: Option<Tick>,
    finished: Option<Tick>,
    /// What is still to be asked of the ground, in order.
    to_come: VecDeque<Action>,
    refused: Vec<(Action, Refusal)>,
    /// When the ground is lost.
    absences: Absences,
    /// What the ground was told since that was taken last, where somebody wants to know.
    told: Option<Vec<Told>>,
}

impl Apart {
    /// Both ends at the epoch.
    #[must_use]
    pub fn new(ground: Ground, space: Catalogue, radio: Radio) -> Self {
        Self {
            ground,
            space,
            channel: Channel::new(radio),
            begun: None,
            finished: None,
            to_come: VecDeque::new(),
            refused: Vec::new(),
            absences: Absences::default(),
            told: Some(Vec::new()),
        }
    }

    /// Something is asked of the ground before the mission begins. What is refused is in its counts.
    pub fn ask_first(&mut self, action: Action) {
        self.tell(Told::Asked(action));
    }

    /// The same from a tick on, up to which both have heard and sent.
    #[must_use]
    pub fn from_tick(mut self, tick: Tick) -> Self {
        (self.begun, self.finished) = (Some(tick), Some(tick));
        self
    }

    /// Something will be asked of the ground, after all that is still to come.
    pub fn will_also_be_asked(&mut self, action: Action) {
        self.to_come.push_back(action);
    }

    /// From now on, nobody wants to know what the ground is told.
    pub fn forget_told(&mut self) {
        self.told = None;
    }

    /// What the ground was told since the last call.
    pub fn take_told(&mut self) -> Vec<Told> {
        self.told.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// What is asked of the ground on the way, in order, and when the ground is lost and back.
    pub fn will_be_asked(&mut self, actions: Vec<Action>, absences: Absences) {
        self.to_come.extend(actions);
        self.absences = absences;
    }

    /// The ground.
    #[must_use]
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    /// The satellite.
    #[must_use]
    pub fn space(&self) -> &Catalogue {
        &self.space
    }

    /// The radio.
    #[must_use]
    pub fn radio(&self) -> &Radio {
        self.channel.radio()
    }

    /// What was asked for and refused at once, and why.
    #[must_use]
    pub fn refused(&self) -> &[(Action, Refusal)] {
        &self.refused
    }

    /// The next tick at which something happens.
    fn next_event(&self) -> Option<Tick> {
        let next = self.finished.map_or(Tick(0), |last| last.after(1));
        let asked = self.to_come.front().map(|action| action.at.max(next));
        asked.into_iter().chain(self.channel.next_event(next)).min()
    }

    /// A tick begins: frames arrive, and the ground is asked.
    fn begin(&mut self, tick: Tick) {
        if self.begun.is_some_and(|begun| begun >= tick) {
            return;
        }
        self.begun = Some(tick);
        for bytes in self.channel.arrived(Direction::Up, tick) {
            self.space.hear(tick, &bytes);
        }
        let frames = self.channel.arrived(Direction::Down, tick);
        if self.ground_is_left(tick) {
            return;
        }
        for bytes in frames {
            self.tell(Told::Heard(tick, bytes));
        }
        while let Some(action) = self.to_come.pop_front_if(|action| action.at <= tick) {
            let action = Action { at: tick, ..action };
            if let Answer::Asked(Err(refusal)) = self.tell(Told::Asked(action.clone())) {
                self.refused.push((action, refusal));
            }
        }
    }

    /// The ground is told something, which is noted where somebody wants to know.
    fn tell(&mut self, told: Told) -> Answer {
        let answer = self.ground.tell(&told);
        self.told.iter_mut().for_each(|all| all.push(told.clone()));
        answer
    }

    /// A tick ends: both send, once.
    fn finish(&mut self, tick: Tick) {
        let first = self.finished.is_none_or(|finished| finished < tick);
        self.finished = self.finished.max(Some(tick));
        if first && self.radio().open(tick) {
            if !self.ground_is_left(tick)
                && let Answer::Sent(sent) = self.tell(Told::Open(tick))
            {
                self.channel.carry(Direction::Up, tick, sent);
            }
            self.channel.carry(Direction::Down, tick, self.space.transmit(tick));
        }
        for contradiction in self.space.take_contradictions().iter().chain(&self.ground.take_contradictions()) {
            tracing::error!("{contradiction}");
        }
    }

    /// Whether nobody is on the ground; who comes back to it was told the same, and is where the one before was.
    fn ground_is_left(&mut self, now: Tick) -> bool {
        matches!(self.absences.at(now), Presence::Away(_))
    }

    /// All that happens before a tick.
    fn advance_to(&mut self, tick: Tick) {
        while let Some(event) = self.next_event().filter(|event| *event < tick) {
            self.begin(event);
            self.finish(event);
        }
    }

    /// A task that images a strip is flown up to `until`, unless the satellite hears that it is no longer wanted: then
    /// the tick at which it does.
    pub fn fly(&mut self, flown: InFlight, until: Tick) -> Tick {
        self.space.on_task(flown);
        let mut imaging = Some(flown.start.after(flown.t_pre));
        loop {
            let event = self.next_event().into_iter().chain(imaging).min().filter(|event| *event < until);
            let Some(event) = event else { return until };
            self.begin(event);
            if self.space.take_aborts().iter().any(|abort| abort.task == flown.task) {
                return event;
            }
            if imaging.take_if(|imaging| *imaging == event).is_some() {
                self.space.on_imaging(flown.task, event);
            }
            self.finish(event);
        }
    }
}

impl RequestKeeper for Apart {
    fn offer(&mut self, task: u64, situation: &Situation, candidates: &mut Vec<Candidate>) {
        self.advance_to(situation.now.after(1));
        *candidates = self.space.on_decision_point(task, situation).candidates;
    }

    fn settle(&mut self, record: &TaskRecord) -> f64 {
        self.advance_to(record.end);
        self.begin(record.end);
        let reward = self.space.on_result(record);
        self.finish(record.end);
        reward
    }
}
