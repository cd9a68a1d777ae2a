//! `swath alarms`: what is wrong, and what operators say of it.

use std::time::Duration;

use anyhow::{Result, bail};
use clap::{Args, Subcommand};
use serde_json::json;
use swath_msgs::swath_msgs as msg;
use swath_node::out;
use swath_ros::{RosArgs, Shutdown, graph};

use super::client::Operator;
use super::files::printable;
use crate::alarms::messages::{event_name, severity_name, state_name};
use crate::place::Place;
use crate::requests::json::{time, time_json};

/// `swath alarms`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  swath alarms\n  swath alarms ack guidance \"wheel y\" --comment \"seen, planned around\"\n  \
    swath alarms shelve guidance \"gyro biased\" --minutes 30\n  swath alarms watch"
)]
pub struct AlarmsArgs {
    #[command(subcommand)]
    command: Option<AlarmsCommand>,
    #[command(flatten)]
    place: Place,
    /// Who acts.
    #[arg(long, global = true, default_value = "operator")]
    actor: String,
    /// Why, in words.
    #[arg(long, global = true, default_value = "")]
    comment: String,
    /// Print JSON, one value a line.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum AlarmsCommand {
    /// List the alarms that are not normal; so it is without a command.
    List,
    /// Say that they are known.
    Ack {
        #[command(flatten)]
        which: Which,
        /// All that nobody has acknowledged.
        #[arg(long)]
        all: bool,
    },
    /// Do not tell of one for a while.
    Shelve {
        #[command(flatten)]
        which: Named,
        /// For how long [minutes of simulated time].
        #[arg(long, default_value_t = 30.0, allow_negative_numbers = true)]
        minutes: f64,
    },
    /// Tell of one again.
    Unshelve {
        #[command(flatten)]
        which: Named,
    },
    /// Watch what happens to alarms, until Ctrl-C.
    Watch {
        /// End after this many events.
        #[arg(long)]
        count: Option<u64>,
    },
}

#[derive(Debug, Args)]
struct Named {
    /// The node that raises it.
    node: String,
    /// Its name, as it is listed.
    name: String,
}

#[derive(Debug, Args)]
struct Which {
    /// The node that raises it.
    #[arg(required_unless_present = "all", requires = "name")]
    node: Option<String>,
    /// Its name, as it is listed.
    #[arg(conflicts_with = "all")]
    name: Option<String>,
}

const REFRESH: Duration = Duration::from_millis(250);

/// Runs `swath alarms`.
///
/// # Errors
/// When no mission is flying, or what is wished makes no sense.
pub fn run(args: &AlarmsArgs, ros: &RosArgs) -> Result<()> {
    let operator = Operator::start(&args.place.args(ros))?;
    match args.command.as_ref().unwrap_or(&AlarmsCommand::List) {
        AlarmsCommand::List => list(&operator, args),
        AlarmsCommand::Ack { all: true, .. } => acknowledge_all(&operator, args),
        AlarmsCommand::Ack { which, .. } => {
            let (node, name) = (which.node.clone().unwrap_or_default(), which.name.clone().unwrap_or_default());
            acknowledge(&operator, args, &Named { node, name })
        }
        AlarmsCommand::Shelve { which, minutes } => {
            let call = msg::ShelveAlarmRequest {
                node: which.node.clone(),
                name: which.name.clone(),
                duration_s: minutes * 60.0,
                actor: args.actor.clone(),
                comment: args.comment.clone(),
            };
            let answer = operator.desk(&graph::SHELVE_ALARM)?.call_once(msg::ShelveAlarmRequest::default(), call)?;
            done(args, "shelved", which, answer.accepted, &answer.reason)
        }
        AlarmsCommand::Unshelve { which } => {
            let call = msg::UnshelveAlarmRequest {
                node: which.node.clone(),
                name: which.name.clone(),
                actor: args.actor.clone(),
                comment: args.comment.clone(),
            };
            let answer =
                operator.desk(&graph::UNSHELVE_ALARM)?.call_once(msg::UnshelveAlarmRequest::default(), call)?;
            done(args, "unshelved", which, answer.accepted, &answer.reason)
        }
        AlarmsCommand::Watch { count } => watch(&operator, args, *count),
    }
}

fn list(operator: &Operator, args: &AlarmsArgs) -> Result<()> {
    let answer = operator.desk(&graph::LIST_ALARMS)?.call(msg::ListAlarmsRequest::default())?;
    if args.json {
        let lines: Vec<String> = answer.alarms.iter().map(|it| format!("{}\n", alarm_json(it))).collect();
        out::print(&lines.concat())?;
        return Ok(());
    }
    let mut text = format!("{}  {} alarms\n", time(&answer.now), answer.alarms.len());
    for it in &answer.alarms {
        let until = match it.shelved_until_tick {
            0 => String::new(),
            _ => format!(" until {}", time(&it.shelved_until)),
        };
        text += &format!(
            "{:<9}{:<16} {:<18} {}{until} since {}: {}\n",
            severity_name(it.severity),
            printable(&it.node),
            printable(&it.name),
            state_name(it.state),
            time(&it.raised),
            printable(&it.text),
        );
    }
    out::print(&text)?;
    Ok(())
}

fn acknowledge(operator: &Operator, args: &AlarmsArgs, which: &Named) -> Result<()> {
    let call = msg::AcknowledgeAlarmRequest {
        node: which.node.clone(),
        name: which.name.clone(),
        actor: args.actor.clone(),
        comment: args.comment.clone(),
    };
    let answer = operator.desk(&graph::ACKNOWLEDGE_ALARM)?.call_once(msg::AcknowledgeAlarmRequest::default(), call)?;
    done(args, "acknowledged", which, answer.accepted, &answer.reason)
}

fn acknowledge_all(operator: &Operator, args: &AlarmsArgs) -> Result<()> {
    let answer = operator.desk(&graph::LIST_ALARMS)?.call(msg::ListAlarmsRequest::default())?;
    let waits = |it: &msg::Alarm| {
        [msg::Alarm::STATE_UNACKNOWLEDGED, msg::Alarm::STATE_RETURNED_UNACKNOWLEDGED].contains(&it.state)
    };
    for it in answer.alarms.into_iter().filter(waits) {
        acknowledge(operator, args, &Named { node: it.node, name: it.name })?;
    }
    Ok(())
}

fn done(args: &AlarmsArgs, verb: &str, which: &Named, accepted: bool, reason: &str) -> Result<()> {
    if !accepted {
        bail!("{}", printable(reason));
    }
    let Named { node, name } = which;
    out::print_line(match args.json {
        true => json!({ "node": node, "name": name, "done": verb }).to_string(),
        false => format!("{verb} {} of {}", printable(name), printable(node)),
    })?;
    Ok(())
}

fn watch(operator: &Operator, args: &AlarmsArgs, count: Option<u64>) -> Result<()> {
    let shutdown = Shutdown::on_signals(operator.node.signal())?;
    let events = operator.node.subscription(&graph::ALARM_EVENTS)?;
    let mut seen = 0;
    while !shutdown.asked() && count.is_none_or(|count| seen < count) {
        match events.take()? {
            Some(event) => {
                seen += 1;
                if !out::print_line(if args.json { event_json(&event).to_string() } else { event_line(&event) })? {
                    break;
                }
            }
            None => _ = operator.node.wait(REFRESH)?,
        }
    }
    Ok(())
}

fn event_line(event: &msg::AlarmEvent) -> String {
    format!(
        "{}  {:<9}{} of {} {} by {}: {}",
        time(&event.header.stamp),
        severity_name(event.severity),
        printable(&event.name),
        printable(&event.node),
        event_name(event.event),
        printable(&event.actor),
        printable(&event.text),
    )
}

fn alarm_json(it: &msg::Alarm) -> serde_json::Value {
    json!({
        "node": it.node,
        "name": it.name,
        "severity": severity_name(it.severity),
        "state": state_name(it.state),
        "beneath": state_name(it.beneath),
        "text": it.text,
        "sequence": it.sequence,
        "raised_tick": it.raised_tick,
        "raised": time_json(&it.raised),
        "shelved_until": time_json(&it.shelved_until),
    })
}

fn event_json(it: &msg::AlarmEvent) -> serde_json::Value {
    json!({
        "number": it.number,
        "tick": it.tick,
        "time": time_json(&it.header.stamp),
        "node": it.node,
        "name": it.name,
        "severity": severity_name(it.severity),
        "event": event_name(it.event),
        "state": state_name(it.state),
        "sequence": it.sequence,
        "actor": it.actor,
        "text": it.text,
    })
}
