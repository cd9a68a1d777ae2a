//! What nodes report of conditions that follow from the mission itself, so that each flight of it reports the same.

use serde::{Deserialize, Serialize};
use swath_sim::config::resources::ResourcesConfig;
use swath_sim::time::{Tick, TickPeriod};
use swath_sim::vehicle::health::Health;
use swath_sim::vehicle::resources::{Failure as Failed, ResourceState};

use super::board::{Board, Key};
use super::definitions::Severity;
use super::wishes::Wish;
use crate::faults::grammar::{Failure, Process, What};
use crate::faults::plan::{FaultPlan, Scheduled};

/// Who tells of what the satellite knows of itself.
const GUIDANCE: &str = "guidance";
/// Who tells of planners that are replaced.
const PLANNER: &str = "planner";
/// Who tells of a ground that is not heard.
const CATALOGUE: &str = "catalogue";
/// Who tells of lost nodes.
const LAUNCHER: &str = "launcher";

/// The alarm of messages that are dropped.
const MESSAGES_DROPPED: &str = "messages dropped";
/// The alarm of frames of the radio that are lost by order.
const FRAMES_LOST: &str = "frames lost";
/// The alarm of a store that cannot be written.
pub const STORE_FULL: &str = "store full";
/// The alarm of a bag that cannot be written.
pub const BAG_FULL: &str = "bag full";

/// A node says whether something is wrong.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// When.
    pub tick: Tick,
    /// Which alarm.
    pub key: Key,
    /// How grave it is, where the table does not say.
    pub severity: Severity,
    /// Whether something is wrong.
    pub wrong: bool,
    /// What.
    pub text: String,
}

impl Report {
    /// What a node reports of an alarm of the table.
    #[must_use]
    pub fn new(tick: Tick, node: &str, name: &str, wrong: bool, text: String) -> Self {
        Self { tick, key: Key::new(node, name), severity: Severity::Error, wrong, text }
    }
}

/// Tells the board of reports, in the order of their ticks, and of the nodes' names at one tick, in which order ever they
/// came; and of operators' wishes, each after the reports up to its tick.
pub fn report_all(board: &mut Board, mut reports: Vec<Report>, wishes: &[Wish]) {
    reports.sort_by(|a, b| (a.tick, &a.key).cmp(&(b.tick, &b.key)));
    let mut wishes = wishes.iter().peekable();
    // A wish was followed when it came; what it met may have come in another order then.
    let follow = |wish: &Wish, board: &mut Board| _ = wish.follow(board);
    for Report { tick, key, severity, wrong, text } in reports {
        while let Some(wish) = wishes.next_if(|wish| wish.tick < tick) {
            follow(wish, board);
        }
        board.report(tick, key, severity, wrong, &text);
    }
    wishes.for_each(|wish| follow(wish, board));
}

/// What guidance reports of wheels and sensors.
#[must_use]
pub fn of_health(tick: Tick, health: &Health) -> Vec<Report> {
    let mut reports = Vec::new();
    for (name, &share) in ["wheel x", "wheel y", "wheel z"].into_iter().zip(&health.wheels) {
        let text = match share {
            1.0 => "it gives what is commanded".to_owned(),
            share if share <= 0.0 => "it gives no torque: only some strips can be pointed at".to_owned(),
            share => format!("it gives {:.0} % of its torque limit", share * 100.0),
        };
        reports.push(Report::new(tick, GUIDANCE, name, share < 1.0, text));
    }
    let bias = health.gyro_bias.map(f64::to_degrees);
    let text = format!("by {:.4}, {:.4} and {:.4} deg/s about x, y and z", bias.x, bias.y, bias.z);
    reports.push(Report::new(tick, GUIDANCE, "gyro biased", health.biased(), text));
    let text = if health.tracker_out { "the gyro carries the attitude on" } else { "it has an attitude" };
    reports.push(Report::new(tick, GUIDANCE, "star tracker out", health.tracker_out, text.to_owned()));
    reports
}

/// Charge above the floor, over the capacity, at which the battery counts as low.
const LOW: f64 = 0.05;
/// Share of the storage at which it counts as full.
const FULL: f64 = 0.95;
/// Share of its limit at which a wheel's momentum counts as high.
const HIGH: f64 = 0.8;

/// What guidance reports of power, data and momentum at a decision.
#[must_use]
pub fn of_resources(tick: Tick, state: &ResourceState, config: &ResourcesConfig) -> Vec<Report> {
    let report = |name, wrong, text| Report::new(tick, GUIDANCE, name, wrong, text);
    let percent = |share: f64| share * 100.0;
    let (level, floor) = (state.level(), config.battery_floor);
    let stored = state.stored_bits as f64 / (state.storage_bits as f64).max(1.0);
    let (momentum, limit) = (state.momentum_nms, config.wheel_momentum_max_nms);
    let failed = match state.safe_mode {
        None => "it goes on",
        Some(Failed::BatteryEmpty) => "the battery was empty: the satellite charges until it is above its floor",
        Some(Failed::WheelMomentum) => "a wheel was over its limit: the satellite only sees to that",
    };
    let charge = format!("{:.1} % of its capacity, the floor is {:.1} %", percent(level), percent(floor));
    vec![
        report("battery low", level < floor + LOW, charge),
        report("storage full", stored > FULL, format!("{:.1} % is taken", percent(stored))),
        report("momentum high", momentum > HIGH * limit, format!("{momentum:.2} N m s of {limit} N m s")),
        report("power or wheels failed", state.safe_mode.is_some(), failed.to_owned()),
    ]
}

/// What the planner reports of a decision: why another one, `name`, made it in its place.
#[must_use]
pub fn of_planner(tick: Tick, replaced: Option<&str>, name: &str) -> Report {
    let text = replaced.map_or_else(|| "it decides".to_owned(), |reason| format!("{reason}; {name} takes over"));
    Report::new(tick, PLANNER, "planner replaced", replaced.is_some(), text)
}

/// What the on-board catalogue reports of the ground, which it has heard last at a tick.
#[must_use]
pub fn of_ground(tick: Tick, heard: Tick, silent: bool) -> Report {
    let text = if silent { format!("nothing is heard since {heard}") } else { "it is heard".to_owned() };
    Report::new(tick, CATALOGUE, "ground silent", silent, text)
}

/// What is reported of the faults by order that wheels and sensors do not show: when each begins and ends.
#[must_use]
pub fn of_plan(plan: &FaultPlan, period: TickPeriod) -> Vec<Report> {
    let mut reports = Vec::new();
    for it in plan.scheduled(period) {
        let Some((node, name, text)) = planned(&it) else { continue };
        reports.push(Report::new(it.from, node, &name, true, text));
        let until = if matches!(it.what, What::Process(Process::Guidance, _)) { back(&it) } else { it.until };
        reports.push(Report::new(until, node, &name, false, "over".to_owned()));
    }
    reports.sort_by_key(|report| report.tick);
    reports
}

/// Tick at which a fresh guidance is there: it does not see the state at which the one before was lost.
#[must_use]
pub fn back(lost: &Scheduled) -> Tick {
    lost.until.max(lost.from.after(1))
}

fn planned(it: &Scheduled) -> Option<(&'static str, String, String)> {
    let alarm = |name: String, text: &str| Some((LAUNCHER, name, text.to_owned()));
    match it.what {
        What::Process(process, Failure::Kill) => alarm(format!("{} lost", process.name()), "killed by order"),
        What::Process(process, Failure::Hang) => alarm(format!("{} lost", process.name()), "hangs by order"),
        What::Drop(_) => alarm(MESSAGES_DROPPED.to_owned(), &format!("{} by order", it.what)),
        What::FramesLost(_) => alarm(FRAMES_LOST.to_owned(), &format!("{} by order", it.what)),
        What::StoreFull => alarm(STORE_FULL.to_owned(), "full by order"),
        What::BagFull => alarm(BAG_FULL.to_owned(), "full by order"),
        What::Vehicle(_) => None,
    }
}
