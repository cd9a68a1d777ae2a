//! Every request by its number, state, reference, place and time: one step changes all of them together.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use swath_sim::time::Tick;
use swath_sim::world::strip::{Strip, StripId, StripRequest};
use swath_sim::world::windows::Window;

use super::duplicates::{Place, place};
use super::index::{Area, Index};
use super::journal::Standing;
use super::lifecycle::{IllegalTransition, State};
use super::reason_number::Reason;
use super::request::Request;

/// The requests that have a number.
#[derive(Clone, Debug, Default)]
pub struct Register {
    requests: Vec<Request>,
    by_state: BTreeMap<State, BTreeSet<StripId>>,
    by_reference: HashMap<(String, String), StripId>,
    /// Orders of several strips by submitter and reference.
    by_order_ref: HashMap<(String, String), StripId>,
    /// The strips of each order.
    by_order: BTreeMap<StripId, Vec<StripId>>,
    /// Requests that are not over, by where their strips lie.
    by_place: HashMap<Place, Vec<StripId>>,
    index: Index,
}

impl Register {
    /// Adds a request under the next number.
    pub fn add(&mut self, request: Request, strip: &Strip, windows: &[Window]) -> StripId {
        let id = StripId::from_index(self.requests.len());
        self.index.add(id, strip, windows);
        if !request.order.client_ref.is_empty() {
            let key = (request.order.submitter.clone(), request.order.client_ref.clone());
            // The first of two twins has the reference; a replacement takes it over.
            let twin = self.by_reference.get(&key).copied().is_some_and(|known| {
                let wanted = &request.order.request;
                known.0 + 1 == id.0
                    && self.get(known).is_some_and(|known| {
                        wanted.bidirectional
                            && known.order.request == wanted.reversed()
                            && known.supersedes == request.supersedes
                    })
            });
            if !twin {
                self.by_reference.insert(key, id);
            }
        }
        if let Some(part) = &request.order.part {
            let key = (request.order.submitter.clone(), part.order_ref.clone());
            self.by_order_ref.entry(key).or_insert(request.order_id);
        }
        self.by_order.entry(request.order_id).or_default().push(id);
        if !request.state.is_final() {
            self.by_place.entry(place(&request.order.request)).or_default().push(id);
        }
        self.by_state.entry(request.state).or_default().insert(id);
        self.requests.push(request);
        id
    }

    /// The one place where a request that has a number changes its state; without the request nothing happens.
    ///
    /// # Errors
    /// When the life cycle has no such step.
    pub fn step(
        &mut self,
        id: StripId,
        to: State,
        reason: (Reason, String),
        actor: &str,
        now: Tick,
    ) -> Result<(), IllegalTransition> {
        let Some(request) = self.get_mut(id) else { return Ok(()) };
        let state = request.state.step(to)?;
        let before = std::mem::replace(&mut request.state, state);
        request.reason = reason;
        actor.clone_into(&mut request.actor);
        request.changed = now;
        let key = place(&request.order.request);
        if let Some(set) = self.by_state.get_mut(&before) {
            set.remove(&id);
        }
        self.by_state.entry(state).or_default().insert(id);
        if state.is_final()
            && let Some(there) = self.by_place.get_mut(&key)
        {
            there.retain(|&other| other != id);
            if there.is_empty() {
                self.by_place.remove(&key);
            }
        }
        Ok(())
    }

    /// A request by its number.
    #[must_use]
    pub fn get(&self, id: StripId) -> Option<&Request> {
        self.requests.get(id.index()?)
    }

    /// What a request has gone through.
    pub fn standing_mut(&mut self, id: StripId) -> Option<&mut Standing> {
        self.get_mut(id).map(|request| &mut request.standing)
    }

    fn get_mut(&mut self, id: StripId) -> Option<&mut Request> {
        self.requests.get_mut(id.index()?)
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.requests.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.requests.is_empty()
    }

    /// How many are in a state.
    #[must_use]
    pub fn count(&self, state: State) -> usize {
        self.by_state.get(&state).map_or(0, BTreeSet::len)
    }

    /// The first `limit` requests of a state with numbers from `from` on.
    pub fn in_state(&self, state: State, from: StripId, limit: usize) -> impl Iterator<Item = StripId> {
        self.by_state.get(&state).into_iter().flat_map(move |ids| ids.range(from..).take(limit).copied())
    }

    /// The request of a submitter under a reference.
    #[must_use]
    pub fn by_reference(&self, submitter: &str, client_ref: &str) -> Option<StripId> {
        self.by_reference.get(&(submitter.to_owned(), client_ref.to_owned())).copied()
    }

    /// Number of the order of several strips of a submitter under a reference.
    #[must_use]
    pub fn order_by_reference(&self, submitter: &str, order_ref: &str) -> Option<StripId> {
        self.by_order_ref.get(&(submitter.to_owned(), order_ref.to_owned())).copied()
    }

    /// The strips of an order, in ascending order; none if there is no such order.
    #[must_use]
    pub fn strips_of(&self, order_id: StripId) -> &[StripId] {
        self.by_order.get(&order_id).map_or(&[], Vec::as_slice)
    }

    /// Requests that are not over for the same strip, to about a metre.
    pub fn at_place(&self, request: &StripRequest) -> impl Iterator<Item = (StripId, &Request)> {
        let there = self.by_place.get(&place(request)).into_iter().flatten();
        there.filter_map(|&id| Some((id, self.get(id)?)))
    }

    /// Strips that may touch an area, in ascending order.
    #[must_use]
    pub fn near(&self, area: &Area) -> Vec<StripId> {
        self.index.near(area)
    }

    /// Strips that may have a window between two ticks, in ascending order.
    #[must_use]
    pub fn between(&self, from: Tick, until: Tick) -> Vec<StripId> {
        self.index.between(from, until)
    }
}
