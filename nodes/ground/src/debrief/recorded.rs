//! A recorded mission, read from its bag: what was asked for and when, what was decided, and what came of it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use swath_bags::cli::{MANIFEST, MANIFEST_TEXT};
use swath_bags::schema::{Schema, adapt};
use swath_bags::{Bag, Filter, TopicPattern};
use swath_msgs::RosMessage;
use swath_msgs::swath_msgs as msg;
use swath_node::fault_orders::ordered;
use swath_node::messages::task_result::task_record;
use swath_ros::{Cdr, decode, graph};
use swath_sim::task::SettledTask;
use swath_sim::time::Tick;
use swath_sim::vehicle::model::Model;
use swath_sim::world::strip::StripId;

use swath_mission::faults::orders::Ordered;
use swath_mission::file::{Mission, MissionRequests};
use swath_mission::orders::action::{Act, Action};
use swath_mission::orders::order::Order;
use swath_mission::outcome::TaskLine;
use swath_mission::task_log::TaskLog;
use swath_node::orders::{action, request_of_strip};

/// Which recording, and of what.
#[derive(Debug, Args)]
pub struct RecordedArgs {
    /// Bag directory or file of a mission
    pub bag: PathBuf,
    /// Mission file, for a bag without a manifest: one of `ros2 bag record`, or a converted one
    #[arg(long, value_name = "FILE")]
    pub mission: Option<PathBuf>,
    /// Namespace of the mission's nodes, such as /sat2 [default: the manifest's, or /swath]
    #[arg(long)]
    pub namespace: Option<String>,
}

impl RecordedArgs {
    /// Reads the mission.
    ///
    /// # Errors
    /// As [`Recorded::open`] and [`Recorded::open_of_mission`].
    pub fn open(&self) -> Result<Recorded> {
        match &self.mission {
            Some(mission) => Recorded::open_of_mission(&self.bag, self.namespace.as_deref(), mission),
            None => Recorded::open(&self.bag, self.namespace.as_deref()),
        }
    }
}

/// A mission as its bag tells it.
pub struct Recorded {
    bag: Bag,
    namespace: String,
    /// The mission as it was flown; its requests are in [`events`](Self::events).
    pub mission: Mission,
    /// Its constants.
    pub model: Arc<Model>,
    /// Each task's record and line, by number.
    pub tasks: Vec<(SettledTask, TaskLine)>,
    /// What the planner was offered, by number of the task.
    pub offers: BTreeMap<u64, msg::UpcomingStrips>,
    /// What the planner said of its choice, by number of the task.
    pub decisions: BTreeMap<u64, msg::Decision>,
    /// Changes of strip requests, in order.
    pub events: Vec<msg::StripStatus>,
    /// Faults that were ordered on the way, which the mission has too.
    pub fault_orders: Vec<Ordered>,
    /// Whether the recording reaches the mission's end.
    pub complete: bool,
}

impl Recorded {
    /// Reads a mission's configuration, requests, decisions and tasks.
    ///
    /// # Errors
    /// When the bag cannot be read, or does not hold a mission recorded in this namespace.
    pub fn open(path: &Path, namespace: Option<&str>) -> Result<Self> {
        let bag = Bag::open(path)?;
        let mission = mission_of(&bag).with_context(|| format!("{} holds no mission", path.display()))?;
        Self::read(bag, namespace, mission)
    }

    /// The same from a bag without a manifest, such as others record, of a mission whose file is known.
    ///
    /// # Errors
    /// As [`open`](Self::open), and when the mission file cannot be used.
    pub fn open_of_mission(path: &Path, namespace: Option<&str>, mission: &Path) -> Result<Self> {
        let bag = Bag::open(path)?;
        Self::read(bag, namespace, without_files(Mission::read(mission)?))
    }

    fn read(bag: Bag, namespace: Option<&str>, mission: Mission) -> Result<Self> {
        let manifest = bag.metadata_named(MANIFEST).cloned().unwrap_or_default();
        let told = namespace.or_else(|| manifest.get("namespace").map(String::as_str));
        let namespace = told.unwrap_or(graph::NAMESPACE).to_owned();
        let model = Arc::new(mission.model()?);
        let mut recorded = Self {
            bag,
            namespace: namespace.trim_end_matches('/').to_owned(),
            mission,
            model,
            tasks: Vec::new(),
            offers: BTreeMap::new(),
            decisions: BTreeMap::new(),
            events: Vec::new(),
            fault_orders: Vec::new(),
            complete: false,
        };
        recorded.read_fault_orders()?;
        recorded.read_points()?;
        recorded.offers = recorded.by_task(&graph::UPCOMING_STRIPS, |offer| offer.task)?;
        recorded.decisions = recorded.by_task(&graph::PLANNER_DECISION, |decision| decision.task)?;
        let mut events = Vec::new();
        recorded.for_each(&graph::STRIP_EVENTS, |event| {
            events.push(event);
            Ok(())
        })?;
        recorded.events = events;
        Ok(recorded)
    }

    fn name_of<M>(&self, topic: &graph::Topic<M>) -> String {
        match topic.entry.name.starts_with('/') {
            true => topic.entry.name.to_owned(),
            false => format!("{}/{}", self.namespace, topic.entry.name),
        }
    }

    /// Whether the bag has a topic.
    #[must_use]
    pub fn has<M>(&self, topic: &graph::Topic<M>) -> bool {
        let name = self.name_of(topic);
        self.bag.topics().iter().any(|recorded| recorded.topic.name == name)
    }

    /// Hands each message of a topic to `each`, in order of time.
    ///
    /// # Errors
    /// When the bag cannot be read, a message is not of its type, or `each` fails.
    pub fn for_each<M: RosMessage>(
        &self,
        topic: &graph::Topic<M>,
        mut each: impl FnMut(M) -> Result<()>,
    ) -> Result<()> {
        let name = self.name_of(topic);
        let recorded = self.bag.topics().iter().find(|t| t.topic.name == name);
        let Some(recorded) = recorded else { bail!("the bag has no topic {name}: is --namespace right?") };
        let type_name = &recorded.topic.type_name;
        ensure!(type_name == M::TYPE_NAME, "topic {name} is of type {type_name}, not {}", M::TYPE_NAME);
        // What an earlier version recorded is read by what the recording says of its types.
        let own = Schema::parse(M::TYPE_NAME, M::SCHEMA)?;
        let then = Schema::of(&recorded.topic)?;
        let topics = TopicPattern::new(std::slice::from_ref(&name), None, None)?;
        let mut messages = self.bag.messages(&Filter { topics, ..Filter::default() })?;
        while let Some(message) = messages.next()? {
            let time = message.log_time;
            let data = if then == own { message.data.to_vec() } else { adapt(&then, &own, message.data)? };
            let read = decode(&Cdr::from_bytes(data));
            each(read.with_context(|| format!("{name} at {time} ns"))?)?;
        }
        Ok(())
    }

    /// Hands each tick's state to `each`; one that was sent again counts once.
    ///
    /// # Errors
    /// As [`for_each`](Self::for_each).
    pub fn for_each_state(&self, mut each: impl FnMut(msg::SpacecraftState) -> Result<()>) -> Result<()> {
        let mut last = None;
        self.for_each(&graph::SPACECRAFT_STATE, |state| {
            if last.is_some_and(|last| last >= state.tick) {
                return Ok(());
            }
            last = Some(state.tick);
            each(state)
        })
    }

    /// The messages of a topic by their task; an answer that was repeated counts once.
    fn by_task<M: RosMessage>(&self, topic: &graph::Topic<M>, task: impl Fn(&M) -> u64) -> Result<BTreeMap<u64, M>> {
        let mut by_task = BTreeMap::new();
        self.for_each(topic, |message| {
            by_task.entry(task(&message)).or_insert(message);
            Ok(())
        })?;
        Ok(by_task)
    }

    /// Faults that were ordered on the way befall the mission when it is flown again. Each message tells of all before.
    fn read_fault_orders(&mut self) -> Result<()> {
        let mut orders: Vec<Ordered> = Vec::new();
        if self.has(&graph::FAULT_ORDERS) {
            self.for_each(&graph::FAULT_ORDERS, |message| {
                let new = ordered(&message).into_iter().filter(|order| !orders.contains(order)).collect::<Vec<_>>();
                orders.extend(new);
                Ok(())
            })?;
        }
        orders.iter().for_each(|order| _ = self.mission.faults.add(order.fault));
        self.fault_orders = orders;
        Ok(())
    }

    fn read_points(&mut self) -> Result<()> {
        let (mut log, mut complete) = (TaskLog::default(), false);
        // Before the request manager settled rewards, guidance told of them.
        let settled_apart = self.has(&graph::TASK_RESULTS);
        self.for_each(&graph::DECISION_POINT, |point| {
            complete |= point.mission_over;
            if let Some(result) = point.result.first() {
                log.flown(task_record(result)?, &result.strip_name);
                if !settled_apart {
                    log.settled(result.task, result.reward);
                }
            }
            Ok(())
        })?;
        if settled_apart {
            self.for_each(&graph::TASK_RESULTS, |result| {
                log.settled(result.task, result.reward);
                Ok(())
            })?;
        }
        log.give_up();
        (self.tasks, self.complete) = (log.take(), complete);
        Ok(())
    }

    /// What was asked for and taken: of the request manager, and of the planner, each in order.
    ///
    /// # Errors
    /// When the recording does not begin with the mission, or a strip is missing in it.
    pub fn actions(&self) -> Result<(Vec<Action>, Vec<Action>)> {
        if !self.has(&graph::REQUEST_ACTIONS) {
            return Ok((self.arrivals()?, Vec::new()));
        }
        Ok((self.actions_on(&graph::REQUEST_ACTIONS)?, self.actions_on(&graph::PLANNER_ACTIONS)?))
    }

    fn actions_on(&self, topic: &graph::Topic<msg::OperatorAction>) -> Result<Vec<Action>> {
        let mut actions = Vec::new();
        if self.has(topic) {
            self.for_each(topic, |message| {
                actions.push(action(&message)?);
                Ok(())
            })?;
        }
        Ok(actions)
    }

    /// The strips of a bag from before actions were recorded, as its events and offers tell of them.
    fn arrivals(&self) -> Result<Vec<Action>> {
        let Some(first) = self.offers.get(&0) else { bail!("the recording does not begin with the mission") };
        // The strips known at the first decision are those pending, those held, and those that expired at once.
        let is_at_first = |event: &&msg::StripStatus| event.tick == first.tick && event.strip.id > 0;
        let not_offered = [msg::StripStatus::STATE_EXPIRED, msg::StripStatus::STATE_HELD];
        let left_out = |event: &&msg::StripStatus| not_offered.contains(&event.state);
        let known = first.pending + self.events.iter().filter(is_at_first).filter(left_out).count() as u64;
        let mut arrivals = Vec::new();
        let mut next = 1;
        for event in self.first_events()?.values() {
            let id = event.strip.id;
            if id < next {
                continue;
            }
            let bidirectional = event.linked_to == id + 1;
            next = id + 1 + u64::from(bidirectional);
            let mut request = request_of_strip(&event.strip);
            request.bidirectional = bidirectional;
            let (client_ref, name) = (event.client_ref.clone(), event.strip.name.clone());
            let submitter = event.submitter.clone();
            let order = Order { submitter, ..Order::new(client_ref, name, request) };
            arrivals.push(Action {
                at: Tick(event.tick),
                initial: id <= known,
                actor: event.submitter.clone(),
                reason: String::new(),
                act: Act::Submit(StripId(id), Box::new(order)),
            });
        }
        Ok(arrivals)
    }

    /// The first event of each strip, by its number.
    fn first_events(&self) -> Result<BTreeMap<u64, &msg::StripStatus>> {
        let mut first = BTreeMap::new();
        for event in self.events.iter().filter(|event| event.strip.id > 0) {
            first.entry(event.strip.id).or_insert(event);
        }
        let missing = (1..).zip(first.keys()).find(|(expected, id)| expected != *id);
        if let Some((missing, _)) = missing {
            bail!("the recording does not tell of strip {missing}");
        }
        Ok(first)
    }

    /// Each strip's last event, by its number.
    #[must_use]
    pub fn last_events(&self) -> BTreeMap<u64, &msg::StripStatus> {
        self.events.iter().filter(|event| event.strip.id > 0).map(|event| (event.strip.id, event)).collect()
    }

    /// Numbers of the strips that were imaged.
    #[must_use]
    pub fn imaged(&self) -> BTreeSet<StripId> {
        self.tasks.iter().map(|(task, _)| &task.record).filter(|it| it.success()).filter_map(|it| it.strip).collect()
    }
}

/// The mission in a bag's manifest.
fn mission_of(bag: &Bag) -> Result<Mission> {
    let missing = || format!("no metadata record {MANIFEST}; --mission says which was flown");
    let manifest = bag.metadata_named(MANIFEST).with_context(missing)?;
    let text = manifest.get(MANIFEST_TEXT).with_context(|| format!("{MANIFEST} has no entry {MANIFEST_TEXT}"))?;
    let mission: Mission = toml::from_str(text).with_context(|| format!("{MANIFEST} is no mission"))?;
    let mission = without_files(mission);
    mission.validate()?;
    Ok(mission)
}

/// A mission without its files of requests: they need not be there any more, the bag tells what was asked for.
fn without_files(mission: Mission) -> Mission {
    let requests = MissionRequests { max_attempts: mission.requests.max_attempts, ..MissionRequests::default() };
    Mission { requests, ..mission }
}
