//! Which nodes of a mission are there: as DDS tells it, and as the launcher does, who is the first to know.

use std::collections::{BTreeMap, BTreeSet};

use swath_msgs::swath_msgs as msg;

use crate::facts::Fact;

/// How the launcher calls the alarm of a node that has ended or hangs.
const LOST: &str = " lost";

/// What is known of the nodes.
#[derive(Default)]
pub struct Presence {
    /// Those that the launcher has lost, and not found again.
    lost: BTreeSet<String>,
    /// Those besides the mission's own that have been there.
    seen: BTreeSet<String>,
    told: Option<Fact>,
}

impl Presence {
    /// The alarms that stand: a node that was killed is known in DDS for some time yet.
    pub fn standing(&mut self, standing: &msg::StandingAlarms) {
        use msg::Alarm;
        let stands = |alarm: &&Alarm| {
            let state = if alarm.state == Alarm::STATE_SHELVED { alarm.beneath } else { alarm.state };
            [Alarm::STATE_UNACKNOWLEDGED, Alarm::STATE_ACKNOWLEDGED].contains(&state)
        };
        let lost = standing.alarms.iter().filter(stands).filter_map(|alarm| alarm.name.strip_suffix(LOST));
        self.lost = lost.map(str::to_owned).collect();
    }

    /// The nodes that are there, of those that must be and those that come besides, and how often each was started anew;
    /// told when it changes.
    pub fn look(
        &mut self,
        present: &BTreeSet<String>,
        expected: &[&str],
        besides: &[&str],
        epochs: BTreeMap<String, u64>,
    ) -> Option<Fact> {
        let besides = besides.iter().map(|it| (*it).to_owned());
        self.seen.extend(besides.filter(|name| present.contains(name) || self.lost.contains(name)));
        let known: Vec<_> = expected.iter().map(|name| (*name).to_owned()).chain(self.seen.iter().cloned()).collect();
        let again = epochs.into_iter().filter(|(name, epoch)| *epoch > 0 && known.contains(name)).collect();
        let (present, missing) =
            known.into_iter().partition(|name| present.contains(name) && !self.lost.contains(name));
        let nodes = Fact::Nodes { present, missing, restarts: again };
        (self.told.as_ref() != Some(&nodes)).then(|| {
            self.told = Some(nodes.clone());
            nodes
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MUST: [&str; 2] = ["guidance", "planner"];
    const BESIDES: [&str; 2] = ["launcher", "recorder"];

    fn looked(presence: &mut Presence, present: &[&str], epochs: &[(&str, u64)]) -> Option<(Vec<String>, Vec<String>)> {
        let present = present.iter().map(|name| (*name).to_owned()).collect();
        let epochs = epochs.iter().map(|(name, epoch)| ((*name).to_owned(), *epoch)).collect();
        match presence.look(&present, &MUST, &BESIDES, epochs)? {
            Fact::Nodes { missing, restarts, .. } => Some((missing, restarts.into_keys().collect())),
            _ => None,
        }
    }

    fn words(words: &[&str]) -> Vec<String> {
        words.iter().map(|word| (*word).to_owned()).collect()
    }

    #[test]
    fn nodes_are_told_when_they_come_or_go() {
        let mut presence = Presence::default();
        let both = ["guidance", "planner", "console"];
        assert_eq!(looked(&mut presence, &both, &[]), Some((vec![], vec![])));
        assert_eq!(looked(&mut presence, &both[..2], &[]), None, "who is no part of the mission");
        assert_eq!(looked(&mut presence, &["planner"], &[]), Some((words(&["guidance"]), vec![])));
        let again = looked(&mut presence, &both, &[("planner", 0), ("guidance", 1)]);
        assert_eq!(again, Some((vec![], words(&["guidance"]))));
    }

    #[test]
    fn who_comes_besides_is_missed_once_it_was_there() {
        let mut presence = Presence::default();
        assert_eq!(looked(&mut presence, &MUST, &[]), Some((vec![], vec![])));
        assert_eq!(looked(&mut presence, &["guidance", "planner", "launcher"], &[]), Some((vec![], vec![])));
        assert_eq!(looked(&mut presence, &MUST, &[]), Some((words(&["launcher"]), vec![])));
    }

    #[test]
    fn whom_the_launcher_has_lost_is_missing_before_dds_knows_it() {
        let mut presence = Presence::default();
        looked(&mut presence, &MUST, &[]);
        let alarm = |name: &str, state| msg::Alarm { name: name.to_owned(), state, ..Default::default() };
        let mut tell = |alarms: &[(&str, u8)]| {
            let alarms = alarms.iter().map(|(name, state)| alarm(name, *state)).collect();
            presence.standing(&msg::StandingAlarms { alarms, ..Default::default() });
            looked(&mut presence, &MUST, &[])
        };
        let (stands, over) = (msg::Alarm::STATE_UNACKNOWLEDGED, msg::Alarm::STATE_RETURNED_UNACKNOWLEDGED);
        assert_eq!(tell(&[("planner lost", stands), ("late", stands)]), Some((words(&["planner"]), vec![])));
        assert_eq!(tell(&[("planner lost", over)]), Some((vec![], vec![])));
        assert_eq!(tell(&[("recorder lost", stands)]), Some((words(&["recorder"]), vec![])));
    }
}
