//! Orders as wholes: what each asks for, and how much of it is imaged.

use std::collections::BTreeMap;

use anyhow::Result;
use serde_json::{Value, json};
use swath_mission::orders::order::Order;
use swath_mission::outcome::OrderOutcome;
use swath_mission::requests::lifecycle::State;
use swath_mission::requests::logic::RequestLogic;
use swath_msgs::swath_msgs as msg;
use swath_node::stamp::Stamper;
use swath_sim::world::strip::StripId;

use super::json::state_name;
use super::messages::{stored_status, strip_status};
use super::store::Store;

/// Orders by their numbers, from the strips of them that are known.
#[derive(Clone, Debug, Default)]
pub struct Orders(BTreeMap<u64, Whole>);

impl Orders {
    /// Adds a strip to its order; strips come in the order of their numbers.
    pub fn add(&mut self, status: &msg::StripStatus) {
        self.0.entry(status.order_id).or_default().add(status);
    }

    /// The orders of statuses of all requests, in the order of their numbers.
    pub fn of(statuses: impl IntoIterator<Item = msg::StripStatus>) -> Self {
        let mut orders = Self::default();
        statuses.into_iter().for_each(|status| orders.add(&status));
        orders
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Each of them.
    pub fn wholes(&self) -> impl Iterator<Item = &Whole> {
        self.0.values()
    }

    /// What became of those that have several strips.
    #[must_use]
    pub fn outcomes(&self) -> Vec<OrderOutcome> {
        self.wholes().filter(|whole| whole.of > 1).map(Whole::outcome).collect()
    }

    /// How many strips there are, and what share of their worth is imaged.
    #[must_use]
    pub fn summary(&self) -> String {
        let strips: usize = self.0.values().map(|whole| whole.parts.len()).sum();
        let (worth, imaged) = self.0.values().fold((0.0, 0.0), |sum, whole| {
            let worth = whole.worth();
            (sum.0 + worth, sum.1 + whole.priority() * whole.imaged())
        });
        let share = if worth > 0.0 { 100.0 * imaged / worth } else { 0.0 };
        format!("{strips} strips, {share:.1} % of what they show is imaged")
    }
}

/// An order, from the strips of it that are known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Whole {
    number: u64,
    submitter: String,
    reference: String,
    name: String,
    /// Strips that it has.
    of: u32,
    /// Its parts as they stand, each with its share of the worth and its priority.
    parts: BTreeMap<u32, (u8, f64, f64)>,
    reward: f64,
}

impl Whole {
    /// Of two directions of a strip, and of a strip that was asked for again, the one that was imaged counts, else the
    /// last one.
    fn add(&mut self, status: &msg::StripStatus) {
        if self.parts.is_empty() {
            let alone = status.parts == 0;
            self.number = status.order_id;
            self.submitter.clone_from(&status.submitter);
            self.reference.clone_from(if alone { &status.client_ref } else { &status.order_ref });
            let name = &status.strip.name;
            let piece = name.rfind(' ').filter(|_| !alone && name.ends_with(&format!("/{}", status.parts)));
            self.name = name[..piece.unwrap_or(name.len())].to_owned();
            self.of = status.parts.max(1);
        }
        self.reward += status.reward;
        let entry = (status.state, status.share, status.strip.priority);
        let slot = self.parts.entry(status.part).or_insert(entry);
        if !is_imaged(slot.0) {
            *slot = entry;
        }
    }

    /// Share of its worth that is imaged [1].
    fn imaged(&self) -> f64 {
        // The sum of nothing is -0.
        self.parts.values().filter(|(state, ..)| is_imaged(*state)).map(|(_, share, _)| share).sum::<f64>() + 0.0
    }

    /// Sum of the priorities of the strips that are known [1].
    fn worth(&self) -> f64 {
        self.parts.values().map(|(_, _, priority)| priority).sum::<f64>() + 0.0
    }

    /// Its priority: what imaging all of it is worth [1].
    fn priority(&self) -> f64 {
        let share: f64 = self.parts.values().map(|(_, share, _)| share).sum();
        if share > 0.0 { self.worth() / share } else { 0.0 }
    }

    /// How many of its strips are in which state, in the order of the states' numbers.
    #[must_use]
    pub fn states(&self) -> Vec<(&'static str, usize)> {
        let mut states = BTreeMap::new();
        for (state, ..) in self.parts.values() {
            *states.entry(*state).or_insert(0) += 1;
        }
        states.into_iter().map(|(state, count)| (state_name(state), count)).collect()
    }

    /// What became of it.
    #[must_use]
    pub fn outcome(&self) -> OrderOutcome {
        OrderOutcome {
            order_id: self.number,
            submitter: self.submitter.clone(),
            order_ref: self.reference.clone(),
            name: self.name.clone(),
            strips: self.of,
            priority: self.priority(),
            imaged: self.imaged(),
            reward: self.reward,
        }
    }

    /// The same with its states, for machines.
    #[must_use]
    pub fn json(&self) -> Value {
        let mut json = json!(self.outcome());
        let states = self.states().into_iter().map(|(state, count)| (state.to_owned(), count.into()));
        json["states"] = Value::Object(states.collect());
        json
    }
}

fn is_imaged(state: u8) -> bool {
    [State::Completed, State::FulfilledByLink].iter().any(|imaged| imaged.number() == state)
}

/// The orders of a store, and where they stand.
///
/// # Errors
/// When the store cannot be read.
pub fn stored(store: &Store) -> Result<Vec<(Order, msg::StripStatus)>> {
    let snapshot = store.snapshot()?;
    let stamper = store.stamper()?;
    let stored = (1..).map(StripId).zip(snapshot.requests);
    let requests = stored.map(|(id, stored)| {
        let status = stored_status(&stamper, snapshot.progress.now, id, &stored);
        (stored.request.order, status)
    });
    Ok(requests.collect())
}

/// What became of the orders of a request manager's memory.
#[must_use]
pub fn outcomes(stamper: &Stamper, logic: &RequestLogic) -> Vec<OrderOutcome> {
    let ids = (1..=logic.len() as u64).map(StripId);
    let requests = ids.filter_map(|id| Some(strip_status(stamper, logic, id, logic.request(id)?)));
    Orders::of(requests).outcomes()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(id: u64, part: u32, state: State, linked_to: u64) -> msg::StripStatus {
        let strip = msg::Strip { id, name: format!("po {part}/2"), priority: 0.4, ..Default::default() };
        msg::StripStatus {
            strip,
            order_id: 3,
            order_ref: "po".to_owned(),
            part,
            parts: 2,
            share: 0.5,
            state: state.number(),
            reward: if state == State::Completed { 0.4 } else { 0.0 },
            linked_to,
            ..Default::default()
        }
    }

    #[test]
    fn an_order_counts_each_of_its_strips_once() {
        let mut whole = Whole::default();
        for status in [
            strip(3, 1, State::Completed, 4),
            strip(4, 1, State::FulfilledByLink, 3),
            strip(5, 2, State::CancelledByUser, 0),
            strip(9, 2, State::Accepted, 0),
        ] {
            whole.add(&status);
        }
        assert_eq!((whole.number, whole.name.as_str(), whole.of), (3, "po", 2));
        assert_eq!((whole.imaged(), whole.priority(), whole.reward), (0.5, 0.8, 0.4));
        assert_eq!(whole.json()["states"], json!({"completed": 1, "accepted": 1}));
        whole.add(&strip(10, 2, State::Completed, 0));
        assert_eq!((whole.imaged(), whole.reward), (1.0, 0.8));
    }

    #[test]
    fn what_is_served_by_the_imaging_of_another_request_is_imaged() {
        let mut orders = Orders::default();
        orders.add(&strip(3, 1, State::FulfilledByLink, 0));
        orders.add(&strip(4, 2, State::Accepted, 0));
        assert_eq!(orders.summary(), "2 strips, 50.0 % of what they show is imaged");
    }
}
