//! `swath strips watch`: requests as they change.

use std::collections::VecDeque;
use std::io::IsTerminal as _;
use std::time::Duration;

use anyhow::Result;
use clap::Args;
use swath_msgs::swath_msgs as msg;
use swath_node::out;
use swath_ros::{RosArgs, Shutdown, Subscription, graph};

use super::client::Operator;
use super::files::printable;
use super::link::plan_line;
use super::show::{status_head, status_line};
use crate::requests::json::{state_name, status_json, time};

/// `swath strips watch`.
#[derive(Debug, Args)]
pub struct WatchArgs {
    /// Print each change as a JSON line.
    #[arg(long)]
    json: bool,
    /// End after this many changes.
    #[arg(long)]
    count: Option<u64>,
}

const REFRESH: Duration = Duration::from_millis(250);
/// Changes that the live view shows.
const SHOWN: usize = 20;

/// Watches requests change until Ctrl-C.
///
/// # Errors
/// When DDS cannot be used.
pub fn watch(args: &WatchArgs, ros: &RosArgs) -> Result<()> {
    let operator = Operator::start(ros)?;
    let shutdown = Shutdown::on_signals(operator.node.signal())?;
    let events = operator.node.subscription(&graph::STRIP_EVENTS)?;
    let summaries = operator.node.subscription(&graph::REQUEST_SUMMARY)?;
    let planner = operator.node.subscription(&graph::PLANNER_STATUS)?;
    let radio = operator.node.subscription(&graph::LINK_STATUS)?;
    let plans = operator.node.subscription(&graph::PREDICTED_PLAN)?;
    let live = std::io::stdout().is_terminal() && !args.json;
    let mut view = View::default();
    let mut seen = 0;
    while !shutdown.asked() {
        let mut news = false;
        while let Some(event) = events.take()? {
            seen += 1;
            news = true;
            let line = || if args.json { status_json(&event).to_string() } else { event_line(&event) };
            if !live && !out::print_line(line())? {
                return Ok(());
            }
            view.last.push_front(event);
            view.last.truncate(SHOWN);
            if args.count.is_some_and(|count| seen >= count) {
                return Ok(());
            }
        }
        while let Some(summary) = summaries.take()? {
            view.summary = Some(summary);
            news = true;
        }
        while let Some(status) = planner.take()? {
            // With a radio it is on board, and nobody on the ground sees it.
            view.planner = view.radio.is_none().then_some(status);
            news = true;
        }
        match view.take_radio(&radio, &plans, !live && !args.json)? {
            Some(told) => news |= told,
            None => return Ok(()),
        }
        if live && news {
            out::print(&format!("\x1b[H\x1b[2J{}", view.text()))?;
            // A person reads a few pictures a second.
            std::thread::sleep(REFRESH);
        } else {
            operator.node.wait(REFRESH)?;
        }
    }
    Ok(())
}

fn event_line(event: &msg::StripStatus) -> String {
    format!("{}  {}", time(&event.header.stamp), status_line(event))
}

/// That the link has opened or closed, and what waits for it.
fn radio_line(status: &msg::LinkStatus) -> String {
    format!(
        "{}  link {}: {} orders and {} changes wait, {} on board, {} imaged, {} delivered",
        time(&status.header.stamp),
        if status.open { "up" } else { "down" },
        status.waiting_orders,
        status.waiting_changes,
        status.on_board,
        status.imaged,
        status.delivered,
    )
}

#[derive(Default)]
struct View {
    radio: Option<msg::LinkStatus>,
    plan: Option<msg::PredictedPlan>,
    summary: Option<msg::RequestSummary>,
    planner: Option<msg::PlannerStatus>,
    last: VecDeque<msg::StripStatus>,
}

impl View {
    /// Takes what the ground tells of the radio and of what it predicts; returns whether there was anything, and nothing
    /// where nobody reads what is printed of it.
    fn take_radio(
        &mut self,
        radio: &Subscription<msg::LinkStatus>,
        plans: &Subscription<msg::PredictedPlan>,
        prints: bool,
    ) -> Result<Option<bool>> {
        let mut news = false;
        while let Some(status) = radio.take()? {
            let turned = self.radio.as_ref().is_none_or(|before| before.open != status.open);
            if prints && turned && !out::print_line(radio_line(&status))? {
                return Ok(None);
            }
            (self.radio, self.planner, news) = (Some(status), None, true);
        }
        while let Some(plan) = plans.take()? {
            let line = || format!("{}  plan: {}", time(&plan.header.stamp), printable(&plan_line(&plan)));
            if prints && !out::print_line(line())? {
                return Ok(None);
            }
            (self.plan, news) = (Some(plan), true);
        }
        Ok(Some(news))
    }

    fn text(&self) -> String {
        let mut text = String::new();
        if let Some(it) = &self.summary {
            text += &format!(
                "{}  {} accepted, {} held, {} under way, {} imaged, {} failed, {} expired, {} refused, reward {:.2}\n",
                time(&it.header.stamp),
                it.accepted,
                it.held,
                it.scheduled + it.executing,
                it.completed,
                it.failed,
                it.expired,
                it.rejected,
                it.reward,
            );
        }
        if let Some(it) = &self.radio {
            text += &format!("{}\n", radio_line(it));
        }
        if let Some(it) = &self.plan {
            text += &format!("plan: {}\n", printable(&plan_line(it)));
        }
        if let Some(it) = &self.planner {
            text += &super::planner::status_text(it);
        }
        text += &format!("\n{:<22}{}\n", "changed", status_head());
        for event in &self.last {
            let mark = if event.state == msg::StripStatus::STATE_COMPLETED { "\x1b[32m" } else { "" };
            text += &format!("{mark}{}\x1b[0m\n", event_line(event));
        }
        if self.last.is_empty() {
            text += &format!("nothing is {} yet\n", state_name(msg::StripStatus::STATE_SCHEDULED));
        }
        text
    }
}
