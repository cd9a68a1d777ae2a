//! What a mission leaves behind beside its bag: a line a task, and a summary.

use serde::{Deserialize, Serialize};
use swath_sim::task::{Duty, FailureReason, SettledTask, TaskOutcome, TaskRecord, Totals};
use swath_sim::time::{Tick, TickPeriod};
use swath_sim::vehicle::resources::{Delivered, ResourceState};
use swath_sim::world::strip::StripId;

use crate::fallback::Deciders;
use crate::link::response::LinkSummary;

/// Most orders in a table for people.
const ORDERS_TOLD: usize = 20;

/// One line of `tasks.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TaskLine {
    /// Number of the task, from 0.
    pub task: u64,
    /// Tick at which it began.
    pub start_tick: u64,
    /// Tick at which it ended.
    pub end_tick: u64,
    /// Number of the strip; absent for a wait.
    pub strip: Option<u64>,
    /// Name of the strip; absent for a wait.
    pub name: Option<String>,
    /// What was done instead, in a mission with `[resources]`; absent for an image or a wait.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duty: Option<Duty>,
    /// Transition time T_pre [ticks].
    pub t_pre_ticks: u32,
    /// Acquisition time T_acq [ticks].
    pub t_acq_ticks: u32,
    /// Whether the strip was imaged.
    pub success: bool,
    /// Why not.
    pub reason: Option<FailureReason>,
    /// Largest ‖σ_BR‖ while imaging.
    pub max_attitude_error: f64,
    /// Least elevation while imaging [deg].
    pub min_elevation_deg: f64,
    /// Reward earned.
    pub reward: f64,
}

impl TaskLine {
    /// The line of a task; `name` is its strip's.
    #[must_use]
    pub fn new(settled: &SettledTask, name: Option<&str>) -> Self {
        let record = &settled.record;
        Self {
            task: record.task,
            start_tick: record.start.0,
            end_tick: record.end.0,
            strip: record.strip.map(|id| id.0),
            name: name.map(str::to_owned),
            duty: record.duty,
            t_pre_ticks: record.t_pre,
            t_acq_ticks: record.t_acq,
            success: record.success(),
            reason: record.strip.and(record.outcome.failure),
            max_attitude_error: record.outcome.max_attitude_error,
            min_elevation_deg: record.outcome.min_elevation.to_degrees(),
            reward: settled.reward,
        }
    }

    /// The task that the line tells of.
    #[must_use]
    pub fn settled(&self) -> SettledTask {
        let outcome = TaskOutcome {
            failure: self.reason,
            max_attitude_error: self.max_attitude_error,
            min_elevation: self.min_elevation_deg.to_radians(),
        };
        let record = TaskRecord {
            task: self.task,
            start: Tick(self.start_tick),
            end: Tick(self.end_tick),
            strip: self.strip.map(StripId),
            duty: self.duty,
            t_pre: self.t_pre_ticks,
            t_acq: self.t_acq_ticks,
            outcome,
        };
        SettledTask { record, reward: self.reward }
    }
}

/// A process of the mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodeProcess {
    /// Name of the node.
    pub name: String,
    /// Its process.
    pub pid: u32,
}

/// `summary.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Name of the planner that was asked for.
    pub planner: String,
    /// Decisions that another made in its place, by that one's name; absent if there are none.
    #[serde(default, skip_serializing_if = "Deciders::is_empty")]
    pub decided_instead: Deciders,
    /// Why the mission was not flown to its end; absent if it was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// Seed of the mission.
    pub seed: u64,
    /// Length [orbits].
    pub orbits: f64,
    /// Simulated time flown [s].
    pub sim_seconds: f64,
    /// Wall-clock time from the first state to the last [s].
    pub wall_seconds: f64,
    /// Ratio of the two.
    pub real_time_factor: f64,
    /// Strips asked for at the start.
    pub requests: u64,
    /// Strips accepted, those submitted in flight included; a bidirectional one counts twice.
    pub accepted: u64,
    /// Imaging tasks flown to their end.
    pub attempts: u64,
    /// Strips imaged.
    pub fulfilled: u64,
    /// Share of the attempts that succeeded; absent without attempts.
    pub success_rate: Option<f64>,
    /// Sum of the priorities of the strips imaged.
    pub reward: f64,
    /// The same per orbit.
    pub reward_per_orbit: f64,
    /// Mean transition time of the attempts [s]; absent without attempts.
    pub mean_t_pre_s: Option<f64>,
    /// Mean acquisition time of the attempts [s]; absent without attempts.
    pub mean_t_acq_s: Option<f64>,
    /// Time spent waiting [s].
    pub wait_s: f64,
    /// Messages in the bag; 0 without one.
    pub messages_recorded: u64,
    /// Processes that flew the mission.
    pub nodes: Vec<NodeProcess>,
    /// Lines and areas that became several strips; absent if there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub orders: Vec<OrderOutcome>,
    /// What came to the ground and what was left, in a mission with `[resources]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resources: Option<ResourcesSummary>,
    /// How long orders took over the radio, in a mission with `[link]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<LinkSummary>,
}

/// A line or an area that became several strips, and how much of it is imaged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrderOutcome {
    /// Its number.
    pub order_id: u64,
    /// Who asked for it.
    pub submitter: String,
    /// The submitter's reference.
    pub order_ref: String,
    /// Its name.
    pub name: String,
    /// Its strips.
    pub strips: u32,
    /// What imaging all of it is worth.
    pub priority: f64,
    /// Share of its worth that is imaged.
    pub imaged: f64,
    /// Reward earned with it.
    pub reward: f64,
}

/// What came to the ground, and how power and data stood at the end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResourcesSummary {
    /// Images that came to the ground, their priorities, and failures of battery or wheels.
    pub delivered: Delivered,
    /// Charge over capacity at the end.
    pub battery_level: f64,
    /// Bits stored at the end.
    pub stored_bits: u64,
}

impl ResourcesSummary {
    /// The summary of how power and data stand at a mission's end.
    #[must_use]
    pub fn new(state: &ResourceState) -> Self {
        Self { delivered: state.delivered, battery_level: state.level(), stored_bits: state.stored_bits }
    }
}

/// What a summary takes from outside the totals.
#[derive(Clone, Debug, Default)]
pub struct SummaryInputs {
    /// Name of the planner that was asked for.
    pub planner: String,
    /// Decisions that another made in its place, by that one's name.
    pub decided_instead: Deciders,
    /// Why the mission was not flown to its end.
    pub failure: Option<String>,
    /// Seed of the mission.
    pub seed: u64,
    /// Length [orbits].
    pub orbits: f64,
    /// Ticks flown.
    pub ticks: u64,
    /// Wall-clock time [s].
    pub wall_seconds: f64,
    /// Strips asked for at the start.
    pub requests: u64,
    /// Strips accepted.
    pub accepted: u64,
    /// Messages in the bag.
    pub messages_recorded: u64,
    /// Processes.
    pub nodes: Vec<NodeProcess>,
    /// Lines and areas that became several strips.
    pub orders: Vec<OrderOutcome>,
    /// What came to the ground and what was left.
    pub resources: Option<ResourcesSummary>,
    /// How long orders took over the radio.
    pub link: Option<LinkSummary>,
}

impl Summary {
    /// The summary of a mission.
    #[must_use]
    pub fn new(inputs: SummaryInputs, totals: &Totals, period: TickPeriod) -> Self {
        let seconds = |ticks: u64| ticks as f64 * period.seconds();
        let of_attempts = |value: f64| (totals.attempts > 0).then(|| value / totals.attempts as f64);
        let sim_seconds = seconds(inputs.ticks);
        Self {
            planner: inputs.planner,
            decided_instead: inputs.decided_instead,
            failure: inputs.failure,
            seed: inputs.seed,
            orbits: inputs.orbits,
            sim_seconds,
            wall_seconds: inputs.wall_seconds,
            real_time_factor: sim_seconds / inputs.wall_seconds.max(1e-9),
            requests: inputs.requests,
            accepted: inputs.accepted,
            attempts: totals.attempts,
            fulfilled: totals.fulfilled,
            success_rate: of_attempts(totals.fulfilled as f64),
            reward: totals.reward,
            reward_per_orbit: totals.reward / inputs.orbits,
            mean_t_pre_s: of_attempts(seconds(totals.t_pre_ticks)),
            mean_t_acq_s: of_attempts(seconds(totals.t_acq_ticks)),
            wait_s: seconds(totals.wait_ticks),
            messages_recorded: inputs.messages_recorded,
            nodes: inputs.nodes,
            orders: inputs.orders,
            resources: inputs.resources,
            link: inputs.link,
        }
    }

    /// The summary as a table for people.
    #[must_use]
    pub fn table(&self) -> String {
        let mean = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.1} s"));
        let others = self.decided_instead.iter().map(|(name, count)| format!(", {count} decisions by {name}"));
        let mut rows = vec![
            ("planner", self.planner.clone() + &others.collect::<String>()),
            ("seed", self.seed.to_string()),
            ("orbits", self.orbits.to_string()),
            ("simulated time", format!("{:.0} s", self.sim_seconds)),
            ("wall-clock time", format!("{:.2} s ({:.0} x real time)", self.wall_seconds, self.real_time_factor)),
            ("strips requested", format!("{}, {} accepted", self.requests, self.accepted)),
            ("attempts", self.attempts.to_string()),
            ("strips imaged", self.fulfilled.to_string()),
            ("success rate", self.success_rate.map_or("-".to_owned(), |rate| format!("{:.1} %", rate * 100.0))),
            ("reward", format!("{:.2} ({:.2} per orbit)", self.reward, self.reward_per_orbit)),
            ("mean transition", mean(self.mean_t_pre_s)),
            ("mean acquisition", mean(self.mean_t_acq_s)),
            ("waited", format!("{:.0} s", self.wait_s)),
            ("messages recorded", self.messages_recorded.to_string()),
        ];
        if let Some(ResourcesSummary { delivered, battery_level, stored_bits }) = &self.resources {
            rows.extend([
                ("strips delivered", delivered.strips.to_string()),
                ("delivered reward", format!("{:.2}", delivered.reward)),
                ("failures", delivered.failures.to_string()),
                ("below the floor", format!("{} times", delivered.floor_violations)),
                ("battery at the end", format!("{:.1} %", battery_level * 100.0)),
                ("stored at the end", format!("{:.3} Gbit", *stored_bits as f64 / 1e9)),
            ]);
        }
        rows.extend(self.link.iter().flat_map(LinkSummary::rows));
        let lines = rows.iter().map(|(name, value)| format!("  {name:<20} {value}\n"));
        let told = self.orders.iter().take(ORDERS_TOLD).map(|it| {
            let name: String = it.name.chars().filter(|letter| !letter.is_control()).collect();
            format!(
                "  {:<20} {:.1} % of {name} imaged, {} strips\n",
                format!("order {}", it.order_id),
                100.0 * it.imaged,
                it.strips
            )
        });
        let rest = self.orders.len().saturating_sub(ORDERS_TOLD);
        let rest = (rest > 0).then(|| format!("  {:<20} in summary.json\n", format!("{rest} more orders")));
        lines.chain(told).chain(rest).collect()
    }
}
