//! Taking requests in: what is checked, and where a request is found again.

use swath_sim::error::StripError;
use swath_sim::requests::catalogue::{Prepared, Validity};
use swath_sim::time::Tick;
use swath_sim::world::strip::{StripId, StripRequest};

use super::journal::{Added, Change, Entry, Standing};
use super::lifecycle::State;
use super::logic::{Request, RequestLogic, SYSTEM};
use super::refusal::{ATTEMPTS_MAX, CAPACITY, Refusal, TEXT_MAX, check_text};
use crate::orders::geojson::NamedRequest;

/// Units of a degree in which strips are compared: about a metre.
const SAME_PLACE_PER_DEG: f64 = 1e5;

/// Where a strip lies: latitude and longitude of its ends in those units.
pub(super) type Place = [i32; 4];

impl RequestLogic {
    /// A request's strip one way or both, checked at a tick but not taken.
    ///
    /// # Errors
    /// Why it would be refused.
    pub(super) fn prepare(&self, named: &NamedRequest, at: Tick) -> Result<Vec<(StripRequest, Prepared)>, Refusal> {
        check_text("name", &named.name)?;
        check_text("client_ref", &named.client_ref)?;
        check_text("submitter", &named.submitter)?;
        if named.max_attempts > ATTEMPTS_MAX {
            return Err(Refusal::Attempts { given: named.max_attempts });
        }
        let request = &named.request;
        // What is wrong with the strip itself comes before when it may be imaged.
        request.to_strip(&self.model.config.requests, self.model.config.earth.radius_m)?;
        let validity = self.validity(named, at)?;
        let prepare = |request: StripRequest| {
            let prepared = self.catalogue.prepare(&self.model, &request, validity, at)?;
            Ok::<_, StripError>((request, prepared))
        };
        if !request.bidirectional {
            return Ok(vec![prepare(request.clone())?]);
        }
        match (prepare(request.clone()), prepare(request.reversed())) {
            (Ok(forward), Ok(backward)) => Ok(vec![forward, backward]),
            (Ok(one), Err(_)) | (Err(_), Ok(one)) => Ok(vec![one]),
            (Err(error), Err(_)) => Err(error.into()),
        }
    }

    fn validity(&self, named: &NamedRequest, at: Tick) -> Result<Validity, Refusal> {
        let period_ns = self.model.period.nanoseconds();
        let epoch_ns = self.rules.epoch_ns;
        let since_epoch = |ns: u64| (ns as f64 - epoch_ns as f64) * 1e-9;
        let (from_ns, until_ns) = (named.valid_from_ns, named.valid_until_ns);
        let from = Tick(from_ns.saturating_sub(epoch_ns).div_ceil(period_ns));
        if until_ns == 0 {
            return Ok(Validity { from, until: None });
        }
        if until_ns <= from_ns {
            return Err(Refusal::ValidityOrder { from_s: since_epoch(from_ns), until_s: since_epoch(until_ns) });
        }
        let until = Tick(until_ns.saturating_sub(epoch_ns) / period_ns);
        if until_ns < epoch_ns || until <= at {
            let now_s = self.model.period.time_s(at);
            return Err(Refusal::ValidityOver { until_s: since_epoch(until_ns), now_s });
        }
        Ok(Validity { from, until: Some(until) })
    }

    pub(super) fn take_in(
        &mut self,
        named: &NamedRequest,
        replaces: Option<StripId>,
        at: Tick,
    ) -> Result<StripId, Refusal> {
        if let Some(id) = self.by_reference(&named.submitter, &named.client_ref).filter(|&id| Some(id) != replaces) {
            return if same_order(&self.requests[id.0 as usize - 1].named, named) {
                Ok(id)
            } else {
                let client_ref = named.client_ref.chars().take(TEXT_MAX).collect();
                Err(Refusal::Reference { client_ref, id: id.0 })
            };
        }
        if self.requests.len() + 1 >= CAPACITY {
            return Err(Refusal::Capacity { count: self.requests.len() });
        }
        let ways = self.prepare(named, at)?;
        self.check_same_strip(named, replaces)?;
        let state = State::Received.step(if named.hold_for_approval { State::Held } else { State::Accepted });
        let state = state.map_err(|illegal| Refusal::State { id: 0, illegal })?;
        let first = StripId(self.requests.len() as u64 + 1);
        let twin = (ways.len() > 1).then_some(StripId(first.0 + 1));
        for (id, (request, prepared)) in (first.0..).map(StripId).zip(ways) {
            let named = NamedRequest { request, ..named.clone() };
            let linked = if id == first { twin } else { Some(first) };
            let request = Request {
                actor: named.submitter.clone(),
                named,
                state,
                reason: (0, String::new()),
                created: at,
                changed: at,
                standing: Standing::default(),
                supersedes: replaces,
            };
            self.add(id, request, prepared, linked);
        }
        if let Some(twin) = twin {
            self.catalogue.link(first, twin);
        }
        Ok(first)
    }

    fn add(&mut self, id: StripId, request: Request, prepared: Prepared, linked: Option<StripId>) {
        self.journal.push(Entry::Added(Box::new(Added {
            id,
            named: request.named.clone(),
            windows: prepared.windows.clone(),
            tick: request.created,
            linked,
            supersedes: request.supersedes,
        })));
        let held = request.state == State::Held;
        self.insert(prepared, request);
        if held {
            self.catalogue.hold(id);
        }
        self.note(id);
    }

    /// Puts a request into the catalogue and into all that finds it again.
    pub(super) fn insert(&mut self, prepared: Prepared, request: Request) {
        let strip = prepared.strip;
        let id = self.catalogue.insert(prepared);
        if let Some(listed) = self.catalogue.get(id) {
            self.index.add(id, &strip, &listed.windows);
        }
        if !request.named.client_ref.is_empty() {
            let key = (request.named.submitter.clone(), request.named.client_ref.clone());
            // The first of two twins has the reference; a replacement takes it over.
            let twin = self.by_reference.get(&key).is_some_and(|known| {
                known.0 + 1 == id.0 && self.requests[known.0 as usize - 1].supersedes == request.supersedes
            });
            if !twin {
                self.by_reference.insert(key, id);
            }
        }
        if !request.state.is_final() {
            self.by_place.entry(place(&request.named.request)).or_default().push(id);
        }
        self.by_state.entry(request.state).or_default().insert(id);
        self.requests.push(request);
    }

    fn check_same_strip(&self, named: &NamedRequest, replaces: Option<StripId>) -> Result<(), Refusal> {
        let replaced = |id: StripId| {
            replaces
                .is_some_and(|old| old == id || self.catalogue.get(old).is_some_and(|entry| entry.linked == Some(id)))
        };
        let same = self.by_place.get(&place(&named.request)).into_iter().flatten().copied().find(|&id| {
            let known = &self.requests[id.0 as usize - 1];
            let (ours, theirs) = (valid(named), valid(&known.named));
            !known.state.is_final()
                && !replaced(id)
                && known.named.request.acquisition_speed_m_s == named.request.acquisition_speed_m_s
                && ours.0 < theirs.1
                && theirs.0 < ours.1
        });
        match same {
            Some(id) => Err(Refusal::SameStrip { id: id.0, state: self.requests[id.0 as usize - 1].state.name() }),
            None => Ok(()),
        }
    }

    pub(super) fn note_refusal(&mut self, named: NamedRequest, refusal: &Refusal, at: Tick) {
        self.rejected += 1;
        let clip = |text: String| if text.len() <= TEXT_MAX { text } else { text.chars().take(TEXT_MAX).collect() };
        let named = NamedRequest {
            name: clip(named.name),
            client_ref: clip(named.client_ref),
            submitter: clip(named.submitter),
            ..named
        };
        self.journal.push(Entry::Changed(Change {
            id: StripId(0),
            state: State::Rejected,
            reason: (refusal.code(), refusal.to_string()),
            actor: SYSTEM.to_owned(),
            tick: at,
            standing: Standing::default(),
            refused: Some(Box::new(named)),
        }));
    }
}

/// When a request may be imaged [ns since 1970-01-01 UTC].
fn valid(named: &NamedRequest) -> (u64, u64) {
    let until = if named.valid_until_ns == 0 { u64::MAX } else { named.valid_until_ns };
    (named.valid_from_ns, until)
}

/// Where a strip lies, to about a metre.
pub(super) fn place(request: &StripRequest) -> Place {
    let rounded = |degrees: f64| (degrees * SAME_PLACE_PER_DEG).round() as i32;
    let east = |degrees: f64| rounded(if degrees > 180.0 { degrees - 360.0 } else { degrees });
    [
        rounded(request.start_latitude_deg),
        east(request.start_longitude_deg),
        rounded(request.end_latitude_deg),
        east(request.end_longitude_deg),
    ]
}

/// Whether two orders ask for the same; of a bidirectional one the other direction may have been kept.
pub(super) fn same_order(known: &NamedRequest, given: &NamedRequest) -> bool {
    known == given
        || (given.request.bidirectional
            && *known == NamedRequest { request: given.request.reversed(), ..given.clone() })
}
