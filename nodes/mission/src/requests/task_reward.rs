//! What becomes of a request when its task has ended, and what that is worth.

use swath_sim::task::{FailureReason, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

use super::journal::{Attempt, Entry, Outcome};
use super::lifecycle::State;
use super::logic::RequestLogic;
use super::reason_number::Reason;
use super::request::{GUIDANCE, SYSTEM};

impl RequestLogic {
    /// A task that imaged, or should have imaged, a strip has ended. Returns its reward.
    pub(super) fn settle(&mut self, record: &TaskRecord) -> f64 {
        self.progress.in_flight = self.progress.in_flight.filter(|flown| flown.task > record.task);
        let Some(id) = record.strip else { return 0.0 };
        let worth = self.catalogue.get(id).map_or(0.0, |entry| entry.strip.priority);
        let Some(wanted) = self.state(id).map(|state| !state.is_final()) else { return 0.0 };
        let outcome = match record.outcome.failure {
            _ if !wanted => Outcome::Cancelled,
            None => Outcome::Succeeded,
            Some(failure) => Outcome::Failed(failure),
        };
        let reward = if outcome == Outcome::Succeeded { worth } else { 0.0 };
        if let Some(standing) = self.register.standing_mut(id) {
            standing.attempts += 1;
            standing.imaging = record.start.after(record.t_pre);
            standing.reward += reward;
        }
        self.reward += reward;
        self.journal.push(Entry::Attempted(Attempt {
            id,
            task: record.task,
            start: record.start,
            end: record.end,
            t_pre: record.t_pre,
            t_acq: record.t_acq,
            outcome,
            max_attitude_error: record.outcome.max_attitude_error,
            min_elevation: record.outcome.min_elevation,
            reward,
        }));
        match outcome {
            Outcome::Cancelled => self.note(id),
            Outcome::Succeeded => self.imaged(id),
            Outcome::Failed(failure) => self.not_imaged(id, failure),
        }
        reward
    }

    fn imaged(&mut self, id: StripId) {
        self.catch_up(id, State::Executing);
        let twin = self.catalogue.get(id).and_then(|entry| entry.linked);
        let imaging = self.request(id).map_or(Tick(0), |request| request.standing.imaging);
        let served = self.served_with(id, imaging);
        self.catalogue.fulfil(id);
        self.must(id, State::Completed, (Reason::None, String::new()), GUIDANCE);
        if let Some(twin) = twin.filter(|&twin| self.state(twin).is_some_and(|state| !state.is_final())) {
            let text = format!("request {} was imaged", id.0);
            self.must(twin, State::FulfilledByLink, (Reason::None, text), SYSTEM);
        }
        for other in served {
            self.served(other, id);
        }
    }

    fn not_imaged(&mut self, id: StripId, failure: FailureReason) {
        if self.state(id) == Some(State::Held) {
            return self.note(id);
        }
        let text = match failure {
            FailureReason::Attitude => "the attitude error exceeded its limit while imaging",
            FailureReason::Elevation => "the satellite was too low over the target while imaging",
            FailureReason::Interrupted => "the task was cut short",
        };
        let begun = failure != FailureReason::Interrupted;
        self.catch_up(id, if begun { State::Executing } else { State::Scheduled });
        let Some(asked) = self.request(id).map(|request| request.order.max_attempts) else { return };
        let allowed = if asked == 0 { self.rules.max_attempts } else { asked };
        let Some(standing) = self.register.standing_mut(id) else { return };
        standing.counted += u32::from(begun);
        if begun && standing.counted >= allowed {
            let text = format!("{text}; this was attempt {allowed} of {allowed}");
            self.must(id, State::Failed, (Reason::Attempts, text), GUIDANCE);
            self.catalogue.remove(id);
        } else {
            self.must(id, State::Accepted, (failure.into(), text.to_owned()), GUIDANCE);
        }
    }

    /// Goes through the steps that were not heard of, such as while the request manager was away.
    fn catch_up(&mut self, id: StripId, to: State) {
        for step in [State::Accepted, State::Scheduled, State::Executing] {
            let behind = self.state(id).is_some_and(|state| state < step);
            if behind && step <= to {
                self.must(id, step, (Reason::None, String::new()), SYSTEM);
            }
        }
    }

    /// The task of a strip was not flown: another one was, or none.
    pub(super) fn not_flown(&mut self, id: StripId) {
        if self.state(id) == Some(State::Scheduled) {
            let reason = (Reason::NotFlown, "the task was given up before it began".to_owned());
            self.must(id, State::Accepted, reason, SYSTEM);
        }
    }
}
