//! The mirror without ROS: it is told what the ground is told, and all that it says follows from that.

use std::collections::BTreeMap;
use std::sync::Arc;

use swath_sim::planner::Planner;
use swath_sim::task::TaskRecord;
use swath_sim::time::Tick;
use swath_sim::vehicle::model::Model;
use swath_sim::world::orbit::Orbit;
use swath_sim::world::strip::StripId;
use thiserror::Error;

use super::flying::{Flying, Imagined, nominal};
use super::parting::Cause;
use super::score::Score;
use crate::file::{Mission, MissionError};
use crate::in_process::{InProcessError, InProcessMission};
use crate::link::apart::Apart;
use crate::link::catalogue::Catalogue;
use crate::link::ground::{Fact, Ground, WayLine};
use crate::link::radio::Radio;
use crate::link::told::{Answer, Told};
use crate::orders::action::Action;
use crate::requests::logic::RequestLogic;
use crate::requests::refusal::Refusal;

/// How far apart a strip may be imaged in flight and in the prediction and count as foretold [s].
const ABOUT_S: f64 = 120.0;

/// Why nothing can be predicted.
#[derive(Debug, Error)]
pub enum MirrorError {
    /// The mission has no `[link]`.
    #[error("the mission has no [link]: ground and satellite are one, and nothing is to be predicted")]
    NoLink,
    /// The mission cannot be flown in the head.
    #[error(transparent)]
    Flight(#[from] InProcessError),
    /// What came down cannot be flown on from.
    #[error(transparent)]
    Refused(#[from] Refusal),
}

impl From<MissionError> for MirrorError {
    fn from(error: MissionError) -> Self {
        Self::Flight(error.into())
    }
}

/// What the satellite is going to do, as far as the ground can know.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prediction {
    /// When it was made.
    pub at: Tick,
    /// From when on it was flown in the head: the epoch, or the housekeeping that it rests on.
    pub since: Tick,
    /// Tick up to which it goes.
    pub until: Tick,
    /// Tasks, of which the first one may have begun.
    pub tasks: Vec<TaskRecord>,
    /// Each request and its way over the radio, what is still to come included.
    pub ways: Vec<WayLine>,
}

/// The ground's mirror of the satellite.
pub struct Mirror {
    /// The mission as it is in the head.
    nominal: Mission,
    model: Arc<Model>,
    orbit: Orbit,
    horizon: Tick,
    radio: Radio,
    /// The planner as it was made; it decides where it cannot be doubled.
    planner: Box<dyn Planner + Send>,
    /// The ground as it is.
    ground: Ground,
    /// What was asked before the flight in the head has begun.
    first: Vec<Action>,
    /// The flight in the head, up to a decision before which all is known that was asked.
    present: Option<Flying>,
    /// The same a task further, before which something may still be asked.
    next: Option<(Flying, Imagined)>,
    imagined: BTreeMap<u64, Imagined>,
    facts: Vec<Fact>,
    now: Tick,
    /// The last tick of the radio that was told of.
    radio_at: Tick,
    since: Tick,
    score: Score,
}

impl Mirror {
    /// The mirror of a mission with `[link]` at the epoch; `planner` is the one that the satellite flies, as it is made.
    ///
    /// # Errors
    /// When the mission has no radio, or cannot be flown.
    pub fn new(mission: &Mission, planner: Box<dyn Planner + Send>) -> Result<Self, MirrorError> {
        let nominal = nominal(mission);
        let model = Arc::new(nominal.model().map_err(MirrorError::from)?);
        let radio = Radio::of(&nominal, &model)?.ok_or(MirrorError::NoLink)?;
        let (orbit, horizon) = (nominal.orbit(&model), nominal.horizon(&model));
        let requests = RequestLogic::new((*model).clone(), &nominal.initial(), horizon, nominal.rules());
        let mut ground = Ground::new(requests, radio.rates().0);
        ground.note_facts();
        Ok(Self {
            nominal,
            model,
            orbit,
            horizon,
            radio,
            planner,
            ground,
            first: Vec::new(),
            present: None,
            next: None,
            imagined: BTreeMap::new(),
            facts: Vec::new(),
            now: Tick(0),
            radio_at: Tick(0),
            since: Tick(0),
            score: Score::default(),
        })
    }

    /// The ground is told something. Once a pass is over, what it brought is looked at, as [`Self::look`] does.
    ///
    /// # Errors
    /// As [`Self::look`].
    pub fn tell(&mut self, told: &Told) -> Result<(), MirrorError> {
        let at = told.at();
        if at > self.radio_at.after(1) && !self.facts.is_empty() {
            self.look(self.radio_at.after(1))?;
        }
        if !matches!(told, Told::Asked(_)) {
            self.radio_at = at;
        }
        self.now = self.now.max(at);
        let answer = self.ground.tell(told);
        if let (Told::Asked(action), Answer::Asked(Ok(_))) = (told, answer) {
            self.next = None;
            match &mut self.present {
                Some(present) => present.mission.will_be_asked(action.clone()),
                None => self.first.push(action.clone()),
            }
        }
        self.facts.extend(self.ground.take_facts());
        // The ground itself writes them down.
        self.ground.take_journal();
        Ok(())
    }

    /// How far flight and prediction have been the same, up to what [`Self::predict`] has looked at.
    #[must_use]
    pub fn score(&self) -> &Score {
        &self.score
    }

    /// What the satellite is going to do from `now` on, which is not before anything that was told, for `ticks` or to
    /// the mission's end.
    ///
    /// # Errors
    /// When the planner gives no usable decision, or what came down cannot be flown on from.
    pub fn predict(&mut self, now: Tick, ticks: u64) -> Result<Prediction, MirrorError> {
        self.look(now)?;
        let until = Tick(now.0.saturating_add(ticks)).min(self.horizon);
        let mut ahead = match &self.present {
            Some(present) => present.fork(),
            None => self.begin()?,
        };
        let mut tasks = Vec::new();
        while ahead.mission.now() < until
            && let Some(imagined) = ahead.step(self.planner.as_mut())?
        {
            tasks.push(imagined.record);
        }
        Ok(Prediction { at: now, since: self.since, until, tasks, ways: ahead.mission.ways() })
    }

    /// Compares what came down with what was predicted up to `now`, and goes on from what came down where it differs.
    ///
    /// # Errors
    /// When the planner gives no usable decision, or what came down cannot be flown on from.
    pub fn look(&mut self, now: Tick) -> Result<(), MirrorError> {
        self.now = self.now.max(now);
        self.advance()?;
        self.compare();
        if self.score.differs() && self.resume()? {
            self.advance()?;
        }
        Ok(())
    }

    /// The flight in the head at the epoch.
    fn begin(&self) -> Result<Flying, MirrorError> {
        let mission = InProcessMission::with_actions(&self.nominal, self.first.clone())?;
        Ok(Flying::new(mission, self.planner.as_ref()))
    }

    /// Flies in the head up to the last decision before now: what is asked from now on may change what comes after it.
    fn advance(&mut self) -> Result<(), MirrorError> {
        if self.present.is_none() {
            if self.now == Tick(0) {
                return Ok(());
            }
            self.present = Some(self.begin()?);
        }
        while let Some(present) = &self.present {
            let next = match self.next.take() {
                Some(next) => Some(next),
                None => {
                    let mut next = present.fork();
                    next.step(self.planner.as_mut())?.map(|imagined| (next, imagined))
                }
            };
            match next {
                Some((next, imagined)) if next.mission.now() < self.now => {
                    self.imagined.insert(imagined.record.task, imagined);
                    self.present = Some(next);
                }
                later => {
                    self.next = later;
                    break;
                }
            }
        }
        Ok(())
    }

    /// Compares the facts. They are told in classes, so what was on board and how the satellite did is looked at before
    /// how tasks went.
    fn compare(&mut self) {
        // What has happened up to now does not rest on what may still be asked.
        let newest = self.next.as_ref().map(|(next, _)| next).or(self.present.as_ref());
        let Some(apart) = newest.and_then(|flying| flying.mission.link()) else { return };
        let next = self.next.as_ref().map(|(_, imagined)| imagined);
        let imagined =
            |task: u64| self.imagined.get(&task).or_else(|| next.filter(|imagined| imagined.record.task == task));
        for fact in &self.facts {
            match fact {
                Fact::OnBoard { at, first, count } => {
                    let ids = (first.0..).take(usize::try_from(*count).unwrap_or(usize::MAX)).map(StripId);
                    let predicted = |id: StripId| (id, apart.space().on_board(id));
                    let other = ids.map(predicted).find(|(_, predicted)| *predicted != Some(*at));
                    if let Some((id, predicted)) = other {
                        let when = predicted.map_or(*at, |predicted| predicted.min(*at));
                        self.score.differ(when, Cause::Radio { id, on_board: *at, predicted });
                    }
                }
                Fact::Housekeeping(told) => {
                    if let Some(imagined) = imagined(told.task).filter(|it| it.decided == told.at) {
                        self.score.point(told, &imagined.body);
                    }
                }
                Fact::Attempted(_) => {}
            }
        }
        let records = self.imagined.values().chain(next).map(|imagined| &imagined.record);
        let foretold = records.filter(|it| it.success()).filter_map(|it| Some((it.strip?, it.start))).collect();
        let about = i64::from(self.model.period.ticks_ceil(ABOUT_S));
        for fact in &self.facts {
            if let Fact::Attempted(attempt) = fact {
                let predicted = imagined(attempt.task).map(|imagined| &imagined.record);
                self.score.attempt(attempt, predicted, &foretold, about);
            }
        }
        self.facts.clear();
    }

    /// Goes on from the last housekeeping, if that is all that is known. Returns whether it does.
    fn resume(&mut self) -> Result<bool, MirrorError> {
        let (Some(told), Some(present)) = (self.ground.housekeeping().copied(), &self.present) else {
            return Ok(false);
        };
        // How power and data stand does not come down in full.
        if told.at <= self.since || self.model.config.resources.is_some() {
            return Ok(false);
        }
        let Some(known) = self.ground.known(&told, &self.nominal.initial(), self.horizon)? else { return Ok(false) };
        let empty =
            RequestLogic::new((*self.model).clone(), &self.nominal.initial(), self.horizon, self.nominal.rules());
        let space = Catalogue::new(empty, self.radio.rates().1, self.radio.config(), self.model.period);
        let space = space.known(known, told.at);
        let apart = Apart::new(self.ground.clone(), space, self.radio.clone()).from_tick(self.now);
        let situation = told.situation(self.orbit.position(told.at), self.orbit.velocity(told.at));
        let mission = InProcessMission::resumed(&self.nominal, told.task, &situation, apart)?;
        self.present = Some(present.resumed(mission));
        self.next = None;
        self.imagined.split_off(&told.task);
        self.since = told.at;
        self.score.go_on_from(told.at);
        Ok(true)
    }
}
