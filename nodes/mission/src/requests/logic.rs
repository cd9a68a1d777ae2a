//! The request manager without ROS and without its store: every strip ever requested, what is upcoming, what is
//! fulfilled.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use swath_sim::mission::windows_until;
use swath_sim::model::Model;
use swath_sim::requests::catalogue::Entry as Listed;
use swath_sim::requests::catalogue::{Candidate, Catalogue, Prepared};
use swath_sim::task::TaskRecord;
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::Situation;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::world::orbit::Orbit;
use swath_sim::world::strip::StripId;
use swath_sim::world::windows::Window;

use super::index::Index;
use super::intake::{Place, place, same_order};
use super::journal::{Change, Entry, InFlight, Progress, Standing};
use super::lifecycle::State;
use super::refusal::{Refusal, check_text};
use crate::orders::action::{Act, Action};
use crate::orders::geojson::NamedRequest;

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

/// What an operator decides on a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Review {
    /// A held request is accepted.
    Release,
    /// A held request is refused.
    Reject,
    /// An accepted request is held.
    Hold,
}

/// A request that has a number.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// What was asked for.
    pub named: NamedRequest,
    /// Where it stands.
    pub state: State,
    /// Why: code and text; 0 and empty without a reason.
    pub reason: (u16, String),
    /// Who brought it there.
    pub actor: String,
    /// When it was taken.
    pub created: Tick,
    /// When it changed last.
    pub changed: Tick,
    /// What it has gone through.
    pub standing: Standing,
    /// The request that it replaces.
    pub supersedes: Option<StripId>,
}

/// A request as the store gives it back.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    /// The request.
    pub request: Request,
    /// Its start windows.
    pub windows: Vec<Window>,
    /// The same strip scanned the other way.
    pub linked: Option<StripId>,
}

/// What a mission says of its requests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rules {
    /// Simulated time of the epoch [ns since 1970-01-01 UTC].
    pub epoch_ns: u64,
    /// Attempts that count before a request fails, for requests that do not say.
    pub max_attempts: u32,
}

/// Name of the request manager in the history.
pub const SYSTEM: &str = "request_manager";
/// Name of guidance in the history.
pub(super) const GUIDANCE: &str = "guidance";
/// Name of the planner in the history.
const PLANNER: &str = "planner";

/// The request manager's state.
#[derive(Clone, Debug)]
pub struct RequestLogic {
    pub(super) model: Model,
    pub(super) catalogue: Catalogue,
    pub(super) index: Index,
    pub(super) requests: Vec<Request>,
    pub(super) by_state: BTreeMap<State, BTreeSet<StripId>>,
    pub(super) situation: Option<Situation>,
    pub(super) rules: Rules,
    pub(super) by_reference: HashMap<(String, String), StripId>,
    pub(super) by_place: HashMap<Place, Vec<StripId>>,
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
            index: Index::default(),
            requests: Vec::new(),
            by_state: BTreeMap::new(),
            situation: None,
            rules,
            by_reference: HashMap::new(),
            by_place: HashMap::new(),
            rejected: 0,
            reward: 0.0,
            progress: Progress::default(),
            wanted: 0,
            begun: false,
            last_settled: None,
            journal: Vec::new(),
            aborts: Vec::new(),
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
                request.named.request.to_strip(&self.model.config.requests, self.model.config.earth.radius_m)?;
            let t_acq = strip.acquisition_ticks(self.model.period);
            self.reward += request.standing.reward;
            self.insert(Prepared { strip, t_acq, windows }, request);
        }
        for (id, linked) in (1..).map(StripId).zip(links) {
            if let Some(linked) = linked {
                self.catalogue.link(id, linked);
            }
            match self.requests[id.0 as usize - 1].state {
                State::Held => {
                    self.catalogue.hold(id);
                }
                state if state.is_final() => {
                    self.catalogue.remove(id);
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Takes a request now. The same one again under the same reference of the same submitter gets the number that it
    /// has.
    ///
    /// # Errors
    /// Why it is refused.
    pub fn submit(&mut self, named: NamedRequest) -> Result<StripId, Refusal> {
        self.submit_at(named, self.now())
    }

    /// As [`Self::submit`], for a request that came at a tick: its windows are sought from there.
    ///
    /// # Errors
    /// Why it is refused.
    pub fn submit_at(&mut self, named: NamedRequest, at: Tick) -> Result<StripId, Refusal> {
        let known = self.len();
        let result = self.take_in(&named, None, at);
        match &result {
            Ok(id) if self.len() > known => {
                let actor = named.submitter.clone();
                self.taken(at, actor, String::new(), Act::Submit(*id, Box::new(named)));
            }
            Ok(_) => {}
            Err(refusal) => self.note_refusal(named, refusal, at),
        }
        result
    }

    /// Takes a request in place of another one. The same call again gets the number that the request has.
    ///
    /// # Errors
    /// Why it is refused; the other one stays as it is then.
    pub fn replace(&mut self, old: StripId, named: NamedRequest) -> Result<StripId, Refusal> {
        self.replace_at(old, named, self.now())
    }

    fn replace_at(&mut self, old: StripId, named: NamedRequest, at: Tick) -> Result<StripId, Refusal> {
        if let Some(new) = self.request(old).and_then(|request| request.standing.superseded_by)
            && self.by_reference(&named.submitter, &named.client_ref) == Some(new)
            && self.request(new).is_some_and(|request| same_order(&request.named, &named))
        {
            return Ok(new);
        }
        let result = self.both_ways(old, State::Superseded).and_then(|_| self.take_in(&named, Some(old), at));
        let new = match result {
            Ok(new) => new,
            Err(refusal) => {
                self.note_refusal(named, &refusal, at);
                return Err(refusal);
            }
        };
        let (actor, text) = (named.submitter.clone(), format!("replaced by request {}", new.0));
        self.taken(at, actor.clone(), String::new(), Act::Replace(old, Box::new(named)));
        for id in self.both_ways(old, State::Superseded)? {
            self.requests[id.0 as usize - 1].standing.superseded_by = Some(new);
            self.leave(id, State::Superseded, (0, text.clone()), &actor)?;
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
            self.leave(id, State::CancelledByUser, (0, reason.to_owned()), actor)?;
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
            let illegal = super::lifecycle::IllegalTransition { from: self.known(id)?.state, to };
            return Err(Refusal::State { id: id.0, illegal });
        }
        for id in self.both_ways(id, to)? {
            match review {
                Review::Release => {
                    self.catalogue.release(id);
                    self.stand(id, to, (0, reason.to_owned()), actor)?;
                }
                Review::Hold => {
                    self.catalogue.hold(id);
                    self.stand(id, to, (0, reason.to_owned()), actor)?;
                    self.abort_if_under_way(id);
                }
                Review::Reject => self.leave(id, to, (0, reason.to_owned()), actor)?,
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
            Act::Submit(_, named) => self.submit_at((**named).clone(), action.at).map(drop),
            Act::Replace(old, named) => self.replace_at(*old, (**named).clone(), action.at).map(drop),
            Act::Cancel(id) => self.cancel(*id, actor, reason),
            Act::Review(id, review) => self.review(*id, *review, actor, reason),
            // These are the planner's.
            Act::SetMode(_) | Act::Decide { .. } => Ok(()),
        }
    }

    fn taken(&mut self, at: Tick, actor: String, reason: String, act: Act) {
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
            // The catalogue has none but accepted and held requests now.
            let _ = self.stand(id, State::Expired, (0, "its last window has closed".to_owned()), SYSTEM);
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
        self.requests[flown.id.0 as usize - 1].standing.imaging = flown.start.after(flown.t_pre);
        let _ = self.stand(flown.id, State::Scheduled, (0, String::new()), PLANNER);
    }

    /// Imaging of a task has begun.
    pub fn on_imaging(&mut self, task: u64, tick: Tick) {
        let Some(flown) = self.progress.in_flight.filter(|flown| flown.task == task) else { return };
        self.progress.now = self.progress.now.max(tick);
        if self.state(flown.id) == Some(State::Scheduled) {
            let _ = self.stand(flown.id, State::Executing, (0, String::new()), GUIDANCE);
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

    /// Where a request stands.
    #[must_use]
    pub fn state(&self, id: StripId) -> Option<State> {
        self.request(id).map(|request| request.state)
    }

    /// A request by its number.
    #[must_use]
    pub fn request(&self, id: StripId) -> Option<&Request> {
        self.requests.get(usize::try_from(id.0.checked_sub(1)?).ok()?)
    }

    /// A request by its number.
    ///
    /// # Errors
    /// When there is none.
    pub fn known(&self, id: StripId) -> Result<&Request, Refusal> {
        self.request(id).ok_or(Refusal::Unknown { id: id.0, last: self.requests.len() as u64 })
    }

    /// The request of a submitter under a reference.
    #[must_use]
    pub fn by_reference(&self, submitter: &str, client_ref: &str) -> Option<StripId> {
        self.by_reference.get(&(submitter.to_owned(), client_ref.to_owned())).copied()
    }

    /// A strip with its windows.
    #[must_use]
    pub fn strip(&self, id: StripId) -> Option<&Listed> {
        self.catalogue.get(id)
    }

    /// Requests that have a number.
    #[must_use]
    pub fn len(&self) -> usize {
        self.requests.len()
    }

    /// Whether no request has a number.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.requests.is_empty()
    }

    /// How many requests are in a state; those refused at once are counted too.
    #[must_use]
    pub fn count(&self, state: State) -> usize {
        let refused = if state == State::Rejected { self.rejected } else { 0 };
        refused + self.by_state.get(&state).map_or(0, BTreeSet::len)
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
    fn leave(&mut self, id: StripId, to: State, reason: (u16, String), actor: &str) -> Result<(), Refusal> {
        self.stand(id, to, reason, actor)?;
        self.catalogue.remove(id);
        self.forget_place(id);
        self.abort_if_under_way(id);
        Ok(())
    }

    pub(super) fn forget_place(&mut self, id: StripId) {
        let Some(key) = self.request(id).map(|request| place(&request.named.request)) else { return };
        if let Some(there) = self.by_place.get_mut(&key) {
            there.retain(|&other| other != id);
            if there.is_empty() {
                self.by_place.remove(&key);
            }
        }
    }

    fn abort_if_under_way(&mut self, id: StripId) {
        if let Some(flown) = self.progress.in_flight.filter(|flown| flown.id == id) {
            self.aborts.push(Abort { task: flown.task, id });
        }
    }

    /// The one place where a request that has a number changes its state.
    pub(super) fn stand(&mut self, id: StripId, to: State, reason: (u16, String), actor: &str) -> Result<(), Refusal> {
        let state = self.known(id)?.state.step(to).map_err(|illegal| Refusal::State { id: id.0, illegal })?;
        let now = self.now();
        let request = &mut self.requests[id.0 as usize - 1];
        let before = std::mem::replace(&mut request.state, state);
        request.reason = reason;
        actor.clone_into(&mut request.actor);
        request.changed = now;
        if let Some(set) = self.by_state.get_mut(&before) {
            set.remove(&id);
        }
        self.by_state.entry(state).or_default().insert(id);
        if state == State::Expired {
            self.forget_place(id);
        }
        self.note(id);
        Ok(())
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
