//! What an update brought, for people and for plots.

use crate::ppo::UpdateStatistics;

/// One update, for people and for plots.
#[derive(Debug, Clone, Copy)]
pub struct Report {
    /// Environment steps taken so far.
    pub steps: u64,
    /// Episodes that ended during the update.
    pub episodes: usize,
    /// Mean reward of these episodes; NaN when there was none.
    pub episode_return: f64,
    /// Reward per orbit over all decisions of the update.
    pub reward_per_orbit: f64,
    /// Share of the attempts that succeeded.
    pub success_rate: f64,
    /// Mean transition time [s].
    pub t_pre_s: f64,
    /// Adam's step.
    pub learning_rate: f64,
    /// Weight of the KL penalty.
    pub kl_coefficient: f64,
    /// What the learner says.
    pub update: UpdateStatistics,
}

impl Report {
    /// Everything but the steps under the names of plots; `speed` is in environment steps a second.
    #[must_use]
    pub fn scalars(&self, speed: f64) -> [(&'static str, f64); 17] {
        let update = &self.update;
        [
            ("return", self.episode_return),
            ("reward_per_orbit", self.reward_per_orbit),
            ("success_rate", self.success_rate),
            ("t_pre_mean_s", self.t_pre_s),
            ("kl", update.kl),
            ("clip_fraction", update.clip_fraction),
            ("entropy", update.entropy),
            ("transition_entropy", update.transition_entropy),
            ("explained_variance", update.explained_variance),
            ("gradient_norm", update.gradient_norm),
            ("surrogate", update.surrogate),
            ("value_loss", update.value_loss),
            ("epochs", update.epochs),
            ("learning_rate", self.learning_rate),
            ("kl_coefficient", self.kl_coefficient),
            ("episodes", self.episodes as f64),
            ("steps_per_s", speed),
        ]
    }
}
