//! The guidance node without ROS: it flies the active task and says when one has ended.

use std::collections::VecDeque;

use nalgebra::Vector3;
use swath_sim::model::Model;
use swath_sim::task::{Task, TaskOutcome, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::Situation;
use swath_sim::vehicle::guidance::{Guidance, GuidanceTick};
use swath_sim::world::strip::StripId;
use thiserror::Error;

use swath_sim::vehicle::spacecraft::StateSample;

/// A task as the planner gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskOrder {
    /// Number of the task.
    pub task: u64,
    /// What to do.
    pub kind: Task,
    /// The strip and its name; `None` for a wait.
    pub strip: Option<(StripId, String)>,
}

/// Why a task is not taken.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum TaskError {
    /// Another task is wanted, or none.
    #[error("task {task} is not the one wanted ({})", wanted.map_or("none is".to_owned(), |task| task.to_string()))]
    NotWanted {
        /// Number given.
        task: u64,
        /// Number wanted.
        wanted: Option<u64>,
    },
    /// The transition is longer than allowed.
    #[error("task {task}: a transition of {t_pre} ticks exceeds the longest, {max}")]
    TransitionTooLong {
        /// Number of the task.
        task: u64,
        /// Transition [ticks].
        t_pre: u32,
        /// Longest [ticks].
        max: u32,
    },
    /// The task would take no time.
    #[error("task {task} has no length")]
    Empty {
        /// Number of the task.
        task: u64,
    },
}

/// A finished task.
#[derive(Clone, Debug, PartialEq)]
pub struct FinishedTask {
    /// How it went.
    pub record: TaskRecord,
    /// Name of its strip; empty for a wait.
    pub name: String,
}

/// A task is wanted, or the mission is over.
#[derive(Clone, Debug, PartialEq)]
pub struct DecisionPoint {
    /// Number of the task wanted.
    pub task: u64,
    /// State that the decision rests on.
    pub state: StateSample,
    /// What else a planner may know.
    pub situation: Situation,
    /// Whether the mission is over: no task is wanted.
    pub mission_over: bool,
    /// The task that just ended.
    pub finished: Option<FinishedTask>,
    /// The last task that imaged a strip, for those who were away when it ended.
    pub last_imaging: Option<FinishedTask>,
}

/// What guidance does at a tick.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// A torque command.
    Command(Command),
    /// A task is wanted; the tick's command follows when it has come.
    Decide(Box<DecisionPoint>),
}

/// The command of a tick, and what it rests on.
#[derive(Clone, Debug, PartialEq)]
pub struct Command {
    /// Tick of the state.
    pub tick: Tick,
    /// Number of the task in hand.
    pub task: u64,
    /// Torque and tracking error.
    pub guidance: GuidanceTick,
    /// Whether a strip is in hand.
    pub has_strip: bool,
    /// Ticks that remain of the transition, the imaging or the wait.
    pub remaining: u32,
}

/// The guidance node's state.
#[derive(Clone, Debug)]
pub struct GuidanceLogic {
    model: Model,
    guidance: Guidance,
    horizon: Tick,
    hold: u32,
    task: u64,
    active: Option<Active>,
    /// The state at which a task is wanted, then states that came meanwhile.
    waiting: VecDeque<StateSample>,
    latest: Option<Command>,
    torque_pending: Vector3<f64>,
    last_imaging: Option<FinishedTask>,
    /// Number of a task in hand that is given up at the next state.
    aborted: Option<u64>,
    /// Tasks that did not come in time.
    pub late: u64,
}

#[derive(Clone, Debug)]
struct Active {
    order: TaskOrder,
    start: Tick,
}

impl GuidanceLogic {
    /// Guidance at the epoch of a mission that ends at `horizon`; without a task in time the attitude is held for `hold`
    /// ticks.
    #[must_use]
    pub fn new(model: Model, horizon: Tick, hold: u32) -> Self {
        Self {
            guidance: Guidance::new(&model),
            model,
            horizon,
            hold: hold.max(1),
            task: 0,
            active: None,
            waiting: VecDeque::new(),
            latest: None,
            torque_pending: Vector3::zeros(),
            last_imaging: None,
            aborted: None,
            late: 0,
        }
    }

    /// Number of the task wanted now.
    #[must_use]
    pub fn wanted(&self) -> Option<u64> {
        self.waiting.front().map(|_| self.task)
    }

    /// Number and name of the strip in hand.
    #[must_use]
    pub fn strip(&self) -> Option<&(StripId, String)> {
        self.active.as_ref()?.order.strip.as_ref()
    }

    /// Takes a state. A state seen before brings its command again, so that a lost sample stops nothing.
    pub fn on_state(&mut self, state: StateSample) -> Vec<Effect> {
        if let Some(latest) = &self.latest
            && state.tick <= latest.tick
        {
            return if state.tick == latest.tick { vec![Effect::Command(latest.clone())] } else { Vec::new() };
        }
        if !self.waiting.is_empty() {
            if self.waiting.iter().all(|waiting| waiting.tick < state.tick) {
                self.waiting.push_back(state);
            }
            return Vec::new();
        }
        self.process(state)
    }

    /// Takes the task wanted.
    ///
    /// # Errors
    /// When the task is not the one wanted, or is none that can be flown.
    pub fn on_task(&mut self, order: TaskOrder) -> Result<Vec<Effect>, TaskError> {
        let task = order.task;
        if self.wanted() != Some(task) {
            return Err(TaskError::NotWanted { task, wanted: self.wanted() });
        }
        if order.kind.ticks() == 0 {
            return Err(TaskError::Empty { task });
        }
        if let Task::Image { t_pre, .. } = order.kind {
            let max = self.model.t_pre_max();
            if t_pre > max {
                return Err(TaskError::TransitionTooLong { task, t_pre, max });
            }
        }
        Ok(self.begin(order))
    }

    /// The task wanted has not come in time: holds the attitude for a while, then asks again.
    pub fn on_deadline(&mut self) -> Vec<Effect> {
        if self.wanted().is_none() {
            return Vec::new();
        }
        self.late += 1;
        self.begin(TaskOrder { task: self.task, kind: Task::Wait { ticks: self.hold }, strip: None })
    }

    /// A task is no longer wanted: it ends at the next state, unless imaging has begun. Returns whether it ends.
    pub fn on_abort(&mut self, task: u64) -> bool {
        let slewing = match (&self.active, &self.latest) {
            (Some(active), Some(latest)) => active.order.task == task && !latest.guidance.imaging,
            _ => false,
        };
        if slewing {
            self.aborted = Some(task);
        }
        slewing
    }

    fn begin(&mut self, order: TaskOrder) -> Vec<Effect> {
        let mut states = std::mem::take(&mut self.waiting);
        let Some(state) = states.pop_front() else { return Vec::new() };
        self.guidance.start(order.kind, state.tick, &state.body);
        self.active = Some(Active { order, start: state.tick });
        let mut effects = vec![self.fly(&state)];
        for state in states {
            effects.extend(self.on_state(state));
        }
        effects
    }

    fn process(&mut self, state: StateSample) -> Vec<Effect> {
        let aborted = self.aborted.take().is_some_and(|task| self.may_end(task, &state));
        let ended = aborted || self.guidance.end().is_some_and(|end| state.tick >= end);
        let over = state.tick >= self.horizon;
        let finished = if ended || over { self.finish(&state) } else { None };
        if self.active.is_some() {
            return vec![self.fly(&state)];
        }
        let situation = Situation {
            now: state.tick,
            r_BN_N: state.r_BN_N,
            v_BN_N: state.v_BN_N,
            body: state.body,
            servo_integral: self.guidance.servo_integral,
            torque_pending: self.torque_pending,
        };
        if !over {
            self.waiting.push_back(state);
        }
        vec![Effect::Decide(Box::new(DecisionPoint {
            task: self.task,
            state,
            situation,
            mission_over: over,
            finished,
            last_imaging: self.last_imaging.clone(),
        }))]
    }

    /// Whether a task is in hand whose imaging has not begun at a state.
    fn may_end(&self, task: u64, state: &StateSample) -> bool {
        self.active.as_ref().is_some_and(|active| match active.order.kind {
            Task::Image { t_pre, .. } => active.order.task == task && state.tick < active.start.after(t_pre),
            Task::Wait { .. } => false,
        })
    }

    fn finish(&mut self, state: &StateSample) -> Option<FinishedTask> {
        let Active { order, start } = self.active.take()?;
        let outcome = self.guidance.finish(state.tick, &state.r_BN_N, &state.body).unwrap_or(TaskOutcome::NOT_BEGUN);
        let (t_pre, t_acq, priority) = match order.kind {
            Task::Image { strip, t_pre, t_acq } => (t_pre, t_acq, strip.priority),
            Task::Wait { .. } => (0, 0, 0.0),
        };
        let (strip, name) = order.strip.map_or((None, String::new()), |(id, name)| (Some(id), name));
        let reward = if strip.is_some() && outcome.failure.is_none() { priority } else { 0.0 };
        let record = TaskRecord { task: order.task, start, end: state.tick, strip, t_pre, t_acq, outcome, reward };
        self.task += 1;
        let finished = FinishedTask { record, name };
        if finished.record.strip.is_some() {
            self.last_imaging = Some(finished.clone());
        }
        Some(finished)
    }

    fn fly(&mut self, state: &StateSample) -> Effect {
        let guidance = self.guidance.tick(state.tick, &state.r_BN_N, &state.body);
        self.torque_pending = guidance.torque;
        let (has_strip, remaining) = match &self.active {
            Some(Active { order: TaskOrder { kind: Task::Image { t_pre, t_acq, .. }, .. }, start }) => {
                let flown = state.tick.since(*start) as u32;
                (true, if flown < *t_pre { t_pre - flown } else { (t_pre + t_acq).saturating_sub(flown) })
            }
            Some(Active { order, start }) => (false, order.kind.ticks() - state.tick.since(*start) as u32),
            None => (false, 0),
        };
        let command = Command { tick: state.tick, task: self.task, guidance, has_strip, remaining };
        self.latest = Some(command.clone());
        Effect::Command(command)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use swath_sim::config::SimConfig;
    use swath_sim::learn::env::{Env, EpisodeConfig};
    use swath_sim::planner::{Decision, Heuristic, Planner};
    use swath_sim::rng;
    use swath_sim::vehicle::initial::InitialState;

    use super::*;
    use crate::spacecraft::logic::SpacecraftLogic;

    const SEED: u64 = 4;

    fn model() -> Model {
        Model::new(SimConfig::default()).unwrap()
    }

    /// Spacecraft and guidance as two nodes with two ticks under way, against the environment in one process.
    #[test]
    fn two_nodes_fly_what_the_environment_flies() {
        let model = model();
        let config = EpisodeConfig { orbits: 0.5, ..EpisodeConfig::evaluation() };
        let mut env = Env::episode(Arc::new(model.clone()), &config, SEED);
        let initial = InitialState::draw(&model.config, &mut rng::stream(SEED, rng::INITIAL_STATE));
        let mut spacecraft = SpacecraftLogic::new(&model, &initial, env.horizon());
        let mut guidance = GuidanceLogic::new(model, env.horizon(), 20);
        let mut planner = Heuristic { t_pre_s: 60.0 };
        let mut states = VecDeque::from([spacecraft.sample()]);
        let mut over = false;
        while !over {
            let mut effects = VecDeque::new();
            if spacecraft.ready() && !spacecraft.done() {
                states.push_back(spacecraft.advance());
            }
            if let Some(state) = states.pop_front() {
                effects.extend(guidance.on_state(state));
            }
            while let Some(effect) = effects.pop_front() {
                match effect {
                    Effect::Command(command) => spacecraft.command(command.tick, command.guidance.torque).unwrap(),
                    Effect::Decide(point) => {
                        over = point.mission_over;
                        let decision = planner.decide(&env.context()).unwrap();
                        assert_eq!(&point.situation, env.context().situation);
                        if let Some(finished) = &point.finished {
                            assert_eq!(finished.record.end, env.now());
                        }
                        if over {
                            break;
                        }
                        let kind = decision.to_task(&env.context()).unwrap();
                        let strip = match decision {
                            Decision::Image { candidate, .. } => {
                                Some((env.context().candidates[candidate].id, "strip".to_owned()))
                            }
                            Decision::Wait { .. } => None,
                        };
                        let order = TaskOrder { task: point.task, kind, strip };
                        let expected = env.step_to_horizon(decision).unwrap().record;
                        effects.extend(guidance.on_task(order).unwrap());
                        assert_eq!(expected.task, point.task);
                    }
                }
            }
        }
        assert!(env.truncated());
        assert!(guidance.task > 20, "only {} tasks", guidance.task);
        assert_eq!((spacecraft.missed, guidance.late), (0, 0));
    }

    #[test]
    fn a_late_task_is_replaced_by_holding_the_attitude() {
        let model = model();
        let initial = InitialState::draw(&model.config, &mut rng::stream(SEED, rng::INITIAL_STATE));
        let mut spacecraft = SpacecraftLogic::new(&model, &initial, Tick(100));
        let mut guidance = GuidanceLogic::new(model, Tick(100), 10);
        assert!(matches!(guidance.on_state(spacecraft.sample())[..], [Effect::Decide(_)]));
        assert!(guidance.on_state(spacecraft.advance()).is_empty(), "the next state waits for the task");
        let effects = guidance.on_deadline();
        assert!(matches!(effects[..], [Effect::Command(_), Effect::Command(_)]));
        assert_eq!(guidance.late, 1);
        let order = TaskOrder { task: 0, kind: Task::Wait { ticks: 5 }, strip: None };
        assert_eq!(guidance.on_task(order), Err(TaskError::NotWanted { task: 0, wanted: None }));
    }

    #[test]
    fn a_task_is_given_up_while_slewing_and_not_once_imaging_has_begun() {
        let model = model();
        let env = Env::episode(Arc::new(model.clone()), &EpisodeConfig::evaluation(), SEED);
        let candidate = env.context().candidates[0];
        let initial = InitialState::draw(&model.config, &mut rng::stream(SEED, rng::INITIAL_STATE));
        for (ticks, given_up) in [(10, true), (60, false)] {
            let mut spacecraft = SpacecraftLogic::new(&model, &initial, Tick(1000));
            let mut guidance = GuidanceLogic::new(model.clone(), Tick(1000), 10);
            guidance.on_state(spacecraft.sample());
            let kind = Task::Image { strip: candidate.strip, t_pre: 40, t_acq: candidate.t_acq };
            let order = TaskOrder { task: 0, kind, strip: Some((candidate.id, "strip".to_owned())) };
            guidance.on_task(order).unwrap();
            let mut sample = |guidance: &mut GuidanceLogic| {
                let effects = guidance.on_state(spacecraft.advance());
                if let Some(Effect::Command(command)) = effects.first() {
                    spacecraft.command(command.tick, command.guidance.torque).unwrap();
                }
                effects
            };
            for _ in 1..ticks {
                sample(&mut guidance);
            }
            assert!(!guidance.on_abort(7), "another task");
            assert_eq!(guidance.on_abort(0), given_up);
            match &sample(&mut guidance)[..] {
                [Effect::Decide(point)] => {
                    let finished = point.finished.as_ref().unwrap();
                    assert!(given_up);
                    assert_eq!(finished.record.outcome, TaskOutcome::NOT_BEGUN);
                    assert_eq!(finished.record.end, Tick(ticks));
                    assert_eq!(point.last_imaging.as_ref(), Some(finished));
                }
                effects => assert!(!given_up, "{effects:?}"),
            }
        }
    }
}
