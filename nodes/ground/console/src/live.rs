//! A flying mission, told to the ledger: what there was before the console came, and every message since.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use anyhow::{Result, ensure};
use swath_msgs::diagnostic_msgs::DiagnosticArray;
use swath_msgs::sensor_msgs::{JointState, NavSatFix};
use swath_msgs::{RosMessage, swath_msgs as msg};
use swath_ros::{Node, Subscription, graph};

use crate::desks::{Counter, Desks, call};
use crate::shared::Shared;

/// How long to wait for messages before other things are looked at.
const IDLE: Duration = Duration::from_millis(200);
/// How often it is looked which nodes are there.
const LOOK: Duration = Duration::from_millis(500);
/// Entries of a page of requests or of their history.
const PAGE: u32 = 1000;

/// What the console hears.
pub struct Ear {
    events: Subscription<msg::StripStatus>,
    points: Subscription<NavSatFix>,
    wheels: Subscription<JointState>,
    guidance: Subscription<msg::GuidanceStatus>,
    tasks: Subscription<msg::ImagingTask>,
    results: Subscription<msg::TaskResult>,
    offers: Subscription<msg::UpcomingStrips>,
    decisions: Subscription<msg::Decision>,
    planner: Subscription<msg::PlannerStatus>,
    summaries: Subscription<msg::RequestSummary>,
    standing: Subscription<msg::StandingAlarms>,
    alarm_events: Subscription<msg::AlarmEvent>,
    diagnostics: Subscription<DiagnosticArray>,
    link: Subscription<msg::LinkStatus>,
    plans: Subscription<msg::PredictedPlan>,
    resources: Subscription<msg::ResourceState>,
    looked: Option<Instant>,
}

impl Ear {
    /// Begins to listen.
    ///
    /// # Errors
    /// When DDS cannot be used.
    pub fn new(node: &Node) -> Result<Self> {
        Ok(Self {
            events: node.subscription(&graph::STRIP_EVENTS)?,
            points: node.subscription(&graph::SUB_SATELLITE_POINT)?,
            wheels: node.subscription(&graph::WHEELS)?,
            guidance: node.subscription(&graph::GUIDANCE_STATUS)?,
            tasks: node.subscription(&graph::PLANNER_TASK)?,
            results: node.subscription(&graph::TASK_RESULTS)?,
            offers: node.subscription(&graph::UPCOMING_STRIPS)?,
            decisions: node.subscription(&graph::PLANNER_DECISION)?,
            planner: node.subscription(&graph::PLANNER_STATUS)?,
            summaries: node.subscription(&graph::REQUEST_SUMMARY)?,
            standing: node.subscription(&graph::STANDING_ALARMS)?,
            alarm_events: node.subscription(&graph::ALARM_EVENTS)?,
            diagnostics: node.subscription(&graph::DIAGNOSTICS)?,
            link: node.subscription(&graph::LINK_STATUS)?,
            plans: node.subscription(&graph::PREDICTED_PLAN)?,
            resources: node.subscription(&graph::RESOURCES)?,
            looked: None,
        })
    }

    /// Tells the ledger of everything that has come, and waits a little for more.
    ///
    /// # Errors
    /// When DDS fails.
    pub fn listen(&mut self, node: &Node, shared: &Shared) -> Result<()> {
        shared.update(|ledger| {
            drain(&self.guidance, |it| ledger.guidance(&it))?;
            drain(&self.events, |it| ledger.strip(&it))?;
            drain(&self.points, |it| ledger.point(&it))?;
            drain(&self.wheels, |it| ledger.wheels(&it))?;
            drain(&self.offers, |it| ledger.offer(&it))?;
            drain(&self.decisions, |it| ledger.choice(&it))?;
            drain(&self.tasks, |it| ledger.task(&it))?;
            drain(&self.results, |it| ledger.result(&it))?;
            drain(&self.planner, |it| ledger.planner(&it))?;
            drain(&self.summaries, |it| ledger.summary(&it))?;
            drain(&self.link, |it| ledger.link(&it))?;
            drain(&self.plans, |it| ledger.plan(&it))?;
            drain(&self.resources, |it| ledger.resources(&it))?;
            drain(&self.alarm_events, |it| ledger.alarm_event(&it))?;
            drain(&self.standing, |it| ledger.standing(&it))?;
            drain(&self.diagnostics, |it| ledger.diagnostics(&it))
        })?;
        if self.looked.is_none_or(|looked| looked.elapsed() >= LOOK) {
            self.looked = Some(Instant::now());
            let (present, epochs) = (members(node), node.epochs());
            shared.update(|ledger| ledger.nodes(&present, epochs));
        }
        node.wait(IDLE)?;
        Ok(())
    }
}

fn drain<M: RosMessage>(subscription: &Subscription<M>, mut tell: impl FnMut(M)) -> Result<()> {
    while let Some(message) = subscription.take()? {
        tell(message);
    }
    Ok(())
}

/// Names of the nodes that are there, without their namespace.
fn members(node: &Node) -> BTreeSet<String> {
    let space = format!("{}/", node.names().namespace().trim_end_matches('/'));
    node.nodes().iter().filter_map(|name| name.strip_prefix(&space)).map(str::to_owned).collect()
}

/// Asks for all requests and for their past, in the background, as soon as somebody can tell.
pub fn catch_up(counter: &Counter, shared: &Shared) {
    let shared = shared.clone();
    counter.hand_in(move |desks| {
        if let Err(error) = past(desks, &shared) {
            tracing::warn!("the past of the requests is not known: {error:#}");
        }
    });
}

fn past(desks: &Desks, shared: &Shared) -> Result<()> {
    let mut strips = Vec::new();
    let mut page = msg::ListStripsRequest { limit: PAGE, ..Default::default() };
    loop {
        let answer = call(&desks.list, &page)?;
        ensure!(answer.reason_code == 0, "{} (reason {})", answer.reason, answer.reason_code);
        page.after_id = answer.strips.last().map_or(page.after_id, |status| status.strip.id);
        strips.extend(answer.strips);
        if !answer.more {
            break;
        }
    }
    let mut changes = Vec::new();
    let mut page = msg::ListHistoryRequest { limit: PAGE, ..Default::default() };
    loop {
        let answer = call(&desks.history, &page)?;
        ensure!(answer.reason_code == 0, "{} (reason {})", answer.reason, answer.reason_code);
        page.after_sequence = answer.entries.last().map_or(page.after_sequence, |entry| entry.sequence);
        changes.extend(answer.entries);
        if !answer.more {
            break;
        }
    }
    shared.update(|ledger| {
        strips.iter().for_each(|status| ledger.introduce(status));
        changes.iter().for_each(|entry| ledger.history(entry));
        strips.iter().for_each(|status| ledger.strip(status));
    });
    Ok(())
}
