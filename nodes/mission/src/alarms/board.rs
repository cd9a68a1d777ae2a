//! All alarms of a mission, and the journal of what happened to them.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use swath_sim::time::{Tick, TickPeriod};
use thiserror::Error;

use super::definitions::{Severity, definition, rules};
use super::state::{Alarm, Input, Refused, State};

/// Which alarm: the node that raises it, and its name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Key {
    /// The node.
    pub node: String,
    /// The alarm.
    pub name: String,
}

impl Key {
    /// The alarm `name` of a node.
    #[must_use]
    pub fn new(node: &str, name: &str) -> Self {
        Self { node: node.to_owned(), name: name.to_owned() }
    }
}

/// What happened to an alarm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// It was raised.
    Raised,
    /// Nothing is wrong any more.
    Returned,
    /// An operator knows of it.
    Acknowledged,
    /// An operator does not want to be told for a while.
    Shelved,
    /// It is told of again.
    Unshelved,
}

impl Event {
    /// The events, in the order of their numbers.
    pub const ALL: [Self; 5] = [Self::Raised, Self::Returned, Self::Acknowledged, Self::Shelved, Self::Unshelved];

    /// Its name in messages, files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Raised => "raised",
            Self::Returned => "returned",
            Self::Acknowledged => "acknowledged",
            Self::Shelved => "shelved",
            Self::Unshelved => "unshelved",
        }
    }
}

/// A line of the journal.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// Number of the line, from 1.
    pub number: u64,
    /// Simulated time.
    pub tick: Tick,
    /// The alarm.
    #[serde(flatten)]
    pub key: Key,
    /// How grave it is.
    pub severity: Severity,
    /// What happened.
    pub event: Event,
    /// Where it stands now.
    pub state: State,
    /// Where it would stand if it were not shelved.
    pub beneath: State,
    /// Tick at which it is told of again.
    pub shelved_until: Option<Tick>,
    /// Times that it was raised.
    pub sequence: u64,
    /// When it was raised last.
    pub raised: Tick,
    /// Who did it: the node, or an operator.
    pub actor: String,
    /// What the node says of the condition, or the operator's comment.
    pub text: String,
}

/// An alarm that is not normal.
#[derive(Clone, Debug, PartialEq)]
pub struct Standing {
    /// Which one.
    pub key: Key,
    /// How grave it is.
    pub severity: Severity,
    /// How it stands.
    pub alarm: Alarm,
    /// What its node says of it.
    pub text: String,
}

/// Why an operator's wish is not followed.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum OperatorError {
    /// There is no such alarm.
    #[error("there is no alarm `{name}` of {node}", name = .0.name, node = .0.node)]
    Unknown(Key),
    /// It makes no sense as the alarm stands.
    #[error("{name} of {node}: {source}", name = key.name, node = key.node)]
    Refused {
        /// The alarm.
        key: Key,
        /// Why.
        source: Refused,
    },
}

#[derive(Clone, Debug)]
struct Known {
    alarm: Alarm,
    severity: Severity,
    text: String,
}

/// All alarms of a mission.
#[derive(Clone, Debug)]
pub struct Board {
    period: TickPeriod,
    known: BTreeMap<Key, Known>,
    lines: u64,
    journal: Vec<Entry>,
    now: Tick,
}

impl Board {
    /// A board without alarms.
    #[must_use]
    pub fn new(period: TickPeriod) -> Self {
        Self { period, known: BTreeMap::new(), lines: 0, journal: Vec::new(), now: Tick(0) }
    }

    /// The board that a journal tells of.
    #[must_use]
    pub fn restored(period: TickPeriod, journal: &[Entry]) -> Self {
        let mut board = Self::new(period);
        for entry in journal {
            let alarm = Alarm::restored(entry.beneath, entry.shelved_until, entry.sequence, entry.raised, entry.tick);
            let before = board.known.get(&entry.key).map(|known| known.text.clone()).unwrap_or_default();
            let told = matches!(entry.event, Event::Raised | Event::Returned);
            let text = if told { entry.text.clone() } else { before };
            board.known.insert(entry.key.clone(), Known { alarm, severity: entry.severity, text });
            board.lines = entry.number;
            board.now = board.now.max(entry.tick);
        }
        board
    }

    /// Where time stands.
    #[must_use]
    pub fn now(&self) -> Tick {
        self.now
    }

    /// A node says whether something is wrong, and what. `severity` counts where the table has none.
    pub fn report(&mut self, now: Tick, key: Key, severity: Severity, wrong: bool, text: &str) {
        self.advance(now);
        if !wrong && !self.known.contains_key(&key) {
            return;
        }
        let severity = definition(&key.name).map_or(severity, |it| it.severity);
        let known = self.known.entry(key.clone()).or_insert_with(|| Known {
            alarm: Alarm::default(),
            severity,
            text: String::new(),
        });
        if wrong {
            known.severity = severity;
        }
        text.clone_into(&mut known.text);
        let actor = key.node.clone();
        // Only operators' wishes are refused.
        _ = self.step(&key, Input::Condition(wrong), &actor, text);
    }

    /// An operator knows of an alarm.
    ///
    /// # Errors
    /// When it does not stand, or is acknowledged.
    pub fn acknowledge(&mut self, now: Tick, key: &Key, actor: &str, comment: &str) -> Result<(), OperatorError> {
        self.advance(now);
        self.step(key, Input::Acknowledge, actor, comment)
    }

    /// An operator does not want to be told of an alarm for a number of ticks.
    ///
    /// # Errors
    /// When it does not stand, or is shelved.
    pub fn shelve(
        &mut self,
        now: Tick,
        key: &Key,
        ticks: u32,
        actor: &str,
        comment: &str,
    ) -> Result<(), OperatorError> {
        self.advance(now);
        self.step(key, Input::Shelve(self.now.after(ticks)), actor, comment)
    }

    /// An operator wants to be told of an alarm again.
    ///
    /// # Errors
    /// When it is not shelved.
    pub fn unshelve(&mut self, now: Tick, key: &Key, actor: &str, comment: &str) -> Result<(), OperatorError> {
        self.advance(now);
        self.step(key, Input::Unshelve, actor, comment)
    }

    /// Time passes: conditions return when their off-delay is over, and what is shelved is told of again. What happens
    /// at the same tick happens in the order of the alarms' names.
    pub fn advance(&mut self, now: Tick) {
        if now <= self.now {
            return;
        }
        for tick in self.due(now) {
            self.now = tick;
            let keys: Vec<Key> = self.known.keys().cloned().collect();
            for key in keys {
                let text = self.known.get(&key).map(|known| known.text.clone()).unwrap_or_default();
                let actor = key.node.clone();
                // Only operators' wishes are refused.
                _ = self.step(&key, Input::Time, &actor, &text);
            }
        }
        self.now = now;
    }

    /// Ticks up to `now` at which time alone changes something, so that it is told with its own tick however seldom the
    /// board is told the time.
    fn due(&self, now: Tick) -> Vec<Tick> {
        let mut ticks = std::collections::BTreeSet::from([now]);
        for (key, known) in &self.known {
            let returns = known.alarm.returns(&rules(&key.name, self.period));
            ticks.extend(
                known.alarm.shelved_until().into_iter().chain(returns).filter(|&tick| tick > self.now && tick < now),
            );
        }
        ticks.into_iter().collect()
    }

    /// Alarms that are not normal, the gravest first.
    #[must_use]
    pub fn standing(&self) -> Vec<Standing> {
        let mut standing: Vec<_> = self
            .known
            .iter()
            .filter(|(_, known)| known.alarm.state() != State::Normal)
            .map(|(key, known)| Standing {
                key: key.clone(),
                severity: known.severity,
                alarm: known.alarm,
                text: known.text.clone(),
            })
            .collect();
        standing.sort_by_key(|it| std::cmp::Reverse(it.severity));
        standing
    }

    /// The lines of the journal since the last call.
    pub fn take_journal(&mut self) -> Vec<Entry> {
        std::mem::take(&mut self.journal)
    }

    fn step(&mut self, key: &Key, input: Input, actor: &str, text: &str) -> Result<(), OperatorError> {
        let Some(known) = self.known.get_mut(key) else { return Err(OperatorError::Unknown(key.clone())) };
        let before = known.alarm;
        let after = before
            .step(&rules(&key.name, self.period), self.now, input)
            .map_err(|source| OperatorError::Refused { key: key.clone(), source })?;
        known.alarm = after;
        let severity = known.severity;
        for event in events(&before, &after, input) {
            self.lines += 1;
            self.journal.push(Entry {
                number: self.lines,
                tick: self.now,
                key: key.clone(),
                severity,
                event,
                state: after.state(),
                beneath: after.beneath(),
                shelved_until: after.shelved_until(),
                sequence: after.sequence,
                raised: after.raised,
                actor: actor.to_owned(),
                text: text.to_owned(),
            });
        }
        Ok(())
    }
}

/// What a step did, in the order in which it happened.
fn events(before: &Alarm, after: &Alarm, input: Input) -> Vec<Event> {
    let mut events = Vec::new();
    if after.sequence > before.sequence {
        events.push(Event::Raised);
    }
    if input == Input::Acknowledge {
        events.push(Event::Acknowledged);
    }
    if before.active() && !after.active() {
        events.push(Event::Returned);
    }
    match (before.shelved_until(), after.shelved_until()) {
        (None, Some(_)) => events.push(Event::Shelved),
        (Some(_), None) => events.push(Event::Unshelved),
        _ => {}
    }
    events
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board() -> Board {
        Board::new(TickPeriod::from_frequency(2.0).unwrap())
    }

    fn wheel() -> Key {
        Key::new("guidance", "wheel x")
    }

    fn told(board: &mut Board) -> Vec<(u64, Event, State)> {
        board.take_journal().into_iter().map(|it| (it.tick.0, it.event, it.state)).collect()
    }

    #[test]
    fn the_journal_tells_what_happened_at_its_tick() {
        let mut board = board();
        board.report(Tick(10), wheel(), Severity::Warn, true, "gives nothing");
        board.report(Tick(11), wheel(), Severity::Warn, true, "gives nothing");
        assert_eq!(board.standing()[0].severity, Severity::Error, "the table knows better");
        board.acknowledge(Tick(12), &wheel(), "ana", "seen").unwrap();
        board.report(Tick(20), wheel(), Severity::Warn, false, "sound");
        board.advance(Tick(100));
        assert!(board.standing().is_empty());
        board.report(Tick(110), Key::new("planner", "task refused"), Severity::Warn, true, "too long");
        board.advance(Tick(500));
        assert_eq!(
            told(&mut board),
            [
                (10, Event::Raised, State::Unacknowledged),
                (12, Event::Acknowledged, State::Acknowledged),
                (22, Event::Returned, State::Normal),
                (110, Event::Raised, State::Unacknowledged),
                (120, Event::Returned, State::ReturnedUnacknowledged),
            ]
        );
    }

    #[test]
    fn shelved_alarms_are_told_of_again() {
        let mut board = board();
        board.report(Tick(1), wheel(), Severity::Error, true, "gives nothing");
        board.shelve(Tick(2), &wheel(), 100, "ana", "known").unwrap();
        board.advance(Tick(1000));
        assert_eq!(
            told(&mut board)[1..],
            [(2, Event::Shelved, State::Shelved), (102, Event::Unshelved, State::Unacknowledged),]
        );
        let error = board.unshelve(Tick(1001), &wheel(), "ana", "").unwrap_err();
        assert_eq!(error.to_string(), "wheel x of guidance: the alarm is not shelved");
        let error = board.acknowledge(Tick(1001), &Key::new("guidance", "wheel q"), "ana", "").unwrap_err();
        assert_eq!(error.to_string(), "there is no alarm `wheel q` of guidance");
    }

    #[test]
    fn a_board_comes_back_from_its_journal() {
        let mut first = board();
        let biased = Key::new("guidance", "gyro biased");
        first.report(Tick(1), wheel(), Severity::Error, true, "gives nothing");
        first.report(Tick(3), biased.clone(), Severity::Warn, true, "by 0.01 deg/s");
        first.acknowledge(Tick(4), &biased, "ana", "noted").unwrap();
        first.shelve(Tick(5), &wheel(), 50, "ana", "known").unwrap();
        let journal = first.take_journal();
        let text: Vec<String> = journal.iter().map(|it| serde_json::to_string(it).unwrap()).collect();
        let read: Vec<Entry> = text.iter().map(|it| serde_json::from_str(it).unwrap()).collect();
        assert_eq!(read, journal);
        let mut second = Board::restored(first.period, &read);
        let summary = |board: &Board| -> Vec<_> {
            let of = |it: Standing| (it.key, it.severity, it.alarm.state(), it.alarm.sequence, it.text);
            board.standing().into_iter().map(of).collect()
        };
        assert_eq!(summary(&second), summary(&first));
        for board in [&mut first, &mut second] {
            board.report(Tick(60), wheel(), Severity::Error, false, "sound");
            board.advance(Tick(70));
        }
        assert_eq!(first.take_journal(), second.take_journal());
    }
}
