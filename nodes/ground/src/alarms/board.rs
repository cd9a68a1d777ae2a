//! The board of a flying mission: what nodes report and operators wish comes in, topics and answers go out.

use std::collections::VecDeque;

use anyhow::Result;
use swath_msgs::swath_msgs as msg;
use swath_node::stamp::Stamper;
use swath_ros::{Node, Publisher, Server, graph};
use swath_sim::time::{Tick, TickPeriod};

use super::messages;
use swath_mission::alarms::conditions::{Report, report_all};
use swath_mission::alarms::wishes::{Act, Wish};
use swath_mission::alarms::{Board, Entry, Key};

/// All alarms of a flying mission.
pub struct FlyingBoard {
    period: TickPeriod,
    stamper: Stamper,
    /// Alarms as they stand, told in the order in which reports came.
    board: Board,
    /// What is reported by the mission's plan, the next first.
    planned: VecDeque<Report>,
    /// What the journal is made of: what two nodes report of one tick comes in any order.
    reports: Vec<Report>,
    wishes: Vec<Wish>,
    /// Reports of before this process, which may be told again.
    before: usize,
    standing: Publisher<msg::StandingAlarms>,
    events: Publisher<msg::AlarmEvent>,
    acknowledge: Server<msg::AcknowledgeAlarm>,
    shelve: Server<msg::ShelveAlarm>,
    unshelve: Server<msg::UnshelveAlarm>,
    list: Server<msg::ListAlarms>,
}

impl FlyingBoard {
    /// Opens topics and services. `planned` is what is known from the start to be reported.
    ///
    /// # Errors
    /// When DDS fails.
    pub fn new(node: &Node, period: TickPeriod, stamper: Stamper, planned: Vec<Report>) -> Result<Self> {
        let board = Self {
            period,
            stamper,
            board: Board::new(period),
            planned: planned.into(),
            reports: Vec::new(),
            wishes: Vec::new(),
            before: 0,
            standing: node.publisher(&graph::STANDING_ALARMS)?,
            events: node.publisher(&graph::ALARM_EVENTS)?,
            acknowledge: node.server(&graph::ACKNOWLEDGE_ALARM)?,
            shelve: node.server(&graph::SHELVE_ALARM)?,
            unshelve: node.server(&graph::UNSHELVE_ALARM)?,
            list: node.server(&graph::LIST_ALARMS)?,
        };
        board.tell_standing()?;
        Ok(board)
    }

    /// Goes on from what another process has kept of this mission. What is reported again, by nodes or by the plan, is
    /// nothing new.
    ///
    /// # Errors
    /// When DDS fails.
    pub fn take_up(&mut self, reports: Vec<Report>, wishes: Vec<Wish>) -> Result<()> {
        report_all(&mut self.board, reports.clone(), &wishes);
        // It was told of when it happened.
        let _ = self.board.take_journal();
        (self.before, self.reports, self.wishes) = (reports.len(), reports, wishes);
        self.tell_standing()
    }

    /// What was reported, and what operators wished.
    #[must_use]
    pub fn kept(&self) -> (&[Report], &[Wish]) {
        (&self.reports, &self.wishes)
    }

    /// Up to when the board is.
    #[must_use]
    pub fn now(&self) -> Tick {
        self.board.now()
    }

    /// A node says whether something is wrong.
    pub fn report(&mut self, report: Report) {
        if self.reports.iter().take(self.before).any(|known| *known == report) {
            return;
        }
        self.show(&report);
        self.reports.push(report);
    }

    fn show(&mut self, Report { tick, key, severity, wrong, text }: &Report) {
        self.board.report(*tick, key.clone(), *severity, *wrong, text);
    }

    /// More is known to be reported.
    pub fn plan(&mut self, reports: Vec<Report>) {
        self.planned.extend(reports);
        self.planned.make_contiguous().sort_by_key(|report| report.tick);
    }

    /// Time has come to `now`: tells what happened, and answers operators. Returns whether anything happened.
    ///
    /// # Errors
    /// When DDS fails.
    pub fn step(&mut self, now: Tick) -> Result<bool> {
        while let Some(report) = self.planned.pop_front_if(|report| report.tick <= now) {
            self.report(report);
        }
        self.board.advance(now);
        while let Some((id, call)) = self.acknowledge.take()? {
            let done = self.follow(Act::Acknowledge, Key::new(&call.node, &call.name), call.actor, call.comment);
            let (accepted, reason) = answer(done);
            self.acknowledge.respond(id, msg::AcknowledgeAlarmResponse { accepted, reason })?;
        }
        while let Some((id, call)) = self.shelve.take()? {
            let act = Act::shelve(self.period, call.duration_s).map_err(|error| error.to_string());
            let key = Key::new(&call.node, &call.name);
            let (accepted, reason) = answer(act.and_then(|act| self.follow(act, key, call.actor, call.comment)));
            self.shelve.respond(id, msg::ShelveAlarmResponse { accepted, reason })?;
        }
        while let Some((id, call)) = self.unshelve.take()? {
            let done = self.follow(Act::Unshelve, Key::new(&call.node, &call.name), call.actor, call.comment);
            let (accepted, reason) = answer(done);
            self.unshelve.respond(id, msg::UnshelveAlarmResponse { accepted, reason })?;
        }
        while let Some((id, _)) = self.list.take()? {
            let now = self.stamper.time(self.board.now());
            self.list.respond(id, msg::ListAlarmsResponse { now, alarms: self.alarms() })?;
        }
        let journal = self.board.take_journal();
        for entry in &journal {
            self.events.publish(&messages::event(&self.stamper, entry))?;
        }
        if !journal.is_empty() {
            self.tell_standing()?;
        }
        Ok(!journal.is_empty())
    }

    fn follow(&mut self, act: Act, key: Key, actor: String, comment: String) -> Result<(), String> {
        let wish = Wish { tick: self.board.now(), key, act, actor, comment };
        wish.follow(&mut self.board).map_err(|error| error.to_string())?;
        self.wishes.push(wish);
        Ok(())
    }

    fn alarms(&self) -> Vec<msg::Alarm> {
        self.board.standing().iter().map(|it| messages::alarm(&self.stamper, it)).collect()
    }

    fn tell_standing(&self) -> Result<()> {
        let now = self.board.now();
        let header = self.stamper.header(now, "");
        Ok(self.standing.publish(&msg::StandingAlarms { header, tick: now.0, alarms: self.alarms() })?)
    }

    /// What has happened to alarms up to a tick, in an order that is the same in each flight of the mission.
    #[must_use]
    pub fn journal(&self, end: Tick) -> Vec<Entry> {
        let mut board = Board::new(self.period);
        let planned = self.planned.iter().filter(|report| report.tick <= end);
        report_all(&mut board, self.reports.iter().chain(planned).cloned().collect(), &self.wishes);
        board.advance(end);
        board.take_journal()
    }
}

fn answer(done: Result<(), String>) -> (bool, String) {
    let reason = done.err();
    (reason.is_none(), reason.unwrap_or_default())
}
