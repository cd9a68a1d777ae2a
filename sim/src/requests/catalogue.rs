//! Every strip of a mission with its windows, and the next N of them by closing time.

use std::collections::BTreeSet;

use crate::error::StripError;
use crate::time::Tick;
use crate::vehicle::model::Model;
use crate::world::orbit::Orbit;
use crate::world::strip::{Strip, StripId, StripRequest};
use crate::world::windows::{Window, WindowFinder};

/// A strip that a planner may choose, with its next window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Identity in the catalogue.
    pub id: StripId,
    /// The same strip scanned the other way, if both may be chosen.
    pub twin: Option<StripId>,
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
    /// As pending, but not offered until it is released.
    Held,
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

/// When a strip may be imaged: not before `from`, and done by `until`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Validity {
    /// First tick at which imaging may start.
    pub from: Tick,
    /// Last tick of imaging; `None` for any.
    pub until: Option<Tick>,
}

impl Validity {
    /// What is left of a start window of a strip that takes `t_acq` ticks.
    fn clip(self, window: Window, t_acq: u32) -> Option<Window> {
        let latest = self.until.map_or(Some(u64::MAX), |until| until.0.checked_sub(u64::from(t_acq)))?;
        let window = Window { open: window.open.max(self.from), close: window.close.min(Tick(latest)) };
        (window.open <= window.close).then_some(window)
    }
}

/// A strip with its windows, not yet in a catalogue.
#[derive(Clone, Debug, PartialEq)]
pub struct Prepared {
    /// The strip.
    pub strip: Strip,
    /// Acquisition time T_acq [ticks].
    pub t_acq: u32,
    /// Start windows, in order; at least one.
    pub windows: Vec<Window>,
}

/// The strips of a mission. Identities are numbers from 1 in order of addition.
#[derive(Clone, Debug)]
pub struct Catalogue {
    finder: WindowFinder,
    horizon: Tick,
    entries: Vec<Entry>,
    /// Pending strips by the closing of their next window.
    queue: BTreeSet<(Tick, StripId)>,
    /// Held strips by the closing of their last window.
    held: BTreeSet<(Tick, StripId)>,
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
            held: BTreeSet::new(),
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
        Ok(self.insert(self.prepare(model, request, Validity::default(), now)?))
    }

    /// The strip of a request that becomes known at `now`, one way, with its windows up to the horizon.
    ///
    /// # Errors
    /// Why the request is refused.
    pub fn prepare(
        &self,
        model: &Model,
        request: &StripRequest,
        validity: Validity,
        now: Tick,
    ) -> Result<Prepared, StripError> {
        let strip = request.to_strip(&model.config.requests, model.config.earth.radius_m)?;
        let t_acq = strip.acquisition_ticks(model.period);
        let mut windows = Vec::new();
        self.finder.find(&strip, now, self.horizon, &mut windows);
        if validity != Validity::default() {
            windows = windows.into_iter().filter_map(|window| validity.clip(window, t_acq)).collect();
            windows.retain(|window| window.close > now);
        }
        if windows.is_empty() {
            let horizon_s = model.period.time_s(self.horizon) - model.period.time_s(now);
            return Err(StripError::NoWindow { horizon_s });
        }
        Ok(Prepared { strip, t_acq, windows })
    }

    /// Adds a prepared strip; one without windows has expired.
    pub fn insert(&mut self, prepared: Prepared) -> StripId {
        let Prepared { strip, t_acq, windows } = prepared;
        let id = StripId::from_index(self.entries.len());
        let state = match windows.first() {
            Some(first) => {
                self.queue.insert((first.close, id));
                StripState::Pending
            }
            None => StripState::Expired,
        };
        self.entries.push(Entry { strip, t_acq, windows, state, linked: None, next: 0 });
        id
    }

    /// What finds the windows.
    #[must_use]
    pub fn finder(&self) -> &WindowFinder {
        &self.finder
    }

    /// Tick up to which windows are sought.
    #[must_use]
    pub fn horizon(&self) -> Tick {
        self.horizon
    }

    /// Adds every request that can be flown and leaves out the others, such as strips too far from the equator for the
    /// orbit; returns how many were added.
    pub fn add_all(&mut self, model: &Model, requests: &[StripRequest], now: Tick) -> usize {
        requests.iter().filter(|request| self.add(model, request, now).is_ok()).count()
    }

    /// Makes two strips each other's twin: fulfilling either fulfils both.
    pub fn link(&mut self, a: StripId, b: StripId) {
        for (one, other) in [(a, b), (b, a)] {
            if let Some(entry) = self.entry_mut(one) {
                entry.linked = Some(other);
            }
        }
    }

    /// A strip by its identity.
    #[must_use]
    pub fn get(&self, id: StripId) -> Option<&Entry> {
        self.entries.get(id.index()?)
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
        candidates.extend(self.queue.iter().take(count).filter_map(|&(_, id)| {
            let entry = self.get(id)?;
            entry.windows.get(entry.next).map(|&window| entry.candidate(id, window))
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
            let Some(entry) = self.entry_mut(id) else { continue };
            if let Some(window) = entry.next_after(now) {
                self.queue.insert((window.close, id));
            } else {
                entry.state = StripState::Expired;
                expired.push(id);
            }
        }
        while let Some(&(_, id)) = self.held.first().filter(|&&(close, _)| close <= now) {
            self.held.pop_first();
            if let Some(entry) = self.entry_mut(id) {
                entry.state = StripState::Expired;
            }
            expired.push(id);
        }
        expired
    }

    /// Stops offering a pending strip. Returns whether it was pending.
    pub fn hold(&mut self, id: StripId) -> bool {
        if self.get(id).is_none_or(|entry| entry.state != StripState::Pending) || !self.leave(id, StripState::Held) {
            return false;
        }
        if let Some(last) = self.get(id).and_then(|entry| entry.windows.last()) {
            self.held.insert((last.close, id));
        }
        true
    }

    /// Offers a held strip again. Returns whether it was held.
    pub fn release(&mut self, id: StripId) -> bool {
        if self.get(id).is_none_or(|entry| entry.state != StripState::Held) || !self.leave(id, StripState::Pending) {
            return false;
        }
        let Some(entry) = self.get(id) else { return false };
        // Windows that closed meanwhile are passed over by the next `next`.
        self.queue.insert((entry.windows[entry.next].close, id));
        true
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

    /// Takes a pending or held strip back. Returns whether it was either.
    pub fn remove(&mut self, id: StripId) -> bool {
        self.leave(id, StripState::Removed)
    }

    fn leave(&mut self, id: StripId, state: StripState) -> bool {
        let Some(entry) = self.entry_mut(id) else { return false };
        let before = std::mem::replace(&mut entry.state, state);
        let (next, last) = (entry.windows.get(entry.next).copied(), entry.windows.last().copied());
        match (before, next, last) {
            (StripState::Pending, Some(next), _) => self.queue.remove(&(next.close, id)),
            (StripState::Held, _, Some(last)) => self.held.remove(&(last.close, id)),
            _ => {
                if let Some(entry) = self.entry_mut(id) {
                    entry.state = before;
                }
                false
            }
        }
    }

    fn entry_mut(&mut self, id: StripId) -> Option<&mut Entry> {
        self.entries.get_mut(id.index()?)
    }
}

impl Entry {
    /// The strip in one of its windows.
    #[must_use]
    pub fn candidate(&self, id: StripId, window: Window) -> Candidate {
        Candidate { id, twin: self.linked, strip: self.strip, t_acq: self.t_acq, window }
    }

    /// The first window that closes after `now`; the ones before it are not looked at again.
    fn next_after(&mut self, now: Tick) -> Option<Window> {
        self.next += self.windows[self.next..].iter().take_while(|window| window.close <= now).count();
        self.windows.get(self.next).copied()
    }

    /// Windows that close after `now`.
    #[must_use]
    pub fn windows_after(&self, now: Tick) -> &[Window] {
        let closed = self.windows.partition_point(|window| window.close <= now);
        &self.windows[closed..]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SimConfig;
    use crate::requests::scenario::ScenarioConfig;
    use crate::rng;
    use crate::world::orbit::OrbitPhase;

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
    fn held_strips_are_not_offered_and_expire_all_the_same() {
        let (_, mut catalogue) = catalogue();
        let mut candidates = Vec::new();
        catalogue.next(Tick(0), 40, &mut candidates);
        let id = candidates[0].id;
        assert!(catalogue.hold(id) && !catalogue.hold(id));
        catalogue.next(Tick(0), 40, &mut candidates);
        assert!(candidates.iter().all(|candidate| candidate.id != id));
        assert!(catalogue.release(id) && !catalogue.release(id));
        catalogue.next(Tick(0), 40, &mut candidates);
        assert_eq!(candidates[0].id, id);
        assert!(catalogue.hold(id));
        assert!(catalogue.next(Tick(400_000), 40, &mut candidates).contains(&id));
        assert!(!catalogue.release(id) && !catalogue.remove(id));
    }

    #[test]
    fn validity_clips_windows_so_that_imaging_is_done_in_time() {
        let (model, catalogue) = catalogue();
        let request = StripRequest {
            start_latitude_deg: 10.0,
            start_longitude_deg: 20.0,
            end_latitude_deg: 12.0,
            end_longitude_deg: 21.0,
            priority: 0.5,
            acquisition_speed_m_s: 3000.0,
            bidirectional: false,
        };
        let any = catalogue.prepare(&model, &request, Validity::default(), Tick(0)).unwrap();
        let window = any.windows[1];
        let validity =
            Validity { from: Tick(window.open.0 + 3), until: Some(Tick(window.close.0 + u64::from(any.t_acq) - 5)) };
        let clipped = catalogue.prepare(&model, &request, validity, Tick(0)).unwrap();
        let expected = Window { open: Tick(window.open.0 + 3), close: Tick(window.close.0 - 5) };
        assert_eq!(clipped.windows, [expected]);
        let between = Validity { from: Tick(any.windows[0].close.0 + 1), until: Some(window.open) };
        let refused = catalogue.prepare(&model, &request, between, Tick(0));
        assert!(matches!(refused, Err(StripError::NoWindow { .. })));
        let early = Validity { from: Tick(0), until: Some(Tick(3)) };
        let refused = catalogue.prepare(&model, &request, early, Tick(0));
        assert!(matches!(refused, Err(StripError::NoWindow { .. })));
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
