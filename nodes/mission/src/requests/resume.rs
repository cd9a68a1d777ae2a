//! A request manager that ends and takes up its work from what it has written down.

use swath_sim::time::Tick;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::world::strip::StripId;

use super::journal::Progress;
use super::lifecycle::State;
use super::logic::RequestLogic;
use super::refusal::Refusal;
use super::request::Stored;

impl RequestLogic {
    /// The requests as a store gives them back, in the order of their numbers.
    #[must_use]
    pub fn stored(&self) -> Vec<Stored> {
        let of = |id: StripId| {
            let listed = self.catalogue.get(id);
            Some(Stored {
                request: self.request(id)?.clone(),
                windows: listed.map(|it| it.windows.clone()).unwrap_or_default(),
                linked: listed.and_then(|it| it.linked),
            })
        };
        (1..=self.len() as u64).map(StripId).filter_map(of).collect()
    }

    /// The one that takes over when this one is lost, in a mission that began at `initial` and ends at `horizon`: it
    /// knows what was written down, and nothing else.
    ///
    /// # Errors
    /// When a request is no strip.
    pub fn restarted(&self, initial: &InitialState, horizon: Tick) -> Result<Self, Refusal> {
        let mut fresh = Self::new(self.model.clone(), initial, horizon, self.rules);
        fresh.restore(self.stored(), self.rejected, self.progress, self.last_settled)?;
        Ok(fresh)
    }

    /// The first `count` requests as they were on board when the mission had come so far, where no later change is
    /// known but what is under way since.
    ///
    /// # Errors
    /// When a request is no strip.
    pub fn as_on_board(
        &self,
        initial: &InitialState,
        horizon: Tick,
        count: usize,
        progress: Progress,
    ) -> Result<Self, Refusal> {
        let mut stored = self.stored();
        stored.truncate(count);
        for it in &mut stored {
            if matches!(it.request.state, State::Scheduled | State::Executing) {
                it.request.state = State::Accepted;
            }
        }
        let mut fresh = Self::new(self.model.clone(), initial, horizon, self.rules);
        fresh.restore(stored, 0, progress, None)?;
        Ok(fresh)
    }
}
