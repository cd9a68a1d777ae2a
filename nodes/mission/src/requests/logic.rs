//! The request manager without ROS and without its store: every strip ever requested, what is upcoming, what is
//! fulfilled.

use std::collections::BTreeMap;

use swath_sim::mission::windows_until;
use swath_sim::requests::catalogue::Entry as Listed;
use swath_sim::requests::catalogue::{Candidate, Catalogue, Prepared};
use swath_sim::task::TaskRecord;
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::Situation;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model;
use swath_sim::world::orbit::Orbit;
use swath_sim::world::strip::StripId;
use thiserror::Error;

use super::journal::{Change, Entry, InFlight, Progress};
use super::lifecycle::{IllegalTransition, State};
use super::reason_number::Reason;
use super::refusal::{Refusal, check_text};
use super::register::Register;
use super::request::{GUIDANCE, PLANNER, Request, SYSTEM, Stored};
use crate::orders::action::{Act, Action, Review};
use crate::orders::order::Order;

/// What the planner is offered for a task.
#[derive(Clone, Debug, PartialEq)]
pub struct Offer {
    /// Number of the task.
    pub task: u64,
    /// Now.
    pub tick: Tick,
    /// The candidates, by the closing of their windows.
    pub candidates: Vec<Candidate>,
    /// Strips that are still to be imaged.
    pub pending: usize,
    /// Strips imaged.
    pub fulfilled: usize,
}

/// A task that guidance should give up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Abort {
    /// Number of the task.
    pub task: u64,
    /// The strip.
    pub id: StripId,
}

/// A change that was reported and that the life cycle does not have.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("reported by {actor}: {refusal}")]
pub struct Contradiction {
    /// Who reported it.
    pub actor: String,
    /// What is wrong with it.
    pub refusal: Refusal,
}

/// What a mission says of its requests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rules {
    /// Simulated time of the epoch [ns since 1970-01-01 UTC].
    pub epoch_ns: u64,
    /// Attempts that count before a request fails, for requests that do not say.
    pub max_attempts: u32,
}

/// The request manager's state.
#[derive(Clone, Debug)]
pub struct RequestLogic {
    pub(super) model: Model,
    pub(super) catalogue: Catalogue,
    pub(super) register: Register,
    pub(super) situation: Option<Situation>,
    pub(super) rules: Rules,
    pub(super) rejected: usize,
    pub(super) reward: f64,
    pub(super) progress: Progress,
    /// Number of the last task that was wanted.
    wanted: u64,
    /// Whether a task was ever wanted.
    begun: bool,
    /// The imaging task that was settled last, with its reward.
    pub(super) last_settled: Option<(u64, f64)>,
    pub(super) journal: Vec<Entry>,
    pub(super) aborts: Vec<Abort>,
    /// Requests that the imaging of someone else's request for the same strip serves.
    pub(super) served_by: BTreeMap<StripId, StripId>,
    contradictions: Vec<Contradiction>,
}

impl RequestLogic {
    /// A request manager at the epoch of a mission that ends at `horizon`.
    #[must_use]
    pub fn new(model: Model, initial: &InitialState, horizon: Tick, rules: Rules) -> Self {
        let orbit = Orbit::new(&model.config, initial.orbit, model.period);
        let catalogue = Catalogue::new(&model, &orbit, windows_until(&model, horizon));
        Self {
            model,
            catalogue,
            register: Register::default(),
            situation: None,
            rules,
            rejected: 0,
            reward: 0.0,
            progress: Progress::default(),
            wanted: 0,
            begun: false,
            last_settled: None,
            journal: Vec::new(),
            aborts: Vec::new(),
            served_by: BTreeMap::new(),
            contradictions: Vec::new(),
        }
    }

    /// Takes up what the store has: requests in the order of their numbers, how many were refused, how far the mission
    /// has come, the imaging task that was settled last with its reward.
    ///
    /// # Errors
    /// When a stored request is no strip: it was stored for a mission with other limits.
    pub fn restore(
        &mut self,
        stored: Vec<Stored>,
        rejected: usize,
        progress: Progress,
        last_settled: Option<(u64, f64)>,
    ) -> Result<(), Refusal> {
        self.rejected = rejected;
        self.progress = progress;
        self.last_settled = last_settled;
        self.begun = self.progress.now > Tick(0);
        let links: Vec<_> = stored.iter().map(|stored| stored.linked).collect();
        for Stored { request, windows, .. } in stored {
            let strip =
                request.order.request.to_strip(&self.model.config.requests, self.model.config.earth.radius_m)?;
            let t_acq = strip.acquisition_ticks(self.model.period);
            self.reward += request.standing.reward;
            self.insert(Prepared { strip, t_acq, windows }, request);
        }
        for (id, linked) in (1..).map(StripId).zip(links) {
            if let Some(linked) = linked {
                self.catalogue.link(id, linked);
            }
            match self.known(id)?.state {
                State::Held => {
                    self.catalogue.hold(id);
                }
                state if state.is_final() => {
                    self.catalogue.remove(id);
                }
                _ => {}
            }
        }
        for id in (1..=self.len() as u64).map(StripId) {
            self.share_imaging(id);
        }
        Ok(())
    }

    /// Takes a request that comes at a tick: its windows are sought from there. The same one again under the same
    /// reference of the same submitter gets the number that it has.
    ///
    /// # Errors
    /// Why it is refused.
    pub fn submit(&mut self, order: Order, at: Tick) -> Result<StripId, Refusal> {
        let known = self.len();
        let result = self.take_in(&order, None, at);
        match &result {
            Ok(id) if self.len() > known => {
                let actor = order.submitter.clone();
                self.taken(at, actor, String::new(), Act::Submit(*id, Box::new(order)));
            }
            Ok(_) => {}
            Err(refusal) => self.note_refusal(order, refusal, at),
        }
        result
    }

    /// Takes a request that comes at a tick in place of another one. The same call again gets the number that the
    /// request has.
    ///
    /// # Errors
    /// Why it is refused; the other one stays as it is then.
    pub fn replace(&mut self, old: StripId, order: Order, at: Tick) -> Result<StripId, Refusal> {
        if let Some(new) = self.request(old).and_then(|request| request.standing.superseded_by)
            && self.by_reference(&order.submitter, &order.client_ref) == Some(new)
            && self.request(new).is_some_and(|known| order.is_for_the_same_as(&known.order))
        {
            return Ok(new);
        }
        let result = self.both_ways(old, State::Superseded).and_then(|_| self.take_in(&order, Some(old), at));
        let new = match result {
            Ok(new) => new,
            Err(refusal) => {
                self.note_refusal(order, &refusal, at);
                return Err(refusal);
            }
        };
        let (actor, text) = (order.submitter.clone(), format!("replaced by request {}", new.0));
        self.taken(at, actor.clone(), String::new(), Act::Replace(old, Box::new(order)));
        for id in self.both_ways(old, State::Superseded)? {
            if let Some(standing) = self.register.standing_mut(id) {
                standing.superseded_by = Some(new);
            }
            self.leave(id, State::Superseded, (Reason::None, text.clone()), &actor)?;
        }
        Ok(new)
    }

    /// Takes a request back.
    ///
    /// # Errors
    /// When there is no such request, or imaging has begun.
    pub fn cancel(&mut self, id: StripId, actor: &str, reason: &str) -> Result<(), Refusal> {
        check_text("actor", actor)?;
        check_text("reason", reason)?;
        for id in self.both_ways(id, State::CancelledByUser)? {
            self.leave(id, State::CancelledByUser, (Reason::None, reason.to_owned()), actor)?;
        }
        self.taken(self.now(), actor.to_owned(), reason.to_owned(), Act::Cancel(id));
        Ok(())
    }

    /// Decides on a held request, or holds an accepted one.
    ///
    /// # Errors
    /// When there is no such request, or its state does not allow it.
    pub fn review(&mut self, id: StripId, review: Review, actor: &str, reason: &str) -> Result<(), Refusal> {
        check_text("actor", actor)?;
        check_text("reason", reason)?;
        let to = match review {
            Review::Release => State::Accepted,
            Review::Reject => State::Rejected,
            Review::Hold => State::Held,
        };
        // A release is for held requests only, although the life cycle has other ways to be accepted.
        if review == Review::Release && self.known(id)?.state != State::Held {
            let illegal = IllegalTransition { from: self.known(id)?.state, to };
            return Err(Refusal::State { id: id.0, illegal });
        }
        for id in self.both_ways(id, to)? {
            match review {
                Review::Release => {
                    self.catalogue.release(id);
                    self.stand(id, to, (Reason::None, reason.to_owned()), actor)?;
                }
                Review::Hold => {
                    self.catalogue.hold(id);
                    self.stand(id, to, (Reason::None, reason.to_owned()), actor)?;
                    self.abort_if_under_way(id);
                }
                Review::Reject => self.leave(id, to, (Reason::None, reason.to_owned()), actor)?,
            }
        }
        self.taken(self.now(), actor.to_owned(), reason.to_owned(), Act::Review(id, review));
        Ok(())
    }

    /// Takes something that was taken before, in another flight of the same mission.
    ///
    /// # Errors
    /// Why it is refused now.
    pub fn take_again(&mut self, action: &Action) -> Result<(), Refusal> {
        let (actor, reason) = (&action.actor, &action.reason);
        match &action.act {
            Act::Submit(_, order) => self.submit((**order).clone(), action.at).map(drop),
            Act::Replace(old, order) => self.replace(*old, (**order).clone(), action.at).map(drop),
            Act::Cancel(id) => self.cancel(*id, actor, reason),
            Act::Review(id, review) => self.review(*id, *review, actor, reason),
            // These are the planner's.
            Act::SetMode(_) | Act::Decide { .. } => Ok(()),
        }
    }

    pub(super) fn taken(&mut self, at: Tick, actor: String, reason: String, act: Act) {
        let action = Action { at, initial: !self.begun, actor, reason, act };
        self.journal.push(Entry::Taken(Box::new(action)));
    }

    /// A task is wanted at `now`; `results` are those of tasks that have ended, also ones that are known. Answers with
    /// the candidates.
    pub fn on_decision_point(&mut self, task: u64, now: Tick, results: &[TaskRecord]) -> Offer {
        self.progress.now = self.progress.now.max(now);
        self.wanted = self.wanted.max(task);
        self.begun = true;
        for record in results {
            self.on_result(record);
        }
        if let Some(flown) = self.progress.in_flight.filter(|flown| flown.task < task) {
            self.progress.in_flight = None;
            self.not_flown(flown.id);
        }
        let mut candidates = Vec::new();
        let count = self.model.config.planning.candidates;
        for id in self.catalogue.next(self.progress.now, count, &mut candidates) {
            self.not_flown(id);
            let reason = (Reason::None, "its last window has closed".to_owned());
            self.must(id, State::Expired, reason, SYSTEM);
        }
        Offer {
            task,
            tick: self.progress.now,
            candidates,
            pending: self.catalogue.pending(),
            fulfilled: self.count(State::Completed),
        }
    }

    /// A task has ended; one that is known changes nothing. Returns its reward.
    pub fn on_result(&mut self, record: &TaskRecord) -> f64 {
        self.progress.now = self.progress.now.max(record.end);
        if record.strip.is_some() && record.task >= self.progress.settled {
            self.progress.settled = record.task + 1;
            self.last_settled = Some((record.task, self.settle(record)));
        }
        self.reward_of(record.task)
    }

    /// Reward of a task, if it is the imaging task that was settled last; else 0.
    #[must_use]
    pub fn reward_of(&self, task: u64) -> f64 {
        self.last_settled.filter(|(settled, _)| *settled == task).map_or(0.0, |(_, reward)| reward)
    }

    /// What is known of the satellite at the last decision point; previews predict transitions from there.
    pub fn set_situation(&mut self, situation: Situation) {
        self.situation = Some(situation);
    }

    /// A strip was chosen as the next task. A choice that came too late for a change of the request is given up; one
    /// for a task that is no longer wanted is nothing.
    pub fn on_task(&mut self, flown: InFlight) {
        let known = self.progress.in_flight.is_some_and(|under_way| under_way.task >= flown.task);
        if flown.task < self.progress.settled || flown.task < self.wanted || known {
            return;
        }
        let Ok(request) = self.known(flown.id) else { return };
        if request.state != State::Accepted {
            self.aborts.push(Abort { task: flown.task, id: flown.id });
            return;
        }
        self.progress.in_flight = Some(flown);
        if let Some(standing) = self.register.standing_mut(flown.id) {
            standing.imaging = flown.start.after(flown.t_pre);
        }
        self.must(flown.id, State::Scheduled, (Reason::None, String::new()), PLANNER);
    }

    /// Imaging of a task has begun.
    pub fn on_imaging(&mut self, task: u64, tick: Tick) {
        let Some(flown) = self.progress.in_flight.filter(|flown| flown.task == task) else { return };
        self.progress.now = self.progress.now.max(tick);
        if self.state(flown.id) == Some(State::Scheduled) {
            self.must(flown.id, State::Executing, (Reason::None, String::new()), GUIDANCE);
        }
    }

    /// Lines of the journal since the last call.
    pub fn take_journal(&mut self) -> Vec<Entry> {
        std::mem::take(&mut self.journal)
    }

    /// Tasks to give up since the last call.
    pub fn take_aborts(&mut self) -> Vec<Abort> {
        std::mem::take(&mut self.aborts)
    }

    /// Changes that were reported since the last call and that the life cycle does not have.
    pub fn take_contradictions(&mut self) -> Vec<Contradiction> {
        std::mem::take(&mut self.contradictions)
    }

    /// Where a request stands.
    #[must_use]
    pub fn state(&self, id: StripId) -> Option<State> {
        self.request(id).map(|request| request.state)
    }

    /// A request by its number.
    #[must_use]
    pub fn request(&self, id: StripId) -> Option<&Request> {
        self.register.get(id)
    }

    /// A request by its number.
    ///
    /// # Errors
    /// When there is none.
    pub fn known(&self, id: StripId) -> Result<&Request, Refusal> {
        self.request(id).ok_or(Refusal::Unknown { id: id.0, last: self.len() as u64 })
    }

    /// The request of a submitter under a reference.
    #[must_use]
    pub fn by_reference(&self, submitter: &str, client_ref: &str) -> Option<StripId> {
        self.register.by_reference(submitter, client_ref)
    }

    /// A strip with its windows.
    #[must_use]
    pub fn strip(&self, id: StripId) -> Option<&Listed> {
        self.catalogue.get(id)
    }

    /// Requests that have a number.
    #[must_use]
    pub fn len(&self) -> usize {
        self.register.len()
    }

    /// Whether no request has a number.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.register.is_empty()
    }

    /// How many requests are in a state; those refused at once are counted too.
    #[must_use]
    pub fn count(&self, state: State) -> usize {
        let refused = if state == State::Rejected { self.rejected } else { 0 };
        refused + self.register.count(state)
    }

    /// Reward earned so far.
    #[must_use]
    pub fn reward(&self) -> f64 {
        self.reward
    }

    /// How far the mission has come.
    #[must_use]
    pub fn progress(&self) -> Progress {
        self.progress
    }

    /// Simulated time as far as it is known here.
    #[must_use]
    pub fn now(&self) -> Tick {
        self.progress.now
    }

    /// What the mission says of its requests.
    #[must_use]
    pub fn rules(&self) -> Rules {
        self.rules
    }

    /// A request and its twin, those of them that can go to a state; the request itself must.
    pub(super) fn both_ways(&self, id: StripId, to: State) -> Result<Vec<StripId>, Refusal> {
        let may = |id: StripId| {
            let step = self.known(id)?.state.step(to);
            step.map_err(|illegal| Refusal::State { id: id.0, illegal })
        };
        may(id)?;
        let twin = self.catalogue.get(id).and_then(|entry| entry.linked);
        match twin.filter(|&twin| self.state(twin).is_some_and(|state| !state.is_final())) {
            // Of two twins one may be under way: what is done to the other is done to it, or to neither.
            Some(twin) if self.state(twin) == Some(State::Executing) => Err(may(twin).err().unwrap_or(Refusal::Empty)),
            Some(twin) if may(twin).is_ok() => Ok(vec![id, twin]),
            _ => Ok(vec![id]),
        }
    }

    /// A request leaves for good.
    pub(super) fn leave(
        &mut self,
        id: StripId,
        to: State,
        reason: (Reason, String),
        actor: &str,
    ) -> Result<(), Refusal> {
        self.stand(id, to, reason, actor)?;
        self.catalogue.remove(id);
        self.abort_if_under_way(id);
        Ok(())
    }

    fn abort_if_under_way(&mut self, id: StripId) {
        if let Some(flown) = self.progress.in_flight.filter(|flown| flown.id == id) {
            self.aborts.push(Abort { task: flown.task, id });
        }
    }

    /// A request changes its state, which is written down.
    fn stand(&mut self, id: StripId, to: State, reason: (Reason, String), actor: &str) -> Result<(), Refusal> {
        self.known(id)?;
        let step = self.register.step(id, to, reason, actor, self.progress.now);
        step.map_err(|illegal| Refusal::State { id: id.0, illegal })?;
        self.note(id);
        self.share_imaging(id);
        Ok(())
    }

    /// A change that was reported rather than asked for: if the life cycle does not have it, someone must hear of it.
    pub(super) fn must(&mut self, id: StripId, to: State, reason: (Reason, String), actor: &str) {
        if let Err(refusal) = self.stand(id, to, reason, actor) {
            self.contradicted(actor, refusal);
        }
    }

    pub(super) fn contradicted(&mut self, actor: &str, refusal: Refusal) {
        self.contradictions.push(Contradiction { actor: actor.to_owned(), refusal });
    }

    pub(super) fn note(&mut self, id: StripId) {
        let Some(request) = self.request(id) else { return };
        let change = Change {
            id,
            state: request.state,
            reason: request.reason.clone(),
            actor: request.actor.clone(),
            tick: request.changed,
            standing: request.standing.clone(),
            refused: None,
        };
        self.journal.push(Entry::Changed(change));
    }
}
