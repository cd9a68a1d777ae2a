//! Every window of a catalogue, by time.

use crate::requests::catalogue::{Candidate, Catalogue};
use crate::time::Tick;
use crate::world::strip::StripId;

/// The windows of all strips, by opening time.
pub(super) struct Passes {
    passes: Vec<Candidate>,
    /// Length of the longest window [ticks].
    longest: u64,
}

impl Passes {
    pub(super) fn new(catalogue: &Catalogue) -> Self {
        let entries = (1..=catalogue.len() as u64).filter_map(|id| Some((StripId(id), catalogue.get(StripId(id))?)));
        let mut passes: Vec<Candidate> = entries
            .flat_map(|(id, entry)| entry.windows.iter().map(move |&window| entry.candidate(id, window)))
            .collect();
        passes.sort_by_key(|pass| (pass.window.open, pass.id));
        let longest = passes.iter().map(|pass| pass.window.close.since(pass.window.open) as u64).max().unwrap_or(0);
        Self { passes, longest }
    }

    pub(super) fn all(&self) -> &[Candidate] {
        &self.passes
    }

    /// Indices of the windows in which imaging can begin at some tick from `now` to `latest`.
    pub(super) fn open_between(&self, now: Tick, latest: Tick) -> impl Iterator<Item = usize> + '_ {
        let from = Tick(now.0.saturating_sub(self.longest));
        let begin = self.passes.partition_point(|pass| pass.window.open < from);
        let end = self.passes.partition_point(|pass| pass.window.open <= latest);
        (begin..end).filter(move |&i| self.passes[i].window.close >= now)
    }
}
