//! What becomes of a request when its task has ended.

use swath_sim::task::{FailureReason, TaskRecord};
use swath_sim::world::strip::StripId;

use super::journal::{Attempt, Entry, Outcome, failure_reason};
use super::lifecycle::State;
use super::logic::{GUIDANCE, Request, RequestLogic, SYSTEM};

impl RequestLogic {
    /// A task that imaged, or should have imaged, a strip has ended. Returns its reward.
    pub(super) fn settle(&mut self, record: &TaskRecord) -> f64 {
        self.progress.in_flight = self.progress.in_flight.filter(|flown| flown.task > record.task);
        let Some(id) = record.strip else { return 0.0 };
        let worth = self.catalogue.get(id).map_or(0.0, |entry| entry.strip.priority);
        let Some(request) = self.request_mut(id) else { return 0.0 };
        request.standing.attempts += 1;
        request.standing.imaging = record.start.after(record.t_pre);
        let wanted = !request.state.is_final();
        let outcome = match record.outcome.failure {
            _ if !wanted => Outcome::Cancelled,
            None => Outcome::Succeeded,
            Some(failure) => Outcome::Failed(failure),
        };
        let reward = if outcome == Outcome::Succeeded { worth } else { 0.0 };
        request.standing.reward += reward;
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
        self.catalogue.fulfil(id);
        let _ = self.stand(id, State::Completed, (0, String::new()), GUIDANCE);
        self.forget_place(id);
        if let Some(twin) = twin.filter(|&twin| self.state(twin).is_some_and(|state| !state.is_final())) {
            let text = format!("request {} was imaged", id.0);
            let _ = self.stand(twin, State::FulfilledByLink, (0, text), SYSTEM);
            self.forget_place(twin);
        }
    }

    fn not_imaged(&mut self, id: StripId, failure: FailureReason) {
        let (code, text) = failure_reason(failure);
        if self.state(id) == Some(State::Held) {
            return self.note(id);
        }
        let begun = failure != FailureReason::Interrupted;
        self.catch_up(id, if begun { State::Executing } else { State::Scheduled });
        let default = self.rules.max_attempts;
        let Some(request) = self.request_mut(id) else { return };
        request.standing.counted += u32::from(begun);
        let allowed = if request.named.max_attempts == 0 { default } else { request.named.max_attempts };
        let used_up = begun && request.standing.counted >= allowed;
        let _ = if used_up {
            let text = format!("{text}; this was attempt {allowed} of {allowed}");
            self.stand(id, State::Failed, (code, text), GUIDANCE).map(|()| {
                self.catalogue.remove(id);
                self.forget_place(id);
            })
        } else {
            self.stand(id, State::Accepted, (code, text.to_owned()), GUIDANCE)
        };
    }

    /// Goes through the steps that were not heard of, such as while the request manager was away.
    fn catch_up(&mut self, id: StripId, to: State) {
        for step in [State::Accepted, State::Scheduled, State::Executing] {
            let behind = self.state(id).is_some_and(|state| state < step);
            if behind && step <= to {
                let _ = self.stand(id, step, (0, String::new()), SYSTEM);
            }
        }
    }

    /// The task of a strip was not flown: another one was, or none.
    pub(super) fn not_flown(&mut self, id: StripId) {
        if self.state(id) == Some(State::Scheduled) {
            let reason = (204, "the task was given up before it began".to_owned());
            let _ = self.stand(id, State::Accepted, reason, SYSTEM);
        }
    }

    fn request_mut(&mut self, id: StripId) -> Option<&mut Request> {
        self.requests.get_mut(usize::try_from(id.0.checked_sub(1)?).ok()?)
    }
}
