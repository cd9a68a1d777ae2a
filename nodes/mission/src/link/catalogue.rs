//! The satellite's end: what has been uplinked, what of it may be imaged next, and what must come down.

use swath_sim::task::TaskRecord;
use swath_sim::time::{Tick, TickPeriod};
use swath_sim::vehicle::flight::Situation;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::world::strip::StripId;

use super::config::{CommandLossMode, LinkConfig};
use super::end::{Counts, End, Rates, Sent};
use super::ground::Known;
use super::message::{Down, HOUSEKEEPING, Housekeeping, IMAGES, RESULTS, Up, Wish, item, message};
use crate::requests::journal::{Change, Entry, InFlight};
use crate::requests::lifecycle::State;
use crate::requests::logic::{Abort, Contradiction, Offer, RequestLogic};
use crate::requests::refusal::Refusal;

/// Least time between two messages of housekeeping [s].
const HOUSEKEEPING_S: f64 = 60.0;
/// What a part of an image needs in a frame beside its data [bit].
const PART_BITS: u64 = 512;

/// The on-board catalogue.
#[derive(Clone, Debug)]
pub struct Catalogue {
    requests: RequestLogic,
    end: End,
    rates: Rates,
    strip_bits: u64,
    /// Time without a frame from the ground after which it is lost [ticks].
    command_loss: Option<u64>,
    command_loss_mode: CommandLossMode,
    /// When a frame from the ground was heard last.
    heard: Tick,
    /// How often housekeeping is sent [ticks], and when it was last.
    housekeeping: (u64, Option<Tick>),
    misread: u64,
    /// When each request was taken up, in the order of their numbers.
    on_board: Vec<Tick>,
}

impl Catalogue {
    /// A catalogue to which nothing was uplinked yet.
    #[must_use]
    pub fn new(requests: RequestLogic, rates: Rates, config: &LinkConfig, period: TickPeriod) -> Self {
        Self {
            requests,
            end: End::new(rates),
            rates,
            strip_bits: config.strip_bits as u64,
            command_loss: config.command_loss_h.map(|hours| u64::from(period.ticks_ceil(hours * 3600.0))),
            command_loss_mode: config.command_loss_mode,
            heard: Tick(0),
            housekeeping: (u64::from(period.ticks_ceil(HOUSEKEEPING_S)), None),
            misread: 0,
            on_board: Vec::new(),
        }
    }

    /// One that goes on from what the ground knows: what is on board and when it was taken up, how far the radio has
    /// come, and when the ground was heard last.
    #[must_use]
    pub fn known(mut self, known: Known, heard: Tick) -> Self {
        self.end = End::restored(self.rates, known.kept);
        for (id, parts) in known.images {
            self.send_image(id, parts);
        }
        Self { requests: known.requests, on_board: known.on_board, heard, ..self }
    }

    /// When a request was taken up.
    #[must_use]
    pub fn on_board(&self, id: StripId) -> Option<Tick> {
        self.on_board.get(id.index()?).copied()
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

    /// What has been uplinked.
    #[must_use]
    pub fn requests(&self) -> &RequestLogic {
        &self.requests
    }

    /// What was seen of the air.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.end.counts()
    }

    /// Messages that came whole and could not be read or taken.
    #[must_use]
    pub fn misread(&self) -> u64 {
        self.misread
    }

    /// Whether nothing was heard of the ground for so long that it is lost.
    #[must_use]
    pub fn command_lost(&self, now: Tick) -> bool {
        self.command_loss.is_some_and(|patience| now.0.saturating_sub(self.heard.0) >= patience)
    }

    /// Whether nothing is imaged because the ground is lost.
    #[must_use]
    pub fn holds(&self, now: Tick) -> bool {
        self.command_loss_mode == CommandLossMode::Hold && self.command_lost(now)
    }

    /// When a frame from the ground was heard last; the epoch before any.
    #[must_use]
    pub fn heard(&self) -> Tick {
        self.heard
    }

    /// A frame is heard.
    pub fn hear(&mut self, now: Tick, bytes: &[u8]) {
        let heard = self.end.counts().heard;
        let Ok(arrivals) = self.end.hear(now, bytes) else { return };
        if self.end.counts().heard > heard {
            self.heard = now;
        }
        self.requests.wait_until(now);
        let mut known = self.requests.len();
        for arrival in arrivals {
            match message::<Up>(&arrival.item) {
                Some(Up::Order { id, at, replaces, order }) => {
                    if let Err(refusal) = self.requests.take_up(id, &order, at, replaces) {
                        self.misread += 1;
                        tracing::error!("request {} cannot be taken up on board: {refusal}", id.0);
                    }
                }
                Some(Up::Change { number, id, wish, actor, reason }) => {
                    self.tell_taken_up(now, &mut known);
                    let done = match wish {
                        Wish::Cancel => self.requests.cancel(id, &actor, &reason),
                        Wish::Review(review) => self.requests.review(id, review, &actor, &reason),
                    };
                    self.tell_journal();
                    let refusal = done.err().map(|refusal| refusal.to_string());
                    self.tell(RESULTS, &Down::Answer { number, at: now, refusal });
                }
                None => self.misread += 1,
            }
        }
        self.tell_taken_up(now, &mut known);
        self.tell_journal();
    }

    /// The requests from number `known` + 1 on were taken up.
    fn tell_taken_up(&mut self, now: Tick, known: &mut usize) {
        let count = self.requests.len() - *known;
        if count > 0 {
            self.on_board.resize(self.requests.len(), now);
            let first = StripId::from_index(*known);
            self.tell(RESULTS, &Down::OnBoard { at: now, first, count: count as u64 });
            *known += count;
        }
    }

    /// A strip was chosen as the next task.
    pub fn on_task(&mut self, flown: InFlight) {
        self.requests.on_task(flown);
        self.tell_journal();
    }

    /// Imaging of a task has begun.
    pub fn on_imaging(&mut self, task: u64, tick: Tick) {
        self.requests.on_imaging(task, tick);
        self.tell_journal();
    }

    /// A task has ended. Returns its reward.
    pub fn on_result(&mut self, record: &TaskRecord) -> f64 {
        let reward = self.requests.on_result(record);
        self.tell_journal();
        reward
    }

    /// A task is wanted: what may be imaged.
    pub fn on_decision_point(&mut self, task: u64, situation: &Situation) -> Offer {
        self.requests.set_situation(*situation);
        let offer = self.requests.on_decision_point(task, situation.now, &[]);
        self.tell_journal();
        let (every, last) = self.housekeeping;
        if last.is_none_or(|last| situation.now.since(last) >= every as i64) {
            self.housekeeping.1 = Some(situation.now);
            let housekeeping = Housekeeping {
                at: situation.now,
                task,
                sigma_bn: situation.body.sigma_BN.into(),
                omega_bn_b: situation.body.omega_BN_B.into(),
                wheel_speed: situation.body.wheel_speed.into(),
                servo_integral: situation.servo_integral.into(),
                torque_pending: situation.torque_pending.into(),
                wheels: situation.wheels.into(),
                results: self.end.next(RESULTS),
                pending: offer.pending as u64,
                imaged: offer.fulfilled as u64,
            };
            self.tell(HOUSEKEEPING, &Down::Housekeeping(housekeeping));
        }
        offer
    }

    /// Tasks to give up since the last call.
    pub fn take_aborts(&mut self) -> Vec<Abort> {
        self.requests.take_aborts()
    }

    /// Changes that were reported since the last call and that the life cycle does not have.
    pub fn take_contradictions(&mut self) -> Vec<Contradiction> {
        self.requests.take_contradictions()
    }

    /// What leaves at a tick at which the radio is open.
    pub fn transmit(&mut self, now: Tick) -> Vec<Sent> {
        self.end.transmit(now)
    }

    fn tell(&mut self, class: usize, down: &Down) {
        self.end.push(class, item(down, 0));
    }

    fn tell_journal(&mut self) {
        for entry in self.requests.take_journal() {
            match entry {
                Entry::Changed(change) => {
                    let imaged = (change.state == State::Completed).then_some(change.id);
                    self.tell(RESULTS, &Down::Changed(Change { refused: None, ..change }));
                    imaged.into_iter().for_each(|id| self.send_image(id, 0));
                }
                Entry::Attempted(attempt) => self.tell(RESULTS, &Down::Attempted(attempt)),
                Entry::Added(_) | Entry::Taken(_) | Entry::Told(_) => {}
            }
        }
    }

    /// An image comes down in parts of a frame each, from a part on.
    fn send_image(&mut self, id: StripId, from: u32) {
        let most = self.end.frame_bits().saturating_sub(PART_BITS).max(1);
        let of = self.strip_bits.div_ceil(most);
        for part in u64::from(from)..of {
            let bits = most.min(self.strip_bits - part * most);
            self.end.push(IMAGES, item(&Down::Image { id, part: part as u32, of: of as u32 }, bits));
        }
    }
}
