//! The guidance node's topics, deadlines and alarms.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use anyhow::Result;
use swath_msgs::swath_msgs as msg;
use swath_node::messages::spacecraft_state::state_sample;
use swath_ros::{Publisher, Spec, Subscription, graph};

use swath_sim::time::Tick;
use swath_sim::vehicle::dynamics::BodyState;
use swath_sim::vehicle::spacecraft::StateSample;

use super::logic::{Command, Effect, GuidanceLogic, Lost};
use super::messages;
use super::radio::RadioGate;
use swath_mission::alarms::conditions::{back, of_health, of_resources};
use swath_mission::faults::grammar::Process;
use swath_mission::faults::plan::Scheduled;
use swath_mission::file::PACED_PATIENCE;
use swath_node::lifecycle::{self, LifecycleNode};
use swath_node::node::{MissionNode, Severity};
use swath_node::patient::keep;
use swath_node::program::{PACE, Program};

/// How long a question without an answer waits before it is asked again.
const ASK_AGAIN_AFTER: Duration = Duration::from_millis(500);
/// The same where messages are dropped by order.
const ASK_SOON_AFTER: Duration = Duration::from_millis(50);
/// A question is asked at least so often before its deadline.
const TIMES_ASKED: u32 = 5;
/// Share of a tick's wall-clock time that planning may take in a paced mission.
const PACED_SHARE: f64 = 0.8;
/// How long, instead of the mission's deadline, a task is waited for whose planner may be started again on the way.
const RESTARTED: Duration = Duration::from_secs(45);
/// The file in which guidance keeps what is in hand.
const KEPT: &str = "guidance.json";
/// Simulated time between two status messages [s].
const STATUS_PERIOD_S: f64 = 10.0;

/// The node as a program.
const PROGRAM: Program = Program {
    node: graph::GUIDANCE,
    name: "swath-guidance",
    about: "Guidance and attitude control: flies the tasks of the planner",
    parameters: &[PACE],
};

/// Runs the guidance node until it is asked to end.
///
/// # Errors
/// When the node cannot come up or DDS fails.
pub fn run() -> Result<()> {
    let base = MissionNode::start(&PROGRAM)?;
    let pace = Spec::new(PACE.name, base.mission.pace, PACE.about);
    let pace = base.node.parameters().declare(pace.in_range(0.0..=1e6).read_only())?;
    base.node.parameters().check_given()?;
    lifecycle::run(base, |base| GuidanceNode::new(base, pace))
}

struct GuidanceNode {
    logic: GuidanceLogic,
    states: Subscription<msg::SpacecraftState>,
    /// What the sensors do not tell, where they are not exact.
    truths: Subscription<msg::SpacecraftState>,
    /// States that wait for the truth of their tick, and truths that wait for their states.
    unpaired: (VecDeque<StateSample>, BTreeMap<Tick, BodyState>),
    tasks: Subscription<msg::ImagingTask>,
    torques: Publisher<msg::WheelTorque>,
    points: Publisher<msg::DecisionPoint>,
    status: Publisher<msg::GuidanceStatus>,
    phases: Publisher<msg::TaskPhase>,
    /// There is none where there is a radio.
    aborts: Option<Subscription<msg::TaskAbort>>,
    radio: Option<RadioGate>,
    /// The last decision point, and how many launchers were told of it.
    last_point: Option<msg::DecisionPoint>,
    told_to: u64,
    /// Task and whether it images, as they were told last.
    phase_told: Option<(u64, bool)>,
    status_every: u64,
    pace: f64,
    deadline: Duration,
    ask_again_after: Duration,
    question: Option<Question>,
    /// When there is no planner, by order.
    nobody_plans: Vec<Scheduled>,
    /// Task and whether it was begun, as it was kept last.
    kept: Option<(u64, bool)>,
    /// Whether something was wrong with wheels or sensors before.
    health_told: bool,
    /// The same of power, data and momentum.
    resources_told: bool,
    /// States before are old.
    since: Tick,
    /// Whether it commanded nothing since it last flew.
    rested: bool,
    base: MissionNode,
}

/// A task that is wanted.
struct Question {
    message: msg::DecisionPoint,
    asked: Instant,
    last_asked: Instant,
}

impl GuidanceNode {
    fn new(base: MissionNode, pace: f64) -> Result<Self> {
        let period = base.model.period;
        let mut node = Self {
            logic: take_up(&base, pace)?,
            states: base.node.subscription(&graph::SPACECRAFT_STATE)?,
            truths: base.node.subscription(&graph::SPACECRAFT_TRUTH)?,
            unpaired: Default::default(),
            tasks: base.node.subscription(&graph::PLANNER_TASK)?,
            torques: base.node.publisher(&graph::WHEEL_TORQUE)?,
            points: base.node.publisher(&graph::DECISION_POINT)?,
            status: base.node.publisher(&graph::GUIDANCE_STATUS)?,
            phases: base.node.publisher(&graph::TASK_PHASE)?,
            aborts: match base.mission.link {
                None => Some(base.node.subscription(&graph::TASK_ABORT)?),
                Some(_) => None,
            },
            radio: RadioGate::new(&base, pace)?,
            last_point: None,
            told_to: 0,
            phase_told: None,
            status_every: u64::from(period.ticks_ceil(STATUS_PERIOD_S)).max(1),
            pace,
            deadline: Duration::ZERO,
            ask_again_after: ASK_AGAIN_AFTER,
            question: None,
            nobody_plans: Vec::new(),
            kept: None,
            // What the one before has told may be over.
            health_told: base.goes_on(),
            resources_told: base.goes_on(),
            since: base.stamper.tick_from(&base.node.clock().stamp()),
            rested: false,
            base,
        };
        node.mind_faults();
        Ok(node)
    }

    /// What follows from the faults by order, those that were ordered on the way too.
    fn mind_faults(&mut self) {
        let faults = &self.base.mission.faults;
        let period = self.base.model.period;
        self.nobody_plans = faults.of(Process::Planner, period).into_iter().map(|(it, _)| it).collect();
        let who_offers = [Process::RequestManager, Process::Catalogue];
        let offers_restart = who_offers.iter().any(|&process| !faults.of(process, period).is_empty());
        let restarts = offers_restart || !self.nobody_plans.is_empty();
        let deadline = Duration::from_secs_f64(if self.pace > 0.0 {
            (PACED_SHARE * period.seconds() / self.pace).max(PACED_PATIENCE.as_secs_f64())
        } else {
            self.base.mission.planning_deadline_s
        });
        self.deadline = if restarts && self.pace == 0.0 { deadline.max(RESTARTED) } else { deadline };
        let patience = if faults.drops(period).is_empty() { ASK_AGAIN_AFTER } else { ASK_SOON_AFTER };
        self.ask_again_after = patience.min(self.deadline / TIMES_ASKED);
        self.logic.set_struck_at(self.base.strikes_at());
    }

    fn work(&mut self) -> Result<Duration> {
        self.tell_another_launcher()?;
        while let Some(message) = self.next_abort()? {
            self.give_up(message.task, &message.reason);
        }
        self.listen()?;
        self.take_states()?;
        while self.may_look()?
            && let Some(state) = self.next_state()
        {
            let effects = self.logic.on_state(state);
            self.tell_health()?;
            self.carry_out(effects)?;
        }
        while let Some(message) = self.tasks.take()? {
            self.take_task(&message)?;
        }
        let wait = self.mind_question()?;
        let patience = self.radio.as_ref().and_then(RadioGate::patience);
        Ok(patience.map_or(wait, |patience| patience.min(wait)))
    }

    /// A launcher that takes over learns how far the mission is; the others only answer again.
    fn tell_another_launcher(&mut self) -> Result<()> {
        let launchers = self.base.node.taken_over();
        if std::mem::replace(&mut self.told_to, launchers) != launchers
            && let Some(point) = &self.last_point
        {
            self.points.publish(point)?;
        }
        Ok(())
    }

    fn next_abort(&self) -> Result<Option<msg::TaskAbort>> {
        Ok(self.aborts.as_ref().map_or(Ok(None), Subscription::take)?)
    }

    fn give_up(&mut self, task: u64, reason: &str) {
        if self.logic.on_abort(task) {
            tracing::info!("task {task} is given up: {reason}");
        }
    }

    /// What was heard over the radio.
    fn listen(&mut self) -> Result<()> {
        while let Some(heard) = self.radio.as_mut().map_or(Ok(None), RadioGate::take)? {
            if heard.abort {
                self.give_up(heard.abort_task, &heard.reason);
            }
            if heard.hold && self.logic.wanted() == Some(heard.hold_task) {
                let effects = self.logic.on_absence(u32::MAX);
                self.carry_out(effects)?;
            }
        }
        Ok(())
    }

    /// Whether there is a state, and the radio has been heard up to its tick, where there is one.
    fn may_look(&mut self) -> Result<bool> {
        let Some(tick) = self.unpaired.0.front().map(|state| state.tick) else { return Ok(false) };
        let flown = self.logic.wanted().is_none().then(|| self.logic.flown());
        self.radio.as_mut().map_or(Ok(true), |it| it.may_look(&self.base, tick, flown))
    }

    fn take_states(&mut self) -> Result<()> {
        while let Some(message) = self.truths.take()? {
            match self.base.tick(message.tick).and_then(|_| state_sample(&message)) {
                Ok(truth) => _ = self.unpaired.1.insert(truth.tick, truth.body),
                Err(error) => self.base.alarm(Severity::Error, "truth refused", &error.to_string())?,
            }
        }
        while let Some(message) = self.states.take()? {
            match self.base.tick(message.tick).and_then(|_| state_sample(&message)) {
                // A reader that comes late is sent what the writer still holds.
                Ok(state) if state.tick < self.since => {}
                Ok(state) => self.unpaired.0.push_back(state),
                Err(error) => self.base.alarm(Severity::Error, "state refused", &error.to_string())?,
            }
        }
        if self.base.take_fault_orders()? {
            self.mind_faults();
        }
        Ok(())
    }

    /// The next state, once its truth is there, where there is one.
    fn next_state(&mut self) -> Option<StateSample> {
        while let Some(mut state) = self.unpaired.0.pop_front() {
            if state.tick < self.base.truth_from() {
                return Some(state);
            }
            state.truth = self.unpaired.1.remove(&state.tick);
            if state.truth.is_some() {
                self.unpaired.1.retain(|&tick, _| tick > state.tick);
                return Some(state);
            }
            // Truths come in order: one that has not come before a later one is lost, and so is its state.
            if self.unpaired.1.keys().next_back().is_none_or(|&last| last <= state.tick) {
                self.unpaired.0.push_front(state);
                return None;
            }
        }
        None
    }

    /// Tells what came to be known of wheels and sensors; nothing as long as nothing was ever wrong.
    fn tell_health(&mut self) -> Result<()> {
        for (tick, health) in self.logic.take_changes() {
            let reports = of_health(tick, &health);
            self.health_told |= reports.iter().any(|report| report.wrong);
            if self.health_told {
                reports.iter().try_for_each(|report| self.base.condition(report))?;
            }
        }
        Ok(())
    }

    /// Tells how power, data and momentum stand at a decision; nothing as long as nothing was ever wrong.
    fn tell_resources(&mut self, state: &StateSample) -> Result<()> {
        let told = state.resources.iter().zip(&self.base.model.config.resources);
        let reports: Vec<_> = told.flat_map(|(it, config)| of_resources(state.tick, it, config)).collect();
        self.resources_told |= reports.iter().any(|report| report.wrong);
        if self.resources_told {
            reports.iter().try_for_each(|report| self.base.condition(report))?;
        }
        Ok(())
    }

    fn take_task(&mut self, message: &msg::ImagingTask) -> Result<()> {
        // An answer given twice, or after its deadline, is nothing new.
        if self.logic.wanted() != Some(message.task) {
            tracing::debug!("task {} is not wanted", message.task);
            return Ok(());
        }
        let order = messages::task_order(&self.base.model, message).map_err(|error| error.to_string());
        match order.and_then(|order| self.logic.on_task(order).map_err(|error| error.to_string())) {
            Ok(effects) => self.carry_out(effects),
            Err(error) => self.base.alarm(Severity::Error, "task refused", &error),
        }
    }

    /// Asks again, or holds the attitude when the answer is late; returns how long there is nothing to do.
    fn mind_question(&mut self) -> Result<Duration> {
        let again = self.ask_again_after;
        let Some(question) = &mut self.question else { return Ok(ASK_AGAIN_AFTER) };
        if self.logic.wanted() != Some(question.message.task) {
            self.question = None;
            return Ok(Duration::ZERO);
        }
        let (task, waited) = (question.message.task, question.asked.elapsed());
        if let Some(left) = self.deadline.checked_sub(waited) {
            if question.last_asked.elapsed() >= again {
                question.last_asked = Instant::now();
                self.points.publish(&question.message)?;
            }
            return Ok(left.min(again));
        }
        let hold = self.base.mission.hold_s;
        let text =
            format!("task {task} did not come within {} s: holding attitude for {hold} s", self.deadline.as_secs_f64());
        self.base.alarm(Severity::Warn, "planner late", &text)?;
        let effects = self.logic.on_deadline();
        self.base.count("late_tasks", self.logic.late);
        self.carry_out(effects)?;
        Ok(Duration::ZERO)
    }

    fn carry_out(&mut self, effects: Vec<Effect>) -> Result<()> {
        if !effects.is_empty() {
            self.keep()?;
        }
        for effect in effects {
            match effect {
                Effect::Command(command) => self.send(&command)?,
                Effect::Decide(point) => {
                    self.tell_resources(&point.state)?;
                    let message = messages::decision_point(&self.base.stamper, &point);
                    self.points.publish(&message)?;
                    self.last_point = Some(message.clone());
                    let now = Instant::now();
                    self.question = (!point.mission_over).then_some(Question { message, asked: now, last_asked: now });
                    self.hold_without_planner(point.state.tick)?;
                }
                Effect::Strike => {
                    self.base.strike();
                }
            }
        }
        Ok(())
    }

    /// Where there is no planner, by order, nobody is waited for.
    fn hold_without_planner(&mut self, now: Tick) -> Result<()> {
        let Some(it) = self.nobody_plans.iter().find(|it| it.from <= now && now < it.until) else { return Ok(()) };
        let effects = self.logic.on_absence(it.until.since(now) as u32);
        self.carry_out(effects)
    }

    /// Keeps what another guidance must know, when it has changed.
    fn keep(&mut self) -> Result<()> {
        let Some(path) = self.base.keeps(KEPT) else { return Ok(()) };
        let marks = self.logic.marks();
        if self.kept != Some(marks) && keep(&path, &messages::kept_text(&self.logic.kept())?)? {
            self.kept = Some(marks);
        }
        Ok(())
    }

    fn send(&mut self, command: &Command) -> Result<()> {
        self.base.set_now(command.tick);
        self.torques.publish(&messages::wheel_torque(&self.base.stamper, command))?;
        let flown = self.logic.flown();
        self.radio.as_mut().map_or(Ok(()), |it| it.answered(&self.base, command.tick, flown))?;
        let phase = (command.task, command.guidance.imaging);
        if command.has_strip && self.phase_told != Some(phase) {
            self.phase_told = Some(phase);
            let strip = self.logic.strip().map_or(0, |(id, _)| id.0);
            self.phases.publish(&messages::task_phase(&self.base.stamper, command, strip))?;
        }
        if command.tick.0.is_multiple_of(self.status_every) {
            let strip = self.logic.strip().map(|(id, name)| (id.0, name));
            self.status.publish(&messages::guidance_status(&self.base.stamper, command, strip))?;
        }
        Ok(())
    }
}

impl LifecycleNode for GuidanceNode {
    fn base(&self) -> &MissionNode {
        &self.base
    }

    fn activate(&mut self) -> Result<()> {
        if std::mem::take(&mut self.rested) {
            // What was in hand counts as interrupted.
            self.logic = fresh(&self.base).taking_up(self.logic.kept(), None);
            (self.question, self.kept) = (None, None);
            self.mind_faults();
        }
        Ok(())
    }

    fn deactivate(&mut self) -> Result<()> {
        self.rested = true;
        Ok(())
    }

    fn turn(&mut self) -> Result<()> {
        let wait = self.work()?;
        self.base.wait(wait)?;
        Ok(())
    }

    /// The wheels hold no torque. The last state waits for one who can end the mission.
    fn rest(&mut self) -> Result<()> {
        while self.next_abort()?.is_some() {}
        while self.radio.as_mut().map_or(Ok(None), RadioGate::take)?.is_some() {}
        while self.tasks.take()?.is_some() {}
        self.take_states()?;
        while self.unpaired.0.front().is_some_and(|state| state.tick < self.base.horizon)
            && let Some(state) = self.next_state()
        {
            self.send(&self.logic.idle(state.tick))?;
        }
        self.base.wait(ASK_AGAIN_AFTER)?;
        Ok(())
    }

    fn end(self) -> Result<MissionNode> {
        Ok(self.base)
    }
}

/// Guidance that knows nothing of a flight yet.
fn fresh(base: &MissionNode) -> GuidanceLogic {
    let (mission, period) = (&base.mission, base.model.period);
    GuidanceLogic::new((*base.model).clone(), base.horizon, period.ticks_ceil(mission.hold_s))
        .with_planning_delay(period.ticks_ceil(mission.plant.planning_delay_s))
        .watching(mission.plant.noisy())
}

/// Guidance where the one before was, if there was one.
fn take_up(base: &MissionNode, pace: f64) -> Result<GuidanceLogic> {
    let logic = fresh(base);
    let Some(text) = base.kept(KEPT)? else { return Ok(logic) };
    let kept = messages::kept(&text)?;
    tracing::info!("guidance goes on after task {}", kept.task);
    // States are sent again in lockstep alone.
    let lost = base.struck().map(|it| Lost { at: it.from, back: back(&it), waits: pace == 0.0 });
    Ok(logic.taking_up(kept, lost))
}
