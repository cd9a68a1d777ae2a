//! Requests where ground and satellite are apart: the ground takes what is asked for and learns what became of it, the
//! satellite takes up what the ground has sent.

use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

use super::journal::{Attempt, Change, Entry};
use super::lifecycle::State;
use super::logic::RequestLogic;
use super::reason_number::Reason;
use super::refusal::Refusal;
use super::request::SYSTEM;
use crate::orders::action::{Act, Action};
use crate::orders::order::Order;

impl RequestLogic {
    /// Simulated time goes on.
    pub fn wait_until(&mut self, now: Tick) {
        self.progress.now = self.progress.now.max(now);
    }

    /// On the ground: a request that shall take the place of another one gets a number; the other one stays until the
    /// satellite has heard of it.
    ///
    /// # Errors
    /// Why it is refused.
    pub fn replace_when_heard(&mut self, old: StripId, order: Order, at: Tick) -> Result<StripId, Refusal> {
        self.still_open(old, State::Superseded)?;
        let known = self.len();
        let result = self.take_in(&order, Some(old), at);
        match &result {
            Ok(_) if self.len() > known => {
                let actor = order.submitter.clone();
                self.taken(at, actor, String::new(), Act::Replace(old, Box::new(order)));
            }
            Ok(_) => {}
            Err(refusal) => self.note_refusal(order, refusal, at),
        }
        result
    }

    /// On the ground: checks a change that the satellite will decide on.
    ///
    /// # Errors
    /// When there is no such request, or it is known to be over.
    pub fn still_open(&self, id: StripId, to: State) -> Result<(), Refusal> {
        let state = self.known(id)?.state;
        match state.step(to) {
            Err(illegal) if state.is_final() => Err(Refusal::State { id: id.0, illegal }),
            _ => Ok(()),
        }
    }

    /// On the ground: notes that something was asked for which the satellite will decide on.
    pub fn asked(&mut self, action: Action) {
        let Action { at, actor, reason, act, .. } = action;
        self.taken(at, actor, reason, act);
    }

    /// On the ground: a request has changed on board. What the life cycle does not have is a contradiction, and changes
    /// nothing.
    pub fn adopt(&mut self, change: &Change) {
        let Change { id, state, reason, actor, tick, standing, .. } = change;
        let before = self.state(*id);
        if before != Some(*state) {
            let step = self.known(*id).map(drop).and_then(|()| {
                let step = self.register.step(*id, *state, reason.clone(), actor, *tick);
                step.map_err(|illegal| Refusal::State { id: id.0, illegal })
            });
            if let Err(refusal) = step {
                return self.contradicted(actor, refusal);
            }
        }
        if let Some(mine) = self.register.standing_mut(*id) {
            self.reward += standing.reward - mine.reward;
            mine.clone_from(standing);
        }
        match state {
            State::Held => _ = self.catalogue.hold(*id),
            State::Accepted if before == Some(State::Held) => _ = self.catalogue.release(*id),
            State::Completed => _ = self.catalogue.fulfil(*id),
            state if state.is_final() => _ = self.catalogue.remove(*id),
            _ => {}
        }
        self.note(*id);
        self.share_imaging(*id);
    }

    /// On the ground: an attempt has ended on board.
    pub fn adopt_attempt(&mut self, attempt: Attempt) {
        self.journal.push(Entry::Attempted(attempt));
    }

    /// On board: takes up a request that the ground has given a number, at the tick at which it got it. One that is known
    /// changes nothing. One that comes too late to take another one's place has a number too, and is cancelled.
    ///
    /// # Errors
    /// When it is not the next one, or no strip here: ground and satellite do not fly the same mission.
    pub fn take_up(&mut self, id: StripId, order: &Order, at: Tick, replaces: Option<StripId>) -> Result<(), Refusal> {
        let next = self.len() as u64 + 1;
        if id.0 < next {
            return Ok(());
        }
        if id.0 > next {
            return Err(Refusal::Unknown { id: id.0, last: next - 1 });
        }
        let ways = self.prepare(order, at)?;
        let replaced = replaces.map(|old| self.both_ways(old, State::Superseded));
        // What the ground knows need not be told to it.
        let told = self.journal.len();
        self.enter(order, ways, replaces, at)?;
        self.journal.truncate(told);
        let actor = &order.submitter;
        match replaced {
            None => {}
            Some(Ok(before)) => {
                for old in before {
                    if let Some(standing) = self.register.standing_mut(old) {
                        standing.superseded_by = Some(id);
                    }
                    let text = format!("replaced by request {}", id.0);
                    self.leave(old, State::Superseded, (Reason::None, text), actor)?;
                }
            }
            Some(Err(refusal)) => {
                for new in self.both_ways(id, State::CancelledBySystem)? {
                    let reason = (Reason::State, format!("too late: {refusal}"));
                    self.leave(new, State::CancelledBySystem, reason, SYSTEM)?;
                }
            }
        }
        Ok(())
    }
}
