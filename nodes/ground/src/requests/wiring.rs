//! The request manager's topics, and what waits until it is on disk.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result};
use swath_msgs::rosgraph_msgs::Clock;
use swath_msgs::swath_msgs as msg;
use swath_ros::{Publisher, Spec, Subscription, graph};
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

use super::book::Book;
use super::desk::Desk;
use super::flight::FlightSide;
use super::foresight::Foresight;
use super::ground_end::GroundEnd;
use super::lock::StoreLock;
use super::messages;
use super::outgoing::Outgoing;
use super::radio::{self, RadioSide};
use super::store::{Durability, Store};
use super::writer::Writer;
use swath_mission::alarms::conditions::{Report, STORE_FULL};
use swath_mission::fallback::Policies;
use swath_mission::faults::What;
use swath_mission::faults::plan::Scheduled;
use swath_mission::orders::action::Act;
use swath_mission::orders::order::Order;
use swath_mission::requests::journal::{Entry, Progress};
use swath_mission::requests::logic::RequestLogic;
use swath_mission::requests::refusal::Refusal;
use swath_node::lifecycle::{self, LifecycleNode};
use swath_node::node::{MissionNode, Severity};
use swath_node::orders::{operator_action, order_of};
use swath_node::program::{Parameter, Program};

/// Nothing happens by itself: the node only looks whether it is asked to end.
const IDLE: Duration = Duration::from_millis(500);
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
pub fn run(policies: &Policies) -> Result<()> {
    let base = MissionNode::start(&PROGRAM)?;
    let spec = Spec::new(STORE.name, String::new(), STORE.about);
    let path = PathBuf::from(base.node.parameters().declare(spec.read_only())?);
    base.node.parameters().check_given()?;
    lifecycle::run(base, |base| RequestNode::new(base, path.clone(), policies))
}

struct RequestNode {
    book: Book,
    side: Side,
    desk: Desk,
    requests: Subscription<msg::StripRequest>,
    events: Publisher<msg::StripStatus>,
    actions: Publisher<msg::OperatorAction>,
    summary: Publisher<msg::RequestSummary>,
    /// What goes out when the batch of its number is written.
    outbox: VecDeque<(u64, Outgoing)>,
    /// Changes that nobody could have heard of yet.
    unheard: Vec<Arc<Vec<Entry>>>,
    written: Progress,
    writer: Writer,
    /// Whether there was no room, as it was told last.
    full_told: bool,
    /// Whether there is no room because that was ordered.
    full_ordered: bool,
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

/// Who is on the other side: guidance and planner themselves, or a radio.
enum Side {
    Flight(Box<FlightSide>),
    Radio(Box<RadioSide>),
}

impl Side {
    fn new(base: &MissionNode) -> Result<Self> {
        match base.mission.link {
            None => Ok(Self::Flight(Box::new(FlightSide::new(base)?))),
            Some(_) => Ok(Self::Radio(Box::new(RadioSide::new(base)?))),
        }
    }

    fn begun(&self) -> bool {
        match self {
            Self::Flight(side) => side.begun(),
            Self::Radio(side) => side.begun(),
        }
    }
}

impl RequestNode {
    fn new(base: MissionNode, path: PathBuf, policies: &Policies) -> Result<Self> {
        let (path, temporary) = if path.as_os_str().is_empty() {
            tracing::warn!("requests do not outlast this process: parameter `store` is not set");
            let folder = tempfile::tempdir().context("cannot make a temporary store")?;
            (folder.path().join("requests.sqlite"), Some(folder))
        } else {
            (path, None)
        };
        let lock = StoreLock::take(&path, base.goes_on())?;
        let mut store = Store::open(&path, &base.mission.identity())?;
        let reader = Store::open_read_only(&path)?;
        let book = take_up(&base, &mut store, policies)?;
        let mut node = Self {
            desk: Desk::new(&base.node)?,
            side: Side::new(&base)?,
            requests: base.node.subscription(&graph::STRIP_REQUEST)?,
            events: base.node.publisher(&graph::STRIP_EVENTS)?,
            actions: base.node.publisher(&graph::REQUEST_ACTIONS)?,
            summary: base.node.publisher(&graph::REQUEST_SUMMARY)?,
            outbox: VecDeque::new(),
            unheard: Vec::new(),
            written: book.logic().progress(),
            writer: Writer::start(store, base.node.signal().clone()),
            full_told: false,
            full_ordered: false,
            full_by_order: Vec::new(),
            clock: None,
            clock_at: Tick(0),
            reader,
            book,
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

    /// What is on the other side of it: questions of guidance and what is answered, or the next tick of the radio.
    fn take_side(&mut self, outgoing: &mut Vec<Outgoing>) -> Result<Option<(Tick, bool)>> {
        self.take_fault_orders()?;
        loop {
            let point = match (&mut self.side, &mut self.book) {
                (Side::Flight(side), Book::Whole(_)) => side.next()?,
                // Without room the ground is deaf and mute: what it does not hear is sent again.
                (Side::Radio(side), Book::Ground(end)) => return side.take(end, &self.base, self.writer.full()),
                // Both follow from the mission.
                _ => None,
            };
            let Some(point) = point else { break };
            self.take_fault_orders()?;
            self.mind_room(Tick(point.tick))?;
            if let (Side::Flight(side), Book::Whole(logic)) = (&mut self.side, &mut self.book) {
                let offers = self.desk.open;
                side.answer(&point, offers, logic, &self.base, &self.reader, outgoing)?;
            }
        }
        if let (Side::Flight(side), Book::Whole(logic)) = (&self.side, &mut self.book) {
            side.take_tasks(logic, &self.base)?;
        }
        Ok(None)
    }

    fn work(&mut self) -> Result<()> {
        let mut outgoing = Vec::new();
        let sends = self.take_side(&mut outgoing)?;
        self.mind_room(Tick(0))?;
        self.take_what_is_asked(&mut outgoing)?;
        if let (Some((tick, open)), Book::Ground(end)) = (sends, &mut self.book) {
            let sent = end.send(tick, open && !self.writer.full());
            outgoing.push(Outgoing::Radio(Box::new(radio::message(&self.base, tick, sent))));
            outgoing.extend((tick >= self.base.horizon).then_some(Outgoing::Summary));
        }
        self.hand_over(outgoing);
        match (&mut self.side, &mut self.book) {
            (Side::Flight(side), Book::Whole(logic)) => side.tell_aborts(logic, &self.base)?,
            (Side::Radio(side), Book::Ground(end)) => {
                side.tell_status(end, &self.base)?;
                side.tell_plan(end, &self.base)?;
            }
            _ => {}
        }
        for contradiction in self.book.take_contradictions() {
            self.base.alarm(Severity::Error, "contradiction", &contradiction.to_string())?;
        }
        self.release()?;
        self.writer.check()?;
        let busy = sends.is_some() || (self.desk.is_busy() && self.book.may_be_asked());
        self.base.wait(if busy { Duration::ZERO } else { IDLE })?;
        Ok(())
    }

    fn take_what_is_asked(&mut self, outgoing: &mut Vec<Outgoing>) -> Result<()> {
        if !self.book.may_be_asked() {
            return Ok(());
        }
        while let Some(request) = self.requests.take()? {
            let taken = match self.writer.full() {
                true => Err(Refusal::StoreFull),
                false => self.desk.admit(1).and_then(|()| self.book.submit(order_of(&request))),
            };
            if let Err(refusal) = taken {
                self.base.alarm(Severity::Warn, "request refused", &refusal.to_string())?;
            }
        }
        if self.writer.full() {
            self.desk.refuse(&self.book, &self.base, &self.reader)?;
        } else {
            self.desk.take(&mut self.book, &self.base, outgoing)?;
        }
        self.desk.work(&mut self.book, SLICE, outgoing);
        Ok(())
    }

    /// Gives the journal to the writer, and lets what goes out wait for it.
    fn hand_over(&mut self, outgoing: Vec<Outgoing>) {
        let entries = Arc::new(self.book.take_journal());
        let progress = self.book.logic().progress();
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
            ready.extend(flies.into_iter().map(|(_, outgoing)| outgoing));
        }
        for outgoing in ready {
            match outgoing {
                Outgoing::Offer(offer) => {
                    if let Side::Flight(side) = &self.side {
                        side.send_offer(&offer)?;
                    }
                    self.tell_unheard()?;
                    self.tell_summary()?;
                }
                Outgoing::Radio(sent) => {
                    if let Side::Radio(side) = &mut self.side {
                        side.send(&sent)?;
                    }
                    self.tell_unheard()?;
                }
                Outgoing::Result(result) => {
                    if let Side::Flight(side) = &self.side {
                        side.send_result(&result)?;
                    }
                }
                Outgoing::Summary => self.tell_summary()?,
                // Before the mission begins nobody may be listening yet.
                Outgoing::News(entries) if !self.side.begun() => self.unheard.push(entries),
                Outgoing::News(entries) => {
                    self.tell_news(&entries)?;
                    self.tell_summary()?;
                }
                answer => self.desk.answer(answer, self.book.logic(), &self.base, &self.reader)?,
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
        // Room is looked for from time to time: what was ordered may last a little longer.
        self.full_ordered = full && (ordered || self.full_ordered);
        let full = full && !self.full_ordered;
        if full != self.full_told {
            self.full_told = full;
            let text = if full { Refusal::StoreFull.to_string() } else { "there is room".to_owned() };
            let at = self.book.logic().now().max(self.clock_at);
            self.base.condition(&Report::new(at, graph::REQUEST_MANAGER, STORE_FULL, full, text))?;
        }
        Ok(())
    }

    fn tell_unheard(&mut self) -> Result<()> {
        std::mem::take(&mut self.unheard).iter().try_for_each(|entries| self.tell_news(entries))
    }

    fn tell_summary(&self) -> Result<()> {
        Ok(self.summary.publish(&messages::request_summary(&self.base.stamper, self.book.logic()))?)
    }

    fn tell_news(&self, entries: &[Entry]) -> Result<()> {
        for entry in entries {
            match entry {
                Entry::Changed(change) => {
                    self.events.publish(&messages::change(&self.base.stamper, self.book.logic(), change))?;
                }
                Entry::Taken(action) => self.actions.publish(&operator_action(&self.base.stamper, action))?,
                Entry::Added(_) | Entry::Attempted(_) | Entry::Told(_) => {}
            }
        }
        Ok(())
    }
}

impl LifecycleNode for RequestNode {
    fn base(&self) -> &MissionNode {
        &self.base
    }

    fn activate(&mut self) -> Result<()> {
        self.desk.open = true;
        Ok(())
    }

    fn deactivate(&mut self) -> Result<()> {
        self.desk.open = false;
        Ok(())
    }

    fn turn(&mut self) -> Result<()> {
        self.work()
    }

    /// Nothing is taken and nothing offered; what ends is written down, and questions are answered.
    fn rest(&mut self) -> Result<()> {
        self.work()
    }

    fn end(self) -> Result<MissionNode> {
        let Self { mut writer, reader, base, .. } = self;
        // The last connection to close the store leaves one file.
        drop(reader);
        writer.finish()?;
        Ok(base)
    }
}

/// The requests as they stood, or those of the mission when it begins.
fn take_up(base: &MissionNode, store: &mut Store, policies: &Policies) -> Result<Book> {
    if let Some(mut end) = GroundEnd::new(&base.mission, &base.model)? {
        match Foresight::start(&base.mission, base.model.period, policies) {
            Ok(foresight) => end.foresee(foresight),
            // The mission is flown without.
            Err(error) => tracing::warn!("nothing is predicted: {error:#}"),
        }
        match store.snapshot()?.begun {
            true => end.take_up(store)?,
            false => take_initial(base, |order| {
                let actor = order.submitter.clone();
                end.ask(&actor, "", Act::Submit(StripId(0), Box::new(order))).is_ok()
            })?,
        }
        return Ok(Book::Ground(Box::new(end)));
    }
    let snapshot = store.snapshot()?;
    let mut logic =
        RequestLogic::new((*base.model).clone(), &base.mission.initial(), base.horizon, base.mission.rules());
    if snapshot.begun {
        let (count, at) = (snapshot.requests.len(), snapshot.progress.now);
        logic.restore(snapshot.requests, snapshot.rejected, snapshot.progress, snapshot.last_settled)?;
        tracing::info!("{count} requests are taken up from {}, at {at}", store.path().display());
        return Ok(Book::Whole(Box::new(logic)));
    }
    take_initial(base, |order| logic.submit(order, Tick(0)).is_ok())?;
    Ok(Book::Whole(Box::new(logic)))
}

/// Takes the strips known from the start.
fn take_initial(base: &MissionNode, mut take: impl FnMut(Order) -> bool) -> Result<()> {
    let (requests, faults) = base.mission.initial_requests()?;
    faults.iter().for_each(|fault| tracing::warn!("{fault}"));
    let total = requests.len();
    let accepted = requests.into_iter().map(&mut take).filter(|taken| *taken).count();
    tracing::info!("{accepted} of the {total} strips known from the start are accepted");
    Ok(())
}
