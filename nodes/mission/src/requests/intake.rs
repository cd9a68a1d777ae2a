//! Taking requests in: what is checked, and where a request is found again.

use swath_sim::error::StripError;
use swath_sim::requests::catalogue::{Prepared, Validity};
use swath_sim::time::Tick;
use swath_sim::world::strip::{StripId, StripRequest};

use super::duplicates::{is_asked_again, may_be_asked_again};
use super::journal::{Added, Change, Entry, Standing};
use super::lifecycle::State;
use super::logic::RequestLogic;
use super::reason_number::Reason;
use super::refusal::{ATTEMPTS_MAX, CAPACITY, Refusal, TEXT_MAX, check_text};
use super::request::{Request, SYSTEM};
use crate::orders::order::Order;

impl RequestLogic {
    /// A request's strip one way or both, checked at a tick but not taken.
    ///
    /// # Errors
    /// Why it would be refused.
    pub(super) fn prepare(&self, order: &Order, at: Tick) -> Result<Vec<(StripRequest, Prepared)>, Refusal> {
        check_text("name", &order.name)?;
        check_text("client_ref", &order.client_ref)?;
        check_text("submitter", &order.submitter)?;
        check_part(order)?;
        if order.max_attempts > ATTEMPTS_MAX {
            return Err(Refusal::Attempts { given: order.max_attempts });
        }
        let request = &order.request;
        // What is wrong with the strip itself comes before when it may be imaged.
        request.to_strip(&self.model.config.requests, self.model.config.earth.radius_m)?;
        let validity = self.validity(order, at)?;
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

    fn validity(&self, order: &Order, at: Tick) -> Result<Validity, Refusal> {
        let period_ns = self.model.period.nanoseconds();
        let epoch_ns = self.rules.epoch_ns;
        let since_epoch = |ns: u64| (ns as f64 - epoch_ns as f64) * 1e-9;
        let (from_ns, until_ns) = (order.valid_from_ns, order.valid_until_ns);
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

    pub(super) fn take_in(&mut self, order: &Order, replaces: Option<StripId>, at: Tick) -> Result<StripId, Refusal> {
        if let Some(id) = self.by_reference(&order.submitter, &order.client_ref).filter(|&id| Some(id) != replaces)
            && let Some(known) = self.request(id).filter(|known| !may_be_asked_again(known.state))
        {
            // What a strip is called is no part of what is asked for: names of strips without one follow their place in a file.
            let named_so = Order { name: known.order.name.clone(), ..order.clone() };
            return if named_so.is_for_the_same_as(&known.order) {
                Ok(id)
            } else {
                let client_ref = order.client_ref.chars().take(TEXT_MAX).collect();
                Err(Refusal::Reference { client_ref, id: id.0 })
            };
        }
        if self.len() + 1 >= CAPACITY {
            return Err(Refusal::Capacity { count: self.len() });
        }
        let ways = self.prepare(order, at)?;
        self.check_same_strip(order, replaces)?;
        self.enter(order, ways, replaces, at)
    }

    /// Gives a request, which may be one for each way, the next number.
    ///
    /// # Errors
    /// When its state cannot be.
    pub(super) fn enter(
        &mut self,
        order: &Order,
        ways: Vec<(StripRequest, Prepared)>,
        replaces: Option<StripId>,
        at: Tick,
    ) -> Result<StripId, Refusal> {
        let state = State::Received.step(if order.hold_for_approval { State::Held } else { State::Accepted });
        let state = state.map_err(|illegal| Refusal::State { id: 0, illegal })?;
        let first = StripId::from_index(self.len());
        let twin = (ways.len() > 1).then_some(StripId(first.0 + 1));
        let whole = order.part.as_ref();
        let order_id = whole.and_then(|part| self.register.order_by_reference(&order.submitter, &part.order_ref));
        let order_id = order_id.unwrap_or(first);
        for (id, (request, prepared)) in (first.0..).map(StripId).zip(ways) {
            let order = Order { request, ..order.clone() };
            let linked = if id == first { twin } else { Some(first) };
            let request = Request {
                actor: order.submitter.clone(),
                order,
                state,
                reason: (Reason::None, String::new()),
                created: at,
                changed: at,
                standing: Standing::default(),
                supersedes: replaces,
                order_id,
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
            order: request.order.clone(),
            windows: prepared.windows.clone(),
            tick: request.created,
            linked,
            supersedes: request.supersedes,
            order_id: request.order_id,
        })));
        let held = request.state == State::Held;
        self.insert(prepared, request);
        if held {
            self.catalogue.hold(id);
        }
        self.note(id);
        self.share_imaging(id);
    }

    /// Puts a request into the catalogue and the register.
    pub(super) fn insert(&mut self, prepared: Prepared, request: Request) {
        self.register.add(request, &prepared.strip, &prepared.windows);
        self.catalogue.insert(prepared);
    }

    /// A replacement may be for the same as what it replaces.
    fn check_same_strip(&self, order: &Order, replaces: Option<StripId>) -> Result<(), Refusal> {
        let twin = replaces.and_then(|old| self.catalogue.get(old)?.linked);
        let mut there = self.register.at_place(&order.request);
        let same = there.find(|(id, known)| Some(*id) != replaces && Some(*id) != twin && is_asked_again(order, known));
        match same {
            Some((id, known)) => Err(Refusal::SameStrip { id: id.0, state: known.state.name() }),
            None => Ok(()),
        }
    }

    pub(super) fn note_refusal(&mut self, order: Order, refusal: &Refusal, at: Tick) {
        self.rejected += 1;
        let clip = |text: String| if text.len() <= TEXT_MAX { text } else { text.chars().take(TEXT_MAX).collect() };
        let order = Order {
            name: clip(order.name),
            client_ref: clip(order.client_ref),
            submitter: clip(order.submitter),
            ..order
        };
        self.journal.push(Entry::Changed(Change {
            id: StripId(0),
            state: State::Rejected,
            reason: (refusal.reason(), refusal.to_string()),
            actor: SYSTEM.to_owned(),
            tick: at,
            standing: Standing::default(),
            refused: Some(Box::new(order)),
        }));
    }
}

fn check_part(order: &Order) -> Result<(), Refusal> {
    let Some(part) = &order.part else { return Ok(()) };
    check_text("order_ref", &part.order_ref)?;
    if part.number < 1 || part.number > part.of {
        return Err(Refusal::Call { field: "part", value: f64::from(part.number), limits: "1 to parts" });
    }
    if !(0.0..=1.0).contains(&part.share) {
        return Err(Refusal::Call { field: "share", value: part.share, limits: "0 to 1" });
    }
    Ok(())
}
