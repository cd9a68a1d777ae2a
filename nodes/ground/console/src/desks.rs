//! Calls to the services of a flying mission, one after the other, on a thread of their own.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use anyhow::{Context, Result, anyhow};
use swath_msgs::RosService;
use swath_msgs::swath_msgs as msg;
use swath_ros::{Client, Node, Shutdown, graph};
use tokio::sync::oneshot;

/// How long an answer may take.
const TIMEOUT: Duration = Duration::from_secs(10);
/// How long an answer may take before a call that does no harm is made again: the first after a match may be lost.
const ONE_TRY: Duration = Duration::from_secs(2);

/// The services that operators call.
pub struct Desks {
    /// Submits requests.
    pub submit: Client<msg::SubmitStrips>,
    /// Takes requests back.
    pub cancel: Client<msg::CancelStrips>,
    /// Replaces a request by another one.
    pub replace: Client<msg::ReplaceStrip>,
    /// What strips may be.
    pub limits: Client<msg::GetLimits>,
    /// Holds, releases and rejects requests.
    pub review: Client<msg::ReviewStrips>,
    /// All that is known of a request.
    pub get: Client<msg::GetStrip>,
    /// Requests, page by page.
    pub list: Client<msg::ListStrips>,
    /// The audit trail, page by page.
    pub history: Client<msg::ListHistory>,
    /// When a request could be imaged.
    pub preview: Client<msg::PreviewStrip>,
    /// What the planner may do by itself.
    pub mode: Client<msg::SetPlannerMode>,
    /// Decides on proposals.
    pub decide: Client<msg::ReviewProposal>,
    /// Says that alarms have been seen.
    pub acknowledge: Client<msg::AcknowledgeAlarm>,
    /// Puts alarms aside.
    pub shelve: Client<msg::ShelveAlarm>,
}

impl Desks {
    /// Clients of a node; whoever serves them may come later.
    ///
    /// # Errors
    /// When DDS cannot be used.
    pub fn new(node: &Node) -> Result<Self> {
        Ok(Self {
            submit: node.client(&graph::SUBMIT_STRIPS)?,
            cancel: node.client(&graph::CANCEL_STRIPS)?,
            replace: node.client(&graph::REPLACE_STRIP)?,
            limits: node.client(&graph::GET_LIMITS)?,
            review: node.client(&graph::REVIEW_STRIPS)?,
            get: node.client(&graph::GET_STRIP)?,
            list: node.client(&graph::LIST_STRIPS)?,
            history: node.client(&graph::LIST_HISTORY)?,
            preview: node.client(&graph::PREVIEW_STRIP)?,
            mode: node.client(&graph::SET_PLANNER_MODE)?,
            decide: node.client(&graph::REVIEW_PROPOSAL)?,
            acknowledge: node.client(&graph::ACKNOWLEDGE_ALARM)?,
            shelve: node.client(&graph::SHELVE_ALARM)?,
        })
    }
}

/// Calls a service again and again until there is an answer: only for calls that do no harm when they come twice.
///
/// # Errors
/// When nobody serves it, or no answer comes in time.
pub fn call<S: RosService>(client: &Client<S>, request: &S::Request) -> Result<S::Response> {
    if !client.matched() {
        return Err(anyhow!("nobody serves {}", client.service()));
    }
    Ok(client.call_repeatedly(request.clone(), ONE_TRY, TIMEOUT)?)
}

/// Calls a service once, after `harmless` has been answered.
///
/// # Errors
/// When nobody serves it, or no answer comes in time.
pub fn call_once<S: RosService>(client: &Client<S>, harmless: &S::Request, request: S::Request) -> Result<S::Response> {
    call(client, harmless)?;
    Ok(client.call(request, TIMEOUT)?)
}

/// How often it is looked whether the console ends.
const LOOK: Duration = Duration::from_millis(200);

type Job = Box<dyn FnOnce(&Desks) + Send>;

/// Where commands are handed in. Clones lead to the same desks.
#[derive(Clone)]
pub struct Counter {
    jobs: Sender<Job>,
}

impl Counter {
    /// A counter, and what is handed in at it.
    #[must_use]
    pub fn new() -> (Self, Receiver<Job>) {
        let (jobs, handed_in) = channel();
        (Self { jobs }, handed_in)
    }

    /// Has something done at the desks.
    pub fn hand_in(&self, job: impl FnOnce(&Desks) + Send + 'static) {
        // At the console's end nobody does it any more.
        drop(self.jobs.send(Box::new(job)));
    }

    /// Has something asked of the mission.
    ///
    /// # Errors
    /// When the mission does not answer, or the console ends.
    pub async fn ask<T: Send + 'static>(&self, ask: impl FnOnce(&Desks) -> Result<T> + Send + 'static) -> Result<T> {
        let (answer, answered) = oneshot::channel();
        // Whoever asked may have gone; then nobody wants the answer.
        let job = move |desks: &Desks| drop(answer.send(ask(desks)));
        self.jobs.send(Box::new(job)).map_err(|_| anyhow!("the console is ending"))?;
        answered.await.context("the console is ending")?
    }
}

/// Does what is handed in, until the console ends.
pub fn serve(desks: &Desks, handed_in: &Receiver<Job>, shutdown: &Shutdown) {
    while !shutdown.asked() {
        if let Ok(job) = handed_in.recv_timeout(LOOK) {
            job(desks);
        }
    }
}
