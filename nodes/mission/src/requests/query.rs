//! Questions to the request manager: lists, and when a strip could be imaged.

use std::cmp::Reverse;

use swath_sim::planner::{Allowance, Search};
use swath_sim::requests::catalogue::{Candidate, Prepared};
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::Situation;
use swath_sim::world::orbit::Orbit;
use swath_sim::world::strip::StripId;
use swath_sim::world::windows::Window;

use super::index::Area;
use super::lifecycle::State;
use super::logic::RequestLogic;
use super::refusal::Refusal;
use crate::orders::order::Order;

/// Which requests are listed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Filter {
    /// Only strips of the order of this number.
    pub order: Option<StripId>,
    /// Only these states; empty for all.
    pub states: Vec<State>,
    /// Only strips that touch this area.
    pub area: Option<Area>,
    /// Only strips with a start window between these ticks.
    pub between: Option<(Tick, Tick)>,
}

/// A part of a list.
#[derive(Clone, Debug, PartialEq)]
pub struct Page {
    /// The requests, by their numbers.
    pub ids: Vec<StripId>,
    /// Whether there are more.
    pub more: bool,
}

/// A chance to image a strip.
#[derive(Clone, Debug, PartialEq)]
pub struct Opportunity {
    /// Start window.
    pub window: Window,
    /// Acquisition [ticks].
    pub t_acq: u32,
    /// Least elevation while imaging that starts in the middle of the window [rad].
    pub min_elevation: f64,
    /// Shortest transition found [ticks], from the present attitude and wheel speeds.
    pub transition: Option<u32>,
    /// How many other strips wait for the satellite at the same time.
    pub conflicts: usize,
    /// Those of the greatest priorities.
    pub conflict_ids: Vec<StripId>,
}

/// Longest page.
pub const PAGE_MAX: u32 = 1000;
/// Length of a page for those who do not say.
pub const PAGE_DEFAULT: u32 = 100;
/// Conflicts of an opportunity that are named.
const CONFLICTS_NAMED: usize = 16;
/// Opportunities that a preview works out in full; the ones after them are left out.
pub const OPPORTUNITIES_MAX: usize = 200;

/// Checks the length of a page; 0 is the usual one.
///
/// # Errors
/// When it is too long.
pub fn page_length(limit: u32) -> Result<usize, Refusal> {
    match limit {
        0 => Ok(PAGE_DEFAULT as usize),
        1..=PAGE_MAX => Ok(limit as usize),
        _ => Err(Refusal::Call { field: "limit", value: f64::from(limit), limits: "1 to 1000" }),
    }
}

impl RequestLogic {
    /// Requests with numbers after `after` that pass a filter, at most `limit`.
    #[must_use]
    pub fn list(&self, filter: &Filter, after: StripId, limit: usize) -> Page {
        let passes = |id: &StripId| self.passes(filter, *id);
        let page = |ids: &mut dyn Iterator<Item = StripId>| {
            let mut ids: Vec<_> = ids.filter(passes).take(limit + 1).collect();
            let more = ids.len() > limit;
            ids.truncate(limit);
            Page { ids, more }
        };
        let next = StripId(after.0.saturating_add(1));
        // The narrowest way in: an order, a place, a time, a few states, or all.
        if let Some(order) = filter.order {
            return page(&mut self.register.strips_of(order).iter().copied().filter(|id| *id >= next));
        }
        if let Some(area) = &filter.area {
            return page(&mut self.register.near(area).into_iter().filter(|id| *id >= next));
        }
        if let Some((from, until)) = filter.between {
            return page(&mut self.register.between(from, until).into_iter().filter(|id| *id >= next));
        }
        if filter.states.is_empty() {
            return page(&mut (next.0..=self.len() as u64).map(StripId));
        }
        let mut ids: Vec<_> =
            filter.states.iter().flat_map(|state| self.register.in_state(*state, next, limit + 1)).collect();
        ids.sort_unstable();
        ids.dedup();
        page(&mut ids.into_iter())
    }

    fn passes(&self, filter: &Filter, id: StripId) -> bool {
        let (Some(request), Some(listed)) = (self.request(id), self.strip(id)) else { return false };
        let in_window = |(from, until): (Tick, Tick)| {
            listed.windows_after(self.now()).iter().any(|window| window.open <= until && window.close >= from)
        };
        filter.order.is_none_or(|order| request.order_id == order)
            && (filter.states.is_empty() || filter.states.contains(&request.state))
            && filter.area.is_none_or(|area| area.touches(&listed.strip))
            && filter.between.is_none_or(in_window)
    }

    /// When a request could be imaged until `until`, without taking it. A bidirectional one is looked at one way.
    ///
    /// # Errors
    /// Why it would be refused.
    pub fn preview(&self, order: &Order, until: Tick) -> Result<Vec<Opportunity>, Refusal> {
        let ways = self.prepare(order, self.now())?;
        Ok(ways.first().map_or(Vec::new(), |(_, prepared)| self.opportunities(prepared, until, None)))
    }

    /// When a known request can still be imaged until `until`.
    ///
    /// # Errors
    /// When there is no such request.
    pub fn outlook(&self, id: StripId, until: Tick) -> Result<Vec<Opportunity>, Refusal> {
        let state = self.known(id)?.state;
        let Some(listed) = self.strip(id).filter(|_| !state.is_final()) else { return Ok(Vec::new()) };
        let windows = listed.windows_after(self.now()).to_vec();
        Ok(self.opportunities(&Prepared { strip: listed.strip, t_acq: listed.t_acq, windows }, until, Some(id)))
    }

    fn opportunities(&self, prepared: &Prepared, until: Tick, own: Option<StripId>) -> Vec<Opportunity> {
        let Prepared { strip, t_acq, ref windows } = *prepared;
        let now = self.now();
        let coming = windows.iter().filter(|window| window.close > now && window.open <= until);
        let opportunities = coming.take(OPPORTUNITIES_MAX).map(|&window| {
            let candidate = Candidate { id: own.unwrap_or(StripId(0)), twin: None, strip, t_acq, window };
            let mut conflicts = self.conflicts(window, t_acq, own);
            conflicts.sort_by_key(|&(priority, id)| (Reverse(priority), id));
            Opportunity {
                window,
                t_acq,
                min_elevation: self
                    .catalogue
                    .finder()
                    .least_elevation(&strip, Tick(u64::midpoint(window.open.0, window.close.0))),
                transition: self.transition(&candidate),
                conflicts: conflicts.len(),
                conflict_ids: conflicts.into_iter().take(CONFLICTS_NAMED).map(|(_, id)| id).collect(),
            }
        });
        opportunities.collect()
    }

    /// Other requests that wait for the satellite while this one could be imaged, each with its priority's bits, which
    /// order as priorities do.
    fn conflicts(&self, window: Window, t_acq: u32, own: Option<StripId>) -> Vec<(u64, StripId)> {
        let until = window.close.after(t_acq);
        let twin = own.and_then(|own| self.strip(own)?.linked);
        let others = self.register.between(window.open, until).into_iter();
        let others = others.filter(|&id| Some(id) != own && Some(id) != twin);
        let waits = others.filter(|&id| {
            self.served_by(id).is_none() && matches!(self.state(id), Some(State::Accepted | State::Scheduled))
        });
        let waits = waits.filter_map(|id| {
            let listed = self.strip(id)?;
            let overlaps = |other: &Window| other.open <= until && other.close >= window.open;
            let coming = listed.windows_after(self.now());
            coming.iter().any(overlaps).then_some((listed.strip.priority.to_bits(), id))
        });
        waits.collect()
    }

    /// The shortest transition from the attitude and wheel speeds of now. For a window that opens later than a
    /// transition may take, it is the slew from where the satellite will be, as if it held its attitude until then.
    fn transition(&self, candidate: &Candidate) -> Option<u32> {
        let situation = self.situation.as_ref()?;
        let longest = self.model.t_pre_max();
        let begin = Tick(candidate.window.open.0.saturating_sub(u64::from(longest)));
        if begin <= situation.now {
            let found =
                Search::new(&self.model, situation, &Allowance::default()).shortest(situation, candidate, longest);
            return found.map(|found| found.t_pre);
        }
        let period = self.model.period;
        let mut orbit = Orbit::through(&situation.r_BN_N, &situation.v_BN_N, situation.now, period);
        let then = Situation { now: begin, r_BN_N: orbit.position(begin), v_BN_N: orbit.velocity(begin), ..*situation };
        Search::new(&self.model, &then, &Allowance::default()).settling(&then, candidate, longest, longest)
    }
}
