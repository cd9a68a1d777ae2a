//! `swath link`: how the radio of a flying mission stands, and the ways of strips over it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand};
use serde_json::{Map, Value, json};
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::swath_msgs as msg;
use swath_node::out;
use swath_ros::{RosArgs, graph};

use super::client::{Operator, check};
use super::files::printable;
use crate::place::Place;
use crate::requests::json::{time, time_json};

/// `swath link`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  swath link status\n  swath link plan")]
pub struct LinkArgs {
    #[command(subcommand)]
    command: LinkCommand,
    #[command(flatten)]
    place: Place,
    /// Print JSON.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum LinkCommand {
    /// Whether it is open, what waits for it, what has come down, and the next passes.
    Status,
    /// What the satellite is going to do, as the ground predicts it, and where what came down was otherwise.
    Plan,
}

/// How long the latched status may take.
const TIMEOUT: Duration = Duration::from_secs(10);
/// Ways that are asked for at a time.
const PAGE: u32 = 1000;
/// Passes that people are told.
const PASSES: usize = 5;

/// Runs `swath link`.
///
/// # Errors
/// When nobody answers, or the mission has no radio.
pub fn run(args: &LinkArgs, ros: &RosArgs) -> Result<()> {
    let operator = Operator::start(&args.place.args(ros))?;
    // Who serves these tells of the radio, if there is one.
    operator.desk(&graph::LIST_WAYS)?;
    let Some(status) = status(&operator)? else { bail!("the mission has no [link]: ground and satellite are one") };
    match (&args.command, args.json) {
        (LinkCommand::Status, true) => _ = out::print_line(status_json(&status))?,
        (LinkCommand::Status, false) => _ = out::print(&status_text(&status))?,
        (LinkCommand::Plan, as_json) => {
            let plans = operator.node.subscription(&graph::PREDICTED_PLAN)?;
            let plan = plans.newest(operator.node.signal(), TIMEOUT)?;
            let plan = plan
                .context("the ground predicts nothing: set prediction_h in [link], or wait for the first prediction")?;
            match as_json {
                true => out::print_line(plan_json(&plan))?,
                false => out::print(&plan_text(&plan))?,
            };
        }
    }
    Ok(())
}

/// How the radio stands, once the request manager is there; nothing in a mission without one.
///
/// # Errors
/// When DDS cannot be used, or the status does not come.
pub fn status(operator: &Operator) -> Result<Option<msg::LinkStatus>> {
    let topic = operator.node.names().resolve(graph::LINK_STATUS.entry.name)?;
    if !operator.node.remote_writers().iter().any(|writer| writer.topic == topic) {
        return Ok(None);
    }
    let statuses = operator.node.subscription(&graph::LINK_STATUS)?;
    let status = statuses.newest(operator.node.signal(), TIMEOUT)?;
    status.context("the status of the link does not come").map(Some)
}

/// The ways of strips with greater numbers than `after`, at most `count`; none in a mission without a radio.
///
/// # Errors
/// When nobody answers.
pub fn ways(operator: &Operator, after: u64, count: usize) -> Result<BTreeMap<u64, msg::StripWay>> {
    let desk = operator.desk(&graph::LIST_WAYS)?;
    let mut ways = BTreeMap::new();
    let mut after_id = after;
    while ways.len() < count {
        let limit = PAGE.min(u32::try_from(count - ways.len()).unwrap_or(PAGE));
        let page = desk.call(msg::ListWaysRequest { after_id, limit })?;
        check(page.reason_code, &page.reason)?;
        after_id = page.ways.last().map_or(after_id, |way| way.strip_id);
        ways.extend(page.ways.into_iter().map(|way| (way.strip_id, way)));
        if !page.more {
            break;
        }
    }
    Ok(ways)
}

/// A way for machines: each step with its tick and its time.
pub fn way_json(way: &msg::StripWay) -> Value {
    let step = |step: &msg::WayStep| (step.name.clone(), json!({ "tick": step.tick, "time": time_json(&step.time) }));
    let mut steps = way.steps.iter().map(step).collect::<Map<_, _>>();
    if !way.predicted.is_empty() {
        let predicted = way.predicted.iter().map(step).collect();
        steps.insert("predicted".to_owned(), Value::Object(predicted));
    }
    Value::Object(steps)
}

/// A way for people.
pub fn way_text(way: &msg::StripWay) -> String {
    let line = |step: &msg::WayStep, mark: &str| {
        format!("  {:<12}  {}{mark}\n", step.name.replace('_', " "), time(&step.time))
    };
    let steps = way.steps.iter().map(|step| line(step, ""));
    let predicted = way.predicted.iter().map(|step| line(step, ", as predicted"));
    std::iter::once("way over the radio\n".to_owned()).chain(steps).chain(predicted).collect()
}

/// What the satellite is going to do, in a line.
pub fn plan_line(plan: &msg::PredictedPlan) -> String {
    let imaged = plan.tasks.iter().filter(|task| task.success).count();
    let next = plan.tasks.iter().find(|task| task.success).map(|task| (task.strip_id, time(&task.imaging)));
    let next = next.map(|(id, at)| format!(", the next one strip {id} at {at}")).unwrap_or_default();
    let (equal, compared) = (plan.equal, plan.compared);
    format!("{imaged} strips to be imaged{next}; {equal} of {compared} tasks known were as predicted")
}

/// The last step of a way, in a word.
pub fn way_word(way: &msg::StripWay) -> String {
    way.steps.last().map_or(String::new(), |step| step.name.replace('_', " "))
}

/// What the satellite is going to do, for people.
fn plan_text(plan: &msg::PredictedPlan) -> String {
    let mut text = format!("plan made at {}: {}\n", time(&plan.header.stamp), printable(&plan_line(plan)));
    if plan.partings > 0 {
        let (times, reason) = (plan.partings, printable(&plan.parted_reason));
        _ = writeln!(text, "flight and prediction have parted {times} times, last: {reason}");
    }
    _ = writeln!(text, "  {:>6}  {:>7}  {:<20}  {:<20}", "task", "strip", "imaged at", "known at");
    for task in &plan.tasks {
        let known = if task.success { time(&task.known) } else { "fails".to_owned() };
        _ = writeln!(text, "  {:>6}  {:>7}  {:<20}  {known:<20}", task.task, task.strip_id, time(&task.imaging));
    }
    text
}

fn plan_json(plan: &msg::PredictedPlan) -> Value {
    let task = |task: &msg::PredictedTask| {
        json!({
            "task": task.task, "strip": task.strip_id, "start_tick": task.start_tick,
            "imaging_tick": task.imaging_tick, "imaging": time_json(&task.imaging), "end_tick": task.end_tick,
            "success": task.success, "known_tick": (task.known_tick > 0).then_some(task.known_tick),
            "known": time_json(&task.known),
        })
    };
    json!({
        "time": time_json(&plan.header.stamp),
        "tick": plan.tick,
        "since_tick": plan.since_tick,
        "until_tick": plan.until_tick,
        "tasks": plan.tasks.iter().map(task).collect::<Vec<_>>(),
        "compared": { "tasks": plan.compared, "equal": plan.equal, "imaged": plan.imaged, "foretold": plan.foretold },
        "partings": plan.partings,
        "parted": (plan.partings > 0).then(|| {
            json!({ "task": plan.parted_task, "tick": plan.parted_tick, "reason": plan.parted_reason })
        }),
    })
}

/// When a strip that is submitted now can be on board, imaged and known to be, at the earliest.
pub struct Outlook {
    uplink: Option<Time>,
    imaged: Option<Time>,
    known: Option<Time>,
}

impl Outlook {
    /// From how the radio stands, and the chances of the strip.
    pub fn new(link: &msg::LinkStatus, opportunities: &[msg::Opportunity]) -> Self {
        let now = || Some((link.tick, link.header.stamp));
        // The next pass from a tick on, or the tick itself where the radio is always open.
        let pass = |tick: u64, at: &Time| match link.passes.as_slice() {
            [] => link.open.then_some((tick, *at)),
            passes => passes.iter().find(|pass| pass.set_tick > tick).map(|pass| match pass.rise_tick > tick {
                true => (pass.rise_tick, pass.rise),
                false => (tick, *at),
            }),
        };
        let uplink = now().and_then(|(tick, at)| pass(tick, &at));
        let imaged = uplink.as_ref().and_then(|(up, at)| {
            let chance = opportunities.iter().find(|it| it.window_close_tick > *up)?;
            Some(match chance.window_open_tick > *up {
                true => (chance.window_open_tick, chance.window_open),
                false => (*up, *at),
            })
        });
        let known = imaged.as_ref().and_then(|(tick, at)| pass(*tick, at));
        let time = |it: Option<(u64, Time)>| it.map(|(_, time)| time);
        Self { uplink: time(uplink), imaged: time(imaged), known: time(known) }
    }

    /// For machines.
    pub fn json(&self) -> Value {
        let at = |it: &Option<Time>| it.as_ref().map_or(Value::Null, time_json);
        json!({ "uplink": at(&self.uplink), "imaged": at(&self.imaged), "known": at(&self.known) })
    }

    /// For people.
    pub fn text(&self) -> String {
        let at = |it: &Option<Time>| it.as_ref().map_or("not in this mission".to_owned(), time);
        let (uplink, imaged, known) = (at(&self.uplink), at(&self.imaged), at(&self.known));
        format!("  at the earliest: uplink at {uplink}, imaged at {imaged}, known at {known}\n")
    }
}

fn status_json(status: &msg::LinkStatus) -> Value {
    let pass = |pass: &msg::RadioPass| {
        json!({
            "station": pass.station, "rise": time_json(&pass.rise), "set": time_json(&pass.set),
            "elevation_deg": pass.elevation.to_degrees(),
        })
    };
    let housekeeping = json!({
        "tick": status.housekeeping_tick, "task": status.housekeeping_task,
        "pending": status.housekeeping_pending, "imaged": status.housekeeping_imaged,
    });
    json!({
        "time": time_json(&status.header.stamp),
        "tick": status.tick,
        "open": status.open,
        "waiting": { "orders": status.waiting_orders, "changes": status.waiting_changes },
        "on_board": status.on_board,
        "imaged": status.imaged,
        "delivered": status.delivered,
        "frames": { "sent": status.frames_sent, "heard": status.frames_heard, "damaged": status.frames_damaged },
        "housekeeping": if status.has_housekeeping { housekeeping } else { Value::Null },
        "passes": status.passes.iter().map(pass).collect::<Vec<_>>(),
    })
}

fn status_text(status: &msg::LinkStatus) -> String {
    let mut text = format!(
        "link {} at {}\n  waiting     {} orders, {} changes\n  known       {} on board, {} imaged, {} delivered\n  \
         frames      {} sent, {} heard, {} damaged\n",
        if status.open { "open" } else { "closed" },
        time(&status.header.stamp),
        status.waiting_orders,
        status.waiting_changes,
        status.on_board,
        status.imaged,
        status.delivered,
        status.frames_sent,
        status.frames_heard,
        status.frames_damaged,
    );
    if status.has_housekeeping {
        let (task, pending, imaged) =
            (status.housekeeping_task, status.housekeeping_pending, status.housekeeping_imaged);
        _ = writeln!(text, "  satellite   at task {task}: {pending} to image, {imaged} imaged");
    }
    for pass in status.passes.iter().take(PASSES) {
        let (rise, set) = (time(&pass.rise), time(&pass.set));
        _ = writeln!(text, "  pass        {:<16} {rise} to {set}, {:.0}°", pass.station, pass.elevation.to_degrees());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(sec: i32) -> Time {
        Time { sec, nanosec: 0 }
    }

    /// Ticks are half seconds here.
    fn pass(rise: i32, set: i32) -> msg::RadioPass {
        let tick = |sec: i32| u64::from(sec.unsigned_abs()) * 2;
        let station = "roof".to_owned();
        msg::RadioPass {
            station,
            rise_tick: tick(rise),
            set_tick: tick(set),
            rise: at(rise),
            set: at(set),
            elevation: 0.5,
        }
    }

    fn chance(open: i32, close: i32) -> msg::Opportunity {
        let tick = |sec: i32| u64::from(sec.unsigned_abs()) * 2;
        msg::Opportunity {
            window_open_tick: tick(open),
            window_close_tick: tick(close),
            window_open: at(open),
            window_close: at(close),
            ..Default::default()
        }
    }

    #[test]
    fn orders_wait_for_a_pass_and_so_does_the_news_of_them() {
        let mut link =
            msg::LinkStatus { tick: 200, passes: vec![pass(500, 600), pass(3000, 3100)], ..Default::default() };
        link.header.stamp = at(100);
        let told = |link: &msg::LinkStatus, chances: &[msg::Opportunity]| {
            let Outlook { uplink, imaged, known } = Outlook::new(link, chances);
            [uplink, imaged, known].map(|time| time.map(|time| time.sec))
        };
        // The first chance comes before the pass, the second one after it.
        assert_eq!(told(&link, &[chance(200, 300), chance(900, 1000)]), [Some(500), Some(900), Some(3000)]);
        assert_eq!(told(&link, &[chance(400, 550)]), [Some(500), Some(500), Some(500)]);
        assert_eq!(told(&link, &[chance(3200, 3300)]), [Some(500), Some(3200), None]);
        assert_eq!(told(&link, &[]), [Some(500), None, None]);
        // In a pass, and where there are no passes because it is always open.
        link.tick = 1010;
        link.header.stamp = at(505);
        assert_eq!(told(&link, &[chance(520, 590)]), [Some(505), Some(520), Some(520)]);
        link.passes.clear();
        assert_eq!(told(&link, &[chance(520, 590)]), [None; 3]);
        link.open = true;
        assert_eq!(told(&link, &[chance(520, 590)]), [Some(505), Some(520), Some(520)]);
        let text = Outlook::new(&link, &[]).text();
        assert!(
            text.contains("uplink at 1970-01-01T00:08:25") && text.contains("known at not in this mission"),
            "{text}"
        );
    }
}
