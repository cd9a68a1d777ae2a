//! The planner node without ROS: it decides when both the situation and the candidates of a task are known.

use swath_sim::planner::{Decision, DecisionContext, Planner, Rationale, Shield, decide};
use swath_sim::requests::catalogue::Candidate;
use swath_sim::task::{Task, TaskRecord};
use swath_sim::vehicle::flight::Situation;
use swath_sim::vehicle::model::Model;

use swath_mission::approval::{Gate, GatedPlanner};

/// The candidates of a task.
#[derive(Clone, Debug, PartialEq)]
pub struct Upcoming {
    /// Number of the task.
    pub task: u64,
    /// The candidates.
    pub candidates: Vec<Candidate>,
}

/// A decision made.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// Number of the task.
    pub task: u64,
    /// Situation it rests on.
    pub situation: Situation,
    /// What was decided.
    pub decision: Decision,
    /// The task that follows from it.
    pub kind: Task,
    /// Name of the planner that decided.
    pub planner: String,
    /// Why the planner itself did not decide and the heuristic took over.
    pub fault: Option<String>,
    /// How it weighed the candidates.
    pub rationale: Option<Rationale>,
}

/// The planner node's state.
pub struct PlannerLogic {
    model: Model,
    planner: GatedPlanner,
    /// What keeps the planner from what the battery does not last for.
    shield: Option<Shield>,
    point: Option<(u64, Situation, Option<TaskRecord>)>,
    upcoming: Option<Upcoming>,
    decided: Option<u64>,
}

impl PlannerLogic {
    /// A planner node around a planner.
    #[must_use]
    pub fn new(model: Model, planner: GatedPlanner) -> Self {
        Self { shield: Shield::new(&model), model, planner, point: None, upcoming: None, decided: None }
    }

    /// A task is wanted; `previous` is the one that ended here.
    pub fn on_decision_point(
        &mut self,
        task: u64,
        situation: Situation,
        previous: Option<TaskRecord>,
    ) -> Option<Planned> {
        self.point = Some((task, situation, previous));
        self.decide()
    }

    /// The candidates of a task are known.
    pub fn on_upcoming(&mut self, upcoming: Upcoming) -> Option<Planned> {
        self.upcoming = Some(upcoming);
        self.decide()
    }

    /// What the planner may do by itself.
    #[must_use]
    pub fn gate(&self) -> &Gate {
        &self.planner.gate
    }

    /// What the planner may do by itself.
    pub fn gate_mut(&mut self) -> &mut Gate {
        &mut self.planner.gate
    }

    /// Name of the planner.
    #[must_use]
    pub fn planner_name(&self) -> String {
        self.planner.name()
    }

    /// The candidates that the last decision rested on.
    #[must_use]
    pub fn upcoming(&self) -> Option<&Upcoming> {
        self.upcoming.as_ref()
    }

    fn decide(&mut self) -> Option<Planned> {
        let &(task, situation, ref previous) = self.point.as_ref()?;
        let upcoming = self.upcoming.as_ref().filter(|upcoming| upcoming.task == task)?;
        if self.decided.is_some_and(|decided| decided >= task) {
            return None;
        }
        let candidates = &upcoming.candidates;
        let (previous, model) = (previous.as_ref(), &self.model);
        let context = DecisionContext { task, situation: &situation, candidates, previous, model };
        let decision = decide(self.shield.as_ref(), &context, &mut self.planner).ok()?;
        let kind = decision.to_task(&context).ok()?;
        self.decided = Some(task);
        Some(Planned {
            task,
            situation,
            decision,
            kind,
            planner: self.planner.name(),
            fault: self.planner.replaced().map(str::to_owned),
            rationale: self.planner.rationale(),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use swath_sim::config::SimConfig;
    use swath_sim::learn::episode::{Env, EpisodeConfig};
    use swath_sim::planner::{Heuristic, PlannerError};

    use super::*;
    use swath_mission::approval::ApprovalConfig;
    use swath_mission::fallback::GuardedPlanner;

    fn logic(env: &Env, planner: impl Planner + Send + 'static) -> PlannerLogic {
        let gate = Gate::new(&ApprovalConfig::default(), env.model().period);
        let planner = GatedPlanner { gate, planner: GuardedPlanner::new(Box::new(planner)) };
        PlannerLogic::new((**env.model()).clone(), planner)
    }

    struct Broken;

    impl Planner for Broken {
        fn name(&self) -> String {
            "broken".to_owned()
        }

        fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
            Ok(Decision::Image { candidate: context.candidates.len(), t_pre: 0 })
        }
    }

    /// Waits as long as the last task's transition was.
    struct Echo;

    impl Planner for Echo {
        fn name(&self) -> String {
            "echo".to_owned()
        }

        fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
            Ok(Decision::Wait { ticks: context.previous.map_or(1, |previous| previous.t_pre) })
        }
    }

    fn env() -> Env {
        Env::episode(Arc::new(Model::new(SimConfig::default()).unwrap()), &EpisodeConfig::default(), 2)
    }

    fn upcoming(env: &Env, task: u64) -> Upcoming {
        Upcoming { task, candidates: env.context().candidates.to_vec() }
    }

    #[test]
    fn it_decides_once_when_both_halves_are_there_in_either_order() {
        let env = env();
        let situation = *env.context().situation;
        let make = || logic(&env, Heuristic { t_pre_s: 90.0 });
        let mut first = make();
        assert_eq!(first.on_decision_point(0, situation, None), None);
        let planned = first.on_upcoming(upcoming(&env, 0)).unwrap();
        assert_eq!(first.on_decision_point(0, situation, None), None, "a repeated question is not answered twice");
        let mut second = make();
        assert_eq!(second.on_upcoming(upcoming(&env, 0)), None);
        assert_eq!(second.on_decision_point(0, situation, None), Some(planned));
        assert_eq!(second.on_decision_point(1, situation, None), None, "candidates of another task do not count");
    }

    #[test]
    fn the_planner_is_told_how_the_last_task_went() {
        let mut env = env();
        let mut logic = logic(&env, Echo);
        logic.on_decision_point(0, *env.context().situation, None);
        assert_eq!(logic.on_upcoming(upcoming(&env, 0)).unwrap().decision, Decision::Wait { ticks: 1 });
        let record = env.step(Decision::Image { candidate: 0, t_pre: 97 }).unwrap().record;
        logic.on_decision_point(1, *env.context().situation, Some(record));
        assert_eq!(logic.on_upcoming(upcoming(&env, 1)).unwrap().decision, Decision::Wait { ticks: 97 });
    }

    #[test]
    fn the_heuristic_takes_over_from_a_planner_that_fails() {
        let env = env();
        let mut logic = logic(&env, Broken);
        logic.on_decision_point(0, *env.context().situation, None);
        let planned = logic.on_upcoming(upcoming(&env, 0)).unwrap();
        assert_eq!(planned.planner, "heuristic:90");
        assert!(planned.fault.unwrap().contains("candidate 40 was chosen of 40"));
    }
}
