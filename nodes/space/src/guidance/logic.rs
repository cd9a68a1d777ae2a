//! The guidance node without ROS: it flies the active task and says when one has ended.

use std::collections::VecDeque;

use nalgebra::Vector3;
use swath_mission::requests::journal::InFlight;
use swath_sim::planner::{DecisionContext, Nobody, Shield, decide};
use swath_sim::task::{Task, TaskOutcome, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::vehicle::executive::{Executive, Sight};
use swath_sim::vehicle::flight::Situation;
use swath_sim::vehicle::guidance::GuidanceTick;
use swath_sim::vehicle::health::Health;
use swath_sim::vehicle::model::Model;
use swath_sim::vehicle::resources::Activity;
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
    /// What was ordered befalls guidance before it looks at its next state.
    Strike,
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
    /// What is done besides turning, where resources have bounds.
    pub activity: Option<Activity>,
}

/// What a guidance must know to go on where another one was.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kept {
    /// Number of the task in hand, or wanted.
    pub task: u64,
    /// The task in hand, as if it were cut short when it began.
    pub flying: Option<FinishedTask>,
    /// The task that ended where one was wanted.
    pub finished: Option<FinishedTask>,
    /// The last task that was to image.
    pub last_imaging: Option<FinishedTask>,
}

/// When a guidance was lost by order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lost {
    /// Tick of the first state that it did not look at.
    pub at: Tick,
    /// Tick of the first state that the next one looks at.
    pub back: Tick,
    /// Whether that state is waited for: it is sent again and again.
    pub waits: bool,
}

/// What was before a guidance that was started again.
#[derive(Clone, Debug)]
struct Before {
    flying: Option<FinishedTask>,
    lost: Option<Lost>,
    /// Tick of the first state that was looked at.
    first: Option<Tick>,
}

/// The guidance node's state.
#[derive(Clone, Debug)]
pub struct GuidanceLogic {
    model: Model,
    executive: Executive,
    shield: Option<Shield>,
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
    /// The command before the latest one.
    earlier: Option<Command>,
    torque_pending: Vector3<f64>,
    last_imaging: Option<FinishedTask>,
    /// The task that ended where one is wanted.
    finished: Option<FinishedTask>,
    /// There is something where another guidance flew before.
    before: Option<Before>,
    /// State at which it is struck.
    strikes_at: Option<Tick>,
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
            shield: Shield::new(&model),
            model,
            horizon,
            hold: hold.max(1),
            planning_delay: 0,
            task: 0,
            name: String::new(),
            waiting: VecDeque::new(),
            latest: None,
            earlier: None,
            torque_pending: Vector3::zeros(),
            last_imaging: None,
            finished: None,
            before: None,
            strikes_at: None,
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

    /// The task in hand, if it images a strip.
    #[must_use]
    pub fn flown(&self) -> Option<InFlight> {
        let (task, start) = self.executive.task()?;
        let Task::Image { id, t_pre, t_acq, .. } = *task else { return None };
        Some(InFlight { task: self.executive.number()?, id, start, t_pre, t_acq })
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

    /// What was ordered befalls it before it looks at the state at `tick`.
    pub fn set_struck_at(&mut self, tick: Option<Tick>) {
        self.strikes_at = tick;
    }

    /// Goes on where a guidance was that is lost: what it flew counts as interrupted.
    #[must_use]
    pub fn taking_up(mut self, kept: Kept, lost: Option<Lost>) -> Self {
        self.task = kept.task;
        self.finished = kept.finished;
        self.last_imaging = kept.last_imaging;
        self.before = Some(Before { flying: kept.flying, lost, first: None });
        self
    }

    /// What another guidance must know to go on should this one be lost.
    #[must_use]
    pub fn kept(&self) -> Kept {
        let flying = self.executive.task().map(|(task, start)| FinishedTask {
            record: TaskRecord::new(self.task, task, start, start, TaskOutcome::NOT_BEGUN),
            name: self.name.clone(),
        });
        Kept { task: self.task, flying, finished: self.finished.clone(), last_imaging: self.last_imaging.clone() }
    }

    /// What changes whenever [`Self::kept`] does: number of the task, and whether it is in hand.
    #[must_use]
    pub fn marks(&self) -> (u64, bool) {
        (self.task, self.executive.task().is_some())
    }

    /// What came to be known of wheels and sensors since the last call, each with its tick.
    pub fn take_changes(&mut self) -> Vec<(Tick, Health)> {
        self.executive.take_changes()
    }

    /// Takes a state. A state seen before brings its command again, so that a lost sample stops nothing.
    pub fn on_state(&mut self, state: StateSample) -> Vec<Effect> {
        if let Some(effects) = self.mind_the_one_before(state.tick) {
            return effects;
        }
        if let Some(latest) = &self.latest
            && state.tick <= latest.tick
        {
            let known = self.latest.iter().chain(&self.earlier).find(|command| command.tick == state.tick);
            return known.map(|command| Effect::Command(command.clone())).into_iter().collect();
        }
        if !self.waiting.is_empty() {
            if self.waiting.iter().all(|waiting| waiting.tick < state.tick) {
                self.waiting.push_back(state);
            }
            return Vec::new();
        }
        // Two states may be under way: if the first one was lost, it comes again, and this one after it.
        let next = match (&self.latest, &self.before) {
            (Some(latest), _) => latest.tick.after(1),
            (None, None) => Tick(0),
            (None, Some(_)) => state.tick,
        };
        if state.tick == next.after(1) {
            return Vec::new();
        }
        self.process(state)
    }

    /// What is answered to a state that is not looked at, because another guidance flew before.
    fn mind_the_one_before(&mut self, tick: Tick) -> Option<Vec<Effect>> {
        let before = self.before.as_mut()?;
        let first = match before.first {
            Some(first) => first,
            None => {
                let wanted = before.lost.map_or(tick, |lost| lost.back.min(self.horizon));
                if tick < wanted || (tick > wanted && before.lost.is_some_and(|lost| lost.waits)) {
                    return Some(Vec::new());
                }
                before.first = Some(tick);
                tick
            }
        };
        // Nobody knows any more what would have been commanded there.
        (tick < first).then(|| vec![Effect::Command(self.idle(tick))])
    }

    /// The command that does nothing: the wheels hold no torque.
    #[must_use]
    pub fn idle(&self, tick: Tick) -> Command {
        let activity = self.model.config.resources.as_ref().map(|_| Activity::default());
        Command { tick, task: self.task, guidance: GuidanceTick::IDLE, has_strip: false, remaining: 0, activity }
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
        self.hold(self.hold)
    }

    /// There is no planner for `ticks`: holds the attitude for a while, then asks.
    pub fn on_absence(&mut self, ticks: u32) -> Vec<Effect> {
        if self.wanted().is_none() {
            return Vec::new();
        }
        self.hold(self.hold.min(ticks).max(1))
    }

    /// Holds the attitude for `ticks`, where safe mode and the shield have nothing better to do.
    fn hold(&mut self, ticks: u32) -> Vec<Effect> {
        let Some(state) = self.waiting.front().copied() else { return Vec::new() };
        let situation = self.situation(&state);
        let context = DecisionContext {
            task: self.task,
            situation: &situation,
            candidates: &[],
            previous: None,
            model: &self.model,
        };
        let decision = decide(self.shield.as_ref(), &context, &mut Nobody { ticks });
        let kind = decision.and_then(|decision| decision.to_task(&context)).unwrap_or(Task::Wait { ticks });
        self.begin(TaskOrder { task: self.task, kind, name: String::new() }, 0)
    }

    /// What a planner may know at a state.
    fn situation(&mut self, state: &StateSample) -> Situation {
        Situation {
            now: state.tick,
            r_BN_N: state.r_BN_N,
            v_BN_N: state.v_BN_N,
            body: self.executive.look(&sight(state)),
            servo_integral: self.executive.guidance.servo_integral,
            torque_pending: self.torque_pending,
            wheels: self.executive.health().wheels,
            resources: state.resources,
        }
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
        self.finished = None;
        let mut effects = vec![self.fly(&state)];
        for state in states {
            effects.extend(self.on_state(state));
        }
        effects
    }

    fn process(&mut self, state: StateSample) -> Vec<Effect> {
        if self.strikes_at.is_some_and(|at| state.tick >= at) {
            return vec![Effect::Strike];
        }
        let lost = self.before.as_mut().and_then(|before| Some((before.flying.take()?, before.lost)));
        let aborted = self.aborted.take().is_some_and(|task| self.may_end(task, &state));
        let ended = aborted || self.executive.end().is_some_and(|end| state.tick >= end);
        let over = state.tick >= self.horizon;
        let finished = match lost {
            Some((task, lost)) => Some(self.interrupted(task, lost.map_or(state.tick, |lost| lost.at))),
            None if ended || over => self.finish(&state),
            None => None,
        };
        self.finished = finished.or(self.finished.take());
        if self.executive.task().is_some() {
            return vec![self.fly(&state)];
        }
        let situation = self.situation(&state);
        if !over {
            self.waiting.push_back(state);
        }
        vec![Effect::Decide(Box::new(DecisionPoint {
            task: self.task,
            state: StateSample { body: situation.body, ..state },
            situation,
            mission_over: over,
            finished: self.finished.clone(),
            last_imaging: self.last_imaging.clone(),
        }))]
    }

    /// The task that a lost guidance flew, cut short where that was lost.
    fn interrupted(&mut self, mut task: FinishedTask, at: Tick) -> FinishedTask {
        task.record.end = at;
        task.record.start = task.record.start.min(at);
        self.task = task.record.task + 1;
        if task.record.strip.is_some() {
            self.last_imaging = Some(task.clone());
        }
        task
    }

    /// Whether a task is in hand whose imaging has not begun at a state.
    fn may_end(&self, number: u64, state: &StateSample) -> bool {
        match self.executive.task() {
            Some((Task::Image { t_pre, .. }, start)) => {
                self.executive.number() == Some(number) && state.tick <= start.after(*t_pre)
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
        let activity = self.model.config.resources.as_ref().map(|_| self.executive.activity(state.tick));
        let command = Command { tick: state.tick, task: self.task, guidance, has_strip, remaining, activity };
        self.earlier = self.latest.replace(command.clone());
        Effect::Command(command)
    }
}

/// A state as the executive is told of it.
fn sight(state: &StateSample) -> Sight<'_> {
    Sight { now: state.tick, r_BN_N: state.r_BN_N, measured: &state.body, truth: state.truth.as_ref() }
}
