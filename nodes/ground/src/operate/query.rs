//! Commands that only ask.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::json;
use swath_msgs::builtin_interfaces::Time;
use swath_msgs::swath_msgs as msg;
use swath_ros::graph;
use swath_sim::config::SimConfig;

use super::client::{Operator, check};
use super::read_files;
use super::show::{opportunity_json, opportunity_table, report_json, report_text, status_head, status_line};
use crate::requests::json::status_json;
use swath_mission::orders::geojson::Lengths;
use swath_mission::requests::index::Area;
use swath_mission::requests::lifecycle::State;
use swath_mission::time_text;
use swath_node::orders::request_message;

/// `swath strips preview`.
#[derive(Debug, Args)]
pub struct PreviewArgs {
    /// GeoJSON files with strips that need not be submitted.
    #[arg(required_unless_present = "id")]
    files: Vec<PathBuf>,
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
    /// Only strips in this state, such as accepted or cancelled-by-user; may be repeated.
    #[arg(long, value_parser = parse_state)]
    state: Vec<State>,
    /// Only strips that touch an area: south,north,west,east [deg].
    #[arg(long, value_parser = parse_area, allow_hyphen_values = true)]
    area: Option<Area>,
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

fn parse_state(name: &str) -> Result<State, String> {
    State::from_name(name).ok_or_else(|| {
        let names: Vec<_> = State::ALL.iter().map(|state| state.name().replace(' ', "-")).collect();
        format!("expected one of {}", names.join(", "))
    })
}

fn parse_area(text: &str) -> Result<Area, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|number| number.trim().parse().ok()).collect();
    match numbers[..] {
        [south_deg, north_deg, west_deg, east_deg] if text.split(',').count() == 4 => {
            Ok(Area { south_deg, north_deg, west_deg, east_deg })
        }
        _ => Err("expected four numbers: south,north,west,east".to_owned()),
    }
}

/// Says when strips could be imaged.
///
/// # Errors
/// When a file cannot be used, nobody answers, or a strip would be refused.
#[expect(clippy::print_stdout, reason = "the answers are this command's result")]
pub fn preview(args: &PreviewArgs) -> Result<()> {
    let import = read_files(&args.files, Lengths::of(&SimConfig::default()))?;
    let horizon_s = args.hours.map_or(0.0, |hours| hours * 3600.0);
    let mut calls: Vec<_> = import
        .requests
        .iter()
        .map(|named| {
            (named.name.clone(), msg::PreviewStripRequest { id: 0, request: request_message(named), horizon_s })
        })
        .collect();
    if let Some(id) = args.id {
        let call = msg::PreviewStripRequest { id, horizon_s, ..Default::default() };
        calls.push((format!("strip {id}"), call));
    }
    let operator = Operator::start()?;
    let desk = operator.desk(&graph::PREVIEW_STRIP)?;
    let mut refused = 0;
    let count = calls.len();
    for (name, call) in calls {
        let answer = desk.call(call)?;
        refused += usize::from(answer.reason_code != 0);
        if args.json {
            let opportunities: Vec<_> = answer.opportunities.iter().map(opportunity_json).collect();
            println!(
                "{}",
                json!({
                    "name": name, "opportunities": opportunities,
                    "reason_code": answer.reason_code, "reason": answer.reason,
                })
            );
        } else if answer.reason_code != 0 {
            println!("{name}: {} (reason {})", answer.reason, answer.reason_code);
        } else {
            print!("{name}\n{}", opportunity_table(&answer.opportunities));
        }
    }
    if refused + import.refused.len() > 0 {
        bail!("{refused} of {count} strips would be refused");
    }
    Ok(())
}

/// Lists strips.
///
/// # Errors
/// When nobody answers or a filter is refused.
#[expect(clippy::print_stdout, reason = "the list is this command's result")]
pub fn list(args: &ListArgs) -> Result<()> {
    let operator = Operator::start()?;
    let desk = operator.desk(&graph::LIST_STRIPS)?;
    let area = args.area.unwrap_or(Area { south_deg: 0.0, north_deg: 0.0, west_deg: 0.0, east_deg: 0.0 });
    let at = |ns: Option<u64>| ns.map_or_else(Time::default, swath_ros::stamp);
    let mut call = msg::ListStripsRequest {
        states: args.state.iter().map(|state| state.number()).collect::<Vec<_>>(),
        in_area: args.area.is_some(),
        south_deg: area.south_deg,
        north_deg: area.north_deg,
        west_deg: area.west_deg,
        east_deg: area.east_deg,
        opportunity_from: at(args.from),
        opportunity_until: at(args.until),
        after_id: args.after,
        limit: if args.limit == 0 { 100 } else { args.limit },
        with_requests: false,
    };
    if !args.json {
        println!("{}", status_head());
    }
    loop {
        let page = desk.call(call.clone())?;
        check(page.reason_code, &page.reason)?;
        for status in &page.strips {
            if args.json {
                println!("{}", status_json(status));
            } else {
                println!("{}", status_line(status));
            }
        }
        call.after_id = page.strips.last().map_or(call.after_id, |status| status.strip.id);
        if !page.more || args.limit != 0 {
            if page.more && !args.json {
                println!("there are more: --after {}", call.after_id);
            }
            return Ok(());
        }
    }
}

/// Shows all that is known of a strip.
///
/// # Errors
/// When nobody answers or there is no such strip.
#[expect(clippy::print_stdout, reason = "the report is this command's result")]
pub fn show(args: &ShowArgs) -> Result<()> {
    let operator = Operator::start()?;
    let call = msg::GetStripRequest {
        id: args.id.unwrap_or(0),
        submitter: args.submitter.clone(),
        client_ref: args.reference.clone().unwrap_or_default(),
    };
    let answer = operator.desk(&graph::GET_STRIP)?.call(call)?;
    check(answer.reason_code, &answer.reason)?;
    let report = answer.report.first().context("the answer holds no report")?;
    if args.json {
        println!("{}", serde_json::to_string_pretty(&report_json(report))?);
    } else {
        print!("{}", report_text(report));
    }
    Ok(())
}
