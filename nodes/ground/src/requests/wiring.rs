//! The request manager's topics, and what waits until it is on disk.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use swath_msgs::rosgraph_msgs::Clock;
use swath_msgs::swath_msgs as msg;
use swath_node::messages::decision_point::situation;
use swath_node::messages::task_result::task_record;
use swath_ros::{Publisher, Spec, Subscription, graph};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

use super::desk::Desk;
use super::lock::StoreLock;
use super::messages;
use super::outgoing::Outgoing;
use super::store::{Durability, Store};
use super::writer::Writer;
use swath_mission::alarms::conditions::{Report, STORE_FULL};
use swath_mission::faults::What;
use swath_mission::faults::plan::Scheduled;
use swath_mission::requests::journal::{Entry, Progress};
use swath_mission::requests::lifecycle::State;
use swath_mission::requests::logic::{Abort, RequestLogic};
use swath_mission::requests::refusal::Refusal;
use swath_node::node::{MissionNode, Severity};
use swath_node::orders::{operator_action, order_of};
use swath_node::program::{Parameter, Program};

/// Nothing happens by itself: the node only looks whether it is asked to end.
const IDLE: Duration = Duration::from_millis(500);
/// How long the last messages before a fault by order may take to arrive.
const FLUSH_TIMEOUT: Duration = Duration::from_secs(5);
/// Requests of long calls that are taken before the mission is looked at again.
const SLICE: usize = 100;

const STORE: Parameter =
    Parameter { name: "store", about: "Path of the store (SQLite); empty for one that does not last." };

/// The node as a program.
const PROGRAM: Program = Program {
    node: graph::REQUEST_MANAGER,
    name: "swath-requests",
    about: "The request manager: takes requests, offers them to the planner, keeps what became of them",
    parameters: &[STORE],
};

/// Runs the request manager until it is asked to end.
///
/// # Errors
/// When the node cannot come up, the mission's requests cannot be read, the store cannot be used, or DDS fails.
pub fn run() -> Result<()> {
    let mut node = RequestNode::new(MissionNode::start(&PROGRAM)?)?;
    let outcome = node.fly();
    let RequestNode { mut writer, reader, .. } = node;
    // The last connection to close the store leaves one file.
    drop(reader);
    // What was taken is written, also when the node ends on an error.
    writer.finish()?;
    outcome
}

struct RequestNode {
    logic: RequestLogic,
    desk: Desk,
    points: Subscription<msg::DecisionPoint>,
    tasks: Subscription<msg::ImagingTask>,
    phases: Subscription<msg::TaskPhase>,
    requests: Subscription<msg::StripRequest>,
    upcoming: Publisher<msg::UpcomingStrips>,
    events: Publisher<msg::StripStatus>,
    results: Publisher<msg::TaskResult>,
    /// Tasks below this number have been told of.
    told: u64,
    actions: Publisher<msg::OperatorAction>,
    summary: Publisher<msg::RequestSummary>,
    aborts: Publisher<msg::TaskAbort>,
    last: Option<msg::UpcomingStrips>,
    /// What goes out when the batch of its number is written.
    outbox: VecDeque<(u64, Outgoing)>,
    /// Changes that nobody could have heard of yet.
    unheard: Vec<Arc<Vec<Entry>>>,
    written: Progress,
    writer: Writer,
    /// Whether there was no room, as it was told last.
    full_told: bool,
    /// When there is no room, by order, and the time; where nothing is ordered, neither.
    full_by_order: Vec<Scheduled>,
    clock: Option<Subscription<Clock>>,
    clock_at: Tick,
    reader: Store,
    base: MissionNode,
    /// Nobody else writes the store.
    _lock: StoreLock,
    /// Removed when the node ends.
    _temporary: Option<tempfile::TempDir>,
}

impl RequestNode {
    fn new(base: MissionNode) -> Result<Self> {
        let spec = Spec::new(STORE.name, String::new(), STORE.about);
        let path = PathBuf::from(base.node.parameters().declare(spec.read_only())?);
        base.node.parameters().check_given()?;
        let (path, temporary) = if path.as_os_str().is_empty() {
            tracing::warn!("requests do not outlast this process: parameter `store` is not set");
            let folder = tempfile::tempdir().context("cannot make a temporary store")?;
            (folder.path().join("requests.sqlite"), Some(folder))
        } else {
            (path, None)
        };
        let lock = StoreLock::take(&path, base.node.epoch() > 0)?;
        let mut store = Store::open(&path, &base.mission.identity())?;
        let reader = Store::open_read_only(&path)?;
        let logic = take_up(&base, &mut store)?;
        let mut node = Self {
            desk: Desk::new(&base.node)?,
            points: base.node.subscription(&graph::DECISION_POINT)?,
            tasks: base.node.subscription(&graph::PLANNER_TASK)?,
            phases: base.node.subscription(&graph::TASK_PHASE)?,
            requests: base.node.subscription(&graph::STRIP_REQUEST)?,
            upcoming: base.node.publisher(&graph::UPCOMING_STRIPS)?,
            events: base.node.publisher(&graph::STRIP_EVENTS)?,
            results: base.node.publisher(&graph::TASK_RESULTS)?,
            told: 0,
            actions: base.node.publisher(&graph::REQUEST_ACTIONS)?,
            summary: base.node.publisher(&graph::REQUEST_SUMMARY)?,
            aborts: base.node.publisher(&graph::TASK_ABORT)?,
            last: None,
            outbox: VecDeque::new(),
            unheard: Vec::new(),
            written: logic.progress(),
            writer: Writer::start(store, base.node.signal().clone()),
            full_told: false,
            full_by_order: Vec::new(),
            clock: None,
            clock_at: Tick(0),
            reader,
            logic,
            base,
            _lock: lock,
            _temporary: temporary,
        };
        node.mind_faults()?;
        Ok(node)
    }

    fn take_fault_orders(&mut self) -> Result<()> {
        if self.base.take_fault_orders()? { self.mind_faults() } else { Ok(()) }
    }

    /// What follows from the faults by order, those that were ordered on the way too.
    fn mind_faults(&mut self) -> Result<()> {
        self.full_by_order = self.base.mission.faults.when(What::StoreFull, self.base.model.period);
        if !self.full_by_order.is_empty() && self.clock.is_none() {
            self.clock = Some(self.base.node.subscription(&graph::CLOCK)?);
        }
        Ok(())
    }

    fn fly(&mut self) -> Result<()> {
        while !self.base.shutdown.asked() {
            self.turn()?;
        }
        Ok(())
    }

    /// The questions of guidance, and what is answered.
    fn take_points(&mut self) -> Result<Vec<Outgoing>> {
        let mut outgoing = Vec::new();
        self.take_fault_orders()?;
        while let Some(point) = self.points.take()? {
            self.take_fault_orders()?;
            if self.base.strikes_at().is_some_and(|at| Tick(point.tick) >= at) {
                let _ = self.results.flush(FLUSH_TIMEOUT);
                self.base.strike();
            }
            self.mind_room(Tick(point.tick))?;
            let offer = self.offer(&point)?;
            outgoing.extend(self.results(&point).into_iter().map(|result| Outgoing::Result(Box::new(result))));
            outgoing.extend(offer.map(|offer| Outgoing::Offer(Box::new(offer))));
            if point.mission_over {
                outgoing.push(Outgoing::Summary);
            }
        }
        Ok(outgoing)
    }

    fn turn(&mut self) -> Result<()> {
        let mut outgoing = self.take_points()?;
        while let Some(task) = self.tasks.take()? {
            if let Some(flown) = messages::in_flight(&task) {
                self.logic.on_task(flown);
            }
        }
        while let Some(phase) = self.phases.take()? {
            match self.base.tick(phase.tick) {
                Ok(tick) if phase.phase == msg::WheelTorque::PHASE_IMAGING => self.logic.on_imaging(phase.task, tick),
                Ok(_) => {}
                Err(error) => self.base.alarm(Severity::Error, "phase refused", &error.to_string())?,
            }
        }
        self.mind_room(Tick(0))?;
        while let Some(request) = self.requests.take()? {
            if self.writer.full() {
                self.base.alarm(Severity::Warn, "request refused", &Refusal::StoreFull.to_string())?;
            } else if let Err(refusal) = self.logic.submit(order_of(&request), self.logic.now()) {
                self.base.alarm(Severity::Warn, "request refused", &refusal.to_string())?;
            }
        }
        if self.writer.full() {
            self.desk.refuse(&self.logic, &self.base, &self.reader)?;
        } else {
            self.desk.take(&mut self.logic, &self.base, &mut outgoing)?;
        }
        self.desk.work(&mut self.logic, SLICE, &mut outgoing);
        self.hand_over(outgoing);
        self.tell_aborts()?;
        for contradiction in self.logic.take_contradictions() {
            self.base.alarm(Severity::Error, "contradiction", &contradiction.to_string())?;
        }
        self.release()?;
        self.writer.check()?;
        let wait = if self.desk.is_busy() { Duration::ZERO } else { IDLE };
        self.base.wait(wait)?;
        Ok(())
    }

    fn offer(&mut self, point: &msg::DecisionPoint) -> Result<Option<msg::UpcomingStrips>> {
        // The question again: the answer may have been lost.
        if let Some(last) = self.last.as_ref().filter(|last| last.task == point.task && !point.mission_over) {
            return Ok(Some(last.clone()));
        }
        let now = match self.base.tick(point.tick) {
            Ok(now) => now,
            Err(error) => {
                self.base.alarm(Severity::Error, "decision point refused", &error.to_string())?;
                return Ok(None);
            }
        };
        if now < self.logic.now() && self.last.is_none() {
            let known = self.logic.now();
            bail!("store {} is of a flight that is at {known}, this one is at {now}", self.reader.path().display());
        }
        self.base.set_now(now);
        let results = point.result.iter().chain(&point.last_imaging).map(task_record);
        let results = match results.collect::<Result<Vec<_>, _>>() {
            Ok(results) => results,
            Err(error) => {
                self.base.alarm(Severity::Error, "task result refused", &error.to_string())?;
                return Ok(None);
            }
        };
        match situation(point) {
            Ok(situation) => self.logic.set_situation(situation),
            Err(error) => self.base.alarm(Severity::Error, "decision point refused", &error.to_string())?,
        }
        let offer = self.logic.on_decision_point(point.task, now, &results);
        let logic = &self.logic;
        let order = |id: StripId| logic.request(id).map(|request| &request.order);
        let message = messages::upcoming_strips(&self.base.stamper, &offer, |candidate| order(candidate.id));
        self.last = Some(message.clone());
        Ok((!point.mission_over).then_some(message))
    }

    /// The tasks that nobody was told of yet, with their rewards.
    fn results(&mut self, point: &msg::DecisionPoint) -> Vec<msg::TaskResult> {
        let told = self.told;
        let ended = point.last_imaging.iter().chain(&point.result);
        let mut results: Vec<_> = ended.filter(|result| result.task >= told).cloned().collect();
        results.dedup_by_key(|result| result.task);
        for result in &mut results {
            result.reward = self.logic.reward_of(result.task);
            self.told = self.told.max(result.task + 1);
        }
        results
    }

    /// Gives the journal to the writer, and lets what goes out wait for it.
    fn hand_over(&mut self, outgoing: Vec<Outgoing>) {
        let entries = Arc::new(self.logic.take_journal());
        let progress = self.logic.progress();
        if !entries.is_empty() || progress != self.written {
            let durability = outgoing.iter().map(Outgoing::durability).max().unwrap_or(Durability::Process);
            self.writer.write(Arc::clone(&entries), progress, durability);
            self.written = progress;
        }
        let number = self.writer.given();
        self.outbox.extend(outgoing.into_iter().map(|outgoing| (number, outgoing)));
        if !entries.is_empty() {
            self.outbox.push_back((number, Outgoing::News(entries)));
        }
    }

    /// Sends what is written.
    fn release(&mut self) -> Result<()> {
        let written = self.writer.written();
        let mut ready: Vec<Outgoing> = Vec::new();
        while let Some((_, outgoing)) = self.outbox.pop_front_if(|(number, _)| *number <= written) {
            ready.push(outgoing);
        }
        if self.writer.full() {
            // The satellite does not wait for room: it flies on with what nobody but it was promised.
            let (flies, waits) = self.outbox.drain(..).partition(|(_, outgoing)| outgoing.is_of_flight());
            self.outbox = waits;
            let flies: VecDeque<_> = flies;
            ready.extend(flies.into_iter().map(|(_, outgoing)| outgoing));
        }
        for outgoing in ready {
            match outgoing {
                Outgoing::Offer(offer) => {
                    self.upcoming.publish(&offer)?;
                    for entries in std::mem::take(&mut self.unheard) {
                        self.tell_news(&entries)?;
                    }
                    self.tell_summary()?;
                }
                Outgoing::Result(result) => self.results.publish(&result)?,
                Outgoing::Summary => self.tell_summary()?,
                // Before the mission begins nobody may be listening yet.
                Outgoing::News(entries) if self.last.is_none() => self.unheard.push(entries),
                Outgoing::News(entries) => {
                    self.tell_news(&entries)?;
                    self.tell_summary()?;
                }
                answer => self.desk.answer(answer, &self.logic, &self.base, &self.reader)?,
            }
        }
        Ok(())
    }

    /// Whether there is room to write: by order, and as it is. What is ordered is told of by the plan.
    fn mind_room(&mut self, tick: Tick) -> Result<()> {
        while let Some(clock) = self.clock.as_ref().map_or(Ok(None), Subscription::take)? {
            self.clock_at = self.clock_at.max(self.base.stamper.tick_from(&clock.clock));
        }
        let now = self.clock_at.max(tick);
        let ordered = self.full_by_order.iter().any(|it| it.from <= now && now < it.until);
        self.writer.set_full_by_order(ordered);
        let full = self.writer.full();
        if full != self.full_told && !(full && ordered) {
            self.full_told = full;
            let text = if full { Refusal::StoreFull.to_string() } else { "there is room".to_owned() };
            let at = self.logic.now().max(self.clock_at);
            self.base.condition(&Report::new(at, graph::REQUEST_MANAGER, STORE_FULL, full, text))?;
        }
        Ok(())
    }

    fn tell_summary(&self) -> Result<()> {
        Ok(self.summary.publish(&messages::request_summary(&self.base.stamper, &self.logic))?)
    }

    fn tell_news(&self, entries: &[Entry]) -> Result<()> {
        for entry in entries {
            match entry {
                Entry::Changed(change) => {
                    self.events.publish(&messages::change(&self.base.stamper, &self.logic, change))?;
                }
                Entry::Taken(action) => self.actions.publish(&operator_action(&self.base.stamper, action))?,
                Entry::Added(_) | Entry::Attempted(_) => {}
            }
        }
        Ok(())
    }

    fn tell_aborts(&mut self) -> Result<()> {
        for abort in self.logic.take_aborts() {
            let Abort { task, id } = abort;
            let state = self.logic.state(id).map_or("unknown", State::name);
            let reason = format!("request {} is {state}", id.0);
            tracing::info!("task {task} should be given up: {reason}");
            self.aborts.publish(&messages::task_abort(&self.base.stamper, self.logic.now(), abort, reason))?;
        }
        Ok(())
    }
}

/// The requests as they stood, or those of the mission when it begins.
fn take_up(base: &MissionNode, store: &mut Store) -> Result<RequestLogic> {
    let snapshot = store.snapshot()?;
    let mut logic =
        RequestLogic::new((*base.model).clone(), &base.mission.initial(), base.horizon, base.mission.rules());
    if snapshot.begun {
        let (count, at) = (snapshot.requests.len(), snapshot.progress.now);
        logic.restore(snapshot.requests, snapshot.rejected, snapshot.progress, snapshot.last_settled)?;
        tracing::info!("{count} requests are taken up from {}, at {at}", store.path().display());
        return Ok(logic);
    }
    let (requests, faults) = base.mission.initial_requests()?;
    faults.iter().for_each(|fault| tracing::warn!("{fault}"));
    let total = requests.len();
    let accepted = requests.into_iter().filter_map(|order| logic.submit(order, Tick(0)).ok()).count();
    tracing::info!("{accepted} of the {total} strips known from the start are accepted");
    Ok(logic)
}
