//! Tasks as they are flown, in the order of their numbers, each told once its reward is settled.

use std::collections::{BTreeMap, VecDeque};

use swath_sim::task::{SettledTask, TaskRecord, Totals};

use crate::outcome::TaskLine;

/// Joins what guidance tells of tasks with the rewards that the request manager settles.
///
/// A wait has no reward to wait for. What is told twice counts once.
#[derive(Clone, Debug, Default)]
pub struct TaskLog {
    next: u64,
    /// Tasks whose rewards are not known yet, in order.
    open: VecDeque<(TaskRecord, String)>,
    /// Rewards of tasks that are not known yet, or not told yet.
    rewards: BTreeMap<u64, f64>,
    totals: Totals,
    lines: Vec<(SettledTask, TaskLine)>,
}

impl TaskLog {
    /// A log that goes on after the tasks whose lines are written.
    #[must_use]
    pub fn going_on(lines: &[TaskLine]) -> Self {
        let mut log = Self::default();
        for line in lines {
            log.totals.add(&line.settled());
            log.next = log.next.max(line.task + 1);
        }
        log
    }

    /// Number of the next task.
    #[must_use]
    pub fn next(&self) -> u64 {
        self.next
    }

    /// A task has ended; `name` is its strip's.
    pub fn flown(&mut self, record: TaskRecord, name: &str) {
        if record.task < self.next {
            return;
        }
        self.next = record.task + 1;
        if record.strip.is_none() {
            self.rewards.insert(record.task, 0.0);
        }
        self.open.push_back((record, name.to_owned()));
        self.close();
    }

    /// A task's reward is settled.
    pub fn settled(&mut self, task: u64, reward: f64) {
        let told = self.open.front().map_or(self.next, |(record, _)| record.task);
        if task >= told {
            self.rewards.insert(task, reward);
            self.close();
        }
    }

    fn close(&mut self) {
        while let Some((record, name)) = self.open.pop_front_if(|(record, _)| self.rewards.contains_key(&record.task)) {
            let reward = self.rewards.remove(&record.task).unwrap_or(0.0);
            let settled = SettledTask { record, reward };
            self.totals.add(&settled);
            let line = TaskLine::new(&settled, settled.record.strip.map(|_| name.as_str()));
            self.lines.push((settled, line));
        }
    }

    /// Whether a reward is not known yet.
    #[must_use]
    pub fn waits(&self) -> bool {
        !self.open.is_empty()
    }

    /// Rewards that are not known yet will not come: they are 0.
    pub fn give_up(&mut self) {
        let open: Vec<u64> = self.open.iter().map(|(record, _)| record.task).collect();
        for task in open {
            self.rewards.entry(task).or_insert(0.0);
        }
        self.close();
    }

    /// Totals of the tasks whose rewards are settled.
    #[must_use]
    pub fn totals(&self) -> &Totals {
        &self.totals
    }

    /// Tasks that were settled since the last call, with their lines.
    pub fn take(&mut self) -> Vec<(SettledTask, TaskLine)> {
        std::mem::take(&mut self.lines)
    }
}

#[cfg(test)]
mod tests {
    use swath_sim::task::TaskOutcome;
    use swath_sim::time::Tick;
    use swath_sim::world::strip::StripId;

    use super::*;

    fn record(task: u64, strip: Option<u64>) -> TaskRecord {
        let outcome = TaskOutcome { failure: None, max_attitude_error: 0.01, min_elevation: 1.0 };
        let (start, end) = (Tick(task * 10), Tick(task * 10 + 10));
        TaskRecord { task, start, end, strip: strip.map(StripId), duty: None, t_pre: 5, t_acq: 5, outcome }
    }

    #[test]
    fn tasks_come_in_order_once_and_with_their_rewards() {
        let mut log = TaskLog::default();
        log.flown(record(0, Some(7)), "seven");
        log.flown(record(0, Some(7)), "seven");
        log.flown(record(1, None), "");
        assert!(log.waits() && log.take().is_empty());
        log.settled(2, 0.25);
        log.settled(0, 0.5);
        log.settled(0, 0.75);
        let told = |log: &mut TaskLog| log.take().iter().map(|(it, _)| (it.record.task, it.reward)).collect::<Vec<_>>();
        assert_eq!(told(&mut log), [(0, 0.5), (1, 0.0)]);
        log.flown(record(2, Some(8)), "eight");
        assert_eq!(told(&mut log), [(2, 0.25)]);
        log.flown(record(3, Some(9)), "nine");
        log.give_up();
        assert_eq!(told(&mut log), [(3, 0.0)]);
        assert_eq!((log.totals().reward, log.totals().fulfilled, log.waits()), (0.75, 3, false));
    }
}
