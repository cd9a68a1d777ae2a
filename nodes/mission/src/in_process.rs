//! A mission in one process, without DDS: the same tasks, results and rewards as over DDS in lockstep.

use std::collections::VecDeque;
use std::sync::Arc;

use swath_sim::mission::Mission as Loop;
use swath_sim::planner::{Decision, DecisionContext, Nobody, Planner, PlannerError};
use swath_sim::task::{SettledTask, Task};
use swath_sim::time::{Tick, TickPeriod};
use swath_sim::vehicle::executive::Executive;
use swath_sim::vehicle::flight::{Flight, Situation};
use swath_sim::vehicle::model::Model;
use thiserror::Error;

use crate::absences::{Absences, Presence};
use crate::alarms::Board;
use crate::alarms::conditions::{Report, back, of_ground, of_health, of_plan, of_planner, of_resources, report_all};
use crate::faults::grammar::Process;
use crate::file::{Mission, MissionError};
use crate::keeper::Keeper;
use crate::link::apart::Apart;
use crate::link::ground::WayLine;
use crate::link::response::LinkSummary;
use crate::link::told::Told;
use crate::orders::action::Action;
use crate::outcome::{ResourcesSummary, TaskLine};
use crate::requests::journal::InFlight;
use crate::requests::logic::RequestLogic;
use crate::requests::refusal::Refusal;

/// Why a mission was not flown to its end.
#[derive(Debug, Error)]
pub enum InProcessError {
    /// The mission cannot be flown.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// The planner gave no usable decision.
    #[error(transparent)]
    Planner(#[from] PlannerError),
}

/// A mission ready to be flown in this process: the loop of the simulation around the request manager of the nodes.
#[derive(Clone)]
pub struct InProcessMission {
    mission: Loop<Keeper>,
    requested: usize,
    faults: Troubles,
    board: Board,
    /// What is still to be reported of faults by order.
    to_report: VecDeque<Report>,
    /// What is still to be reported of power, data and momentum.
    of_resources: Vec<Report>,
}

impl InProcessMission {
    /// Prepares a mission: its satellite at the epoch, and the strips known from the start.
    ///
    /// # Errors
    /// When a setting is out of range or a file of requests cannot be used.
    pub fn new(mission: &Mission) -> Result<Self, InProcessError> {
        Self::with_actions(mission, Vec::new())
    }

    /// The same with what is asked of the request manager on the way, in order.
    ///
    /// # Errors
    /// When a setting is out of range or a file of requests cannot be used.
    pub fn with_actions(mission: &Mission, actions: Vec<Action>) -> Result<Self, InProcessError> {
        let mut flight = Self::watched(mission, actions)?;
        if let Keeper::Apart(apart) = flight.mission.keeper_mut() {
            apart.forget_told();
        }
        Ok(flight)
    }

    /// The same, of which [`Self::take_told`] tells what the ground was told, in a mission with `[link]`.
    ///
    /// # Errors
    /// When a setting is out of range or a file of requests cannot be used.
    pub fn watched(mission: &Mission, actions: Vec<Action>) -> Result<Self, InProcessError> {
        mission.faults.fits_one_process().map_err(MissionError::from)?;
        let model = Arc::new(mission.model()?);
        let horizon = mission.horizon(&model);
        let (initial, faults) = mission.initial_requests()?;
        faults.iter().for_each(|fault| tracing::warn!("{fault}"));
        let requested = initial.len();
        let faults = Troubles::new(mission, model.period);
        let keeper = Keeper::new(mission, &model, initial, actions, faults.requests.clone())?;
        let mut flight = Flight::new(&model, mission.spacecraft(&model)?);
        flight.watch(&model, mission.plant.noisy());
        let delay = model.period.ticks_ceil(mission.plant.planning_delay_s);
        let board = Board::new(model.period);
        let to_report = of_plan(&mission.faults, model.period).into();
        let mut mission = Loop::new(model, flight, keeper, horizon);
        mission.set_planning_delay(delay);
        Ok(Self { mission, requested, faults, board, to_report, of_resources: Vec::new() })
    }

    /// One that goes on at the decision of a task, from what is known of the satellite there.
    ///
    /// # Errors
    /// When a setting is out of range.
    pub(crate) fn resumed(
        mission: &Mission,
        task: u64,
        situation: &Situation,
        apart: Apart,
    ) -> Result<Self, InProcessError> {
        let mut fresh = Self::new(mission)?;
        let (model, horizon) = (Arc::clone(fresh.model()), fresh.horizon());
        let mut flight = fresh.mission.flight().clone();
        flight.resume(&model, situation);
        let delay = fresh.mission.planning_delay();
        fresh.mission = Loop::from_task(task, model, flight, Keeper::Apart(Box::new(apart)), horizon);
        fresh.mission.set_planning_delay(delay);
        Ok(fresh)
    }

    /// Something will be asked of the ground, after all that is still to come, in a mission with `[link]`.
    pub(crate) fn will_be_asked(&mut self, action: Action) {
        if let Keeper::Apart(apart) = self.mission.keeper_mut() {
            apart.will_also_be_asked(action);
        }
    }

    /// What the ground was told since the last call, where that is watched.
    pub fn take_told(&mut self) -> Vec<Told> {
        match self.mission.keeper_mut() {
            Keeper::Together(_) => Vec::new(),
            Keeper::Apart(apart) => apart.take_told(),
        }
    }

    /// What the next decision rests on.
    #[must_use]
    pub fn context(&self) -> DecisionContext<'_> {
        self.mission.context()
    }

    /// Tick at which the mission ends.
    #[must_use]
    pub fn horizon(&self) -> Tick {
        self.mission.horizon()
    }

    /// Simulated time.
    #[must_use]
    pub fn now(&self) -> Tick {
        self.mission.now()
    }

    /// The alarms.
    pub fn board(&mut self) -> &mut Board {
        &mut self.board
    }

    /// Constants of the mission.
    #[must_use]
    pub fn model(&self) -> &Arc<Model> {
        self.mission.model()
    }

    /// The requests that decide what is flown: with a radio, those on board.
    #[must_use]
    pub fn requests(&self) -> &RequestLogic {
        match self.mission.keeper() {
            Keeper::Together(desk) => &desk.requests,
            Keeper::Apart(apart) => apart.space().requests(),
        }
    }

    /// Ground, radio and satellite, in a mission with `[link]`.
    #[must_use]
    pub fn link(&self) -> Option<&Apart> {
        match self.mission.keeper() {
            Keeper::Together(_) => None,
            Keeper::Apart(apart) => Some(apart),
        }
    }

    /// Each request and its way over the radio, in a mission with `[link]`.
    #[must_use]
    pub fn ways(&self) -> Vec<WayLine> {
        self.link().map(|apart| apart.ground().lines().collect()).unwrap_or_default()
    }

    /// What was asked for and refused, and why.
    #[must_use]
    pub fn refused(&self) -> &[(Action, Refusal)] {
        match self.mission.keeper() {
            Keeper::Together(desk) => &desk.refused,
            Keeper::Apart(apart) => apart.refused(),
        }
    }

    /// Strips asked for at the start, and strips that were not refused.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        (self.requested, self.link().map_or(self.requests(), |apart| apart.ground().requests()).len())
    }

    /// What came to the ground so far and how power and data stand, in a mission with resources.
    #[must_use]
    pub fn resources(&self) -> Option<ResourcesSummary> {
        let onboard = self.mission.onboard()?;
        Some(ResourcesSummary::new(onboard.state()))
    }

    /// How long orders took over the radio, in a mission with `[link]`.
    #[must_use]
    pub fn link_summary(&self) -> Option<LinkSummary> {
        let ground = self.link()?.ground();
        Some(LinkSummary::new(ground.lines(), self.model().period))
    }

    /// Decides and flies to the end, handing each task and its line to `each`.
    ///
    /// # Errors
    /// The first error of the planner.
    pub fn run(
        &mut self,
        planner: &mut dyn Planner,
        mut each: impl FnMut(&SettledTask, TaskLine),
    ) -> Result<(), InProcessError> {
        while let Some((settled, line)) = self.step(planner, self.mission.horizon())? {
            each(&settled, line);
        }
        Ok(())
    }

    /// Decides and flies one task, cut short at `until`; nothing at the end of the mission.
    ///
    /// # Errors
    /// When the planner gave no usable decision.
    pub fn step(
        &mut self,
        planner: &mut dyn Planner,
        until: Tick,
    ) -> Result<Option<(SettledTask, TaskLine)>, InProcessError> {
        if let Some((_, back)) = self.faults.guidance.pop_front_if(|(from, _)| *from <= self.mission.now()) {
            let executive = self.fresh_executive();
            self.mission.without_guidance(back.min(self.mission.horizon()), executive);
        }
        self.look_at_resources();
        if self.mission.over() {
            self.report(None);
            return Ok(None);
        }
        let decided_at = self.mission.now();
        let holds = self.link().is_some_and(|apart| apart.space().holds(decided_at));
        let held = self.faults.hold(decided_at, planner).or(holds.then_some(self.faults.hold));
        let (decision, delay) = match held {
            Some(ticks) => (self.mission.decide(&mut Nobody { ticks })?, 0),
            None => (self.mission.decide(planner)?, self.mission.planning_delay()),
        };
        let settled = self.fly(decision, delay, until.min(self.mission.horizon()))?;
        self.report(Some(of_planner(decided_at, planner.replaced(), &planner.name())));
        let request = settled.record.strip.and_then(|id| self.requests().request(id));
        let line = TaskLine::new(&settled, request.map(|request| request.order.name.as_str()));
        Ok(Some((settled, line)))
    }

    /// Flies a task, in which guidance may be lost.
    fn fly(&mut self, decision: Decision, delay: u32, until: Tick) -> Result<SettledTask, PlannerError> {
        let task = decision.to_task(&self.mission.context())?;
        let start = self.mission.now().after(delay);
        let end = start.after(task.ticks()).min(until);
        let lost = self.faults.guidance.front().map_or(end, |(from, _)| end.min(*from));
        let given_up = self.listen(&task, start, lost).filter(|given_up| *given_up < lost);
        if let Some(given_up) = given_up {
            return self.mission.fly_after(decision, delay, given_up);
        }
        match self.faults.guidance.pop_front_if(|(from, _)| *from <= end) {
            Some((from, back)) => {
                let executive = self.fresh_executive();
                let back = back.min(self.mission.horizon());
                self.mission.fly_lost(decision, delay, (from, back), executive)
            }
            None => self.mission.fly_after(decision, delay, until),
        }
    }

    /// What the satellite hears while a task is flown that images a strip; the tick at which it gives the task up, or
    /// `until`.
    fn listen(&mut self, task: &Task, start: Tick, until: Tick) -> Option<Tick> {
        let Task::Image { id, t_pre, t_acq, .. } = *task else { return None };
        let task = self.mission.context().task;
        match self.mission.keeper_mut() {
            Keeper::Together(_) => None,
            Keeper::Apart(apart) => Some(apart.fly(InFlight { task, id, start, t_pre, t_acq }, until)),
        }
    }

    fn fresh_executive(&self) -> Executive {
        Executive::watching(self.mission.model(), self.faults.noisy)
    }

    /// What is to be told of power, data and momentum, as they stand at a decision.
    fn look_at_resources(&mut self) {
        let situation = self.mission.context().situation;
        let (now, state) = (situation.now, situation.resources);
        let told = state.iter().zip(&self.mission.model().config.resources);
        let reports = told.flat_map(|(state, config)| of_resources(now, state, config)).collect::<Vec<_>>();
        self.of_resources.extend(reports);
    }

    /// Tells the board what happened up to now, and what the planner says of its decision.
    fn report(&mut self, planner: Option<Report>) {
        let now = self.mission.now();
        let mut reports: Vec<Report> =
            self.mission.take_changes().iter().flat_map(|(tick, health)| of_health(*tick, health)).collect();
        while let Some(report) = self.to_report.pop_front_if(|report| report.tick <= now) {
            reports.push(report);
        }
        reports.append(&mut self.of_resources);
        reports.extend(planner);
        let space = self.link().map(Apart::space);
        reports.extend(space.map(|space| of_ground(now, space.heard(), space.command_lost(now))));
        report_all(&mut self.board, reports, &[]);
        self.board.advance(now);
    }
}

/// What becomes of nodes on the way, as a mission orders it.
#[derive(Clone, Debug)]
struct Troubles {
    /// When guidance is lost, and when another one is there.
    guidance: VecDeque<(Tick, Tick)>,
    planner: Absences,
    requests: Absences,
    /// How long the attitude is held when nobody decides [ticks].
    hold: u32,
    noisy: bool,
}

impl Troubles {
    fn new(mission: &Mission, period: TickPeriod) -> Self {
        let of = |process| {
            let all = mission.faults.of(process, period).into_iter();
            Absences::new(all.map(|(it, _)| (it.from, it.until)))
        };
        let guidance = mission.faults.of(Process::Guidance, period).iter().map(|(it, _)| (it.from, back(it))).collect();
        Self {
            guidance,
            planner: of(Process::Planner),
            requests: of(Process::RequestManager),
            hold: period.ticks_ceil(mission.hold_s).max(1),
            noisy: mission.plant.noisy(),
        }
    }

    /// How long the attitude is held at `now` because there is no planner [ticks]; one that comes back knows nothing of
    /// what was before.
    fn hold(&mut self, now: Tick, planner: &mut dyn Planner) -> Option<u32> {
        match self.planner.at(now) {
            Presence::Here => None,
            Presence::Back => {
                planner.forget();
                None
            }
            Presence::Away(until) => Some(self.hold.min(until.since(now) as u32)),
        }
    }
}

#[cfg(test)]
mod tests {
    use swath_sim::planner::{Heuristic, Lookahead};
    use swath_sim::task::TaskOutcome;

    use super::*;
    use crate::alarms::{Entry, Event};
    use crate::fallback::GuardedPlanner;

    fn mission(faults: &[&str]) -> Mission {
        let text =
            format!("orbits = 0.3\nseed = 3\n[requests.random]\ncount = [1500, 1500]\n[faults]\nplan = {faults:?}\n");
        let mission: Mission = toml::from_str(&text).unwrap();
        mission.validate().unwrap();
        mission.resolved()
    }

    /// Tasks and the journal of alarms.
    fn flown(faults: &[&str]) -> (Vec<SettledTask>, Vec<Entry>) {
        let mut flight = InProcessMission::new(&mission(faults)).unwrap();
        let mut tasks = Vec::new();
        flight.run(&mut Lookahead::default(), |settled, _| tasks.push(settled.clone())).unwrap();
        (tasks, flight.board().take_journal())
    }

    fn told(journal: &[Entry]) -> Vec<(&str, u64, Event)> {
        journal.iter().map(|it| (it.key.name.as_str(), it.tick.0, it.event)).collect()
    }

    #[test]
    fn without_faults_nothing_is_told() {
        assert_eq!(flown(&[]).1, []);
    }

    #[test]
    fn a_lost_guidance_interrupts_its_task_and_another_one_goes_on() {
        let (nominal, _) = flown(&[]);
        let (tasks, journal) = flown(&["guidance:kill@300s", "guidance:hang@600s+20s"]);
        assert_eq!(
            told(&journal),
            [
                ("guidance lost", 600, Event::Raised),
                ("guidance lost", 603, Event::Returned),
                ("guidance lost", 1200, Event::Raised),
                ("guidance lost", 1242, Event::Returned),
            ]
        );
        for (lost, back) in [(Tick(600), Tick(601)), (Tick(1200), Tick(1240))] {
            let at = tasks.iter().position(|it| it.record.end == lost).unwrap();
            assert_eq!(tasks[at].record.outcome, TaskOutcome::NOT_BEGUN);
            assert_eq!(tasks[at + 1].record.start, back);
            // What was under way is imaged again, or its window is over; it is not lost.
            let numbers: Vec<u64> = tasks.iter().map(|it| it.record.task).collect();
            assert_eq!(numbers, (0..tasks.len() as u64).collect::<Vec<_>>());
        }
        let before = tasks.iter().take_while(|it| it.record.end < Tick(600)).count();
        assert_eq!(tasks[..before], nominal[..before]);
        let reward = |tasks: &[SettledTask]| tasks.iter().map(|it| it.reward).sum::<f64>();
        assert!(reward(&tasks) > 0.8 * reward(&nominal), "{} of {}", reward(&tasks), reward(&nominal));
    }

    #[test]
    fn without_a_planner_the_attitude_is_held() {
        let (tasks, journal) = flown(&["planner:hang@300s+95s"]);
        assert_eq!(told(&journal), [("planner lost", 600, Event::Raised), ("planner lost", 792, Event::Returned),]);
        let held: Vec<_> =
            tasks.iter().filter(|it| it.record.start >= Tick(600) && it.record.end <= Tick(790)).collect();
        assert!(!held.is_empty());
        assert!(held.iter().all(|it| it.record.strip.is_none() && it.record.ticks() <= 20), "{held:?}");
        assert!(tasks.iter().any(|it| it.record.start == Tick(790) && it.record.strip.is_some()));
    }

    /// What was acknowledged and what was imaged is written down: whoever comes back goes on as if nothing had been.
    #[test]
    fn a_request_manager_that_is_killed_changes_nothing() {
        let kills: Vec<String> = (1..10).map(|number| format!("request_manager:kill@{}s", number * 150)).collect();
        let kills: Vec<&str> = kills.iter().map(String::as_str).collect();
        let (tasks, journal) = flown(&kills);
        assert_eq!(tasks, flown(&[]).0);
        assert_eq!(journal.len(), 18);
        let (away, _) = flown(&["request_manager:hang@300s+200s"]);
        let mut imaged: Vec<_> = away.iter().filter(|it| it.record.success()).map(|it| it.record.strip).collect();
        imaged.sort();
        let count = imaged.len();
        imaged.dedup();
        assert_eq!(imaged.len(), count, "imaged twice");
        let meanwhile = |it: &&SettledTask| it.record.start > Tick(600) && it.record.end < Tick(1000);
        assert!(away.iter().filter(meanwhile).any(|it| it.record.success()), "nothing was imaged meanwhile");
    }

    #[test]
    fn what_fails_raises_its_alarm_and_returns() {
        let plan = ["wheel2:dead@300s+200s", "gyro:bias 0.01deg/s@800s+100s", "startracker:out@1000s+30s"];
        let (tasks, journal) = flown(&plan);
        assert_eq!((tasks.clone(), journal.clone()), flown(&plan), "the same plan twice");
        for (name, from, until) in
            [("wheel y", 600, 1000), ("gyro biased", 1600, 1800), ("star tracker out", 2000, 2060)]
        {
            let of: Vec<_> = told(&journal).into_iter().filter(|it| it.0 == name).collect();
            let [(_, raised, Event::Raised), (_, returned, Event::Returned)] = of[..] else { panic!("{of:?}") };
            // A wheel shows when it is asked for torque.
            assert!((from..from + 20).contains(&raised), "{name} raised at {raised}");
            assert!((until..until + 10).contains(&returned), "{name} returned at {returned}");
        }
        assert_eq!(journal.len(), 6, "{:?}", told(&journal));
    }

    #[test]
    fn a_planner_that_does_not_know_what_is_left_is_replaced() {
        let mut flight = InProcessMission::new(&mission(&["wheel1:dead@300s"])).unwrap();
        let mut planner = GuardedPlanner::new(Box::new(Heuristic { t_pre_s: 90.0 }));
        let mut tasks = Vec::new();
        flight.run(&mut planner, |settled, _| tasks.push(settled.clone())).unwrap();
        let later = |it: &&SettledTask| it.record.start > Tick(900) && it.record.strip.is_some();
        let (tried, imaged): (Vec<_>, Vec<_>) = (
            tasks.iter().filter(later).collect(),
            tasks.iter().filter(later).filter(|it| it.record.success()).collect(),
        );
        assert!(imaged.len() * 10 >= tried.len() * 8, "{} of {}", imaged.len(), tried.len());
        assert!(!imaged.is_empty());
        let journal = flight.board().take_journal();
        assert!(told(&journal).iter().any(|it| it.0 == "planner replaced"), "{:?}", told(&journal));
    }
}
