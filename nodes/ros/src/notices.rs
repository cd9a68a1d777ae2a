//! What went wrong with the messages of others: counted, told now and then, never a reason to stop.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::signal::lock;

/// How long after a notice the next one of its kind and topic comes at the earliest.
const QUIET: Duration = Duration::from_secs(5);

/// Kinds and topics that are told apart; what comes beyond goes into the last of them.
const KINDS: usize = 256;

/// What was wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Trouble {
    /// Bytes that are no message of the topic's type.
    Unreadable,
    /// Messages of a writer that does not belong to the mission.
    Stranger,
    /// A reader that lagged, and is waited for no longer.
    Lagging,
    /// A message that could not be sent.
    Unsent,
    /// Another process has a node of this node's name.
    Namesake,
    /// Datagrams that the kernel did not hand over.
    Dropped,
    /// RustDDS was started anew inside this process.
    Renewed,
}

impl Trouble {
    /// Name for alarms.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unreadable => "unreadable messages",
            Self::Stranger => "messages of strangers",
            Self::Lagging => "reader lags",
            Self::Unsent => "messages unsent",
            Self::Namesake => "another node of this name",
            Self::Dropped => "datagrams dropped",
            Self::Renewed => "DDS started anew",
        }
    }
}

/// Something that went wrong since the last notice of its kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice {
    /// What was wrong.
    pub trouble: Trouble,
    /// Fully qualified name of the topic, service or node.
    pub topic: String,
    /// How often since the last notice of this kind and topic.
    pub count: u64,
    /// The last of them in words.
    pub text: String,
}

impl fmt::Display for Notice {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} on {}: {}", self.count, self.topic, self.text)
    }
}

/// Counts what went wrong.
#[derive(Default)]
pub(crate) struct Notices {
    tallies: Mutex<BTreeMap<(Trouble, String), Tally>>,
}

#[derive(Default)]
struct Tally {
    count: u64,
    text: String,
    told: Option<Instant>,
}

impl Notices {
    /// Counts one more. Tells whether it is the first one since the last notice.
    pub(crate) fn note(&self, trouble: Trouble, topic: &str, text: impl FnOnce() -> String) -> bool {
        self.note_several(trouble, topic, 1, text)
    }

    /// The same for several at once.
    pub(crate) fn note_several(
        &self,
        trouble: Trouble,
        topic: &str,
        count: u64,
        text: impl FnOnce() -> String,
    ) -> bool {
        let mut tallies = lock(&self.tallies);
        let mut key = (trouble, topic.to_owned());
        if tallies.len() >= KINDS && !tallies.contains_key(&key) {
            key.1 = "other topics".to_owned();
        }
        let tally = tallies.entry(key).or_default();
        let is_first = tally.count == 0;
        tally.count += count;
        if is_first {
            tally.text = text();
        }
        is_first
    }

    /// What has to be told now.
    pub(crate) fn take(&self, now: Instant) -> Vec<Notice> {
        let mut tallies = lock(&self.tallies);
        let due = |tally: &Tally| tally.told.is_none_or(|told| now.saturating_duration_since(told) >= QUIET);
        tallies
            .iter_mut()
            .filter(|(_, tally)| tally.count > 0 && due(tally))
            .map(|((trouble, topic), tally)| {
                tally.told = Some(now);
                let (count, text) = (std::mem::take(&mut tally.count), std::mem::take(&mut tally.text));
                Notice { trouble: *trouble, topic: topic.clone(), count, text }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_told_once_and_counted() {
        let notices = Notices::default();
        let start = Instant::now();
        let texts = |now| notices.take(now).iter().map(Notice::to_string).collect::<Vec<_>>();
        assert!(notices.note(Trouble::Unreadable, "/a", || "4 bytes".to_owned()));
        assert_eq!(texts(start), ["1 on /a: 4 bytes"]);
        for _ in 0..1000 {
            notices.note(Trouble::Unreadable, "/a", || "5 bytes".to_owned());
        }
        notices.note(Trouble::Stranger, "/a", || "a stranger".to_owned());
        assert_eq!(texts(start + QUIET / 2), ["1 on /a: a stranger"]);
        assert_eq!(texts(start + QUIET), ["1000 on /a: 5 bytes"]);
        assert!(texts(start + 3 * QUIET).is_empty());
    }

    #[test]
    fn names_without_number_do_not_fill_the_memory() {
        let notices = Notices::default();
        for number in 0..10_000 {
            notices.note(Trouble::Namesake, &format!("/n{number}"), String::new);
        }
        assert_eq!(notices.take(Instant::now()).len(), KINDS + 1);
    }
}
