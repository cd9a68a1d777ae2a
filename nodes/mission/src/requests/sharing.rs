//! One imaging for all who ask for the same strip.
//!
//! Of open requests of several submitters for one strip, the one that is under way or of the greatest priority waits for
//! the satellite, and the others are served by it. When it leaves without having been imaged, the next one waits in its
//! place.

use std::cmp::Reverse;

use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

use super::lifecycle::State;
use super::logic::RequestLogic;
use super::reason_number::Reason;
use super::request::SYSTEM;

impl RequestLogic {
    /// The request whose imaging serves this one too.
    #[must_use]
    pub fn served_by(&self, id: StripId) -> Option<StripId> {
        self.served_by.get(&id).copied()
    }

    /// Settles who waits for the satellite where a request has come, or has changed.
    pub(super) fn share_imaging(&mut self, id: StripId) {
        let Some(request) = self.request(id) else { return };
        let wanted = &request.order.request;
        let mut open: Vec<StripId> = self
            .register
            .at_place(wanted)
            .filter(|(_, other)| is_open(other.state))
            .filter(|(_, other)| other.order.request.acquisition_speed_m_s == wanted.acquisition_speed_m_s)
            .map(|(id, _)| id)
            .collect();
        if !open.contains(&id) {
            self.served_by.remove(&id);
        }
        open.sort_by_key(|&id| self.precedence(id));
        let mut waiting: Vec<StripId> = Vec::new();
        for &id in &open {
            let server = waiting.iter().copied().find(|&server| self.can_serve(server, id));
            match server {
                Some(server) => {
                    self.served_by.insert(id, server);
                    self.catalogue.hold(id);
                }
                None => {
                    if self.served_by.remove(&id).is_some() {
                        self.catalogue.release(id);
                    }
                    waiting.push(id);
                }
            }
        }
    }

    /// What is under way comes first, then the greatest priority, then what was asked for first.
    fn precedence(&self, id: StripId) -> (bool, Reverse<u64>, StripId) {
        let request = self.request(id);
        let idle = request.is_none_or(|request| request.state == State::Accepted);
        // Priorities are not negative: their bits order as they do.
        (idle, Reverse(request.map_or(0, |request| request.order.request.priority.to_bits())), id)
    }

    fn can_serve(&self, server: StripId, id: StripId) -> bool {
        let (Some(server), Some(other)) = (self.request(server), self.request(id)) else { return false };
        let ((from, until), (other_from, other_until)) = (server.order.validity_ns(), other.order.validity_ns());
        server.order.submitter != other.order.submitter && from < other_until && other_from < until
    }

    /// Requests that the imaging of one, which started at a tick, has served.
    pub(super) fn served_with(&self, server: StripId, imaging: Tick) -> Vec<StripId> {
        let in_time = |id: &StripId| {
            let windows = self.strip(*id).map_or(&[][..], |listed| &listed.windows);
            windows.iter().any(|window| window.open <= imaging && imaging <= window.close)
        };
        let served = self.served_by.iter().filter(|(_, by)| **by == server).map(|(id, _)| *id);
        served.filter(in_time).collect()
    }

    /// A request was served by the imaging of another one, and its twin with it.
    pub(super) fn served(&mut self, id: StripId, server: StripId) {
        let twin = self.catalogue.get(id).and_then(|entry| entry.linked);
        self.catalogue.fulfil(id);
        for id in [Some(id), twin].into_iter().flatten() {
            if self.state(id).is_some_and(|state| !state.is_final()) {
                let text = format!("request {} was imaged", server.0);
                self.must(id, State::FulfilledByLink, (Reason::None, text), SYSTEM);
            }
        }
    }
}

fn is_open(state: State) -> bool {
    matches!(state, State::Accepted | State::Scheduled | State::Executing)
}
