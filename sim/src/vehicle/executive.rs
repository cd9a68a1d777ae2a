//! The task executive: it flies one task after the other by what is measured, and judges them by what is true.

use nalgebra::Vector3;

use crate::task::{Duty, Task, TaskOutcome, TaskRecord};
use crate::time::Tick;
use crate::vehicle::dynamics::BodyState;
use crate::vehicle::guidance::{Guidance, GuidanceTick};
use crate::vehicle::health::{Health, Watch};
use crate::vehicle::model::Model;
use crate::vehicle::resources::{Activity, Imager};

/// The satellite at a tick, as the executive is told of it.
#[derive(Clone, Copy, Debug)]
pub struct Sight<'a> {
    /// Simulated time.
    pub now: Tick,
    /// Position in N [m].
    pub r_BN_N: Vector3<f64>,
    /// Attitude, rate and wheel speeds as they are measured.
    pub measured: &'a BodyState,
    /// The same as they are, where the sensors are not exact: images are judged by it.
    pub truth: Option<&'a BodyState>,
}

/// Flies tasks.
#[derive(Clone, Debug)]
pub struct Executive {
    /// The guidance law and the task in hand.
    pub guidance: Guidance,
    judge: Option<Box<Guidance>>,
    active: Option<Active>,
    /// There is none in a planner's head, where everything is as the model says.
    watch: Option<Box<Watch>>,
    /// How long the imager warms up [ticks].
    warm_up: u32,
    /// What the image of the task that ended last is worth, until that is told.
    image_worth: Option<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Active {
    number: u64,
    task: Task,
    /// Tick at which the task itself begins; before it the attitude is held.
    start: Tick,
    begun: bool,
}

impl Executive {
    /// An executive without a task.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let warm_up = model.config.resources.as_ref().map_or(0, |it| model.period.ticks_ceil(it.imager_warm_up_s));
        // What another one had begun to image is worth nothing.
        let image_worth = Some(0.0);
        Self { guidance: Guidance::new(model), judge: None, active: None, watch: None, warm_up, image_worth }
    }

    /// The same, watching wheels and sensors; `noisy` is whether the sensors are known to be.
    #[must_use]
    pub fn watching(model: &Model, noisy: bool) -> Self {
        Self { watch: Some(Box::new(Watch::new(model, noisy))), ..Self::new(model) }
    }

    /// What is known of wheels and sensors.
    #[must_use]
    pub fn health(&self) -> Health {
        self.watch.as_ref().map(|watch| *watch.health()).unwrap_or_default()
    }

    /// What came to be known of wheels and sensors since the last call, each with its tick.
    pub fn take_changes(&mut self) -> Vec<(Tick, Health)> {
        self.watch.as_mut().map(|watch| watch.take_changes()).unwrap_or_default()
    }

    /// What another one had come to know before this one was there.
    pub(super) fn precede_changes(&mut self, changes: Vec<(Tick, Health)>) {
        if let Some(watch) = &mut self.watch {
            watch.precede_changes(changes);
        }
    }

    /// Attitude, rate and wheel speeds as they are best known.
    #[inline]
    pub fn look(&mut self, sight: &Sight<'_>) -> BodyState {
        self.watch.as_mut().map_or(*sight.measured, |watch| watch.look(sight.now, sight.measured))
    }

    /// Takes up task `number` after `delay` ticks in which the attitude is held.
    pub fn begin(&mut self, number: u64, task: Task, delay: u32, sight: &Sight<'_>) {
        let start = sight.now.after(delay);
        self.active = Some(Active { number, task, start, begun: delay == 0 });
        self.start(if delay == 0 { task } else { Task::Wait { ticks: delay } }, sight);
    }

    fn start(&mut self, task: Task, sight: &Sight<'_>) {
        let seen = self.look(sight);
        self.guidance.start(task, sight.now, &seen);
        let Some(truth) = sight.truth else {
            self.judge = None;
            return;
        };
        let guidance = &self.guidance;
        self.judge.get_or_insert_with(|| Box::new(guidance.clone())).start(task, sight.now, truth);
    }

    /// Who judges the task in hand by the truth, with the truth. Sensors that go wrong on the way were exact before, so
    /// that what guidance has seen until then was true.
    #[inline]
    fn judge<'a>(&mut self, sight: &Sight<'a>) -> Option<(&mut Guidance, &'a BodyState)> {
        let truth = sight.truth?;
        let guidance = &self.guidance;
        Some((self.judge.get_or_insert_with(|| Box::new(guidance.clone())), truth))
    }

    /// The task in hand and the tick at which it begins.
    #[must_use]
    pub fn task(&self) -> Option<(&Task, Tick)> {
        self.active.as_ref().map(|active| (&active.task, active.start))
    }

    /// Number of the task in hand.
    #[must_use]
    pub fn number(&self) -> Option<u64> {
        self.active.as_ref().map(|active| active.number)
    }

    /// Tick at which the task in hand ends.
    #[must_use]
    pub fn end(&self) -> Option<Tick> {
        self.active.as_ref().map(|active| active.start.after(active.task.ticks()))
    }

    /// Puts the task in hand away and tells how it went; before its end it counts as interrupted. `None` without one.
    pub fn finish(&mut self, sight: &Sight<'_>) -> Option<TaskRecord> {
        let Active { number, task, start, begun } = self.active.take()?;
        let (now, r_BN_N) = (sight.now, &sight.r_BN_N);
        let body = self.look(sight);
        let judged = self.judge(sight).and_then(|(judge, truth)| judge.finish(now, r_BN_N, truth));
        let seen = self.guidance.finish(now, r_BN_N, &body);
        let outcome = judged.or(seen).filter(|_| begun).unwrap_or(TaskOutcome::NOT_BEGUN);
        if let Task::Image { strip, .. } = &task {
            self.image_worth = Some(if outcome.failure.is_none() { strip.priority } else { 0.0 });
        }
        Some(TaskRecord::new(number, &task, start.min(now), now, outcome))
    }

    /// What imager, transmitter and thrusters do over the tick that begins now. What an image is worth is told once.
    pub fn activity(&mut self, now: Tick) -> Activity {
        let mut activity = Activity { image_worth: self.image_worth.take(), ..Activity::default() };
        let Some((task, start)) = self.task().filter(|(_, start)| *start <= now) else { return activity };
        match *task {
            Task::Image { id, t_pre, .. } => {
                let to_go = start.after(t_pre).since(now);
                if to_go <= 0 {
                    activity.imager = Imager::Records(id);
                } else if to_go <= i64::from(self.warm_up) {
                    activity.imager = Imager::Warm;
                }
            }
            Task::Serve { duty: Duty::Downlink, .. } => activity.downlink = true,
            Task::Serve { duty: Duty::Desaturate, .. } => activity.desaturate = Some(now.since(start) as u32),
            Task::Serve { duty: Duty::Charge, .. } | Task::Wait { .. } => {}
        }
        activity
    }

    /// One control tick: the torque command computed from what is seen now. Without a task the torque is zero.
    #[inline]
    pub fn tick(&mut self, sight: &Sight<'_>) -> GuidanceTick {
        if let Some(active) = &mut self.active
            && !active.begun
            && sight.now >= active.start
        {
            active.begun = true;
            let task = active.task;
            self.start(task, sight);
        }
        if let Some((judge, truth)) = self.judge(sight) {
            judge.tick(sight.now, &sight.r_BN_N, truth);
        }
        let Some(watch) = &mut self.watch else {
            return self.guidance.tick(sight.now, &sight.r_BN_N, sight.measured);
        };
        let body = watch.look(sight.now, sight.measured);
        self.guidance.wheel_lost = watch.health().wheel_lost();
        let tick = self.guidance.tick(sight.now, &sight.r_BN_N, &body);
        watch.commanded(sight.now, tick.torque);
        tick
    }
}
