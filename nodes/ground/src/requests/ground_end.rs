//! The ground's end of the radio as the request manager keeps it: what it is told is written down, and told again to
//! whoever takes over.

use anyhow::{Context, Result};
use swath_mission::file::Mission;
use swath_mission::link::end::Sent;
use swath_mission::link::ground::Ground;
use swath_mission::link::radio::Radio;
use swath_mission::link::told::{Answer, Told};
use swath_mission::orders::action::{Act, Action};
use swath_mission::requests::journal::Entry;
use swath_mission::requests::logic::RequestLogic;
use swath_mission::requests::refusal::Refusal;
use swath_sim::time::Tick;
use swath_sim::vehicle::model::Model;
use swath_sim::world::strip::StripId;

use super::foresight::Foresight;
use super::store::Store;

/// How old a prediction may be where the radio never closes [ticks].
const FORESEE_TICKS: i64 = 2400;

/// The ground of a mission, and its place in the radio's time.
pub struct GroundEnd {
    ground: Ground,
    /// What it was told that is not written down yet, and what came of it.
    journal: Vec<Entry>,
    /// The radio's tick that was heard last, and the next one.
    heard: Option<Tick>,
    next: Tick,
    /// Simulated time.
    clock: Tick,
    /// Whether the radio is at its tick: what is asked now counts there.
    at_it: bool,
    horizon: Tick,
    /// What was sent last, and when.
    sent: Option<(Tick, Vec<Sent>)>,
    /// The mirror, where there is one, and the tick from which on it was asked last.
    foresight: Option<Foresight>,
    foresaw: Option<Tick>,
    /// Whether the radio was open when it was heard last.
    open: bool,
}

impl GroundEnd {
    /// The ground of a mission at the epoch; none without a radio.
    ///
    /// # Errors
    /// When a station is not there.
    pub fn new(mission: &Mission, model: &Model) -> Result<Option<Self>> {
        let Some(radio) = Radio::of(mission, model)? else { return Ok(None) };
        let horizon = mission.horizon(model);
        let requests = RequestLogic::new(model.clone(), &mission.initial(), horizon, mission.rules());
        let ground = Ground::new(requests, radio.rates().0);
        Ok(Some(Self {
            ground,
            journal: Vec::new(),
            heard: None,
            next: Tick(0),
            clock: Tick(0),
            at_it: false,
            horizon,
            sent: None,
            foresight: None,
            foresaw: None,
            open: false,
        }))
    }

    /// From now on, tells a mirror what it is told itself.
    pub fn foresee(&mut self, foresight: Option<Foresight>) {
        self.foresight = foresight;
    }

    /// The mirror, if there is one.
    #[must_use]
    pub fn foresight(&self) -> Option<&Foresight> {
        self.foresight.as_ref()
    }

    /// The same, for what it says.
    pub fn foresight_mut(&mut self) -> Option<&mut Foresight> {
        self.foresight.as_mut()
    }

    /// No prediction is wanted any more.
    pub fn end_foresight(&mut self) {
        self.foresight = None;
    }

    /// The ground as a store has it: it is told all that the one before was told.
    ///
    /// # Errors
    /// When the store cannot be read.
    pub fn take_up(&mut self, store: &Store) -> Result<()> {
        for bytes in store.told()? {
            let told = Told::decode(&bytes).with_context(|| format!("store {} is damaged", store.path().display()))?;
            let tick = Some(told.at()).filter(|_| !matches!(told, Told::Asked(_)));
            self.heard = self.heard.max(tick);
            self.foresight.iter().for_each(|foresight| foresight.tell(&told));
            if let (Answer::Sent(sent), Some(tick)) = (self.ground.tell(&told), tick) {
                self.sent = Some((tick, sent));
            }
        }
        // It is in the store.
        self.ground.take_journal();
        Ok(())
    }

    /// The ground.
    #[must_use]
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    /// The ground alone.
    #[must_use]
    pub fn into_ground(self) -> Ground {
        self.ground
    }

    /// The same, for what it reports.
    pub fn ground_mut(&mut self) -> &mut Ground {
        &mut self.ground
    }

    /// Simulated time is at least this.
    pub fn at(&mut self, now: Tick) {
        self.clock = self.clock.max(now.min(self.horizon));
    }

    /// Simulated time.
    #[must_use]
    pub fn now(&self) -> Tick {
        self.clock
    }

    /// The tick at which something that is asked now counts; none while the radio has to be heard first.
    #[must_use]
    pub fn asking(&self) -> Option<Tick> {
        let heard = self.heard?;
        if self.at_it || heard >= self.horizon {
            return Some(heard);
        }
        Some(self.clock.max(heard.after(1))).filter(|tick| *tick < self.next)
    }

    /// Something is asked of the ground.
    ///
    /// # Errors
    /// Why it is refused at once.
    pub fn ask(&mut self, actor: &str, reason: &str, act: Act) -> Result<StripId, Refusal> {
        let at = self.asking().unwrap_or(Tick(0));
        let action =
            Action { at, initial: self.heard.is_none(), actor: actor.to_owned(), reason: reason.to_owned(), act };
        let answer = self.tell(Told::Asked(action));
        if self.heard.is_some() {
            self.want_prediction(at);
        }
        match answer {
            Answer::Asked(asked) => asked.map(|id| id.unwrap_or(StripId(0))),
            Answer::Nothing | Answer::Sent(_) => Ok(StripId(0)),
        }
    }

    /// The radio comes to a tick: hears its frames. Returns whether that is news; then [`Self::send`] follows.
    pub fn hear(&mut self, tick: Tick, next: Tick, frames: Vec<Vec<u8>>) -> bool {
        if self.heard.is_some_and(|heard| tick <= heard) {
            // One that was started again has not heard how long the radio pauses.
            self.next = self.next.max(if self.heard == Some(tick) { next } else { tick });
            return false;
        }
        (self.heard, self.next, self.at_it) = (Some(tick), next, true);
        self.at(tick);
        self.ground.wait_until(tick);
        for frame in frames {
            self.tell(Told::Heard(tick, frame));
        }
        true
    }

    /// The ground sends at the tick that was heard, if the radio is open.
    pub fn send(&mut self, tick: Tick, open: bool) -> Vec<Sent> {
        self.at_it = false;
        let closed = std::mem::replace(&mut self.open, open) && !open;
        if closed || self.foresaw.is_none_or(|last| tick.since(last) >= FORESEE_TICKS) {
            self.want_prediction(tick);
        }
        let sent = match open.then(|| self.tell(Told::Open(tick))) {
            Some(Answer::Sent(sent)) => sent,
            _ => Vec::new(),
        };
        self.sent = Some((tick, sent.clone()));
        sent
    }

    /// What was sent at a tick, if it was the last one.
    #[must_use]
    pub fn sent_at(&self, tick: Tick) -> Option<Vec<Sent>> {
        match &self.sent {
            Some((last, sent)) if *last == tick => Some(sent.clone()),
            // Where it was not open, nothing was sent.
            _ => (self.heard == Some(tick)).then(Vec::new),
        }
    }

    /// What is to be written down.
    pub fn take_journal(&mut self) -> Vec<Entry> {
        std::mem::take(&mut self.journal)
    }

    /// A prediction from a tick on is wanted: at the start, after each pass, when something is asked, and from time to time.
    fn want_prediction(&mut self, tick: Tick) {
        self.foresaw = Some(tick);
        self.foresight.iter().for_each(|foresight| foresight.want(tick));
    }

    fn tell(&mut self, told: Told) -> Answer {
        self.foresight.iter().for_each(|foresight| foresight.tell(&told));
        self.journal.push(Entry::Told(told.encode()));
        let answer = self.ground.tell(&told);
        self.journal.extend(self.ground.take_journal());
        answer
    }
}
