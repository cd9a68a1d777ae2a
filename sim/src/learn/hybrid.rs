//! Strip imaging for whoever learns it: hybrid actions, and episodes in which there is always a strip to choose.
//!
//! Knows the simulation and nothing of networks.

use std::sync::Arc;

use thiserror::Error;

use crate::learn::episode::{Env, EpisodeConfig};
use crate::learn::observation::ObservationSet;
use crate::mission::horizon;
use crate::planner::{Decision, Planner, PlannerError};
use crate::task::FailureReason;
use crate::vehicle::model::Model;

/// How long to wait when no strip is left to choose from [s].
const WAIT_S: f64 = 60.0;

/// Longest time that a teacher may wait before a strip [s].
const LONGEST_LESSON_WAIT_S: f64 = 86_400.0;

/// Size of an observation: a sequence of tokens, each with the same features.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ObservationShape {
    /// Tokens, which are also the discrete choices.
    pub tokens: usize,
    /// Features of one token.
    pub features: usize,
}

impl ObservationShape {
    /// Numbers in one observation.
    #[must_use]
    pub fn len(self) -> usize {
        self.tokens * self.features
    }

    /// Whether it holds no number.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }
}

/// A hybrid action.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Action {
    /// Which token.
    pub token: usize,
    /// Continuous parameter in [0, 1]; for strips T_pre over its maximum.
    pub parameter: f64,
}

/// How an episode stands after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// It goes on.
    Continues,
    /// It is over, and nothing can be gained after it.
    Terminated,
    /// It was cut off: what follows is worth the value of the next observation.
    Truncated,
}

/// What an action led to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Reward, paid at the end of the step.
    pub reward: f64,
    /// Duration of the step [s].
    pub duration_s: f64,
    /// Whether the attempt succeeded.
    pub success: bool,
    /// Why it did not.
    pub failure: Option<FailureReason>,
    /// How the episode stands.
    pub progress: Progress,
}

/// Why an episode cannot begin or go on.
#[derive(Debug, Error)]
pub enum LearnError {
    /// Nothing was begun.
    #[error("no episode has begun")]
    NoEpisode,
    /// There is nothing to learn from.
    #[error("the episode of seed {seed} asks for {asked} strips, and none can be reached within its {orbits} orbits")]
    NoStrip {
        /// Seed of the episode.
        seed: u64,
        /// Strips asked for.
        asked: usize,
        /// Length of the episode [orbits].
        orbits: f64,
    },
    /// Nobody teaches.
    #[error("there is no teacher to learn from")]
    NoTeacher,
    /// A teacher that images nothing.
    #[error("the teacher {name} has waited for a day")]
    Idle {
        /// Name of the planner.
        name: String,
    },
    /// A planner or a decision that fails.
    #[error(transparent)]
    Planner(#[from] PlannerError),
}

/// The decision that an action stands for: T_pre is rounded up to whole ticks.
#[must_use]
pub fn decision(model: &Model, action: Action) -> Decision {
    let t_pre_s = action.parameter * model.config.planning.t_pre_max_s;
    Decision::Image { candidate: action.token, t_pre: model.period.ticks_ceil(t_pre_s).min(model.t_pre_max()) }
}

/// What is done when there is no strip to choose.
#[must_use]
pub fn wait(model: &Model) -> Decision {
    Decision::Wait { ticks: model.period.ticks_ceil(WAIT_S).max(1) }
}

/// Episodes of strip imaging, one task a step, each a pure function of its seed and the actions.
///
/// ```
/// use std::sync::Arc;
///
/// use swath_sim::learn::episode::EpisodeConfig;
/// use swath_sim::learn::hybrid::{Action, Episode};
/// use swath_sim::learn::observation::ObservationSet;
/// use swath_sim::vehicle::model::Model;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let model = Arc::new(Model::new(Default::default())?);
/// let mut episode = Episode::new(model, EpisodeConfig::default(), ObservationSet::Table1);
/// episode.begin(1)?;
/// let shape = episode.shape();
/// let (mut features, mut valid) = (vec![0.0; shape.len()], vec![false; shape.tokens]);
/// episode.observe(&mut features, &mut valid)?;
/// let token = valid.iter().position(|it| *it).expect("there is a strip to choose");
/// // Two minutes before imaging, the longest transition.
/// let outcome = episode.step(Action { token, parameter: 1.0 })?;
/// assert!(outcome.duration_s > 120.0);
/// # Ok(())
/// # }
/// ```
pub struct Episode {
    model: Arc<Model>,
    config: EpisodeConfig,
    set: ObservationSet,
    env: Option<Env>,
    teacher: Option<Teacher>,
}

/// A planner that is learned from in the present episode.
struct Teacher {
    planner: Box<dyn Planner + Send>,
    /// Time that it has waited since the last step [s].
    waited_s: f64,
}

impl Episode {
    /// Episodes that are still to begin, observed through `set`.
    #[must_use]
    pub fn new(model: Arc<Model>, config: EpisodeConfig, set: ObservationSet) -> Self {
        Self { model, config, set, env: None, teacher: None }
    }

    /// Begins the episode of a seed, without a teacher, at its first strip.
    ///
    /// # Errors
    /// An episode none of whose strips can be reached.
    pub fn begin(&mut self, seed: u64) -> Result<(), LearnError> {
        let env = Env::episode(self.model.clone(), &self.config, seed);
        self.begin_in(env, seed, self.config.scenario.count_of(seed))
    }

    /// Begins an episode in a simulation made for it, in which `asked` strips were asked for.
    ///
    /// # Errors
    /// An episode none of whose strips can be reached.
    pub fn begin_in(&mut self, env: Env, seed: u64, asked: usize) -> Result<(), LearnError> {
        self.env = Some(env);
        self.teacher = None;
        let (_, found) = self.wait_for_candidates()?;
        if !found {
            return Err(LearnError::NoStrip { seed, asked, orbits: self.config.orbits });
        }
        Ok(())
    }

    /// Takes a planner as the teacher of the present episode.
    pub fn follow(&mut self, planner: Box<dyn Planner + Send>) {
        self.teacher = Some(Teacher { planner, waited_s: 0.0 });
    }

    /// The satellite.
    #[must_use]
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The simulation as the present episode has it.
    ///
    /// # Errors
    /// Before [`Episode::begin`].
    pub fn env(&self) -> Result<&Env, LearnError> {
        self.env.as_ref().ok_or(LearnError::NoEpisode)
    }

    /// Size of the observations.
    #[must_use]
    pub fn shape(&self) -> ObservationShape {
        ObservationShape { tokens: self.model.config.planning.candidates, features: self.set.features() }
    }

    /// Writes the present observation; see [`crate::learn::observation::observe`].
    ///
    /// # Errors
    /// Before [`Episode::begin`].
    pub fn observe(&self, features: &mut [f32], valid: &mut [bool]) -> Result<(), LearnError> {
        self.env()?.observe(self.set, features, valid);
        Ok(())
    }

    /// Flies an action to its end, and on to where there is a strip to choose. An episode that has none left is over, and
    /// so is one whose satellite failed: an empty battery, a wheel that turns too fast.
    ///
    /// # Errors
    /// A token without a strip; before [`Episode::begin`].
    pub fn step(&mut self, action: Action) -> Result<Outcome, LearnError> {
        let decision = decision(&self.model, action);
        let step = self.env.as_mut().ok_or(LearnError::NoEpisode)?.step(decision)?;
        let (waited, found) = if step.terminated { (0, false) } else { self.wait_for_candidates()? };
        let taught_s = self.teacher.as_mut().map_or(0.0, |teacher| std::mem::take(&mut teacher.waited_s));
        let period = self.model.period;
        Ok(Outcome {
            reward: step.reward,
            duration_s: period.duration_s(step.record.ticks()) + (period.duration_s(waited) + taught_s),
            success: step.record.success(),
            failure: step.record.outcome.failure,
            progress: match (found, step.truncated) {
                (false, _) => Progress::Terminated,
                (true, true) => Progress::Truncated,
                (true, false) => Progress::Continues,
            },
        })
    }

    /// What the teacher does next. Where it would wait, time moves on first, which counts to the duration of the next
    /// step.
    ///
    /// # Errors
    /// An episode without a teacher, one that fails, and one that images nothing for a day.
    pub fn teach(&mut self) -> Result<Action, LearnError> {
        let teacher = self.teacher.as_mut().ok_or(LearnError::NoTeacher)?;
        let env = self.env.as_mut().ok_or(LearnError::NoEpisode)?;
        loop {
            match teacher.planner.decide(&env.context())? {
                Decision::Wait { .. } | Decision::Serve { .. } if teacher.waited_s > LONGEST_LESSON_WAIT_S => {
                    return Err(LearnError::Idle { name: teacher.planner.name() });
                }
                decision @ (Decision::Wait { ticks } | Decision::Serve { ticks, .. }) => {
                    env.step(decision)?;
                    teacher.waited_s += self.model.period.duration_s(ticks);
                }
                Decision::Image { candidate, t_pre } => {
                    let longest_s = self.model.config.planning.t_pre_max_s;
                    return Ok(Action { token: candidate, parameter: self.model.period.duration_s(t_pre) / longest_s });
                }
            }
        }
    }

    /// One orbit [s].
    #[must_use]
    pub fn orbit_s(&self) -> f64 {
        self.model.period.time_s(horizon(&self.model, 1.0))
    }

    /// Waits until there is a strip to choose; how long that took [ticks], and whether there is one. There is none when
    /// the episode's length is reached before.
    fn wait_for_candidates(&mut self) -> Result<(u32, bool), LearnError> {
        let wait = wait(&self.model);
        let env = self.env.as_mut().ok_or(LearnError::NoEpisode)?;
        let mut waited = 0;
        while env.context().candidates.is_empty() {
            if env.truncated() {
                return Ok((waited, false));
            }
            waited += env.step(wait)?.record.ticks();
        }
        Ok((waited, true))
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;
    use crate::config::SimConfig;
    use crate::planner::PlannerSpec;

    /// Few strips, so that a teacher has to wait now and then.
    fn episode(strips: u32) -> Episode {
        let mut config = EpisodeConfig { orbits: 1.0, ..EpisodeConfig::default() };
        config.scenario.count = [strips; 2];
        Episode::new(Arc::new(Model::new(SimConfig::default()).unwrap()), config, ObservationSet::Table1)
    }

    fn planner(name: &str, seed: u64) -> Box<dyn Planner + Send> {
        name.parse::<PlannerSpec>().unwrap().hand_written(seed).unwrap()
    }

    #[test]
    fn what_is_taught_is_what_the_teacher_flies() {
        let (mut episode, seed) = (episode(150), 3);
        episode.begin(seed).unwrap();
        episode.follow(planner("heuristic:90", seed));
        let started = episode.env().unwrap().now();
        let (mut taught, mut seconds) = (Vec::new(), 0.0);
        loop {
            let action = episode.teach().unwrap();
            assert_abs_diff_eq!(action.parameter, 90.0 / 120.0);
            let outcome = episode.step(action).unwrap();
            taught.push((outcome.reward, outcome.success));
            seconds += outcome.duration_s;
            if outcome.progress != Progress::Continues {
                break;
            }
        }
        let period = episode.model.period;
        let ended = episode.env().unwrap().now();
        assert_abs_diff_eq!(seconds, period.time_s(ended) - period.time_s(started), epsilon = 1e-6);

        let mut env = Env::episode(episode.model.clone(), &episode.config, seed);
        let mut planner = planner("heuristic:90", seed);
        let (mut flown, mut waits) = (Vec::new(), 0);
        while !env.truncated() {
            let decision = planner.decide(&env.context()).unwrap();
            let step = env.step(decision).unwrap();
            match decision {
                Decision::Image { .. } => flown.push((step.reward, step.record.success())),
                Decision::Wait { .. } | Decision::Serve { .. } => waits += 1,
            }
        }
        assert!(waits > 0 && flown.len() > 10, "{waits} {}", flown.len());
        assert_eq!(taught[..flown.len()], flown);
    }

    #[test]
    fn exact_transitions_survive_being_taught() {
        let mut episode = episode(150);
        episode.begin(5).unwrap();
        episode.follow(planner("lookahead:0", 5));
        for _ in 0..20 {
            let action = episode.teach().unwrap();
            let ticks = action.parameter * f64::from(episode.model.t_pre_max());
            let Decision::Image { t_pre, .. } = decision(&episode.model, action) else { panic!("it images") };
            assert_abs_diff_eq!(f64::from(t_pre), ticks, epsilon = 1e-6);
            assert!(episode.step(action).unwrap().success);
        }
    }

    #[test]
    fn nothing_is_taught_without_a_teacher_and_nothing_happens_before_the_beginning() {
        let mut episode = episode(150);
        assert!(matches!(episode.teach(), Err(LearnError::NoTeacher)));
        assert!(matches!(episode.step(Action { token: 0, parameter: 0.5 }), Err(LearnError::NoEpisode)));
        episode.begin(1).unwrap();
        assert!(matches!(episode.teach(), Err(LearnError::NoTeacher)));
    }

    #[test]
    fn an_episode_whose_last_strip_is_gone_is_over() {
        let mut episode = episode(3);
        assert!((0..50).any(|seed| episode.begin(seed).is_ok()));
        let mut seconds = 0.0;
        let started = episode.env().unwrap().now();
        loop {
            let outcome = episode.step(Action { token: 0, parameter: 1.0 }).unwrap();
            seconds += outcome.duration_s;
            if outcome.progress != Progress::Continues {
                assert_eq!(outcome.progress, Progress::Terminated);
                break;
            }
        }
        let env = episode.env().unwrap();
        assert!(env.context().candidates.is_empty() && env.truncated());
        let period = episode.model.period;
        assert_abs_diff_eq!(seconds, period.time_s(env.now()) - period.time_s(started), epsilon = 1e-6);
    }

    #[test]
    fn an_episode_without_a_strip_does_not_begin() {
        let error = episode(0).begin(4).unwrap_err().to_string();
        assert_eq!(error, "the episode of seed 4 asks for 0 strips, and none can be reached within its 1 orbits");
    }
}
