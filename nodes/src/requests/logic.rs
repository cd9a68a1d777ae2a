//! The request manager without ROS: every strip ever requested, what is upcoming, what is fulfilled.

use std::collections::BTreeMap;

use swath_sim::catalogue::{Candidate, Catalogue, StripState};
use swath_sim::env::{TaskRecord, windows_until};
use swath_sim::error::StripError;
use swath_sim::guidance::FailureReason;
use swath_sim::model::Model;
use swath_sim::orbit::Orbit;
use swath_sim::scenario::InitialState;
use swath_sim::strip::StripId;
use swath_sim::time::Tick;
use thiserror::Error;

use crate::requests_file::NamedRequest;

/// Why a request is refused.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Refusal {
    /// The strip cannot be flown.
    #[error(transparent)]
    Strip(#[from] StripError),
    /// A text is too long.
    #[error("{field} has {length} characters, the limit is {TEXT_MAX}")]
    Text {
        /// Field of the request.
        field: &'static str,
        /// Its length.
        length: usize,
    },
    /// The reference is known with other contents.
    #[error("client_ref `{client_ref}` is known with other contents")]
    Duplicate {
        /// The reference.
        client_ref: String,
    },
    /// There are too many requests in one call.
    #[error("{count} requests in one call, the limit is {max}")]
    Batch {
        /// Requests in the call.
        count: usize,
        /// Most allowed.
        max: usize,
    },
    /// There are too many strips.
    #[error("{count} strips are held, the limit is {CAPACITY}")]
    Capacity {
        /// Strips held.
        count: usize,
    },
}

impl Refusal {
    /// Stable number of the reason: the REASON constants of `swath_msgs/msg/StripStatus`.
    #[must_use]
    pub fn code(&self) -> u16 {
        match self {
            Self::Strip(error) => error.code(),
            Self::Text { .. } => 107,
            Self::Duplicate { .. } => 108,
            Self::Capacity { .. } | Self::Batch { .. } => 109,
        }
    }
}

/// Longest name or reference [characters].
const TEXT_MAX: usize = 256;
/// Most strips held.
const CAPACITY: usize = 1_000_000;

/// Where a strip stands (DDS states of `swath_msgs/msg/StripStatus`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Standing {
    /// Refused.
    Rejected,
    /// In the catalogue.
    Accepted,
    /// Chosen as the next task.
    Scheduled,
    /// Imaged.
    Completed,
    /// No opportunity is left.
    Expired,
    /// Its twin was imaged.
    FulfilledByLink,
}

/// A change of a strip's standing.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The strip; 0 for a request that was refused.
    pub id: StripId,
    /// What was asked for.
    pub request: NamedRequest,
    /// Where it stands now.
    pub standing: Standing,
    /// Reason code and text; 0 and empty without one.
    pub reason: (u16, String),
    /// When.
    pub tick: Tick,
    /// Attempts so far.
    pub attempts: u32,
    /// Reward earned.
    pub reward: f64,
    /// Its twin.
    pub linked: Option<StripId>,
}

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

#[derive(Clone, Debug)]
struct Held {
    named: NamedRequest,
    standing: Standing,
    attempts: u32,
    reward: f64,
}

/// The request manager's state.
#[derive(Clone, Debug)]
pub struct RequestLogic {
    model: Model,
    catalogue: Catalogue,
    held: Vec<Held>,
    by_client_ref: BTreeMap<String, StripId>,
    rejected: usize,
    now: Tick,
    /// Tasks below this number are settled.
    settled: u64,
    changes: Vec<Change>,
}

impl RequestLogic {
    /// A request manager at the epoch of a mission that ends at `horizon`.
    #[must_use]
    pub fn new(model: Model, initial: &InitialState, horizon: Tick) -> Self {
        let orbit = Orbit::new(&model.config, initial.orbit, model.period);
        let catalogue = Catalogue::new(&model, &orbit, windows_until(&model, horizon));
        Self {
            model,
            catalogue,
            held: Vec::new(),
            by_client_ref: BTreeMap::new(),
            rejected: 0,
            now: Tick(0),
            settled: 0,
            changes: Vec::new(),
        }
    }

    /// Takes a request. The same one again under the same reference gets the identity that it has.
    ///
    /// # Errors
    /// Why it is refused.
    pub fn submit(&mut self, named: NamedRequest) -> Result<StripId, Refusal> {
        let result = self.accept(&named);
        if let Err(refusal) = &result {
            self.rejected += 1;
            let reason = (refusal.code(), refusal.to_string());
            self.changes.push(Change {
                id: StripId(0),
                request: named,
                standing: Standing::Rejected,
                reason,
                tick: self.now,
                attempts: 0,
                reward: 0.0,
                linked: None,
            });
        }
        result
    }

    fn accept(&mut self, named: &NamedRequest) -> Result<StripId, Refusal> {
        for (field, text) in [("name", &named.name), ("client_ref", &named.client_ref)] {
            let length = text.chars().count();
            if length > TEXT_MAX {
                return Err(Refusal::Text { field, length });
            }
        }
        if let Some(&id) = self.by_client_ref.get(&named.client_ref) {
            let known = &self.held[id.0 as usize - 1].named;
            return if known == named {
                Ok(id)
            } else {
                Err(Refusal::Duplicate { client_ref: named.client_ref.clone() })
            };
        }
        if self.held.len() >= CAPACITY {
            return Err(Refusal::Capacity { count: self.held.len() });
        }
        let id = self.catalogue.add(&self.model, &named.request, self.now)?;
        if !named.client_ref.is_empty() {
            self.by_client_ref.insert(named.client_ref.clone(), id);
        }
        // A bidirectional request has a twin, known by the same names.
        for number in self.held.len()..self.catalogue.len() {
            let request =
                if StripId(number as u64 + 1) == id { named.request.clone() } else { named.request.reversed() };
            let named = NamedRequest { request, ..named.clone() };
            self.held.push(Held { named, standing: Standing::Accepted, attempts: 0, reward: 0.0 });
            self.note(StripId(number as u64 + 1), (0, String::new()));
        }
        Ok(id)
    }

    /// A task is wanted at `now`; `finished` is the one that just ended. Answers with the candidates.
    pub fn on_decision_point(&mut self, task: u64, now: Tick, finished: Option<&TaskRecord>) -> Offer {
        self.now = self.now.max(now);
        if let Some(record) = finished
            && record.task >= self.settled
        {
            self.settled = record.task + 1;
            self.settle(record);
        }
        let mut candidates = Vec::new();
        let count = self.model.config.planning.candidates;
        for id in self.catalogue.next(self.now, count, &mut candidates) {
            self.stand(id, Standing::Expired, (0, String::new()));
        }
        Offer { task, tick: self.now, candidates, pending: self.catalogue.pending(), fulfilled: self.fulfilled() }
    }

    /// A strip was chosen as the next task.
    pub fn on_task(&mut self, id: StripId) {
        if self.standing(id) == Some(Standing::Accepted) {
            self.stand(id, Standing::Scheduled, (0, String::new()));
        }
    }

    fn settle(&mut self, record: &TaskRecord) {
        let Some(id) = record.strip else { return };
        let Some(held) = held_mut(&mut self.held, id) else { return };
        held.attempts += 1;
        let Some(failure) = record.outcome.failure else {
            held.reward += record.reward;
            if self.catalogue.fulfil(id).is_some() {
                self.stand(id, Standing::Completed, (0, String::new()));
                self.settle_twin(id);
            }
            return;
        };
        let reason = match failure {
            FailureReason::Attitude => (201, "the attitude error exceeded its limit while imaging".to_owned()),
            FailureReason::Elevation => (202, "the satellite was too low over the target while imaging".to_owned()),
            FailureReason::Interrupted => (203, "the task was cut short".to_owned()),
        };
        if matches!(self.standing(id), Some(Standing::Scheduled | Standing::Accepted)) {
            self.stand(id, Standing::Accepted, reason);
        }
    }

    fn settle_twin(&mut self, id: StripId) {
        let twin = self.catalogue.get(id).and_then(|entry| entry.linked);
        let by_link =
            |twin: &StripId| self.catalogue.get(*twin).is_some_and(|entry| entry.state == StripState::FulfilledByLink);
        if let Some(twin) = twin.filter(by_link) {
            self.stand(twin, Standing::FulfilledByLink, (0, String::new()));
        }
    }

    fn stand(&mut self, id: StripId, standing: Standing, reason: (u16, String)) {
        if let Some(held) = held_mut(&mut self.held, id) {
            held.standing = standing;
            self.note(id, reason);
        }
    }

    fn note(&mut self, id: StripId, reason: (u16, String)) {
        let Some(held) = self.held.get(id.0 as usize - 1) else { return };
        self.changes.push(Change {
            id,
            request: held.named.clone(),
            standing: held.standing,
            reason,
            tick: self.now,
            attempts: held.attempts,
            reward: held.reward,
            linked: self.catalogue.get(id).and_then(|entry| entry.linked),
        });
    }

    /// Changes since the last call.
    pub fn take_changes(&mut self) -> Vec<Change> {
        std::mem::take(&mut self.changes)
    }

    /// Where a strip stands.
    #[must_use]
    pub fn standing(&self, id: StripId) -> Option<Standing> {
        self.held.get(usize::try_from(id.0.checked_sub(1)?).ok()?).map(|held| held.standing)
    }

    /// What was asked for under an identity.
    #[must_use]
    pub fn request(&self, id: StripId) -> Option<&NamedRequest> {
        self.held.get(usize::try_from(id.0.checked_sub(1)?).ok()?).map(|held| &held.named)
    }

    /// Strips imaged, and how many stand where; the refused ones are counted too.
    #[must_use]
    pub fn counts(&self) -> BTreeMap<Standing, usize> {
        let mut counts = BTreeMap::from([(Standing::Rejected, self.rejected)]);
        for held in &self.held {
            *counts.entry(held.standing).or_default() += 1;
        }
        counts
    }

    /// Reward earned so far.
    #[must_use]
    pub fn reward(&self) -> f64 {
        self.held.iter().map(|held| held.reward).sum()
    }

    /// Simulated time of the last decision.
    #[must_use]
    pub fn now(&self) -> Tick {
        self.now
    }

    fn fulfilled(&self) -> usize {
        self.held.iter().filter(|held| held.standing == Standing::Completed).count()
    }
}

fn held_mut(held: &mut [Held], id: StripId) -> Option<&mut Held> {
    held.get_mut(usize::try_from(id.0.checked_sub(1)?).ok()?)
}

/// A request for tests and examples: a strip of 250 km near the equator.
#[cfg(test)]
pub fn equatorial_request(client_ref: &str, longitude_deg: f64) -> NamedRequest {
    NamedRequest {
        client_ref: client_ref.to_owned(),
        name: client_ref.to_owned(),
        request: swath_sim::strip::StripRequest {
            start_latitude_deg: 5.0,
            start_longitude_deg: longitude_deg,
            end_latitude_deg: 6.0,
            end_longitude_deg: longitude_deg + 2.0,
            priority: 0.5,
            acquisition_speed_m_s: 3000.0,
            bidirectional: false,
        },
    }
}

#[cfg(test)]
mod tests {
    use swath_sim::config::SimConfig;
    use swath_sim::guidance::TaskOutcome;
    use swath_sim::rng;

    use super::*;

    fn logic() -> RequestLogic {
        let model = Model::new(SimConfig::default()).unwrap();
        let initial = InitialState::draw(&model.config, &mut rng::stream(1, rng::INITIAL_STATE));
        RequestLogic::new(model, &initial, Tick(172_800))
    }

    fn record(task: u64, id: StripId, failure: Option<FailureReason>) -> TaskRecord {
        let outcome = TaskOutcome { failure, max_attitude_error: 0.05, min_elevation: 0.5 };
        let reward = if failure.is_none() { 0.5 } else { 0.0 };
        TaskRecord { task, start: Tick(0), end: Tick(300), strip: Some(id), t_pre: 100, t_acq: 200, outcome, reward }
    }

    #[test]
    fn the_same_request_again_is_the_same_strip_and_another_under_its_name_is_refused() {
        let mut logic = logic();
        let id = logic.submit(equatorial_request("a", 10.0)).unwrap();
        assert_eq!(logic.submit(equatorial_request("a", 10.0)), Ok(id));
        assert_eq!(logic.submit(equatorial_request("a", 20.0)).unwrap_err().code(), 108);
        let standings: Vec<_> = logic.take_changes().iter().map(|change| change.standing).collect();
        assert_eq!(standings, [Standing::Accepted, Standing::Rejected]);
    }

    #[test]
    fn a_failed_strip_is_offered_again_and_an_imaged_one_is_not() {
        let mut logic = logic();
        let id = logic.submit(equatorial_request("a", 10.0)).unwrap();
        logic.on_task(id);
        assert_eq!(logic.standing(id), Some(Standing::Scheduled));
        let offer = logic.on_decision_point(1, Tick(300), Some(&record(0, id, Some(FailureReason::Attitude))));
        assert_eq!(offer.candidates.len(), 1);
        logic.on_task(id);
        let offer = logic.on_decision_point(2, Tick(600), Some(&record(1, id, None)));
        logic.on_decision_point(2, Tick(600), Some(&record(1, id, None)));
        assert!(offer.candidates.is_empty());
        assert_eq!((offer.pending, offer.fulfilled), (0, 1));
        let changes = logic.take_changes();
        let last = changes.last().unwrap();
        assert_eq!((last.standing, last.attempts, last.reward), (Standing::Completed, 2, 0.5));
        assert_eq!(changes[2].reason.0, 201);
    }

    #[test]
    fn twins_are_fulfilled_together() {
        let mut logic = logic();
        let mut named = equatorial_request("a", 10.0);
        named.request.bidirectional = true;
        let id = logic.submit(named).unwrap();
        logic.on_decision_point(1, Tick(300), Some(&record(0, id, None)));
        assert_eq!(logic.standing(StripId(2)), Some(Standing::FulfilledByLink));
        assert_eq!(logic.counts()[&Standing::FulfilledByLink], 1);
    }

    #[test]
    fn texts_are_limited() {
        let mut logic = logic();
        let mut named = equatorial_request("a", 10.0);
        named.name = "x".repeat(10_000_000);
        assert_eq!(logic.submit(named).unwrap_err().code(), 107);
    }
}
