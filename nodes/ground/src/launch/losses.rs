//! What the launcher does about nodes that are lost, and about what is ordered to befall the mission.

use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use swath_msgs::swath_msgs as msg;
use swath_node::fault_orders::ordered;
use swath_ros::{graph, stamp};
use swath_sim::time::Tick;

use super::over_dds::Launcher;
use super::supervisor::{Event, Fleet, Happened};
use swath_mission::alarms::conditions::{BAG_FULL, Report, of_plan};
use swath_mission::fallback::fallback;
use swath_mission::faults::grammar::{Failure, Process};
use swath_mission::faults::{FaultPlan, What};

/// After so many losses of late another planner decides in the planner's place.
const PLANNER_LOSSES: u32 = 3;
/// A recorder that has been there for so long has room.
const ROOM: Duration = Duration::from_secs(2);
/// The alarm of a mission that goes on with less than it needs.
const SAFE_MODE: &str = "safe mode";

impl Launcher {
    /// Looks after the processes: before the mission has begun none may be lost, then each is started again.
    pub(super) fn mind(&mut self, fleet: &mut Fleet) -> Result<()> {
        if self.flown.is_none() {
            fleet.check()?;
        }
        self.take_fault_orders()?;
        for event in fleet.supervise()? {
            self.note(fleet, event)?;
        }
        let now = self.now(fleet);
        self.mind_safe_mode(now)?;
        if self.room_since.take_if(|since| since.elapsed() >= ROOM).is_some() {
            self.tell(now, BAG_FULL, false, "there is room");
        }
        match self.recorder_faults.pop_front_if(|(it, _)| it.from <= now) {
            Some((_, Failure::Kill)) => fleet.kill(graph::RECORDER),
            Some((_, Failure::Hang)) => fleet.freeze(graph::RECORDER),
            None => Ok(()),
        }
    }

    /// Simulated time as the nodes know it.
    fn now(&self, fleet: &Fleet) -> Tick {
        self.stamper.tick_from(&stamp(fleet.now_ns()))
    }

    fn tell(&mut self, tick: Tick, name: &str, wrong: bool, text: &str) {
        self.alarms.report(Report::new(tick, graph::LAUNCHER, name, wrong, text.to_owned()));
    }

    /// What was ordered while the mission flies.
    fn take_fault_orders(&mut self) -> Result<()> {
        let period = self.model.period;
        while let Some(message) = self.fault_orders.take()? {
            for order in ordered(&message) {
                if !self.faults.add(order.fault) {
                    continue;
                }
                let new = FaultPlan { plan: vec![order.fault], random: 0 };
                self.alarms.plan(of_plan(&new, period));
                let since = self.recorder_since;
                let of_recorder = new.of(Process::Recorder, period).into_iter();
                self.recorder_faults.extend(of_recorder.filter(|(it, _)| it.from > since));
                self.recorder_faults.make_contiguous().sort_by_key(|(it, _)| it.from);
            }
        }
        Ok(())
    }

    /// What has become of a process: tells the alarms, and what comes of it.
    fn note(&mut self, fleet: &mut Fleet, Event { node, what }: Event) -> Result<()> {
        let tick = self.now(fleet);
        let (lost, silent) = (format!("{node} lost"), format!("{node} silent"));
        match what {
            // The plan tells of what was ordered.
            Happened::Silent { by_order: true, .. }
            | Happened::Lost { by_order: true, .. }
            | Happened::Back { by_order: true } => {}
            Happened::Silent { time, .. } => {
                let text = format!("node {node} gives no sign of life for {} s", time.as_secs_f64());
                tracing::warn!("{text}");
                self.tell(tick, &silent, true, &text);
            }
            Happened::Heard => self.tell(tick, &silent, false, "it is heard again"),
            Happened::Lost { how, times, .. } => {
                self.tell(tick, &silent, false, "it is lost");
                self.tell(tick, &lost, true, &how);
                if node == graph::PLANNER && times >= PLANNER_LOSSES {
                    self.tell(tick, "planner replaced", true, &format!("{how}; {} takes over", fallback()));
                    fleet.set_extra(&node, &[format!("planner:={}", fallback())]);
                }
            }
            Happened::NoRoom => {
                self.room_since = None;
                // The recorder is ahead of what is heard of time here: the plan tells of all that it orders.
                if self.faults.when(What::BagFull, self.model.period).is_empty() {
                    self.tell(tick, BAG_FULL, true, "there is no room for it");
                }
            }
            Happened::Back { .. } => {
                self.tell(tick, &lost, false, "it is there again");
                // One that stands in in safe mode holds, whether that is heard before an operator lets it choose or not.
                self.held |= node == graph::PLANNER && self.safe_mode.is_some();
                self.room_since = (node == graph::RECORDER).then(Instant::now).or(self.room_since);
            }
            Happened::GivenUp { how } => {
                self.tell(tick, &silent, false, "it is lost");
                let reason = format!("{how}, as often before: it is not started again");
                self.tell(tick, &lost, true, &reason);
                return self.give_up(fleet, &node, tick, reason);
            }
        }
        Ok(())
    }

    /// A node was lost too often: a planner that only holds stands in for the planner, the recorder can be done without,
    /// and without another one the mission ends.
    fn give_up(&mut self, fleet: &mut Fleet, node: &str, tick: Tick, reason: String) -> Result<()> {
        tracing::error!("{reason}");
        if !graph::ALL_FLIGHT_NODES.contains(&node) {
            return Ok(());
        }
        self.tell(tick, SAFE_MODE, true, &reason);
        let again = self.safe_mode.replace(reason.clone()).is_some();
        if node != graph::PLANNER || again {
            bail!("{reason}");
        }
        self.held = false;
        fleet.set_extra(node, &[format!("planner:={}", fallback()), "mode:=hold".to_owned()]);
        fleet.pardon(node);
        Ok(())
    }

    /// Safe mode is over when an operator lets the planner, which held, choose again.
    fn mind_safe_mode(&mut self, now: Tick) -> Result<()> {
        while let Some(status) = self.planner_status.take()? {
            if self.safe_mode.is_none() {
                continue;
            }
            let holds = status.mode == msg::PlannerStatus::MODE_HOLD;
            if std::mem::replace(&mut self.held, holds) && !holds {
                self.tell(now, SAFE_MODE, false, "an operator lets the planner choose again");
            }
        }
        Ok(())
    }
}
