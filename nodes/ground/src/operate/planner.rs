//! `swath planner`: what the planner may do by itself.

use std::time::Duration;

use anyhow::{Context, Result, bail};
use clap::{Args, Subcommand, ValueEnum};
use serde_json::json;
use swath_msgs::swath_msgs as msg;
use swath_node::out;
use swath_ros::{RosArgs, graph};

use super::client::Operator;
use super::files::printable;
use super::link;
use crate::place::Place;
use crate::requests::json::{time, time_json};

/// `swath planner`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  swath planner mode approve\n  swath planner status\n  swath planner approve")]
pub struct PlannerArgs {
    #[command(subcommand)]
    command: PlannerCommand,
    #[command(flatten)]
    place: Place,
    /// Who acts.
    #[arg(long, global = true, default_value = "operator")]
    actor: String,
    /// Print JSON.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Debug, Subcommand)]
enum PlannerCommand {
    /// Let it fly what it chooses, propose it, or choose nothing.
    Mode {
        /// The mode.
        mode: ModeName,
    },
    /// Approve what it proposes.
    Approve {
        /// Number of the proposal; the open one without it.
        #[arg(default_value_t = 0)]
        proposal: u64,
    },
    /// Reject what it proposes: the strip is not proposed again in this window.
    Reject {
        /// Number of the proposal; the open one without it.
        #[arg(default_value_t = 0)]
        proposal: u64,
    },
    /// Show the mode and the proposal.
    Status,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ModeName {
    /// It chooses and the satellite flies.
    Autonomous,
    /// It proposes and an operator approves.
    Approve,
    /// It chooses nothing: the attitude is held.
    Hold,
}

/// How long to wait for the planner's latched status.
const TIMEOUT: Duration = Duration::from_secs(10);

/// Runs `swath planner`.
///
/// # Errors
/// When the planner does not answer or refuses.
pub fn run(args: &PlannerArgs, ros: &RosArgs) -> Result<()> {
    let operator = Operator::start(&args.place.args(ros))?;
    match &args.command {
        PlannerCommand::Mode { mode } => {
            let number = match mode {
                ModeName::Autonomous => msg::PlannerStatus::MODE_AUTONOMOUS,
                ModeName::Approve => msg::PlannerStatus::MODE_APPROVE,
                ModeName::Hold => msg::PlannerStatus::MODE_HOLD,
            };
            let call = msg::SetPlannerModeRequest { mode: number, actor: args.actor.clone() };
            let answer = operator.desk(&graph::SET_PLANNER_MODE)?.call(call)?;
            if !answer.accepted {
                bail!("{}", answer.reason);
            }
            let name = mode_name(number);
            out::print_line(if args.json { json!({ "mode": name }).to_string() } else { format!("mode {name}") })?;
        }
        PlannerCommand::Approve { proposal } => review(&operator, args, *proposal, true)?,
        PlannerCommand::Reject { proposal } => review(&operator, args, *proposal, false)?,
        PlannerCommand::Status => {
            let statuses = operator.node.subscription(&graph::PLANNER_STATUS)?;
            let status = statuses.newest(operator.node.signal(), TIMEOUT)?;
            let status = status.context("no planner is flying in this domain")?;
            if link::status(&operator)?.is_some() {
                bail!("the planner is on board: with [link] nobody on the ground sees it");
            }
            let text = if args.json { format!("{}\n", status_json(&status)) } else { status_text(&status) };
            out::print(&text)?;
        }
    }
    Ok(())
}

fn review(operator: &Operator, args: &PlannerArgs, proposal: u64, approve: bool) -> Result<()> {
    // No proposal has that number.
    let nothing = msg::ReviewProposalRequest { proposal: u64::MAX, ..Default::default() };
    let call = msg::ReviewProposalRequest { proposal, approve, actor: args.actor.clone() };
    let answer = operator.desk(&graph::REVIEW_PROPOSAL)?.call_once(nothing, call)?;
    if !answer.accepted {
        bail!("{}", answer.reason);
    }
    let verb = if approve { "approved" } else { "rejected" };
    out::print_line(match args.json {
        true => json!({ "proposal": answer.proposal, "approved": approve }).to_string(),
        false => format!("{verb} proposal {}", answer.proposal),
    })?;
    Ok(())
}

fn mode_name(mode: u8) -> &'static str {
    match mode {
        msg::PlannerStatus::MODE_APPROVE => "approve",
        msg::PlannerStatus::MODE_HOLD => "hold",
        _ => "autonomous",
    }
}

fn status_json(status: &msg::PlannerStatus) -> serde_json::Value {
    let state = match status.proposal_state {
        msg::PlannerStatus::PROPOSAL_OPEN => "open",
        msg::PlannerStatus::PROPOSAL_APPROVED => "approved",
        _ => "none",
    };
    json!({
        "mode": mode_name(status.mode),
        "planner": status.planner,
        "proposal_state": state,
        "proposal": status.proposal,
        "strip": status.strip.id,
        "name": status.strip.name,
        "t_pre_ticks": status.t_pre_ticks,
        "t_pre_s": status.t_pre_s,
        "window_close_tick": status.window_close_tick,
        "window_close": time_json(&status.window_close),
        "deadline_tick": status.deadline_tick,
        "deadline": time_json(&status.deadline),
        "last_outcome": status.last_outcome,
    })
}

/// The status as lines for people.
pub fn status_text(status: &msg::PlannerStatus) -> String {
    let mut text = format!("planner {}, mode {}\n", status.planner, mode_name(status.mode));
    if status.proposal != 0 {
        let decided = if status.proposal_state == msg::PlannerStatus::PROPOSAL_APPROVED {
            "approved, waits for its window".to_owned()
        } else if status.deadline_tick == 0 {
            "waits for an operator".to_owned()
        } else {
            format!("waits for an operator until {}", time(&status.deadline))
        };
        text += &format!(
            "proposal {}: strip {} {} after {:.1} s of transition, until {}; {decided}\n",
            status.proposal,
            status.strip.id,
            printable(&status.strip.name),
            status.t_pre_s,
            time(&status.window_close),
        );
    }
    if !status.last_outcome.is_empty() {
        text += &format!("before: {}\n", status.last_outcome);
    }
    text
}
