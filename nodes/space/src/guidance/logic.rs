//! The guidance node without ROS: it flies the active task and says when one has ended.

use std::collections::VecDeque;

use nalgebra::Vector3;
use swath_sim::model::Model;
use swath_sim::task::{Task, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::vehicle::executive::{Executive, Sight};
use swath_sim::vehicle::flight::Situation;
use swath_sim::vehicle::guidance::GuidanceTick;
use swath_sim::vehicle::health::Health;
use swath_sim::vehicle::spacecraft::StateSample;
use swath_sim::world::strip::StripId;
use thiserror::Error;

/// A task as the planner gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskOrder {
    /// Number of the task.
    pub task: u64,
    /// What to do.
    pub kind: Task,
    /// Name of its strip; empty for a wait.
    pub name: String,
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
    executive: Executive,
    horizon: Tick,
    hold: u32,
    /// Time from a situation to the start of the task decided on it [ticks].
    planning_delay: u32,
    task: u64,
    /// Name of the strip in hand.
    name: String,
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

impl GuidanceLogic {
    /// Guidance at the epoch of a mission that ends at `horizon`; without a task in time the attitude is held for `hold`
    /// ticks.
    #[must_use]
    pub fn new(model: Model, horizon: Tick, hold: u32) -> Self {
        Self {
            executive: Executive::new(&model),
            model,
            horizon,
            hold: hold.max(1),
            planning_delay: 0,
            task: 0,
            name: String::new(),
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
    pub fn strip(&self) -> Option<(StripId, &str)> {
        Some((self.executive.task()?.0.strip()?, &self.name))
    }

    /// From now on this much time passes between a situation and the start of the task decided on it [ticks].
    #[must_use]
    pub fn with_planning_delay(mut self, ticks: u32) -> Self {
        self.planning_delay = ticks;
        self
    }

    /// From now on it watches wheels and sensors; `noisy` is whether the sensors are known to be.
    #[must_use]
    pub fn watching(mut self, noisy: bool) -> Self {
        self.executive = Executive::watching(&self.model, noisy);
        self
    }

    /// What came to be known of wheels and sensors since the last call, each with its tick.
    pub fn take_changes(&mut self) -> Vec<(Tick, Health)> {
        self.executive.take_changes()
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
        Ok(self.begin(order, self.planning_delay))
    }

    /// The task wanted has not come in time: holds the attitude for a while, then asks again.
    pub fn on_deadline(&mut self) -> Vec<Effect> {
        if self.wanted().is_none() {
            return Vec::new();
        }
        self.late += 1;
        self.begin(TaskOrder { task: self.task, kind: Task::Wait { ticks: self.hold }, name: String::new() }, 0)
    }

    /// A task is no longer wanted: it ends at the next state, unless imaging has begun. Returns whether it ends.
    pub fn on_abort(&mut self, task: u64) -> bool {
        let slewing = match (self.executive.number(), &self.latest) {
            (Some(number), Some(latest)) => number == task && !latest.guidance.imaging,
            _ => false,
        };
        if slewing {
            self.aborted = Some(task);
        }
        slewing
    }

    fn begin(&mut self, order: TaskOrder, delay: u32) -> Vec<Effect> {
        let mut states = std::mem::take(&mut self.waiting);
        let Some(state) = states.pop_front() else { return Vec::new() };
        self.executive.begin(order.task, order.kind, delay, &sight(&state));
        self.name = order.name;
        let mut effects = vec![self.fly(&state)];
        for state in states {
            effects.extend(self.on_state(state));
        }
        effects
    }

    fn process(&mut self, state: StateSample) -> Vec<Effect> {
        let aborted = self.aborted.take().is_some_and(|task| self.may_end(task, &state));
        let ended = aborted || self.executive.end().is_some_and(|end| state.tick >= end);
        let over = state.tick >= self.horizon;
        let finished = if ended || over { self.finish(&state) } else { None };
        if self.executive.task().is_some() {
            return vec![self.fly(&state)];
        }
        let body = self.executive.look(&sight(&state));
        let situation = Situation {
            now: state.tick,
            r_BN_N: state.r_BN_N,
            v_BN_N: state.v_BN_N,
            body,
            servo_integral: self.executive.guidance.servo_integral,
            torque_pending: self.torque_pending,
            wheels: self.executive.health().wheels,
            resources: None,
        };
        if !over {
            self.waiting.push_back(state);
        }
        vec![Effect::Decide(Box::new(DecisionPoint {
            task: self.task,
            state: StateSample { body, ..state },
            situation,
            mission_over: over,
            finished,
            last_imaging: self.last_imaging.clone(),
        }))]
    }

    /// Whether a task is in hand whose imaging has not begun at a state.
    fn may_end(&self, number: u64, state: &StateSample) -> bool {
        match self.executive.task() {
            Some((Task::Image { t_pre, .. }, start)) => {
                self.executive.number() == Some(number) && state.tick < start.after(*t_pre)
            }
            _ => false,
        }
    }

    fn finish(&mut self, state: &StateSample) -> Option<FinishedTask> {
        let record = self.executive.finish(&sight(state))?;
        self.task += 1;
        let finished = FinishedTask { record, name: std::mem::take(&mut self.name) };
        if finished.record.strip.is_some() {
            self.last_imaging = Some(finished.clone());
        }
        Some(finished)
    }

    fn fly(&mut self, state: &StateSample) -> Effect {
        let guidance = self.executive.tick(&sight(state));
        self.torque_pending = guidance.torque;
        let left = |until: Tick| until.since(state.tick).max(0) as u32;
        let (has_strip, remaining) = match self.executive.task() {
            Some((Task::Image { t_pre, t_acq, .. }, start)) => {
                let imaging = start.after(*t_pre);
                (true, left(if state.tick < imaging { imaging } else { imaging.after(*t_acq) }))
            }
            Some((task, start)) => (false, left(start.after(task.ticks()))),
            None => (false, 0),
        };
        let command = Command { tick: state.tick, task: self.task, guidance, has_strip, remaining };
        self.latest = Some(command.clone());
        Effect::Command(command)
    }
}

/// A state as the executive is told of it.
fn sight(state: &StateSample) -> Sight<'_> {
    Sight { now: state.tick, r_BN_N: state.r_BN_N, measured: &state.body, truth: state.truth.as_ref() }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use swath_sim::config::SimConfig;
    use swath_sim::learn::episode::{Env, EpisodeConfig};
    use swath_sim::planner::{Heuristic, Planner};
    use swath_sim::rng;
    use swath_sim::task::TaskOutcome;
    use swath_sim::vehicle::errors::PlantErrors;
    use swath_sim::vehicle::initial::InitialState;
    use swath_sim::vehicle::spacecraft::Spacecraft;

    use super::*;
    use crate::spacecraft::logic::SpacecraftLogic;

    const SEED: u64 = 4;

    fn model() -> Model {
        Model::new(SimConfig::default()).unwrap()
    }

    fn satellite(model: &Model) -> Spacecraft {
        let initial = InitialState::draw(&model.config, &mut rng::stream(SEED, rng::INITIAL_STATE));
        Spacecraft::new(model, &initial)
    }

    /// Spacecraft and guidance as two nodes with two ticks under way, against the environment in one process.
    #[test]
    fn two_nodes_fly_what_the_environment_flies() {
        for errors in ["none", "noise", "torque-10%,inertia+5%,noise,delay"] {
            let flown = compare(&errors.parse().unwrap());
            assert!(flown > 20, "{errors}: only {flown} tasks");
        }
    }

    fn compare(errors: &PlantErrors) -> u64 {
        let model = model();
        let config = EpisodeConfig { orbits: 0.5, ..EpisodeConfig::evaluation() };
        let mut env = Env::episode(Arc::new(model.clone()), &config, SEED);
        env.differ(errors, SEED).unwrap();
        let mut satellite = satellite(&model);
        satellite.differ(&model, errors, SEED).unwrap();
        let mut spacecraft = SpacecraftLogic::new(satellite, env.horizon());
        let delay = model.period.ticks_ceil(errors.planning_delay_s);
        let mut guidance = GuidanceLogic::new(model, env.horizon(), 20).with_planning_delay(delay);
        let mut planner = Heuristic { t_pre_s: 60.0 };
        let mut expected = None;
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
                        assert_eq!(point.finished.as_ref().map(|finished| &finished.record), expected.as_ref());
                        if over {
                            break;
                        }
                        let kind = decision.to_task(&env.context()).unwrap();
                        let order = TaskOrder { task: point.task, kind, name: "strip".to_owned() };
                        expected = Some(env.fly(decision, env.horizon()).unwrap().record);
                        effects.extend(guidance.on_task(order).unwrap());
                    }
                }
            }
        }
        assert!(env.truncated());
        assert_eq!((spacecraft.missed, guidance.late), (0, 0));
        guidance.task
    }

    #[test]
    fn a_late_task_is_replaced_by_holding_the_attitude() {
        let model = model();
        let mut spacecraft = SpacecraftLogic::new(satellite(&model), Tick(100));
        let mut guidance = GuidanceLogic::new(model, Tick(100), 10);
        assert!(matches!(guidance.on_state(spacecraft.sample())[..], [Effect::Decide(_)]));
        assert!(guidance.on_state(spacecraft.advance()).is_empty(), "the next state waits for the task");
        let effects = guidance.on_deadline();
        assert!(matches!(effects[..], [Effect::Command(_), Effect::Command(_)]));
        assert_eq!(guidance.late, 1);
        let order = TaskOrder { task: 0, kind: Task::Wait { ticks: 5 }, name: String::new() };
        assert_eq!(guidance.on_task(order), Err(TaskError::NotWanted { task: 0, wanted: None }));
    }

    #[test]
    fn a_task_is_given_up_while_slewing_and_not_once_imaging_has_begun() {
        let model = model();
        let env = Env::episode(Arc::new(model.clone()), &EpisodeConfig::evaluation(), SEED);
        let candidate = env.context().candidates[0];
        for (ticks, given_up) in [(10, true), (60, false)] {
            let mut spacecraft = SpacecraftLogic::new(satellite(&model), Tick(1000));
            let mut guidance = GuidanceLogic::new(model.clone(), Tick(1000), 10);
            guidance.on_state(spacecraft.sample());
            let kind = Task::Image { id: candidate.id, strip: candidate.strip, t_pre: 40, t_acq: candidate.t_acq };
            let order = TaskOrder { task: 0, kind, name: "strip".to_owned() };
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
