//! Whoever keeps the requests of a mission in one process: the request manager, or ground and satellite apart.

use std::collections::VecDeque;

use swath_sim::mission::RequestKeeper;
use swath_sim::requests::catalogue::Candidate;
use swath_sim::task::TaskRecord;
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::Situation;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model;
use swath_sim::world::strip::StripId;

use crate::absences::{Absences, Presence};
use crate::file::{Mission, MissionError};
use crate::link::apart::Apart;
use crate::link::catalogue::Catalogue;
use crate::link::ground::Ground;
use crate::link::radio::Radio;
use crate::orders::action::{Act, Action};
use crate::orders::order::{MISSION, Order};
use crate::requests::logic::RequestLogic;
use crate::requests::refusal::Refusal;

/// The request manager of a mission in one process, and what is asked of it on the way.
#[derive(Clone, Debug)]
pub(crate) struct Desk {
    pub requests: RequestLogic,
    absences: Absences,
    /// What another one is made of.
    origin: (InitialState, Tick),
    /// What is still to come, in order.
    to_come: VecDeque<Action>,
    pub refused: Vec<(Action, Refusal)>,
}

impl Desk {
    fn take_while(&mut self, due: impl Fn(&Action) -> bool) {
        while let Some(action) = self.to_come.pop_front_if(|action| due(action)) {
            if let Err(refusal) = self.requests.take_again(&action) {
                self.refused.push((action, refusal));
            }
        }
    }

    /// Whether nobody is at the desk; who comes back to it knows what was written down.
    fn is_left(&mut self, now: Tick) -> bool {
        let presence = self.absences.at(now);
        if presence == Presence::Back {
            let (initial, horizon) = &self.origin;
            match self.requests.restarted(initial, *horizon) {
                Ok(fresh) => self.requests = fresh,
                // Its strips were taken under the same limits.
                Err(refusal) => tracing::error!("the request manager cannot be made again: {refusal}"),
            }
        }
        matches!(presence, Presence::Away(_))
    }
}

impl RequestKeeper for Desk {
    fn offer(&mut self, task: u64, situation: &Situation, candidates: &mut Vec<Candidate>) {
        if self.is_left(situation.now) {
            // The planner goes on with what it was offered, as far as that can still be imaged.
            let open = |it: &Candidate| {
                it.window.close >= situation.now && self.requests.state(it.id).is_some_and(|state| !state.is_final())
            };
            candidates.retain(open);
            return;
        }
        self.requests.set_situation(*situation);
        *candidates = self.requests.on_decision_point(task, situation.now, &[]).candidates;
        for contradiction in self.requests.take_contradictions() {
            tracing::error!("{contradiction}");
        }
        // Nobody keeps a journal here.
        self.requests.take_journal();
    }

    fn settle(&mut self, record: &TaskRecord) -> f64 {
        // What came while the task was flown counts before its result does.
        self.take_while(|action| action.at < record.end);
        self.requests.on_result(record)
    }
}

/// Whoever keeps the requests: ground and satellite as one, or apart.
#[derive(Clone, Debug)]
pub(crate) enum Keeper {
    Together(Box<Desk>),
    Apart(Box<Apart>),
}

impl RequestKeeper for Keeper {
    fn offer(&mut self, task: u64, situation: &Situation, candidates: &mut Vec<Candidate>) {
        match self {
            Self::Together(desk) => desk.offer(task, situation, candidates),
            Self::Apart(apart) => apart.offer(task, situation, candidates),
        }
    }

    fn settle(&mut self, record: &TaskRecord) -> f64 {
        match self {
            Self::Together(desk) => desk.settle(record),
            Self::Apart(apart) => apart.settle(record),
        }
    }
}

impl Keeper {
    /// Those of a mission: what it knows from the start, what is asked on the way, and when nobody is there to ask.
    ///
    /// # Errors
    /// When a station is not there.
    pub fn new(
        mission: &Mission,
        model: &Model,
        initial: Vec<Order>,
        actions: Vec<Action>,
        absences: Absences,
    ) -> Result<Self, MissionError> {
        let origin = (mission.initial(), mission.horizon(model));
        let mut requests = RequestLogic::new(model.clone(), &origin.0, origin.1, mission.rules());
        let Some(radio) = Radio::of(mission, model)? else {
            for order in initial {
                // Why one is refused is in the request manager's counts.
                _ = requests.submit(order, Tick(0));
            }
            let mut desk = Desk { requests, absences, origin, to_come: actions.into(), refused: Vec::new() };
            desk.take_while(|action| action.initial);
            return Ok(Self::Together(Box::new(desk)));
        };
        let (up, down) = radio.rates();
        let ground = Ground::new(requests.clone(), up);
        let space = Catalogue::new(requests, down, radio.config(), model.period);
        let mut apart = Apart::new(ground, space, radio);
        for order in initial {
            let act = Act::Submit(StripId(0), Box::new(order));
            let (actor, reason) = (MISSION.to_owned(), String::new());
            apart.ask_first(Action { at: Tick(0), initial: true, actor, reason, act });
        }
        apart.will_be_asked(actions, absences);
        Ok(Self::Apart(Box::new(apart)))
    }
}
