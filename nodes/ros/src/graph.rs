//! The node graph: the one table of who writes and who reads which topic, with which type and profile.
//!
//! Nodes make their endpoints from these entries, the recorder takes its topics from [`TOPICS`],
//! and the README shows [`mermaid`].

use std::fmt::Write as _;
use std::marker::PhantomData;

use swath_msgs::diagnostic_msgs::DiagnosticArray;
use swath_msgs::rcl_interfaces::{Log, ParameterEvent};
use swath_msgs::rosgraph_msgs::Clock;
use swath_msgs::sensor_msgs::{BatteryState, JointState, NavSatFix};
use swath_msgs::swath_msgs::{
    AcknowledgeAlarm, AlarmEvent, CancelStrips, CatalogueHeard, Decision, DecisionPoint, FaultOrders, GetLimits,
    GetStrip, GuidanceReached, GuidanceStatus, ImagingTask, LinkStatus, ListAlarms, ListHistory, ListStrips, ListWays,
    OperatorAction, OrderFault, PlannerStatus, PredictedPlan, PreviewStrip, RadioSent, RadioTurn, ReplaceStrip,
    RequestSummary, ResourceState, ReviewProposal, ReviewStrips, SetPlannerMode, ShelveAlarm, SpacecraftState,
    StandingAlarms, StripRequest, StripStatus, SubmitStrips, TaskAbort, TaskPhase, TaskResult, UnshelveAlarm,
    UpcomingStrips, WheelTorque,
};
use swath_msgs::tf2_msgs::TFMessage;
use swath_msgs::{RosMessage, RosService};

use crate::qos::Profile;
use crate::segment::{Segment, segment};

pub use crate::segment::{
    BRIDGE, CATALOGUE, CONSOLE, GUIDANCE, LAUNCHER, LINK, OPERATOR, PLANNER, PLAYER, RECORDER, REQUEST_MANAGER,
    SPACECRAFT,
};

/// The namespace that nodes are in when nobody says otherwise.
pub const NAMESPACE: &str = "/swath";

/// The nodes that fly a mission.
pub const FLIGHT_NODES: [&str; 4] = [SPACECRAFT, GUIDANCE, REQUEST_MANAGER, PLANNER];

/// The nodes that fly besides, in missions with a radio.
pub const RADIO_NODES: [&str; 2] = [CATALOGUE, LINK];

/// All nodes that may fly a mission.
pub const ALL_FLIGHT_NODES: [&str; 6] = [SPACECRAFT, GUIDANCE, REQUEST_MANAGER, PLANNER, CATALOGUE, LINK];

/// Topics whose messages come again as long as they are not answered: of these some may be dropped by order.
pub const COME_AGAIN: [Entry; 6] = [
    SPACECRAFT_STATE.entry,
    SPACECRAFT_TRUTH.entry,
    WHEEL_TORQUE.entry,
    DECISION_POINT.entry,
    UPCOMING_STRIPS.entry,
    PLANNER_TASK.entry,
];

/// The nodes that count only what other nodes of their mission say, and wait for nobody else.
pub const MEMBERS: [&str; 7] = [SPACECRAFT, GUIDANCE, REQUEST_MANAGER, PLANNER, CATALOGUE, LINK, LAUNCHER];

/// What the table says of a topic or service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Name, relative to the namespace unless it starts with a slash.
    pub name: &'static str,
    /// Full name of the type, such as `std_msgs/msg/Header`.
    pub type_name: &'static str,
    /// Quality of service.
    pub profile: Profile,
    /// Nodes that write it, or serve it.
    pub writers: &'static [&'static str],
    /// Nodes that read it, or call it; the recorder reads every topic besides.
    pub readers: &'static [&'static str],
    /// Nodes of those that are no end of it in missions with a radio.
    pub not_by_radio: &'static [&'static str],
}

impl Entry {
    /// In missions with a radio, each pair of a writer and a reader of which one is on board and the other on the ground.
    /// Faults are ordered of the simulator, in whichever node it has its place.
    pub fn past_the_radio(&self) -> impl Iterator<Item = (&'static str, &'static str)> {
        let ends = |node: &&str| !self.not_by_radio.contains(node) && !self.name.starts_with("faults/");
        let across = |(writer, reader): &(&str, &str)| {
            let ends = [segment(writer), segment(reader)];
            ends.contains(&Segment::Space) && ends.contains(&Segment::Ground)
        };
        pairs(self).filter(move |(writer, reader)| ends(writer) && ends(reader)).filter(across)
    }
}

/// A topic of the table.
pub struct Topic<M> {
    /// What the table says.
    pub entry: Entry,
    message: PhantomData<fn() -> M>,
}

/// A service of the table.
pub struct Service<S> {
    /// What the table says.
    pub entry: Entry,
    service: PhantomData<fn() -> S>,
}

impl<M: RosMessage> Topic<M> {
    /// A topic that is not in the table, such as one of a test.
    #[must_use]
    pub const fn new(
        name: &'static str,
        profile: Profile,
        writers: &'static [&'static str],
        readers: &'static [&'static str],
    ) -> Self {
        let entry = Entry { name, type_name: M::TYPE_NAME, profile, writers, readers, not_by_radio: &[] };
        Self { entry, message: PhantomData }
    }

    /// The same, where some nodes are no end of it in missions with a radio.
    const fn but_by_radio(mut self, nodes: &'static [&'static str]) -> Self {
        self.entry.not_by_radio = nodes;
        self
    }
}

impl<S: RosService> Service<S> {
    /// A service that is not in the table, such as one of a test.
    #[must_use]
    pub const fn new(name: &'static str, writers: &'static [&'static str], readers: &'static [&'static str]) -> Self {
        let profile = Profile::Service;
        let entry = Entry { name, type_name: S::TYPE_NAME, profile, writers, readers, not_by_radio: &[] };
        Self { entry, service: PhantomData }
    }

    /// The same, where some nodes are no end of it in missions with a radio.
    const fn but_by_radio(mut self, nodes: &'static [&'static str]) -> Self {
        self.entry.not_by_radio = nodes;
        self
    }
}

/// Simulated time.
pub const CLOCK: Topic<Clock> = Topic::new("/clock", Profile::Clock, &[SPACECRAFT], &[]);
/// State of the spacecraft as its sensors measure it, each tick.
pub const SPACECRAFT_STATE: Topic<SpacecraftState> =
    Topic::new("spacecraft/state", Profile::State, &[SPACECRAFT], &[GUIDANCE]);
/// State of the spacecraft as it is, each tick, where its sensors are not exact: images are judged by it.
pub const SPACECRAFT_TRUTH: Topic<SpacecraftState> =
    Topic::new("spacecraft/truth", Profile::State, &[SPACECRAFT], &[GUIDANCE]);
/// Torque command, each tick.
pub const WHEEL_TORQUE: Topic<WheelTorque> =
    Topic::new("guidance/wheel_torque", Profile::State, &[GUIDANCE], &[SPACECRAFT]);
/// A task is wanted.
pub const DECISION_POINT: Topic<DecisionPoint> = Topic::new(
    "guidance/decision_point",
    Profile::Command,
    &[GUIDANCE],
    &[REQUEST_MANAGER, CATALOGUE, PLANNER, LAUNCHER],
)
.but_by_radio(&[REQUEST_MANAGER]);
/// What guidance is doing, every ten seconds.
pub const GUIDANCE_STATUS: Topic<GuidanceStatus> =
    Topic::new("guidance/status", Profile::Event, &[GUIDANCE], &[LAUNCHER]);
/// The task in hand enters another phase.
pub const TASK_PHASE: Topic<TaskPhase> =
    Topic::new("guidance/phase", Profile::Event, &[GUIDANCE], &[REQUEST_MANAGER]).but_by_radio(&[REQUEST_MANAGER]);
/// How far guidance has flown, in missions with a radio.
pub const GUIDANCE_REACHED: Topic<GuidanceReached> =
    Topic::new("guidance/reached", Profile::Command, &[GUIDANCE], &[CATALOGUE]);
/// How far the radio has been heard on board.
pub const CATALOGUE_HEARD: Topic<CatalogueHeard> =
    Topic::new("catalogue/heard", Profile::Command, &[CATALOGUE], &[GUIDANCE]);
/// What the satellite sends.
pub const SATELLITE_SENT: Topic<RadioSent> = Topic::new("catalogue/sent", Profile::Command, &[CATALOGUE], &[LINK]);
/// What the satellite hears.
pub const SATELLITE_TURN: Topic<RadioTurn> = Topic::new("link/up", Profile::Command, &[LINK], &[CATALOGUE]);
/// What the ground sends.
pub const GROUND_SENT: Topic<RadioSent> = Topic::new("requests/sent", Profile::Command, &[REQUEST_MANAGER], &[LINK]);
/// What the ground hears.
pub const GROUND_TURN: Topic<RadioTurn> = Topic::new("link/down", Profile::Command, &[LINK], &[REQUEST_MANAGER]);
/// A task that is no longer wanted.
pub const TASK_ABORT: Topic<TaskAbort> =
    Topic::new("requests/abort", Profile::Command, &[REQUEST_MANAGER], &[GUIDANCE])
        .but_by_radio(&[REQUEST_MANAGER, GUIDANCE]);
/// What the planner may do by itself, and what it proposes.
pub const PLANNER_STATUS: Topic<PlannerStatus> =
    Topic::new("planner/status", Profile::Latched, &[PLANNER], &[LAUNCHER, OPERATOR]).but_by_radio(&[OPERATOR]);
/// The next task.
pub const PLANNER_TASK: Topic<ImagingTask> =
    Topic::new("planner/task", Profile::Command, &[PLANNER], &[GUIDANCE, REQUEST_MANAGER])
        .but_by_radio(&[REQUEST_MANAGER]);
/// How the task was chosen.
pub const PLANNER_DECISION: Topic<Decision> = Topic::new("planner/decision", Profile::Event, &[PLANNER], &[LAUNCHER]);
/// The strips to choose among.
pub const UPCOMING_STRIPS: Topic<UpcomingStrips> =
    Topic::new("requests/upcoming", Profile::Latched, &[REQUEST_MANAGER, CATALOGUE], &[PLANNER])
        .but_by_radio(&[REQUEST_MANAGER]);
/// A strip request from anyone, without an answer.
pub const STRIP_REQUEST: Topic<StripRequest> =
    Topic::new("requests/request", Profile::Event, &[OPERATOR], &[REQUEST_MANAGER]);
/// How each task went, with its reward settled.
pub const TASK_RESULTS: Topic<TaskResult> =
    Topic::new("requests/results", Profile::Command, &[REQUEST_MANAGER, CATALOGUE], &[LAUNCHER])
        .but_by_radio(&[REQUEST_MANAGER]);
/// Changes of strip requests.
pub const STRIP_EVENTS: Topic<StripStatus> =
    Topic::new("requests/events", Profile::Event, &[REQUEST_MANAGER], &[OPERATOR]);
/// The radio, as the ground knows it.
pub const LINK_STATUS: Topic<LinkStatus> =
    Topic::new("requests/link", Profile::Latched, &[REQUEST_MANAGER], &[OPERATOR]);
/// What the satellite is going to do, as the ground predicts it.
pub const PREDICTED_PLAN: Topic<PredictedPlan> =
    Topic::new("requests/plan", Profile::Latched, &[REQUEST_MANAGER], &[OPERATOR]);
/// What was asked for of the request manager and taken.
pub const REQUEST_ACTIONS: Topic<OperatorAction> =
    Topic::new("requests/actions", Profile::Event, &[REQUEST_MANAGER], &[]);
/// What was asked for of the planner and taken.
pub const PLANNER_ACTIONS: Topic<OperatorAction> = Topic::new("planner/actions", Profile::Event, &[PLANNER], &[]);
/// All alarms that are not normal.
pub const STANDING_ALARMS: Topic<StandingAlarms> =
    Topic::new("alarms/standing", Profile::Latched, &[LAUNCHER], &[OPERATOR]);
/// What happens to alarms.
pub const ALARM_EVENTS: Topic<AlarmEvent> = Topic::new("alarms/events", Profile::Event, &[LAUNCHER], &[OPERATOR]);
/// Faults that were ordered while the mission flies.
pub const FAULT_ORDERS: Topic<FaultOrders> = Topic::new(
    "faults/orders",
    Profile::Latched,
    &[SPACECRAFT],
    &[GUIDANCE, REQUEST_MANAGER, PLANNER, CATALOGUE, LINK, LAUNCHER],
);
/// How many strip requests are in which state.
pub const REQUEST_SUMMARY: Topic<RequestSummary> =
    Topic::new("requests/summary", Profile::Latched, &[REQUEST_MANAGER], &[LAUNCHER, OPERATOR]);
/// Point on the ground below the satellite, decimated.
pub const SUB_SATELLITE_POINT: Topic<NavSatFix> =
    Topic::new("spacecraft/sub_satellite_point", Profile::Event, &[SPACECRAFT], &[]);
/// Speeds and torques of the wheels, decimated.
pub const WHEELS: Topic<JointState> = Topic::new("spacecraft/wheels", Profile::Event, &[SPACECRAFT], &[]);
/// Charge of the battery, decimated, in missions with `[resources]`.
pub const BATTERY: Topic<BatteryState> = Topic::new("spacecraft/battery", Profile::Event, &[SPACECRAFT], &[]);
/// Power, storage and momentum, decimated, in missions with `[resources]`.
pub const RESOURCES: Topic<ResourceState> = Topic::new("spacecraft/resources", Profile::Event, &[SPACECRAFT], &[]);
/// Frames, decimated.
pub const TF: Topic<TFMessage> = Topic::new("/tf", Profile::Event, &[SPACECRAFT], &[]);
/// Health of the nodes.
pub const DIAGNOSTICS: Topic<DiagnosticArray> =
    Topic::new("/diagnostics", Profile::Event, &ALL_FLIGHT_NODES, &[LAUNCHER]);
/// Log lines of the nodes.
pub const ROSOUT: Topic<Log> = Topic::new("/rosout", Profile::Log, &ALL_FLIGHT_NODES, &[]);
/// Changes of parameters.
pub const PARAMETER_EVENTS: Topic<ParameterEvent> =
    Topic::new("/parameter_events", Profile::Event, &ALL_FLIGHT_NODES, &[]);

/// Submits strip requests, with an answer for each.
pub const SUBMIT_STRIPS: Service<SubmitStrips> = Service::new("requests/submit", &[REQUEST_MANAGER], &[OPERATOR]);

/// Takes strip requests back.
pub const CANCEL_STRIPS: Service<CancelStrips> = Service::new("requests/cancel", &[REQUEST_MANAGER], &[OPERATOR]);
/// Replaces a strip request by another one.
pub const REPLACE_STRIP: Service<ReplaceStrip> = Service::new("requests/replace", &[REQUEST_MANAGER], &[OPERATOR]);
/// Decides on held strip requests, or holds accepted ones.
pub const REVIEW_STRIPS: Service<ReviewStrips> = Service::new("requests/review", &[REQUEST_MANAGER], &[OPERATOR]);
/// All that is known of a strip request.
pub const GET_STRIP: Service<GetStrip> = Service::new("requests/get", &[REQUEST_MANAGER], &[OPERATOR]);
/// Strip requests by state, area and time, page by page.
pub const LIST_STRIPS: Service<ListStrips> = Service::new("requests/list", &[REQUEST_MANAGER], &[OPERATOR]);
/// The audit trail, page by page.
pub const LIST_HISTORY: Service<ListHistory> = Service::new("requests/history", &[REQUEST_MANAGER], &[OPERATOR]);
/// When a strip could be imaged.
pub const PREVIEW_STRIP: Service<PreviewStrip> = Service::new("requests/preview", &[REQUEST_MANAGER], &[OPERATOR]);
/// The ways of strip requests over the radio, page by page.
pub const LIST_WAYS: Service<ListWays> = Service::new("requests/ways", &[REQUEST_MANAGER], &[OPERATOR]);
/// What strips may be.
pub const GET_LIMITS: Service<GetLimits> = Service::new("requests/limits", &[REQUEST_MANAGER], &[OPERATOR]);
/// What the planner may do by itself.
pub const SET_PLANNER_MODE: Service<SetPlannerMode> =
    Service::new("planner/set_mode", &[PLANNER], &[OPERATOR]).but_by_radio(&[PLANNER]);
/// Approves or rejects what the planner proposes.
pub const REVIEW_PROPOSAL: Service<ReviewProposal> =
    Service::new("planner/review", &[PLANNER], &[OPERATOR]).but_by_radio(&[PLANNER]);
/// An operator knows of an alarm.
pub const ACKNOWLEDGE_ALARM: Service<AcknowledgeAlarm> = Service::new("alarms/acknowledge", &[LAUNCHER], &[OPERATOR]);
/// An operator does not want to be told of an alarm for a while.
pub const SHELVE_ALARM: Service<ShelveAlarm> = Service::new("alarms/shelve", &[LAUNCHER], &[OPERATOR]);
/// An operator wants to be told of an alarm again.
pub const UNSHELVE_ALARM: Service<UnshelveAlarm> = Service::new("alarms/unshelve", &[LAUNCHER], &[OPERATOR]);
/// Something is to fail.
pub const ORDER_FAULT: Service<OrderFault> = Service::new("faults/order", &[SPACECRAFT], &[OPERATOR]);
/// All alarms that are not normal.
pub const LIST_ALARMS: Service<ListAlarms> = Service::new("alarms/list", &[LAUNCHER], &[OPERATOR]);

/// Every topic of the table; the recorder records these.
pub const TOPICS: &[Entry] = &[
    CLOCK.entry,
    SPACECRAFT_STATE.entry,
    SPACECRAFT_TRUTH.entry,
    SUB_SATELLITE_POINT.entry,
    WHEELS.entry,
    BATTERY.entry,
    RESOURCES.entry,
    TF.entry,
    WHEEL_TORQUE.entry,
    DECISION_POINT.entry,
    GUIDANCE_STATUS.entry,
    TASK_PHASE.entry,
    GUIDANCE_REACHED.entry,
    CATALOGUE_HEARD.entry,
    SATELLITE_SENT.entry,
    SATELLITE_TURN.entry,
    GROUND_SENT.entry,
    GROUND_TURN.entry,
    UPCOMING_STRIPS.entry,
    STRIP_REQUEST.entry,
    TASK_RESULTS.entry,
    STRIP_EVENTS.entry,
    REQUEST_ACTIONS.entry,
    REQUEST_SUMMARY.entry,
    LINK_STATUS.entry,
    PREDICTED_PLAN.entry,
    TASK_ABORT.entry,
    PLANNER_TASK.entry,
    PLANNER_DECISION.entry,
    PLANNER_STATUS.entry,
    PLANNER_ACTIONS.entry,
    STANDING_ALARMS.entry,
    ALARM_EVENTS.entry,
    FAULT_ORDERS.entry,
    DIAGNOSTICS.entry,
    ROSOUT.entry,
    PARAMETER_EVENTS.entry,
];

/// Every service of the table; those for parameters, which each node has, are not listed.
pub const SERVICES: &[Entry] = &[
    SUBMIT_STRIPS.entry,
    CANCEL_STRIPS.entry,
    REPLACE_STRIP.entry,
    REVIEW_STRIPS.entry,
    GET_STRIP.entry,
    LIST_STRIPS.entry,
    LIST_HISTORY.entry,
    PREVIEW_STRIP.entry,
    LIST_WAYS.entry,
    GET_LIMITS.entry,
    SET_PLANNER_MODE.entry,
    REVIEW_PROPOSAL.entry,
    ACKNOWLEDGE_ALARM.entry,
    SHELVE_ALARM.entry,
    UNSHELVE_ALARM.entry,
    LIST_ALARMS.entry,
    ORDER_FAULT.entry,
];

/// The table as a Mermaid flow chart: nodes are boxes, topics are arrows between them.
#[must_use]
pub fn mermaid() -> String {
    let mut chart = "flowchart LR\n".to_owned();
    for node in FLIGHT_NODES.iter().chain(&RADIO_NODES).chain(&[LAUNCHER, OPERATOR, RECORDER]) {
        let _ = writeln!(chart, "    {node}[{node}]");
    }
    for (entries, arrow) in [(TOPICS, "-->"), (SERVICES, "<-.->")] {
        for entry in entries {
            let ends = |entry: &Entry| (entry.writers.len(), entry.readers.len());
            // What every node writes is nobody's flow.
            if ends(entry).0 > 2 || ends(entry).1 == 0 {
                continue;
            }
            for (writer, reader) in pairs(entry) {
                let (from, to) = if arrow == "-->" { (writer, reader) } else { (reader, writer) };
                let _ = writeln!(chart, "    {from} {arrow}|{}| {to}", entry.name);
            }
        }
    }
    let _ = writeln!(chart, "    FLIGHT([every topic]) --> {RECORDER}");
    chart
}

fn pairs(entry: &Entry) -> impl Iterator<Item = (&'static str, &'static str)> {
    let (writers, readers) = (entry.writers, entry.readers);
    writers.iter().flat_map(move |writer| readers.iter().map(move |reader| (*writer, *reader)))
}

/// The table in Markdown.
#[must_use]
pub fn table() -> String {
    let mut table = "| topic | type | profile | written by | read by |\n| --- | --- | --- | --- | --- |\n".to_owned();
    for entry in TOPICS.iter().chain(SERVICES) {
        let end = |node: &&str| {
            let unless = if entry.not_by_radio.contains(node) { ", without radio" } else { "" };
            format!("{node} ({}{unless})", segment(node).name())
        };
        let list = |nodes: &[&str]| match nodes {
            [] => "any".to_owned(),
            nodes => nodes.iter().map(end).collect::<Vec<_>>().join(", "),
        };
        let _ = writeln!(
            table,
            "| `{}` | `{}` | {} | {} | {} |",
            entry.name,
            entry.type_name,
            entry.profile.name(),
            list(entry.writers),
            list(entry.readers)
        );
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_topic_is_in_the_table_once_and_has_a_schema() {
        let mut names: Vec<_> = TOPICS.iter().chain(SERVICES).map(|entry| entry.name).collect();
        names.sort_unstable();
        let count = names.len();
        names.dedup();
        assert_eq!(names.len(), count);
        for entry in TOPICS {
            assert!(swath_msgs::schema_for(entry.type_name).is_some(), "{}", entry.name);
            assert!(!entry.writers.is_empty(), "{}", entry.name);
        }
    }

    /// With a radio, whoever is on the ground reads nothing of what is on board but through it, and calls nothing there.
    #[test]
    fn nothing_goes_past_the_radio() {
        for entry in TOPICS.iter().chain(SERVICES) {
            assert_eq!(entry.past_the_radio().collect::<Vec<_>>(), [], "{}", entry.name);
            let ends = entry.writers.iter().chain(entry.readers);
            assert!(entry.not_by_radio.iter().all(|node| ends.clone().any(|end| end == node)), "{}", entry.name);
        }
        let past = |topic: Entry| Entry { not_by_radio: &[], ..topic }.past_the_radio().count();
        for (entry, without) in [(DECISION_POINT.entry, 1), (TASK_ABORT.entry, 1), (PLANNER_STATUS.entry, 1)] {
            assert_eq!(past(entry), without, "{}", entry.name);
        }
        for entry in [SET_PLANNER_MODE.entry, REVIEW_PROPOSAL.entry] {
            assert_eq!(past(entry), 1, "{}", entry.name);
        }
        let sent = [SATELLITE_SENT.entry, GROUND_SENT.entry];
        let heard = [SATELLITE_TURN.entry, GROUND_TURN.entry];
        assert!(sent.iter().all(|it| it.readers == [LINK]) && heard.iter().all(|it| it.writers == [LINK]));
    }

    #[test]
    fn the_control_loop_has_only_its_two_ends() {
        assert_eq!(SPACECRAFT_STATE.entry.readers, [GUIDANCE]);
        assert_eq!(WHEEL_TORQUE.entry.readers, [SPACECRAFT]);
    }

    #[test]
    fn the_diagram_shows_the_flow() {
        let expected = "flowchart LR
    spacecraft[spacecraft]
    guidance[guidance]
    request_manager[request_manager]
    planner[planner]
    catalogue[catalogue]
    link[link]
    launcher[launcher]
    operator[operator]
    recorder[recorder]
    spacecraft -->|spacecraft/state| guidance
    spacecraft -->|spacecraft/truth| guidance
    guidance -->|guidance/wheel_torque| spacecraft
    guidance -->|guidance/decision_point| request_manager
    guidance -->|guidance/decision_point| catalogue
    guidance -->|guidance/decision_point| planner
    guidance -->|guidance/decision_point| launcher
    guidance -->|guidance/status| launcher
    guidance -->|guidance/phase| request_manager
    guidance -->|guidance/reached| catalogue
    catalogue -->|catalogue/heard| guidance
    catalogue -->|catalogue/sent| link
    link -->|link/up| catalogue
    request_manager -->|requests/sent| link
    link -->|link/down| request_manager
    request_manager -->|requests/upcoming| planner
    catalogue -->|requests/upcoming| planner
    operator -->|requests/request| request_manager
    request_manager -->|requests/results| launcher
    catalogue -->|requests/results| launcher
    request_manager -->|requests/events| operator
    request_manager -->|requests/summary| launcher
    request_manager -->|requests/summary| operator
    request_manager -->|requests/link| operator
    request_manager -->|requests/plan| operator
    request_manager -->|requests/abort| guidance
    planner -->|planner/task| guidance
    planner -->|planner/task| request_manager
    planner -->|planner/decision| launcher
    planner -->|planner/status| launcher
    planner -->|planner/status| operator
    launcher -->|alarms/standing| operator
    launcher -->|alarms/events| operator
    spacecraft -->|faults/orders| guidance
    spacecraft -->|faults/orders| request_manager
    spacecraft -->|faults/orders| planner
    spacecraft -->|faults/orders| catalogue
    spacecraft -->|faults/orders| link
    spacecraft -->|faults/orders| launcher
    operator <-.->|requests/submit| request_manager
    operator <-.->|requests/cancel| request_manager
    operator <-.->|requests/replace| request_manager
    operator <-.->|requests/review| request_manager
    operator <-.->|requests/get| request_manager
    operator <-.->|requests/list| request_manager
    operator <-.->|requests/history| request_manager
    operator <-.->|requests/preview| request_manager
    operator <-.->|requests/ways| request_manager
    operator <-.->|requests/limits| request_manager
    operator <-.->|planner/set_mode| planner
    operator <-.->|planner/review| planner
    operator <-.->|alarms/acknowledge| launcher
    operator <-.->|alarms/shelve| launcher
    operator <-.->|alarms/unshelve| launcher
    operator <-.->|alarms/list| launcher
    operator <-.->|faults/order| spacecraft
    FLIGHT([every topic]) --> recorder
";
        assert_eq!(mermaid(), expected);
    }
}
