//! A ROS 2 node: one process, one DDS participant, and the endpoints that are made from it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use ros2_client::Gid;
use ros2_client::builtin_topics::ros_discovery;
use rustdds::{RTPSEntity as _, Timestamp};
use swath_msgs::rmw_dds_common::ParticipantEntitiesInfo;
use swath_msgs::{RosMessage, RosService};

use crate::background::{Background, Fault, Hearing};
use crate::cli::RosArgs;
use crate::clock::SimClock;
use crate::dds::Dds;
use crate::discovered::{RemoteWriter, remote_writers};
use crate::drops::{Dropping, Drops};
use crate::endpoint::{Input, RawPublisher, RawSubscription, Watched};
use crate::entities::Plan;
use crate::environment::Environment;
use crate::error::RosError;
use crate::graph::{self, Entry};
use crate::logging;
use crate::managed::{Managed, Questions};
use crate::members::{Identity, Members};
use crate::memory;
use crate::message::encode_as;
use crate::minder::Minder;
use crate::names::{Names, dds_service, dds_topic, dds_type};
use crate::node_services::NodeServices;
use crate::notices::Notice;
use crate::params::{Parameters, Spec};
use crate::pulse::{Pulse, SIGN_EVERY};
use crate::qos::{Profile, QosProfile, with_depth};
use crate::replies::AllReplies;
use crate::roster::{Direction, Roster};
use crate::service::{Client, Server};
use crate::shutdown::signalled;
use crate::signal::{Signal, lock};
use crate::slot::WriterSlot;
use crate::topic::{Publisher, Subscription};

/// How long a new node listens for another one of its name before it shows itself.
const LISTENING: Duration = Duration::from_millis(600);

/// How long after a match the other side may still not send or receive.
const SETTLING: Duration = Duration::from_millis(300);

/// Memory of a mission's node [10^6 B]: ten times what one needs.
const MEMBER_MEMORY_MB: i64 = 1000;

/// Where nodes of ours say who they are; no topic of the ROS graph.
const IDENTITIES: &str = "swath_identity";
const IDENTITY_TYPE: &str = "swath_msgs/msg/Identity";

/// A ROS 2 node.
///
/// Drop its publishers, subscriptions, servers and clients before the node itself.
pub struct Node {
    // Fields are dropped in this order: the thread first, the participant last.
    background: Background,
    introduction: Arc<WriterSlot>,
    roster: Arc<Roster>,
    parameters: Parameters,
    clock: SimClock,
    signal: Signal,
    pulse: Pulse,
    epoch: u64,
    replies: AllReplies,
    inputs: Mutex<Vec<Watched>>,
    drops: Arc<Drops>,
    names: Names,
    environment: Environment,
    dds: Arc<Dds>,
}

impl Node {
    /// Starts the node that the table calls `name`, in the domain and network that the environment
    /// says, with its log on stderr and on `/rosout`.
    ///
    /// # Errors
    /// If another node of this name runs in the domain, or DDS cannot be used.
    pub fn start(name: &str, args: &RosArgs) -> Result<Self, RosError> {
        Self::start_in(Environment::read()?, name, args)
    }

    /// As [`Self::start`], in an environment of the caller's choice.
    ///
    /// # Errors
    /// As [`Self::start`].
    pub fn start_in(environment: Environment, name: &str, args: &RosArgs) -> Result<Self, RosError> {
        let names = args.names(graph::NAMESPACE, name)?;
        let parameters = Parameters::new(args, &names);
        let (identity, members) = declare_identity(name, &names, &parameters)?;
        let is_member = graph::MEMBERS.contains(&name);
        declare_memory(is_member, &parameters)?;
        let pulse = declare_pulse(&parameters)?;
        let epoch = identity.epoch;
        let screened = "Whether the kernel drops datagrams that would end DDS or fill the memory.";
        let screened = parameters.declare(Spec::new("packet_filter", is_member, screened).read_only())?;
        let dds = Arc::new(Dds::new(&environment, screened)?);
        let participant = dds.participant();
        let minder = Arc::new(Minder::new(&participant)?);
        let signal = Signal::new();
        let latched = Profile::Latched.qos();
        let announcer = dds.writer(plan(ros_discovery::TOPIC_NAME, ParticipantEntitiesInfo::TYPE_NAME, &latched)?)?;
        let own = Gid::from(participant.guid());
        let roster = Roster::new(own, names.clone(), announcer, Arc::clone(&minder), members, is_member);
        let roster = Arc::new(roster);
        let listen = |topic: &str, type_name: &str| -> Result<RawSubscription, RosError> {
            let reader = dds.reader(plan(topic, type_name, &with_depth(latched.clone(), 256))?)?;
            Ok(RawSubscription::new(reader, topic.to_owned(), Arc::clone(&roster), &signal))
        };
        let hearing = Hearing {
            listener: participant.status_listener(),
            announcements: listen(ros_discovery::TOPIC_NAME, ParticipantEntitiesInfo::TYPE_NAME)?,
            identities: listen(IDENTITIES, IDENTITY_TYPE)?,
            own: identity.clone(),
        };
        let introduction = dds.writer(plan(IDENTITIES, IDENTITY_TYPE, &latched)?)?;
        let replies = AllReplies::default();
        let (shared_dds, shared_roster) = (Arc::clone(&dds), Arc::clone(&roster));
        let background =
            Background::start(hearing, shared_dds, shared_roster, minder, replies.clone(), signal.clone())?;
        let clock = SimClock::default();
        let node = Self {
            background,
            introduction,
            roster,
            parameters,
            clock,
            signal,
            pulse,
            epoch,
            replies,
            inputs: Mutex::default(),
            drops: Arc::default(),
            names,
            environment,
            dds,
        };
        node.come_up(args, &identity)?;
        Ok(node)
    }

    fn come_up(&self, args: &RosArgs, identity: &Identity) -> Result<(), RosError> {
        // Of one that is started again, the one before may still be told of.
        let again = self.epoch > 0;
        if !again && self.roster.wait_until(Instant::now() + LISTENING, || self.roster.namesake().is_some()) {
            return Err(self.duplicate());
        }
        self.introduce(identity)?;
        self.roster.announce();
        let rosout = match args.rosout() {
            true => Some(Arc::new(self.publisher(&graph::ROSOUT)?)),
            false => None,
        };
        let logger = self.names.fully_qualified().trim_start_matches('/').replace('/', ".");
        logging::install(logger, args.log_level_of(&self.names), self.clock.clone(), rosout);
        let use_sim_time =
            Spec::new("use_sim_time", true, "Stamps and timers follow simulated time; there is no other here.");
        if !self.parameters.declare(use_sim_time.read_only())? {
            let reason = "the nodes know no time but simulated time".to_owned();
            return Err(RosError::Parameter { name: "use_sim_time".to_owned(), reason });
        }
        self.background.serve(self.services()?);
        Ok(())
    }

    fn introduce(&self, identity: &Identity) -> Result<(), RosError> {
        let cdr = encode_as(IDENTITY_TYPE, identity)?;
        self.introduction
            .write(cdr, Some(Timestamp::now()).into())
            .map(|_| ())
            .map_err(|error| RosError::Send { topic: IDENTITIES.to_owned(), reason: error.to_string() })
    }

    fn services(&self) -> Result<NodeServices, RosError> {
        Ok(NodeServices {
            node: self.names.fully_qualified(),
            parameters: self.parameters.clone(),
            clock: self.clock.clone(),
            describe: self.server(&graph::Service::new("~/describe_parameters", &[], &[]))?,
            get: self.server(&graph::Service::new("~/get_parameters", &[], &[]))?,
            get_types: self.server(&graph::Service::new("~/get_parameter_types", &[], &[]))?,
            list: self.server(&graph::Service::new("~/list_parameters", &[], &[]))?,
            set: self.server(&graph::Service::new("~/set_parameters", &[], &[]))?,
            set_atomically: self.server(&graph::Service::new("~/set_parameters_atomically", &[], &[]))?,
            describe_type: self.server(&graph::Service::new("~/get_type_description", &[], &[]))?,
            events: self.publisher(&graph::PARAMETER_EVENTS)?,
        })
    }

    /// The life cycle of this node, with its services and events; one call a node.
    ///
    /// # Errors
    /// When DDS fails.
    pub fn managed(&self) -> Result<Managed, RosError> {
        let change = self.server(&graph::Service::new("~/change_state", &[], &[]))?;
        let questions = Questions {
            state: self.server(&graph::Service::new("~/get_state", &[], &[]))?,
            states: self.server(&graph::Service::new("~/get_available_states", &[], &[]))?,
            transitions: self.server(&graph::Service::new("~/get_available_transitions", &[], &[]))?,
            graph: self.server(&graph::Service::new("~/get_transition_graph", &[], &[]))?,
        };
        let events = self.publisher(&graph::Topic::new("~/transition_event", Profile::Event, &[], &[]))?;
        let signals = [&self.signal, self.background.signal()];
        let (managed, services) = Managed::new(change, questions, events, self.clock.clone(), signals);
        self.background.manage(services);
        Ok(managed)
    }

    /// A writer of a topic.
    ///
    /// # Errors
    /// When the topic's name breaks the rules of ROS, or DDS fails.
    pub fn publisher<M: RosMessage>(&self, topic: &graph::Topic<M>) -> Result<Publisher<M>, RosError> {
        let Entry { name, type_name, profile, .. } = topic.entry;
        let raw = self.raw_publisher(name, type_name, &profile.qos())?;
        self.roster.remember(Direction::Write, raw.gid(), topic.entry);
        Ok(Publisher::new(raw))
    }

    /// A reader of a topic, with the depth of the topic's profile.
    ///
    /// # Errors
    /// When the topic's name breaks the rules of ROS, or DDS fails.
    pub fn subscription<M: RosMessage>(&self, topic: &graph::Topic<M>) -> Result<Subscription<M>, RosError> {
        self.subscription_with_depth(topic, topic.entry.profile.depth())
    }

    /// A reader that keeps up to `depth` messages until they are taken.
    ///
    /// # Errors
    /// When the topic's name breaks the rules of ROS, or DDS fails.
    pub fn subscription_with_depth<M: RosMessage>(
        &self,
        topic: &graph::Topic<M>,
        depth: usize,
    ) -> Result<Subscription<M>, RosError> {
        let Entry { name, type_name, profile, .. } = topic.entry;
        let raw = self.raw_subscription(name, type_name, &with_depth(profile.qos(), depth))?;
        self.roster.remember(Direction::Read, raw.gid(), topic.entry);
        lock(&self.inputs).push(raw.watched(profile));
        let drops = graph::COME_AGAIN.contains(&topic.entry).then(|| Arc::clone(&self.drops));
        Ok(Subscription::new(raw, topic.entry.writers, drops))
    }

    /// Waits until every reliable reader has all that this node has sent on topics of the table, and tells whether that
    /// is so.
    #[must_use]
    pub fn flush(&self, timeout: Duration) -> bool {
        self.dds.flush(&self.roster.writers_of_table(), timeout)
    }

    /// Drops a share of the messages that come again when they are not answered, drawn from a seed: a fault by order.
    pub fn set_drops(&self, seed: u64, drops: Vec<Dropping>) {
        self.drops.set(seed, drops);
    }

    /// A writer of CDR bytes to the topic `name` (relative, absolute or private) of the type
    /// `type_name` (such as `std_msgs/msg/Header`).
    ///
    /// # Errors
    /// When the name breaks the rules of ROS, or DDS fails.
    pub fn raw_publisher(&self, name: &str, type_name: &str, qos: &QosProfile) -> Result<RawPublisher, RosError> {
        let topic = self.names.resolve(name)?;
        self.writer(topic.clone(), &dds_topic(&topic), type_name, qos)
    }

    /// A reader of CDR bytes from the topic `name` (relative, absolute or private) of the type
    /// `type_name` (such as `std_msgs/msg/Header`).
    ///
    /// # Errors
    /// When the name breaks the rules of ROS, or DDS fails.
    pub fn raw_subscription(&self, name: &str, type_name: &str, qos: &QosProfile) -> Result<RawSubscription, RosError> {
        let topic = self.names.resolve(name)?;
        self.reader(topic.clone(), &dds_topic(&topic), type_name, qos)
    }

    /// A server of a service.
    ///
    /// # Errors
    /// When the service's name breaks the rules of ROS, or DDS fails.
    pub fn server<S: RosService>(&self, service: &graph::Service<S>) -> Result<Server<S>, RosError> {
        let name = self.names.resolve(service.entry.name)?;
        let (request_topic, response_topic) = dds_service(&name);
        let qos = Profile::Service.qos();
        let requests = self.reader(name.clone(), &request_topic, S::Request::TYPE_NAME, &qos)?;
        let responses = self.writer(name, &response_topic, S::Response::TYPE_NAME, &qos)?;
        Ok(Server::new(requests, responses, self.environment.mapping, &self.replies))
    }

    /// A client of a service.
    ///
    /// # Errors
    /// When the service's name breaks the rules of ROS, or DDS fails.
    pub fn client<S: RosService>(&self, service: &graph::Service<S>) -> Result<Client<S>, RosError> {
        let name = self.names.resolve(service.entry.name)?;
        let (request_topic, response_topic) = dds_service(&name);
        let qos = Profile::Service.qos();
        let requests = self.writer(name.clone(), &request_topic, S::Request::TYPE_NAME, &qos)?;
        let responses = self.reader(name.clone(), &response_topic, S::Response::TYPE_NAME, &qos)?;
        Ok(Client::new(name, requests, responses, self.environment.mapping))
    }

    fn writer(
        &self,
        topic: String,
        dds_topic: &str,
        type_name: &str,
        qos: &QosProfile,
    ) -> Result<RawPublisher, RosError> {
        let writer = self.dds.writer(plan(dds_topic, type_name, qos)?)?;
        self.roster.enrol(Direction::Write, writer.gid());
        tracing::debug!("writes {topic} ({type_name})");
        Ok(RawPublisher::new(writer, topic, Arc::clone(&self.roster)))
    }

    fn reader(
        &self,
        topic: String,
        dds_topic: &str,
        type_name: &str,
        qos: &QosProfile,
    ) -> Result<RawSubscription, RosError> {
        let reader = self.dds.reader(plan(dds_topic, type_name, qos)?)?;
        self.roster.enrol(Direction::Read, reader.gid());
        tracing::debug!("reads {topic} ({type_name})");
        Ok(RawSubscription::new(reader, topic, Arc::clone(&self.roster), &self.signal))
    }

    /// Waits for news on this node's subscriptions, and tells whether there are any.
    ///
    /// See [`Signal::wait`]: take from each subscription until it has nothing, then wait.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn wait(&self, timeout: Duration) -> Result<bool, RosError> {
        let start = Instant::now();
        loop {
            let left = timeout.saturating_sub(start.elapsed());
            let news = self.signal.wait(left.min(SIGN_EVERY));
            self.check()?;
            if news || start.elapsed() >= timeout {
                return Ok(news);
            }
        }
    }

    /// Looks whether this node may go on, and gives a sign of life to its launcher; for those who wait for its signal
    /// themselves.
    ///
    /// # Errors
    /// If another node that came up together with it has its name, if another one has taken its place, or if its DDS
    /// has died.
    pub fn check(&self) -> Result<(), RosError> {
        self.pulse.beat(self.clock.now_ns());
        match self.background.fault() {
            None => Ok(()),
            Some(Fault::Namesake) => Err(self.duplicate()),
            Some(Fault::Replaced) => Err(RosError::Replaced { node: self.names.fully_qualified() }),
            Some(Fault::Deaf) => Err(RosError::Deaf { node: self.names.fully_qualified() }),
        }
    }

    /// What went wrong with the messages of others since this was last called: each kind on each topic at most once
    /// in five seconds, with how often it happened. Nothing of it is a reason to stop.
    #[must_use]
    pub fn notices(&self) -> Vec<Notice> {
        self.roster.notices.take(Instant::now())
    }

    /// Waits until each of the nodes (as the table names them, in this namespace) is matched on
    /// every topic that it and this node have in common by the table, in the right direction. The
    /// recorder has every topic in common with everyone. A signal that asks the process to end ([`crate::Shutdown`]) ends
    /// the wait at once, as if they were there.
    ///
    /// # Errors
    /// If that is not so when the time is over; the error names what is missing.
    pub fn wait_for_peers(&self, nodes: &[&str], timeout: Duration) -> Result<(), RosError> {
        let deadline = Instant::now() + timeout;
        let there = || signalled() || self.roster.missing(nodes).is_empty();
        while !self.roster.wait_until(deadline.min(Instant::now() + SIGN_EVERY), there) {
            self.check()?;
            if Instant::now() >= deadline {
                return Err(RosError::MissingPeers { waited: timeout, missing: self.roster.missing(nodes) });
            }
        }
        if !signalled() {
            std::thread::sleep(SETTLING);
        }
        Ok(())
    }

    /// What is missing, in words, until each of the nodes is matched as [`Self::wait_for_peers`] waits for it.
    #[must_use]
    pub fn missing_peers(&self, nodes: &[&str]) -> Vec<String> {
        self.roster.missing(nodes)
    }

    /// Waits until a server of the client's service is there.
    ///
    /// # Errors
    /// [`RosError::MissingPeers`] when there is none in time.
    pub fn wait_for_service<S: RosService>(&self, client: &Client<S>, timeout: Duration) -> Result<(), RosError> {
        if !self.roster.wait_until(Instant::now() + timeout, || client.matched()) {
            let missing = vec![format!("nobody serves {}", client.service())];
            return Err(RosError::MissingPeers { waited: timeout, missing });
        }
        std::thread::sleep(SETTLING);
        Ok(())
    }

    /// Fully qualified names of the nodes of the other processes in the domain.
    #[must_use]
    pub fn nodes(&self) -> BTreeSet<String> {
        self.roster.nodes()
    }

    /// How often each node of this node's namespace was started anew in its mission, by its name in the namespace, as
    /// the nodes say of themselves (`epoch`).
    #[must_use]
    pub fn epochs(&self) -> BTreeMap<String, u64> {
        self.roster.epochs()
    }

    /// The topic writers of the other processes in the domain.
    #[must_use]
    pub fn remote_writers(&self) -> Vec<RemoteWriter> {
        remote_writers(&self.dds.participant())
    }

    /// The parameters of this node.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// Simulated time as this node knows it; the node's logic sets it.
    #[must_use]
    pub fn clock(&self) -> &SimClock {
        &self.clock
    }

    /// The signal that this node's subscriptions raise.
    #[must_use]
    pub fn signal(&self) -> &Signal {
        &self.signal
    }

    /// How often this node was started again in its mission.
    #[must_use]
    pub fn epoch(&self) -> u64 {
        self.epoch
    }

    /// How long the launcher of this node has been gone; nothing while it listens, or when there was none.
    #[must_use]
    pub fn orphaned(&self) -> Option<Duration> {
        self.pulse.orphaned()
    }

    /// How often another launcher has taken this node over.
    #[must_use]
    pub fn taken_over(&self) -> u64 {
        self.pulse.taken_over()
    }

    /// Tells the launcher that what was ordered befalls this node now; with its number among those, from 0.
    pub fn tell_struck(&self, number: u64) {
        self.pulse.tell_struck(number);
    }

    /// What has come on each topic that this node subscribes to.
    #[must_use]
    pub fn inputs(&self) -> Vec<Input> {
        lock(&self.inputs).iter().filter_map(Watched::look).collect()
    }

    /// The names of this node.
    #[must_use]
    pub fn names(&self) -> &Names {
        &self.names
    }

    /// The DDS domain, network and middleware.
    #[must_use]
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    fn duplicate(&self) -> RosError {
        RosError::DuplicateNode { node: self.names.fully_qualified(), domain: self.environment.domain }
    }
}

impl Drop for Node {
    fn drop(&mut self) {
        self.roster.retire();
    }
}

/// Declares the parameters that say who belongs to the mission.
fn declare_identity(name: &str, names: &Names, parameters: &Parameters) -> Result<(Identity, Members), RosError> {
    let fleet = "Nodes of a mission say the same; messages of others do not count. The launcher chooses it.";
    let fleet: String = parameters.declare(Spec::new("fleet", String::new(), fleet).read_only())?;
    let epoch = "How often the node was started in this mission: of two with one name, the later start counts.";
    let epoch = Spec::new("epoch", 0_i64, epoch).in_range(0.0..=9e15).read_only();
    let epoch = parameters.declare(epoch)?.unsigned_abs();
    let external = "Nodes of the table whose place another program takes: its messages count by its name in ROS.";
    let external: Vec<String> = parameters.declare(Spec::new("external", Vec::new(), external).read_only())?;
    let namespace = names.namespace().to_owned();
    let members = Members::new(&namespace, fleet.clone(), external);
    Ok((Identity { namespace, node: name.to_owned(), fleet, epoch }, members))
}

/// Declares the parameter that says whether a launcher listens.
fn declare_pulse(parameters: &Parameters) -> Result<Pulse, RosError> {
    let text =
        "How long the node goes on when the launcher, which listens on its stdout, is gone [s]; 0: none listens.";
    let limit = parameters.declare(Spec::new("orphaned_s", 0.0, text).in_range(0.0..=1e9).read_only())?;
    let text = "Where a launcher listens that takes the node over when its own is gone; empty: nowhere.";
    let next = PathBuf::from(parameters.declare(Spec::new("signs", String::new(), text).read_only())?);
    let next = (!next.as_os_str().is_empty()).then_some(next);
    Ok(Pulse::new((limit > 0.0).then(|| Duration::from_secs_f64(limit)), next))
}

/// Declares the parameter that bounds the memory of this process, and bounds it.
fn declare_memory(is_member: bool, parameters: &Parameters) -> Result<(), RosError> {
    let text = "Memory that this process may have [10^6 B], 0 without bound; beyond it, it ends.";
    let default = if is_member { MEMBER_MEMORY_MB } else { 0 };
    let limit = Spec::new("memory_limit_mb", default, text).in_range(0.0..=1e9).read_only();
    memory::bound(parameters.declare(limit)?.unsigned_abs())
}

fn plan(dds_topic: &str, type_name: &str, qos: &QosProfile) -> Result<Plan, RosError> {
    Ok(Plan { topic: dds_topic.to_owned(), type_name: dds_type(type_name)?, qos: qos.clone() })
}
