//! Strip imaging as the trainer's environment: an [`Episode`] behind [`Environment`], with any planner as its teacher.

use std::sync::Arc;

use swath_sim::learn::hybrid::Episode;
use swath_sim::planner::PlannerSpec;
use swath_sim::vehicle::model::Model;

use crate::config::StripsConfig;
use crate::environment::{Action, Environment, ObservationShape, Outcome};
use crate::error::{Result, TrainingError};
use crate::planners;

pub use swath_sim::learn::hybrid::decision;

/// Strip imaging, one task a step.
pub struct Strips {
    episode: Episode,
    teacher: Option<PlannerSpec>,
}

impl Strips {
    /// Strip imaging as a run configures it.
    ///
    /// # Errors
    /// A setting of the simulation that is out of range.
    pub fn new(config: &StripsConfig) -> Result<Self> {
        let model = Model::new(config.simulation.clone())?;
        let episode = Episode::new(Arc::new(model), config.episode.clone(), config.observation);
        Ok(Self { episode, teacher: None })
    }

    /// The same with a teacher.
    ///
    /// # Errors
    /// A planner that cannot be made.
    pub fn with_teacher(mut self, spec: PlannerSpec) -> Result<Self> {
        planners::make(&spec, 0)?;
        self.teacher = Some(spec);
        Ok(self)
    }
}

impl Environment for Strips {
    fn shape(&self) -> ObservationShape {
        self.episode.shape()
    }

    fn reset(&mut self, seed: u64) -> Result<()> {
        self.episode.begin(seed).map_err(TrainingError::environment)?;
        if let Some(spec) = &self.teacher {
            // A planner may remember what it flew: each episode has a fresh one.
            self.episode.follow(planners::make(spec, seed)?);
        }
        Ok(())
    }

    fn observe(&self, features: &mut [f32], valid: &mut [bool]) -> Result<()> {
        self.episode.observe(features, valid).map_err(TrainingError::environment)
    }

    fn step(&mut self, action: Action) -> Result<Outcome> {
        self.episode.step(action).map_err(TrainingError::environment)
    }

    fn reporting_period_s(&self) -> f64 {
        self.episode.orbit_s()
    }

    fn parameter_scale_s(&self) -> f64 {
        self.episode.model().config.planning.t_pre_max_s
    }

    fn teach(&mut self) -> Result<Action> {
        self.episode.teach().map_err(TrainingError::environment)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_taught_without_a_teacher() {
        let mut config = StripsConfig::default();
        config.episode.orbits = 1.0;
        config.episode.scenario.count = [150, 150];
        let mut strips = Strips::new(&config).unwrap();
        strips.reset(1).unwrap();
        assert!(strips.teach().unwrap_err().to_string().contains("there is no teacher"));
        let mut strips = strips.with_teacher(PlannerSpec::Heuristic(90.0)).unwrap();
        assert!(strips.teach().is_err(), "the teacher comes with the next episode");
        strips.reset(1).unwrap();
        assert_eq!(strips.teach().unwrap().parameter, 0.75);
    }
}
