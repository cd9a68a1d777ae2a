//! Strip imaging as the trainer's environment: the `sim` crate behind [`Environment`].

use std::sync::Arc;

use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::learn::observation::ObservationSet;
use swath_sim::model::Model;
use swath_sim::planner::{Decision, Planner, PlannerSpec};

use crate::config::StripsConfig;
use crate::environment::{Action, Environment, ObservationShape, Outcome, Progress};
use crate::error::{Result, TrainingError};
use crate::planners;

/// How long to wait when no strip is left to choose from [s].
pub(crate) const WAIT_S: f64 = 60.0;

/// Longest time that a teacher may wait before a strip [s].
const LONGEST_LESSON_WAIT_S: f64 = 86_400.0;

/// Strip imaging, one task a step.
pub struct Strips {
    model: Arc<Model>,
    episode: EpisodeConfig,
    set: ObservationSet,
    env: Option<Env>,
    teacher: Option<Teacher>,
}

/// A planner that the policy may learn from.
struct Teacher {
    spec: PlannerSpec,
    planner: Box<dyn Planner + Send>,
    /// Time that it has waited since the last step [s].
    waited_s: f64,
}

impl Strips {
    /// Strip imaging as a run configures it.
    ///
    /// # Errors
    /// A setting of the simulation that is out of range.
    pub fn new(config: &StripsConfig) -> Result<Strips> {
        let model = Model::new(config.simulation.clone()).map_err(failed)?;
        Ok(Strips {
            model: Arc::new(model),
            episode: config.episode.clone(),
            set: config.observation,
            env: None,
            teacher: None,
        })
    }

    /// The same with a teacher.
    ///
    /// # Errors
    /// A planner that cannot be made.
    pub fn with_teacher(mut self, spec: PlannerSpec) -> Result<Strips> {
        self.teacher = Some(Teacher::new(spec, 0)?);
        Ok(self)
    }

    fn env(&self) -> Result<&Env> {
        self.env.as_ref().ok_or_else(no_episode)
    }

    /// Waits until there is a strip to choose; returns the time that took [s].
    fn wait_for_candidates(&mut self) -> Result<f64> {
        let ticks = self.model.period.ticks_ceil(WAIT_S).max(1);
        let env = self.env.as_mut().ok_or_else(no_episode)?;
        let mut waited = 0;
        while env.context().candidates.is_empty() {
            if env.truncated() {
                return Err(failed("an episode has no strip left to choose from"));
            }
            env.step(Decision::Wait { ticks }).map_err(failed)?;
            waited += ticks;
        }
        Ok(self.model.period.duration_s(waited))
    }
}

impl Environment for Strips {
    fn shape(&self) -> ObservationShape {
        ObservationShape { tokens: self.model.config.planning.candidates, features: self.set.features() }
    }

    fn reset(&mut self, seed: u64) -> Result<()> {
        if let Some(teacher) = &mut self.teacher {
            // A planner may remember what it flew.
            *teacher = Teacher::new(teacher.spec.clone(), seed)?;
        }
        self.env = Some(Env::episode(self.model.clone(), &self.episode, seed));
        self.wait_for_candidates()?;
        Ok(())
    }

    fn observe(&self, features: &mut [f32], valid: &mut [bool]) -> Result<()> {
        self.env()?.observe(self.set, features, valid);
        Ok(())
    }

    fn step(&mut self, action: Action) -> Result<Outcome> {
        let decision = decision(&self.model, action);
        let env = self.env.as_mut().ok_or_else(no_episode)?;
        let step = env.step(decision).map_err(failed)?;
        let waited_s = self.wait_for_candidates()?
            + self.teacher.as_mut().map_or(0.0, |teacher| std::mem::take(&mut teacher.waited_s));
        Ok(Outcome {
            reward: step.reward,
            duration_s: self.model.period.duration_s(step.record.ticks()) + waited_s,
            success: step.record.success(),
            progress: if step.truncated { Progress::Truncated } else { Progress::Continues },
        })
    }

    fn reporting_period_s(&self) -> f64 {
        let orbit = swath_sim::mission::horizon(&self.model, 1.0);
        self.model.period.time_s(orbit)
    }

    fn parameter_scale_s(&self) -> f64 {
        self.model.config.planning.t_pre_max_s
    }

    fn teach(&mut self) -> Result<Action> {
        let teacher = self.teacher.as_mut().ok_or_else(|| failed("there is no teacher to learn from"))?;
        let longest_s = self.model.config.planning.t_pre_max_s;
        loop {
            let env = self.env.as_mut().ok_or_else(no_episode)?;
            match teacher.planner.decide(&env.context()).map_err(failed)? {
                Decision::Wait { .. } if teacher.waited_s > LONGEST_LESSON_WAIT_S => {
                    return Err(failed(format!("the teacher {} has waited for a day", teacher.spec)));
                }
                Decision::Wait { ticks } => {
                    env.step(Decision::Wait { ticks }).map_err(failed)?;
                    teacher.waited_s += self.model.period.duration_s(ticks);
                }
                Decision::Image { candidate, t_pre } => {
                    return Ok(Action { token: candidate, parameter: self.model.period.duration_s(t_pre) / longest_s });
                }
            }
        }
    }
}

impl Teacher {
    fn new(spec: PlannerSpec, seed: u64) -> Result<Teacher> {
        Ok(Teacher { planner: planners::make(&spec, seed)?, spec, waited_s: 0.0 })
    }
}

/// The decision that a policy's action stands for: T_pre is rounded up to whole ticks.
pub fn decision(model: &Model, action: Action) -> Decision {
    let t_pre_s = action.parameter * model.config.planning.t_pre_max_s;
    Decision::Image { candidate: action.token, t_pre: model.period.ticks_ceil(t_pre_s).min(model.t_pre_max()) }
}

fn failed(error: impl ToString) -> TrainingError {
    TrainingError::Environment(error.to_string())
}

fn no_episode() -> TrainingError {
    failed("no episode has begun")
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    /// Few strips, so that a teacher has to wait now and then.
    fn config() -> StripsConfig {
        let mut config = StripsConfig::default();
        config.episode.orbits = 1.0;
        config.episode.scenario.count = [150, 150];
        config
    }

    #[test]
    fn what_is_taught_is_what_the_teacher_flies() {
        let (config, seed) = (config(), 3);
        let mut strips = Strips::new(&config).unwrap().with_teacher(PlannerSpec::Heuristic(90.0)).unwrap();
        strips.reset(seed).unwrap();
        let started = strips.env().unwrap().now();
        let (mut taught, mut seconds) = (Vec::new(), 0.0);
        loop {
            let action = strips.teach().unwrap();
            assert_abs_diff_eq!(action.parameter, 90.0 / 120.0);
            let outcome = strips.step(action).unwrap();
            taught.push((outcome.reward, outcome.success));
            seconds += outcome.duration_s;
            if outcome.progress != Progress::Continues {
                break;
            }
        }
        let period = strips.model.period;
        assert_abs_diff_eq!(
            seconds,
            period.time_s(strips.env().unwrap().now()) - period.time_s(started),
            epsilon = 1e-6
        );

        let mut env = Env::episode(strips.model.clone(), &config.episode, seed);
        let mut planner = planners::make(&PlannerSpec::Heuristic(90.0), seed).unwrap();
        let (mut flown, mut waits) = (Vec::new(), 0);
        while !env.truncated() {
            let decision = planner.decide(&env.context()).unwrap();
            let step = env.step(decision).unwrap();
            match decision {
                Decision::Image { .. } => flown.push((step.reward, step.record.success())),
                Decision::Wait { .. } => waits += 1,
            }
        }
        assert!(waits > 0 && flown.len() > 10, "{waits} {}", flown.len());
        assert_eq!(taught[..flown.len()], flown);
    }

    #[test]
    fn exact_transitions_survive_being_taught() {
        let mut strips = Strips::new(&config()).unwrap().with_teacher(PlannerSpec::Lookahead(Some(0))).unwrap();
        strips.reset(5).unwrap();
        for _ in 0..20 {
            let action = strips.teach().unwrap();
            let ticks = action.parameter * f64::from(strips.model.t_pre_max());
            let Decision::Image { t_pre, .. } = decision(&strips.model, action) else { panic!("it images") };
            assert_abs_diff_eq!(f64::from(t_pre), ticks, epsilon = 1e-6);
            assert!(strips.step(action).unwrap().success);
        }
    }

    #[test]
    fn nothing_is_taught_without_a_teacher() {
        let mut strips = Strips::new(&config()).unwrap();
        strips.reset(1).unwrap();
        assert!(strips.teach().unwrap_err().to_string().contains("there is no teacher"));
    }
}
