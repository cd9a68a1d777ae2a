//! The ground's end: takes what is asked for, sends it up, and learns what became of it.

use std::collections::{BTreeMap, VecDeque};

use serde::Serialize;
use swath_sim::time::Tick;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::world::strip::StripId;

use super::end::{Counts, End, Kept, Rates, Sent};
use super::frame::CLASSES;
use super::message::{CHANGES, Down, Housekeeping, ORDERS, RESULTS, Up, Wish, item, message};
use crate::orders::action::{Act, Action, Review};
use crate::requests::journal::{Attempt, Entry, Progress};
use crate::requests::lifecycle::State;
use crate::requests::logic::{Contradiction, RequestLogic};
use crate::requests::refusal::{Refusal, check_text};

/// The way of a request up, and of its image down. Times are by the clock of who noted them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Way {
    /// When the ground took it and it began to wait for a pass.
    pub queued: Tick,
    /// When the ground sent it first.
    pub uplinked: Option<Tick>,
    /// When the satellite took it up, by the satellite's clock.
    pub on_board: Option<Tick>,
    /// When the ground knew that.
    pub acknowledged: Option<Tick>,
    /// When it was imaged, by the satellite's clock.
    pub imaged: Option<Tick>,
    /// When the ground knew that.
    pub known: Option<Tick>,
    /// When all of the image was on the ground.
    pub delivered: Option<Tick>,
    /// Parts of the image that are.
    parts: u32,
}

/// A change that the satellite decides on.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// What was asked for.
    pub action: Action,
    /// When the ground sent it first.
    pub uplinked: Option<Tick>,
    /// When the satellite decided, by the satellite's clock.
    pub decided: Option<Tick>,
    /// When the ground knew that.
    pub answered: Option<Tick>,
    /// Why it was refused, such as because it came too late.
    pub refusal: Option<String>,
}

/// What the ground has come to know of the flight.
#[derive(Clone, Debug, PartialEq)]
pub enum Fact {
    /// Requests were taken up on board.
    OnBoard {
        /// When.
        at: Tick,
        /// Number of the first.
        first: StripId,
        /// How many.
        count: u64,
    },
    /// An attempt has ended.
    Attempted(Attempt),
    /// How the satellite did.
    Housekeeping(Housekeeping),
}

/// The satellite at the decision of which housekeeping tells, as far as the ground knows it.
#[derive(Clone, Debug)]
pub struct Known {
    /// What was on board.
    pub requests: RequestLogic,
    /// When each of them was taken up.
    pub on_board: Vec<Tick>,
    /// What has come over the radio.
    pub kept: Kept,
    /// Images that are not on the ground as a whole, the oldest first, with the parts that are.
    pub images: Vec<(StripId, u32)>,
}

/// What an item on the way up is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum About {
    /// A request, which may be one for each way.
    Request(StripId, u64),
    /// A change, by its number.
    Change(u64),
}

/// The ground's requests, and what it has heard of the satellite's.
#[derive(Clone, Debug)]
pub struct Ground {
    requests: RequestLogic,
    end: End,
    rates: Rates,
    ways: Vec<Way>,
    asked: Vec<Asked>,
    /// Items that were not sent yet, by class: their numbers, and what they are about.
    unsent: [VecDeque<(u64, About)>; 2],
    /// Number of the last item in the class of orders that is about a request.
    in_line: BTreeMap<StripId, u64>,
    housekeeping: Option<Housekeeping>,
    misread: u64,
    /// Number after the last result that changed what may be imaged.
    settling: u64,
    /// What came to be known since that was taken last, where somebody wants to know.
    facts: Option<Vec<Fact>>,
}

impl Ground {
    /// A ground of which nothing was asked yet.
    #[must_use]
    pub fn new(requests: RequestLogic, rates: Rates) -> Self {
        Self {
            requests,
            end: End::new(rates),
            rates,
            ways: Vec::new(),
            asked: Vec::new(),
            unsent: Default::default(),
            in_line: BTreeMap::new(),
            housekeeping: None,
            misread: 0,
            settling: 0,
            facts: None,
        }
    }

    /// From now on, notes what it comes to know.
    pub fn note_facts(&mut self) {
        self.facts.get_or_insert_default();
    }

    /// What came to be known since the last call.
    pub fn take_facts(&mut self) -> Vec<Fact> {
        self.facts.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// The one that takes over when this one is lost: it knows what was kept, and nothing else.
    ///
    /// # Errors
    /// When a request is no strip.
    pub fn restarted(&self, initial: &InitialState, horizon: Tick) -> Result<Self, Refusal> {
        Ok(Self {
            requests: self.requests.restarted(initial, horizon)?,
            end: End::restored(self.rates, self.end.kept()),
            ..self.clone()
        })
    }

    /// The requests as the ground knows them.
    #[must_use]
    pub fn requests(&self) -> &RequestLogic {
        &self.requests
    }

    /// The way of a request.
    #[must_use]
    pub fn way(&self, id: StripId) -> Option<&Way> {
        self.ways.get(id.index()?)
    }

    /// Changes that were asked for, by their numbers from 1.
    #[must_use]
    pub fn asked(&self) -> &[Asked] {
        &self.asked
    }

    /// The last housekeeping that came down.
    #[must_use]
    pub fn housekeeping(&self) -> Option<&Housekeeping> {
        self.housekeeping.as_ref()
    }

    /// What was seen of the air.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.end.counts()
    }

    /// Messages that came whole and could not be read.
    #[must_use]
    pub fn misread(&self) -> u64 {
        self.misread
    }

    /// Changes and orders that are not known to have arrived.
    #[must_use]
    pub fn waiting(&self) -> u64 {
        self.waiting_by_class().iter().sum()
    }

    /// The same by class.
    #[must_use]
    pub fn waiting_by_class(&self) -> [u64; CLASSES] {
        self.end.waiting()
    }

    /// Takes what is asked for. A request gets its number at once; what is asked of a request is decided on board.
    ///
    /// Returns the number of the request that it is about; none for what is the planner's.
    ///
    /// # Errors
    /// Why it is refused at once.
    pub fn ask(&mut self, action: Action, now: Tick) -> Result<Option<StripId>, Refusal> {
        self.requests.wait_until(now);
        check_text("actor", &action.actor)?;
        check_text("reason", &action.reason)?;
        let known = self.requests.len();
        match action.act.clone() {
            Act::Submit(_, order) => {
                let id = self.requests.submit(*order.clone(), now)?;
                self.send_order(known, *order, None, now);
                Ok(Some(id))
            }
            Act::Replace(old, order) => {
                let id = self.requests.replace_when_heard(old, *order.clone(), now)?;
                self.send_order(known, *order, Some(old), now);
                Ok(Some(id))
            }
            Act::Cancel(id) => {
                self.requests.still_open(id, State::CancelledByUser)?;
                self.send_change(action, id, Wish::Cancel);
                Ok(Some(id))
            }
            Act::Review(id, review) => {
                let to = match review {
                    Review::Release => State::Accepted,
                    Review::Reject => State::Rejected,
                    Review::Hold => State::Held,
                };
                self.requests.still_open(id, to)?;
                self.send_change(action, id, Wish::Review(review));
                Ok(Some(id))
            }
            // These are the planner's.
            Act::SetMode(_) | Act::Decide { .. } => Ok(None),
        }
    }

    /// Sends up the requests from number `known` + 1 on; none when what was asked for was known.
    fn send_order(&mut self, known: usize, order: crate::orders::order::Order, replaces: Option<StripId>, now: Tick) {
        let count = self.requests.len() - known;
        if count == 0 {
            return;
        }
        let id = StripId::from_index(known);
        self.ways.resize(self.requests.len(), Way { queued: now, ..Way::default() });
        let number = self.end.push(ORDERS, item(&Up::Order { id, at: now, replaces, order: Box::new(order) }, 0));
        self.unsent[ORDERS].push_back((number, About::Request(id, count as u64)));
        for id in (id.0..).take(count).map(StripId).chain(replaces) {
            self.in_line.insert(id, number);
        }
    }

    fn send_change(&mut self, action: Action, id: StripId, wish: Wish) {
        let number = self.asked.len() as u64 + 1;
        let (actor, reason) = (action.actor.clone(), action.reason.clone());
        let change = item(&Up::Change { number, id, wish, actor, reason }, 0);
        // What overtakes must not overtake what it is about.
        let behind = self.in_line.get(&id).is_some_and(|&last| last >= self.end.arrived(ORDERS));
        let class = if behind { ORDERS } else { CHANGES };
        let item = self.end.push(class, change);
        if behind {
            self.in_line.insert(id, item);
        }
        self.unsent[class].push_back((item, About::Change(number)));
        self.requests.asked(action.clone());
        self.asked.push(Asked { action, uplinked: None, decided: None, answered: None, refusal: None });
    }

    /// A frame is heard.
    pub fn hear(&mut self, now: Tick, bytes: &[u8]) {
        let Ok(arrivals) = self.end.hear(now, bytes) else { return };
        self.requests.wait_until(now);
        for arrival in arrivals {
            match message::<Down>(&arrival.item) {
                Some(down) => {
                    if arrival.class == RESULTS && settles(&down) {
                        self.settling = arrival.number + 1;
                    }
                    self.learn(now, down);
                }
                None => self.misread += 1,
            }
        }
    }

    fn learn(&mut self, now: Tick, down: Down) {
        if let Some(facts) = &mut self.facts {
            facts.extend(fact(&down));
        }
        match down {
            Down::OnBoard { at, first, count } => {
                let from = first.index().unwrap_or(usize::MAX);
                for way in self.ways.iter_mut().skip(from).take(usize::try_from(count).unwrap_or(usize::MAX)) {
                    (way.on_board, way.acknowledged) = (Some(at), Some(now));
                }
            }
            Down::Answer { number, at, refusal } => {
                let asked = usize::try_from(number).ok().and_then(|number| self.asked.get_mut(number.checked_sub(1)?));
                if let Some(asked) = asked {
                    (asked.decided, asked.answered, asked.refusal) = (Some(at), Some(now), refusal);
                }
            }
            Down::Changed(change) => {
                self.requests.adopt(&change);
                let imaged = matches!(change.state, State::Completed | State::FulfilledByLink);
                if let Some(way) = self.way_mut(change.id).filter(|way| imaged && way.imaged.is_none()) {
                    (way.imaged, way.known) = (Some(change.tick), Some(now));
                }
            }
            Down::Attempted(attempt) => self.requests.adopt_attempt(attempt),
            Down::Housekeeping(housekeeping) => self.housekeeping = Some(housekeeping),
            Down::Image { id, of, .. } => {
                if let Some(way) = self.way_mut(id) {
                    way.parts += 1;
                    if way.parts == of {
                        way.delivered = Some(now);
                    }
                }
            }
        }
    }

    /// The satellite at the decision of which housekeeping tells; none where what is known is older or newer than that.
    ///
    /// # Errors
    /// When a request is no strip.
    pub fn known(
        &self,
        housekeeping: &Housekeeping,
        initial: &InitialState,
        horizon: Tick,
    ) -> Result<Option<Known>, Refusal> {
        let newer = self.settling > housekeeping.results || self.end.to_come(RESULTS) < housekeeping.results;
        let on_board: Vec<Tick> =
            self.ways.iter().map_while(|way| way.on_board.filter(|_| way.acknowledged.is_some())).collect();
        // What has arrived, and is not known to have been taken up.
        let next = StripId::from_index(on_board.len());
        let between = self.in_line.get(&next).is_some_and(|item| *item < self.end.arrived(ORDERS));
        if newer || between {
            return Ok(None);
        }
        let progress = Progress { now: housekeeping.at, settled: housekeeping.task, ..Progress::default() };
        let requests = self.requests.as_on_board(initial, horizon, on_board.len(), progress)?;
        let class = std::array::from_fn::<_, CLASSES, _>(|class| class);
        let kept = Kept {
            to_send: class.map(|class| (self.end.to_come(class), Vec::new())),
            received: class.map(|class| self.end.arrived(class)),
        };
        let mut images: Vec<_> = (1..).map(StripId).zip(&self.ways).collect();
        images.retain(|(id, way)| self.requests.state(*id) == Some(State::Completed) && way.delivered.is_none());
        images.sort_by_key(|(id, way)| (way.imaged, *id));
        let images = images.into_iter().map(|(id, way)| (id, way.parts)).collect();
        Ok(Some(Known { requests, on_board, kept, images }))
    }

    fn way_mut(&mut self, id: StripId) -> Option<&mut Way> {
        self.ways.get_mut(id.index()?)
    }

    /// Changes that were reported since the last call and that the life cycle does not have.
    pub fn take_contradictions(&mut self) -> Vec<Contradiction> {
        self.requests.take_contradictions()
    }

    /// What leaves at a tick at which the radio is open.
    pub fn transmit(&mut self, now: Tick) -> Vec<Sent> {
        let frames = self.end.transmit(now);
        for class in [CHANGES, ORDERS] {
            let sent = self.end.sent(class);
            while let Some((_, about)) = self.unsent[class].pop_front_if(|(number, _)| *number < sent) {
                match about {
                    About::Request(first, count) => {
                        for id in (first.0..).map(StripId).take(count as usize) {
                            if let Some(way) = self.way_mut(id) {
                                way.uplinked = Some(now);
                            }
                        }
                    }
                    About::Change(number) => {
                        if let Some(asked) = self.asked.get_mut(number as usize - 1) {
                            asked.uplinked = Some(now);
                        }
                    }
                }
            }
        }
        frames
    }

    /// Lines of the journal since the last call.
    pub fn take_journal(&mut self) -> Vec<Entry> {
        self.requests.take_journal()
    }

    /// Simulated time goes on.
    pub fn wait_until(&mut self, now: Tick) {
        self.requests.wait_until(now);
    }

    /// Each request with its way, in the order of their numbers.
    pub fn lines(&self) -> impl Iterator<Item = WayLine> {
        (1..).map(StripId).zip(&self.ways).filter_map(|(id, way)| {
            let request = self.requests.request(id)?;
            Some(WayLine {
                strip: id.0,
                name: request.order.name.clone(),
                state: request.state.name(),
                queued_tick: way.queued,
                uplinked_tick: way.uplinked,
                on_board_tick: way.on_board,
                acknowledged_tick: way.acknowledged,
                imaged_tick: way.imaged,
                known_tick: way.known,
                delivered_tick: way.delivered,
            })
        })
    }
}

/// One line of `strips.jsonl`: a request and its way over the radio, as the ground knows it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WayLine {
    /// Number of the strip.
    pub strip: u64,
    /// Its name.
    pub name: String,
    /// Its state.
    pub state: &'static str,
    /// See [`Way`].
    pub queued_tick: Tick,
    /// See [`Way`].
    pub uplinked_tick: Option<Tick>,
    /// See [`Way`].
    pub on_board_tick: Option<Tick>,
    /// See [`Way`].
    pub acknowledged_tick: Option<Tick>,
    /// See [`Way`].
    pub imaged_tick: Option<Tick>,
    /// See [`Way`].
    pub known_tick: Option<Tick>,
    /// See [`Way`].
    pub delivered_tick: Option<Tick>,
}

/// Whether a result changes what may be imaged.
fn settles(down: &Down) -> bool {
    match down {
        Down::Changed(change) => !matches!(change.state, State::Scheduled | State::Executing),
        _ => true,
    }
}

fn fact(down: &Down) -> Option<Fact> {
    match down {
        Down::OnBoard { at, first, count } => Some(Fact::OnBoard { at: *at, first: *first, count: *count }),
        Down::Attempted(attempt) => Some(Fact::Attempted(attempt.clone())),
        Down::Housekeeping(housekeeping) => Some(Fact::Housekeeping(*housekeeping)),
        Down::Answer { .. } | Down::Changed(_) | Down::Image { .. } => None,
    }
}
