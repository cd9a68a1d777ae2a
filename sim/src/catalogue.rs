//! Every strip of a mission with its windows, and the next N of them by closing time.

use std::collections::BTreeSet;

use crate::error::StripError;
use crate::model::Model;
use crate::orbit::Orbit;
use crate::strip::{Strip, StripId, StripRequest};
use crate::time::Tick;
use crate::windows::{Window, WindowFinder};

/// A strip that a planner may choose, with its next window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Identity in the catalogue.
    pub id: StripId,
    /// The strip.
    pub strip: Strip,
    /// Acquisition time T_acq [ticks].
    pub t_acq: u32,
    /// Next start window; it has not closed yet.
    pub window: Window,
}

/// Where a strip stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StripState {
    /// Not imaged yet; a window is still to come.
    Pending,
    /// Imaged.
    Fulfilled,
    /// Its linked twin was imaged.
    FulfilledByLink,
    /// Taken back.
    Removed,
    /// Its last window has closed.
    Expired,
}

/// A strip with its windows.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The strip.
    pub strip: Strip,
    /// Acquisition time T_acq [ticks].
    pub t_acq: u32,
    /// Start windows up to the catalogue's horizon, in order.
    pub windows: Vec<Window>,
    /// Where it stands.
    pub state: StripState,
    /// The strip scanned the other way; fulfilling either fulfils both.
    pub linked: Option<StripId>,
    next: usize,
}

/// The strips of a mission. Identities are numbers from 1 in order of addition.
#[derive(Clone, Debug)]
pub struct Catalogue {
    finder: WindowFinder,
    horizon: Tick,
    entries: Vec<Entry>,
    /// Pending strips by the closing of their next window.
    queue: BTreeSet<(Tick, StripId)>,
}

impl Catalogue {
    /// An empty catalogue whose windows are sought up to `horizon`.
    #[must_use]
    pub fn new(model: &Model, orbit: &Orbit, horizon: Tick) -> Self {
        Self {
            finder: WindowFinder::new(&model.config, orbit, model.period),
            horizon,
            entries: Vec::new(),
            queue: BTreeSet::new(),
        }
    }

    /// Adds a request that becomes known at `now`. A bidirectional one gets a linked twin, scanned the other way, with
    /// the identity after its own; fulfilling either fulfils both.
    ///
    /// # Errors
    /// Why the request is refused; the catalogue is unchanged then.
    pub fn add(&mut self, model: &Model, request: &StripRequest, now: Tick) -> Result<StripId, StripError> {
        let forward = self.add_one_way(model, request, now);
        if !request.bidirectional {
            return forward;
        }
        match (forward, self.add_one_way(model, &request.reversed(), now)) {
            (Ok(id), Ok(twin)) => {
                self.link(id, twin);
                Ok(id)
            }
            (Ok(id), Err(_)) | (Err(_), Ok(id)) => Ok(id),
            (Err(error), Err(_)) => Err(error),
        }
    }

    fn add_one_way(&mut self, model: &Model, request: &StripRequest, now: Tick) -> Result<StripId, StripError> {
        let strip = request.to_strip(&model.config.requests, model.config.earth.radius_m)?;
        let mut windows = Vec::new();
        self.finder.find(&strip, now, self.horizon, &mut windows);
        let Some(first) = windows.first() else {
            let horizon_s = model.period.time_s(self.horizon) - model.period.time_s(now);
            return Err(StripError::NoWindow { horizon_s });
        };
        let id = StripId(self.entries.len() as u64 + 1);
        self.queue.insert((first.close, id));
        self.entries.push(Entry {
            strip,
            t_acq: strip.acquisition_ticks(model.period),
            windows,
            state: StripState::Pending,
            linked: None,
            next: 0,
        });
        Ok(id)
    }

    /// Adds every request that can be flown and leaves out the others, such as strips too far from the equator for the
    /// orbit; returns how many were added.
    pub fn add_all(&mut self, model: &Model, requests: &[StripRequest], now: Tick) -> usize {
        requests.iter().filter(|request| self.add(model, request, now).is_ok()).count()
    }

    fn link(&mut self, a: StripId, b: StripId) {
        for (one, other) in [(a, b), (b, a)] {
            if let Some(entry) = self.entry_mut(one) {
                entry.linked = Some(other);
            }
        }
    }

    /// A strip by its identity.
    #[must_use]
    pub fn get(&self, id: StripId) -> Option<&Entry> {
        self.entries.get(index(id)?)
    }

    /// Number of strips ever added.
    #[must_use]
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether no strip was ever added.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Number of strips that are still to be imaged.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.queue.len()
    }

    /// The next `count` pending strips whose window closes after `now`, by closing time, into `candidates`.
    ///
    /// A strip whose window has closed moves on to its following one, or expires; those that expired are returned.
    pub fn next(&mut self, now: Tick, count: usize, candidates: &mut Vec<Candidate>) -> Vec<StripId> {
        let expired = self.move_on(now);
        candidates.clear();
        candidates.extend(self.queue.iter().take(count).map(|&(_, id)| {
            let entry = &self.entries[id.0 as usize - 1];
            Candidate { id, strip: entry.strip, t_acq: entry.t_acq, window: entry.windows[entry.next] }
        }));
        expired
    }

    fn move_on(&mut self, now: Tick) -> Vec<StripId> {
        let mut expired = Vec::new();
        while let Some(&(close, id)) = self.queue.first() {
            if close > now {
                break;
            }
            self.queue.pop_first();
            let entry = &mut self.entries[id.0 as usize - 1];
            let closed = entry.windows[entry.next..].iter().take_while(|window| window.close <= now).count();
            entry.next += closed;
            if let Some(window) = entry.windows.get(entry.next) {
                self.queue.insert((window.close, id));
            } else {
                entry.state = StripState::Expired;
                expired.push(id);
            }
        }
        expired
    }

    /// Marks a strip as imaged, and its twin with it. Returns its priority, or `None` when it was not pending.
    pub fn fulfil(&mut self, id: StripId) -> Option<f64> {
        if !self.leave(id, StripState::Fulfilled) {
            return None;
        }
        let entry = self.get(id)?;
        let priority = entry.strip.priority;
        if let Some(twin) = entry.linked {
            self.leave(twin, StripState::FulfilledByLink);
        }
        Some(priority)
    }

    /// Takes a pending strip back. Returns whether it was pending.
    pub fn remove(&mut self, id: StripId) -> bool {
        self.leave(id, StripState::Removed)
    }

    fn leave(&mut self, id: StripId, state: StripState) -> bool {
        let Some(entry) = self.entry_mut(id) else { return false };
        if entry.state != StripState::Pending {
            return false;
        }
        entry.state = state;
        let close = entry.windows[entry.next].close;
        self.queue.remove(&(close, id))
    }

    fn entry_mut(&mut self, id: StripId) -> Option<&mut Entry> {
        self.entries.get_mut(index(id)?)
    }
}

fn index(id: StripId) -> Option<usize> {
    usize::try_from(id.0.checked_sub(1)?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SimConfig;
    use crate::orbit::OrbitPhase;
    use crate::rng;
    use crate::scenario::ScenarioConfig;

    fn catalogue() -> (Model, Catalogue) {
        let model = Model::new(SimConfig::default()).unwrap();
        let phase = OrbitPhase { raan_deg: 0.0, argument_of_latitude_deg: 0.0 };
        let orbit = Orbit::new(&model.config, phase, model.period);
        let mut catalogue = Catalogue::new(&model, &orbit, Tick(172_800));
        let radius = model.config.earth.radius_m;
        let requests = ScenarioConfig::default().generate(&mut rng::stream(3, rng::CATALOGUE), 500, radius);
        assert!(catalogue.add_all(&model, &requests, Tick(0)) > 350);
        (model, catalogue)
    }

    #[test]
    fn candidates_close_after_now_in_order_and_none_is_passed_over() {
        let (_, mut catalogue) = catalogue();
        let mut candidates = Vec::new();
        for now in (0..172_800).step_by(5000).map(Tick) {
            catalogue.next(now, 40, &mut candidates);
            let expected = (1..=catalogue.len() as u64)
                .filter_map(|id| {
                    catalogue.get(StripId(id))?.windows.iter().find(|w| w.close > now).map(|w| (w.close, id))
                })
                .collect::<BTreeSet<_>>();
            let found = candidates.iter().map(|c| (c.window.close, c.id.0)).collect::<Vec<_>>();
            assert_eq!(found, expected.into_iter().take(40).collect::<Vec<_>>());
        }
    }

    #[test]
    fn strips_expire_when_their_last_window_has_closed() {
        let (_, mut catalogue) = catalogue();
        let mut candidates = Vec::new();
        let pending = catalogue.pending();
        let expired = catalogue.next(Tick(400_000), 40, &mut candidates);
        assert_eq!(expired.len(), pending);
        assert!(candidates.is_empty());
        assert_eq!(catalogue.get(expired[0]).unwrap().state, StripState::Expired);
    }

    #[test]
    fn fulfilling_a_strip_fulfils_its_twin_and_pays_once() {
        let (model, mut catalogue) = catalogue();
        let request = StripRequest {
            start_latitude_deg: 10.0,
            start_longitude_deg: 20.0,
            end_latitude_deg: 12.0,
            end_longitude_deg: 21.0,
            priority: 0.5,
            acquisition_speed_m_s: 3000.0,
            bidirectional: true,
        };
        let a = catalogue.add(&model, &request, Tick(0)).unwrap();
        let b = StripId(a.0 + 1);
        let (forward, backward) = (catalogue.get(a).unwrap(), catalogue.get(b).unwrap());
        assert_eq!((forward.linked, backward.linked), (Some(b), Some(a)));
        assert!((forward.strip.end_E() - backward.strip.start_E).norm() < 1e-12);
        let pending = catalogue.pending();
        assert_eq!(catalogue.fulfil(a), Some(catalogue.get(a).unwrap().strip.priority));
        assert_eq!(catalogue.fulfil(a), None);
        assert_eq!(catalogue.fulfil(b), None);
        assert_eq!(catalogue.get(b).unwrap().state, StripState::FulfilledByLink);
        assert_eq!(catalogue.pending(), pending - 2);
        assert_eq!(catalogue.fulfil(StripId(0)), None);
        assert_eq!(catalogue.fulfil(StripId(9999)), None);
    }
}
