//! Commands that only ask.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::json;
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::swath_msgs as msg;
use swath_ros::{RosArgs, graph};

use super::client::{Operator, check};
use super::files::{CuttingArgs, Files};
use super::link::{Outlook, status as link_status, way_json, way_text, way_word, ways};
use super::selection::Common;
use super::show::{opportunity_json, opportunity_table, report_json, report_text, status_head, status_line};
use crate::requests::json::status_json;
use crate::requests::orders::Orders;
use swath_mission::time_text;
use swath_node::orders::request_message;
use swath_node::out;

/// `swath strips preview`.
#[derive(Debug, Args)]
pub struct PreviewArgs {
    /// Files with lines and areas that need not be submitted.
    #[arg(required_unless_present = "id")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    cutting: CuttingArgs,
    /// Number of a strip that is known instead.
    #[arg(long, conflicts_with = "files")]
    id: Option<u64>,
    /// How far ahead to look [h]; to the mission's end without it.
    #[arg(long)]
    hours: Option<f64>,
    /// Print JSON lines.
    #[arg(long)]
    json: bool,
}

/// `swath strips list`.
#[derive(Debug, Args)]
pub struct ListArgs {
    #[command(flatten)]
    common: Common,
    /// Only strips that can be imaged at this time or later.
    #[arg(long, value_parser = time_text::parse)]
    from: Option<u64>,
    /// Only strips that can be imaged at this time or earlier.
    #[arg(long, value_parser = time_text::parse)]
    until: Option<u64>,
    /// Only strips with greater numbers.
    #[arg(long, default_value_t = 0)]
    after: u64,
    /// Longest list; 0 for all.
    #[arg(long, default_value_t = 100)]
    limit: u32,
    /// Print JSON lines.
    #[arg(long)]
    json: bool,
}

/// `swath strips show`.
#[derive(Debug, Args)]
pub struct ShowArgs {
    /// Number of the strip.
    #[arg(required_unless_present = "reference")]
    id: Option<u64>,
    /// The submitter's own reference instead.
    #[arg(long = "ref", conflicts_with = "id")]
    reference: Option<String>,
    /// Who submitted it, with --ref.
    #[arg(long, default_value = "operator")]
    submitter: String,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Says when strips could be imaged.
///
/// # Errors
/// When a file cannot be used, nobody answers, or a strip would be refused.
pub fn preview(args: &PreviewArgs, ros: &RosArgs) -> Result<()> {
    let files = Files::read(&args.files)?;
    let operator = Operator::start(ros)?;
    let import = files.cut(&args.cutting.of_mission(&operator)?);
    let horizon_s = args.hours.map_or(0.0, |hours| hours * 3600.0);
    let mut calls: Vec<_> = import
        .orders
        .iter()
        .map(|order| {
            (order.name.clone(), msg::PreviewStripRequest { id: 0, request: request_message(order), horizon_s })
        })
        .collect();
    if let Some(id) = args.id {
        let call = msg::PreviewStripRequest { id, horizon_s, ..Default::default() };
        calls.push((format!("strip {id}"), call));
    }
    let desk = operator.desk(&graph::PREVIEW_STRIP)?;
    let link = link_status(&operator)?;
    let mut refused = 0;
    let count = calls.len();
    for (name, call) in calls {
        let known = Some(call.id).filter(|id| *id != 0 && link.is_some());
        let answer = desk.call(call)?;
        refused += usize::from(answer.reason_code != 0);
        // The way of a strip that is known, as it was and as the ground predicts it.
        let way = match known {
            Some(id) => ways(&operator, id - 1, 1)?.remove(&id),
            None => None,
        };
        let text = preview_text(args, &name, &answer, link.as_ref(), way.as_ref());
        if !out::print(&text)? {
            break;
        }
    }
    if refused + import.refused.len() > 0 {
        bail!("{refused} of {count} strips would be refused");
    }
    Ok(())
}

/// When a strip could be imaged: its chances, and over a radio how it gets there, as it will if it is known.
fn preview_text(
    args: &PreviewArgs,
    name: &str,
    answer: &msg::PreviewStripResponse,
    link: Option<&msg::LinkStatus>,
    way: Option<&msg::StripWay>,
) -> String {
    if args.json {
        let opportunities: Vec<_> = answer.opportunities.iter().map(opportunity_json).collect();
        let mut line = json!({
            "name": name, "opportunities": opportunities,
            "reason_code": answer.reason_code, "reason": answer.reason,
        });
        if let Some(link) = link {
            line["over_the_radio"] = Outlook::new(link, &answer.opportunities).json();
        }
        if let Some(way) = way {
            line["way"] = way_json(way);
        }
        format!("{line}\n")
    } else if answer.reason_code != 0 {
        format!("{name}: {} (reason {})\n", answer.reason, answer.reason_code)
    } else if answer.opportunities.is_empty() {
        let span = args.hours.map_or("until the mission's end".to_owned(), |hours| format!("in the next {hours} h"));
        format!("{name}: no chance {span}\n")
    } else {
        let radio = match (way, link) {
            (Some(way), _) => way_text(way),
            (None, Some(link)) => Outlook::new(link, &answer.opportunities).text(),
            (None, None) => String::new(),
        };
        format!("{name}\n{}{radio}", opportunity_table(&answer.opportunities))
    }
}

/// Lists strips.
///
/// # Errors
/// When nobody answers or a filter is refused.
pub fn list(args: &ListArgs, ros: &RosArgs) -> Result<()> {
    let operator = Operator::start(ros)?;
    let desk = operator.desk(&graph::LIST_STRIPS)?;
    let at = |ns: Option<u64>| ns.map_or_else(Time::default, swath_ros::stamp);
    let mut call = msg::ListStripsRequest {
        opportunity_from: at(args.from),
        opportunity_until: at(args.until),
        after_id: args.after,
        ..args.common.call()
    };
    let mut left = if args.limit == 0 { usize::MAX } else { args.limit as usize };
    let mut orders = Orders::default();
    let ways = ways(&operator, args.after, usize::MAX)?;
    let mut listening = args.json || out::print_line(status_head())?;
    loop {
        let page = desk.call(call.clone())?;
        check(page.reason_code, &page.reason)?;
        let meant: Vec<_> = page.strips.iter().filter(|status| args.common.holds(status)).collect();
        let more = page.more || meant.len() > left;
        for status in meant.into_iter().take(left) {
            let line = || line_of(status, ways.get(&status.strip.id), args.json);
            listening = listening && out::print_line(line())?;
            orders.add(status);
            left -= 1;
            call.after_id = status.strip.id;
        }
        if left > 0 {
            call.after_id = page.strips.last().map_or(call.after_id, |status| status.strip.id);
        }
        if !more || left == 0 || !listening {
            if more && listening && !args.json {
                out::print_line(format_args!("there are more: --after {}", call.after_id))?;
            }
            break;
        }
    }
    if args.common.is_one_order() && !args.json {
        out::print_line(orders.summary())?;
    }
    Ok(())
}

/// A strip as a line, with its way over the radio if there is one.
fn line_of(status: &msg::StripStatus, way: Option<&msg::StripWay>, as_json: bool) -> String {
    match (as_json, way) {
        (true, None) => status_json(status).to_string(),
        (true, Some(way)) => {
            let mut line = status_json(status);
            line["way"] = way_json(way);
            line.to_string()
        }
        (false, None) => status_line(status),
        (false, Some(way)) => format!("{}  [{}]", status_line(status), way_word(way)),
    }
}

/// Shows all that is known of a strip.
///
/// # Errors
/// When nobody answers or there is no such strip.
pub fn show(args: &ShowArgs, ros: &RosArgs) -> Result<()> {
    let operator = Operator::start(ros)?;
    let call = msg::GetStripRequest {
        id: args.id.unwrap_or(0),
        submitter: args.submitter.clone(),
        client_ref: args.reference.clone().unwrap_or_default(),
    };
    let answer = operator.desk(&graph::GET_STRIP)?.call(call)?;
    check(answer.reason_code, &answer.reason)?;
    let report = answer.report.first().context("the answer holds no report")?;
    let id = report.status.strip.id;
    let way = ways(&operator, id.saturating_sub(1), 1)?.remove(&id);
    if args.json {
        let mut all = report_json(report);
        if let Some(way) = &way {
            all["way"] = way_json(way);
        }
        out::print_line(serde_json::to_string_pretty(&all)?)?;
    } else {
        out::print(&(report_text(report) + &way.as_ref().map(way_text).unwrap_or_default()))?;
    }
    Ok(())
}
