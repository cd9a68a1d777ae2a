//! The request manager's services: calls come in, answers go out when what they promise is on disk.

use std::collections::VecDeque;

use anyhow::Result;
use swath_msgs::RosService;
use swath_msgs::swath_msgs as msg;
use swath_node::orders::order_of;
use swath_node::orders::request_message;
use swath_ros::{Node, RequestId, RosError, Server, graph};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

use super::book::Book;
use super::messages;
use super::outgoing::Outgoing;
use super::store::Store;
use super::ways;
use swath_mission::requests::logic::RequestLogic;
use swath_mission::requests::query::page_length;
use swath_mission::requests::refusal::{BATCH_MAX, Refusal, check_batch};
use swath_node::node::MissionNode;

/// The services.
pub(super) struct Desk {
    submit: Server<msg::SubmitStrips>,
    cancel: Server<msg::CancelStrips>,
    replace: Server<msg::ReplaceStrip>,
    review: Server<msg::ReviewStrips>,
    get: Server<msg::GetStrip>,
    list: Server<msg::ListStrips>,
    history: Server<msg::ListHistory>,
    preview: Server<msg::PreviewStrip>,
    ways: Server<msg::ListWays>,
    limits: Server<msg::GetLimits>,
    /// Submissions that are being taken, a slice at a time.
    jobs: VecDeque<Job>,
    /// Whether anything is taken.
    pub(super) open: bool,
}

struct Job {
    id: RequestId,
    requests: std::vec::IntoIter<msg::StripRequest>,
    results: Vec<msg::SubmitResult>,
}

impl Desk {
    /// Opens the services.
    pub(super) fn new(node: &Node) -> Result<Self> {
        Ok(Self {
            submit: node.server(&graph::SUBMIT_STRIPS)?,
            cancel: node.server(&graph::CANCEL_STRIPS)?,
            replace: node.server(&graph::REPLACE_STRIP)?,
            review: node.server(&graph::REVIEW_STRIPS)?,
            get: node.server(&graph::GET_STRIP)?,
            list: node.server(&graph::LIST_STRIPS)?,
            history: node.server(&graph::LIST_HISTORY)?,
            preview: node.server(&graph::PREVIEW_STRIP)?,
            ways: node.server(&graph::LIST_WAYS)?,
            limits: node.server(&graph::GET_LIMITS)?,
            jobs: VecDeque::new(),
            open: false,
        })
    }

    /// Whether a call of so many entries is taken.
    pub(super) fn admit(&self, entries: usize) -> Result<(), Refusal> {
        if self.open { check_batch(entries) } else { Err(Refusal::Inactive) }
    }

    /// Takes the calls that have come. Those that ask without changing anything are answered at once.
    pub(super) fn take(&mut self, book: &mut Book, base: &MissionNode, outgoing: &mut Vec<Outgoing>) -> Result<()> {
        self.take_changes(book, outgoing)?;
        while let Some((id, call)) = next(&self.get)? {
            outgoing.push(Outgoing::Get(id, call));
        }
        while let Some((id, call)) = next(&self.history)? {
            outgoing.push(Outgoing::History(id, call));
        }
        self.answer_questions(book, base)
    }

    /// As [`Self::take`], while there is no room for what would be promised: changes are refused.
    pub(super) fn refuse(&mut self, book: &Book, base: &MissionNode, store: &Store) -> Result<()> {
        let (reason_code, reason) = (Refusal::StoreFull.code(), Refusal::StoreFull.to_string());
        while let Some((id, _)) = next(&self.submit)? {
            let answer = msg::SubmitStripsResponse { reason_code, reason: reason.clone(), ..Default::default() };
            self.submit.respond(id, answer)?;
        }
        while let Some((id, _)) = next(&self.cancel)? {
            let answer = msg::CancelStripsResponse { reason_code, reason: reason.clone(), ..Default::default() };
            self.cancel.respond(id, answer)?;
        }
        while let Some((id, _)) = next(&self.replace)? {
            let result = messages::submit_result(book.logic(), true, Err(Refusal::StoreFull));
            self.replace.respond(id, msg::ReplaceStripResponse { result })?;
        }
        while let Some((id, _)) = next(&self.review)? {
            let answer = msg::ReviewStripsResponse { reason_code, reason: reason.clone(), ..Default::default() };
            self.review.respond(id, answer)?;
        }
        while let Some((id, call)) = next(&self.get)? {
            self.answer(Outgoing::Get(id, call), book.logic(), base, store)?;
        }
        while let Some((id, call)) = next(&self.history)? {
            self.answer(Outgoing::History(id, call), book.logic(), base, store)?;
        }
        self.answer_questions(book, base)
    }

    fn take_changes(&mut self, book: &mut Book, outgoing: &mut Vec<Outgoing>) -> Result<()> {
        while let Some((id, call)) = next(&self.submit)? {
            match self.admit(call.requests.len()) {
                Ok(()) => {
                    let requests = call.requests;
                    let results = Vec::with_capacity(requests.len().min(BATCH_MAX));
                    self.jobs.push_back(Job { id, requests: requests.into_iter(), results });
                }
                Err(refusal) => outgoing.push(Outgoing::Submitted(
                    id,
                    msg::SubmitStripsResponse {
                        reason_code: refusal.code(),
                        reason: refusal.to_string(),
                        ..msg::SubmitStripsResponse::default()
                    },
                )),
            }
        }
        while let Some((id, call)) = next(&self.cancel)? {
            let cancel = |&number: &u64| {
                let result = book.cancel(StripId(number), &call.actor, &call.reason).map(|()| StripId(number));
                messages::submit_result(book.logic(), true, result)
            };
            let (results, reason_code, reason) = self.each(&call.ids, cancel);
            outgoing.push(Outgoing::Cancelled(id, msg::CancelStripsResponse { results, reason_code, reason }));
        }
        while let Some((id, call)) = next(&self.replace)? {
            let before = book.logic().len();
            let result = self.admit(1).and_then(|()| book.replace(StripId(call.id), order_of(&call.request)));
            let result = messages::submit_result(book.logic(), book.logic().len() == before, result);
            outgoing.push(Outgoing::Replaced(id, msg::ReplaceStripResponse { result }));
        }
        while let Some((id, call)) = next(&self.review)? {
            let decide = |&number: &u64| {
                let review = messages::review(call.action);
                let decided = review.and_then(|review| book.review(StripId(number), review, &call.actor, &call.reason));
                messages::submit_result(book.logic(), true, decided.map(|()| StripId(number)))
            };
            let (results, reason_code, reason) = self.each(&call.ids, decide);
            outgoing.push(Outgoing::Reviewed(id, msg::ReviewStripsResponse { results, reason_code, reason }));
        }
        Ok(())
    }

    /// Answers those who only ask.
    fn answer_questions(&mut self, book: &Book, base: &MissionNode) -> Result<()> {
        while let Some((id, call)) = next(&self.list)? {
            self.list.respond(id, list(book.logic(), base, &call))?;
        }
        while let Some((id, call)) = next(&self.preview)? {
            self.preview.respond(id, preview(book.logic(), base, &call))?;
        }
        while let Some((id, call)) = next(&self.ways)? {
            self.ways.respond(id, ways::list(book, &base.stamper, &call))?;
        }
        while let Some((id, _)) = next(&self.limits)? {
            self.limits.respond(id, messages::limits(&base.mission.cutting()))?;
        }
        Ok(())
    }

    /// Takes up to `slice` requests of the submissions that have come.
    pub(super) fn work(&mut self, book: &mut Book, slice: usize, outgoing: &mut Vec<Outgoing>) {
        let mut left = slice;
        while left > 0
            && let Some(job) = self.jobs.front_mut()
        {
            let taken = job.requests.by_ref().take(left);
            let before = job.results.len();
            job.results.extend(taken.map(|request| {
                let before = book.logic().len();
                let result = book.submit(order_of(&request));
                messages::submit_result(book.logic(), book.logic().len() == before, result)
            }));
            left -= job.results.len() - before;
            if job.requests.len() == 0
                && let Some(Job { id, results, .. }) = self.jobs.pop_front()
            {
                outgoing.push(Outgoing::Submitted(id, msg::SubmitStripsResponse { results, ..Default::default() }));
            }
        }
    }

    /// Does something with each entry of a call: its results, and why the call as a whole is refused.
    fn each<T>(
        &self,
        entries: &[T],
        apply: impl FnMut(&T) -> msg::SubmitResult,
    ) -> (Vec<msg::SubmitResult>, u16, String) {
        match self.admit(entries.len()) {
            Ok(()) => (entries.iter().map(apply).collect(), 0, String::new()),
            Err(refusal) => (Vec::new(), refusal.code(), refusal.to_string()),
        }
    }

    /// Whether submissions are being taken.
    pub(super) fn is_busy(&self) -> bool {
        !self.jobs.is_empty()
    }

    /// Sends an answer whose promise is kept.
    pub(super) fn answer(
        &self,
        answer: Outgoing,
        logic: &RequestLogic,
        base: &MissionNode,
        store: &Store,
    ) -> Result<()> {
        match answer {
            Outgoing::Submitted(id, response) => self.submit.respond(id, response)?,
            Outgoing::Cancelled(id, response) => self.cancel.respond(id, response)?,
            Outgoing::Replaced(id, response) => self.replace.respond(id, response)?,
            Outgoing::Reviewed(id, response) => self.review.respond(id, response)?,
            Outgoing::Get(id, call) => self.get.respond(id, get(logic, base, store, &call)?)?,
            Outgoing::History(id, call) => self.history.respond(id, history(base, store, &call)?)?,
            Outgoing::Offer(_) | Outgoing::Result(_) | Outgoing::Radio(_) | Outgoing::News(_) | Outgoing::Summary => {}
        }
        Ok(())
    }
}

/// The next call; one that cannot be read is logged and passed over.
fn next<S: RosService>(server: &Server<S>) -> Result<Option<(RequestId, S::Request)>> {
    loop {
        match server.take() {
            Ok(call) => return Ok(call),
            Err(error @ RosError::Decode { .. }) => tracing::warn!("{error}"),
            Err(error) => return Err(error.into()),
        }
    }
}

fn list(logic: &RequestLogic, base: &MissionNode, call: &msg::ListStripsRequest) -> msg::ListStripsResponse {
    let page = messages::filter(&base.stamper, call)
        .and_then(|filter| Ok(logic.list(&filter, StripId(call.after_id), page_length(call.limit)?)));
    match page {
        Ok(page) => {
            let status = |&id: &StripId| Some(messages::strip_status(&base.stamper, logic, id, logic.request(id)?));
            let strips = page.ids.iter().filter_map(status).collect::<Vec<_>>();
            let wanted = page.ids.iter().filter(|_| call.with_requests);
            let requests = wanted.filter_map(|&id| Some(request_message(&logic.request(id)?.order)));
            let requests = requests.collect::<Vec<_>>();
            msg::ListStripsResponse { strips, requests, more: page.more, ..Default::default() }
        }
        Err(refusal) => {
            msg::ListStripsResponse { reason_code: refusal.code(), reason: refusal.to_string(), ..Default::default() }
        }
    }
}

fn preview(logic: &RequestLogic, base: &MissionNode, call: &msg::PreviewStripRequest) -> msg::PreviewStripResponse {
    let found = horizon(logic, base, call.horizon_s).and_then(|until| match call.id {
        0 => logic.preview(&order_of(&call.request), until),
        id => logic.outlook(StripId(id), until),
    });
    let now = base.stamper.time(logic.now());
    match found {
        Ok(found) => {
            let opportunities = found.iter().map(|it| messages::opportunity(&base.stamper, it)).collect::<Vec<_>>();
            msg::PreviewStripResponse { opportunities, now, ..Default::default() }
        }
        Err(refusal) => msg::PreviewStripResponse {
            reason_code: refusal.code(),
            reason: refusal.to_string(),
            now,
            ..Default::default()
        },
    }
}

/// Tick up to which a preview looks.
fn horizon(logic: &RequestLogic, base: &MissionNode, horizon_s: f64) -> Result<Tick, Refusal> {
    if horizon_s.is_nan() || horizon_s < 0.0 {
        return Err(Refusal::Call { field: "horizon_s", value: horizon_s, limits: "0 and above" });
    }
    if horizon_s == 0.0 {
        return Ok(base.horizon);
    }
    Ok(logic.now().after(base.model.period.ticks_ceil(horizon_s)).min(base.horizon))
}

fn get(
    logic: &RequestLogic,
    base: &MissionNode,
    store: &Store,
    call: &msg::GetStripRequest,
) -> Result<msg::GetStripResponse> {
    let found = match call.id {
        0 => logic.by_reference(&call.submitter, &call.client_ref).ok_or_else(|| Refusal::UnknownReference {
            submitter: call.submitter.clone(),
            client_ref: call.client_ref.clone(),
        }),
        id => Ok(StripId(id)),
    };
    let known = found.and_then(|id| Ok((id, logic.known(id)?, logic.outlook(id, base.horizon)?)));
    let (id, request, outlook) = match known {
        Ok(known) => known,
        Err(refusal) => {
            let (reason_code, reason) = (refusal.code(), refusal.to_string());
            return Ok(msg::GetStripResponse { reason_code, reason, ..Default::default() });
        }
    };
    let mut attempts: Vec<_> = store.attempts(id)?.iter().map(|it| messages::attempt(&base.stamper, it)).collect();
    attempts.extend(messages::attempt_under_way(&base.stamper, logic, id));
    let history = store.history(id)?;
    let report = msg::StripReport {
        status: messages::strip_status(&base.stamper, logic, id, request),
        request: request_message(&request.order),
        opportunities: outlook.iter().map(|it| messages::opportunity(&base.stamper, it)).collect::<Vec<_>>(),
        attempts,
        history: history.iter().map(|line| messages::history_entry(&base.stamper, line)).collect::<Vec<_>>(),
    };
    Ok(msg::GetStripResponse { report: vec![report], ..Default::default() })
}

fn history(base: &MissionNode, store: &Store, call: &msg::ListHistoryRequest) -> Result<msg::ListHistoryResponse> {
    let limit = match page_length(call.limit) {
        Ok(limit) => limit,
        Err(refusal) => {
            let (reason_code, reason) = (refusal.code(), refusal.to_string());
            return Ok(msg::ListHistoryResponse { reason_code, reason, ..Default::default() });
        }
    };
    let mut lines = store.trail(call.after_sequence, limit + 1)?;
    let more = lines.len() > limit;
    lines.truncate(limit);
    let entries = lines.iter().map(|line| messages::history_entry(&base.stamper, line)).collect::<Vec<_>>();
    Ok(msg::ListHistoryResponse { entries, more, ..Default::default() })
}
