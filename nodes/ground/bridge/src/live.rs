//! A mission that flies: the tap's topics, simulated time, and what clients may do.

use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use anyhow::Result;
use foxglove::WebSocketServerHandle;
use foxglove::websocket::service::Service;
use swath_bags::TopicPattern;
use swath_bags::tap::{Selection, Tap};
use swath_msgs::swath_msgs::ListStripsRequest;
use swath_ros::{Node, Shutdown, graph};

use crate::channels::Channels;
use crate::listener::Wish;
use crate::publishing::Publishing;
use crate::services;

/// What clients may do besides listening.
#[derive(Clone, Copy)]
pub struct Allowed {
    /// Call services.
    pub services: bool,
    /// Publish.
    pub publish: bool,
}

/// How long messages gather before they are taken [wall time].
const BATCH: Duration = Duration::from_millis(10);
/// Longest wait for a message [wall time].
const IDLE: Duration = Duration::from_millis(50);
/// How often losses, new topics and strips are looked after [wall time].
const CHORES: Duration = Duration::from_secs(1);
/// Samples that a subscription keeps.
const DEPTH: usize = 10_000;
/// Strips of one page.
const PAGE: u32 = 1000;
/// How long the request manager may take to tell of a page.
const TIMEOUT: Duration = Duration::from_secs(5);

/// Serves until a signal ends it.
///
/// # Errors
/// When the server cannot start, or DDS fails.
pub fn run(
    node: Node,
    start: impl FnOnce(Vec<Service>) -> Result<WebSocketServerHandle>,
    mut channels: Channels,
    wishes: &Receiver<Wish>,
    topics: TopicPattern,
    allowed: Allowed,
) -> Result<()> {
    let shutdown = Shutdown::on_signals(node.signal())?;
    let offered = if allowed.services { services::all(&node)? } else { Vec::new() };
    let list = node.client(&graph::LIST_STRIPS)?;
    let mut tap = Tap::new(node, Selection { topics, depth: DEPTH, ..Selection::default() })?;
    let server = start(offered)?;
    let mut publishing = Publishing::default();
    let (mut chores_at, mut known) = (Instant::now(), false);
    while !shutdown.asked() {
        tap.node().wait(IDLE)?;
        if tap.take_all(&mut channels)? > 0 {
            server.broadcast_time(tap.now().unwrap_or(0));
            std::thread::sleep(BATCH);
        }
        for wish in wishes.try_iter().filter(|_| allowed.publish) {
            publishing.follow(tap.node(), wish);
        }
        if chores_at.elapsed() >= CHORES {
            chores_at = Instant::now();
            tap.do_chores(&mut channels)?;
            if !known && list.matched() {
                known = catch_up(&list, &mut channels);
            }
            channels.strips.tell(tap.now().unwrap_or(0));
        }
    }
    Ok(())
}

/// Asks how all strips stand; whether it was told.
fn catch_up(list: &swath_ros::Client<swath_msgs::swath_msgs::ListStrips>, channels: &mut Channels) -> bool {
    let mut page = ListStripsRequest { limit: PAGE, ..Default::default() };
    loop {
        let answer = match list.call(page.clone(), TIMEOUT) {
            Ok(answer) => answer,
            Err(error) => {
                tracing::debug!("how the strips stand is not told yet: {error}");
                return false;
            }
        };
        answer.strips.iter().for_each(|status| channels.strips.take(status));
        page.after_id = answer.strips.last().map_or(page.after_id, |status| status.strip.id);
        if !answer.more {
            return true;
        }
    }
}
