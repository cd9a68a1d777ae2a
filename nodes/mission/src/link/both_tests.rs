//! Ground and satellite that are killed at any tick, over a radio that loses frames: nothing is lost, doubled or invented.

use rand::RngExt as _;
use swath_sim::config::SimConfig;
use swath_sim::mission::horizon;
use swath_sim::requests::scenario::ScenarioConfig;
use swath_sim::rng::{self, Rng};
use swath_sim::task::{FailureReason, TaskOutcome, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::{Flight, Situation};
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model;
use swath_sim::vehicle::spacecraft::Spacecraft;
use swath_sim::world::strip::StripId;

use super::catalogue::Catalogue;
use super::config::LinkConfig;
use super::end::Rates;
use super::ground::Ground;
use crate::orders::action::{Act, Action, Review};
use crate::orders::order::Order;
use crate::requests::journal::InFlight;
use crate::requests::lifecycle::State;
use crate::requests::logic::{RequestLogic, Rules};

/// Ticks in which things are asked and imaged.
const BUSY: u64 = 3000;
/// Ticks in which all of it comes down.
const QUIET: u64 = 3000;

/// Both, what is under way between them, and a satellite that images whatever it is offered.
struct Both {
    ground: Ground,
    space: Catalogue,
    up: Vec<(u64, Vec<u8>)>,
    down: Vec<(u64, Vec<u8>)>,
    origin: (InitialState, Tick),
    situation: Situation,
    flown: Option<InFlight>,
    task: u64,
    rng: Rng,
    loss: f64,
    kill: f64,
    /// Strips imaged, each time.
    imaged: Vec<StripId>,
}

impl Both {
    fn new(seed: u64, loss: f64, kill: f64) -> Self {
        let model = Model::new(SimConfig::default()).unwrap();
        let initial = InitialState::draw(&model.config, &mut rng::stream(seed, rng::INITIAL_STATE));
        let end = horizon(&model, 4.0);
        let rules = Rules { epoch_ns: 1_767_225_600_000_000_000, max_attempts: 2 };
        let requests = RequestLogic::new(model.clone(), &initial, end, rules);
        let config = LinkConfig { strip_bits: 50e3, ..LinkConfig::default() };
        let situation = Flight::new(&model, Spacecraft::new(&model, &initial)).situation();
        Self {
            ground: Ground::new(requests.clone(), Rates::new(1000, 10_000, 3, 40)),
            space: Catalogue::new(requests, Rates::new(10_000, 1000, 3, 40), &config, model.period),
            up: Vec::new(),
            down: Vec::new(),
            origin: (initial, end),
            situation,
            flown: None,
            task: 0,
            rng: rng::stream(seed, 1000),
            loss,
            kill,
            imaged: Vec::new(),
        }
    }

    fn chance(&mut self, probability: f64) -> bool {
        self.rng.random::<f64>() < probability
    }

    fn step(&mut self, tick: u64, busy: bool) {
        let now = Tick(tick);
        for (_, bytes) in self.up.extract_if(.., |(at, _)| *at <= tick) {
            self.space.hear(now, &bytes);
        }
        for (_, bytes) in self.down.extract_if(.., |(at, _)| *at <= tick) {
            self.ground.hear(now, &bytes);
        }
        self.fly(now, busy);
        if self.chance(self.kill) {
            self.ground = self.ground.restarted(&self.origin.0, self.origin.1).unwrap();
        }
        if self.chance(self.kill) {
            self.space = self.space.restarted(&self.origin.0, self.origin.1).unwrap();
        }
        for sent in self.ground.transmit(now) {
            let (late, lost) = (self.rng.random_range(1..4), self.chance(self.loss));
            self.up.extend((!lost).then_some((tick + sent.air_ticks + late, sent.bytes)));
        }
        for sent in self.space.transmit(now) {
            let (late, lost) = (self.rng.random_range(1..4), self.chance(self.loss));
            self.down.extend((!lost).then_some((tick + sent.air_ticks + late, sent.bytes)));
        }
        assert!(self.space.take_contradictions().is_empty());
        assert!(self.ground.take_contradictions().is_empty());
    }

    /// Ten ticks to turn, ten to image; some tasks fail, and some are given up.
    fn fly(&mut self, now: Tick, busy: bool) {
        if let Some(flown) = self.flown {
            let given_up = self.space.take_aborts().iter().any(|abort| abort.task == flown.task);
            if now == flown.start.after(flown.t_pre) && !given_up {
                self.space.on_imaging(flown.task, now);
            }
            let end = flown.start.after(flown.t_pre).after(flown.t_acq);
            if !given_up && now < end {
                return;
            }
            let failure = match given_up {
                true => Some(FailureReason::Interrupted),
                false => self.chance(0.3).then_some(FailureReason::Attitude),
            };
            self.flown = None;
            let InFlight { task, id, start, t_pre, t_acq } = flown;
            let outcome = TaskOutcome { failure, max_attitude_error: 0.01, min_elevation: 1.0 };
            let strip = Some(id);
            self.space.on_result(&TaskRecord { task, start, end: now, strip, duty: None, t_pre, t_acq, outcome });
            self.imaged.extend(failure.is_none().then_some(id));
            self.task += 1;
        }
        let situation = Situation { now, ..self.situation };
        let offer = self.space.on_decision_point(self.task, &situation);
        if let Some(chosen) = offer.candidates.first().filter(|_| busy) {
            let flown = InFlight { task: self.task, id: chosen.id, start: now, t_pre: 10, t_acq: 10 };
            self.space.on_task(flown);
            self.flown = Some(flown);
        }
    }

    /// Something is asked for.
    fn ask(&mut self, now: Tick, number: usize) {
        let known = self.ground.requests().len() as u64;
        let id = StripId(self.rng.random_range(1..=known.max(1)));
        let act = match self.rng.random_range(0..10) {
            0 => Act::Cancel(id),
            1 => Act::Review(id, Review::Hold),
            2 => Act::Review(id, Review::Release),
            3 if known > 0 => {
                let mut order = self.ground.requests().request(id).unwrap().order.clone();
                order.client_ref = format!("instead-{number}");
                Act::Replace(id, Box::new(order))
            }
            _ => {
                let mut requests = ScenarioConfig::default().generate(&mut self.rng, 1, 6_378_136.6);
                let order = Order::new(format!("order-{number}"), String::new(), requests.remove(0));
                Act::Submit(StripId(0), Box::new(order))
            }
        };
        let (actor, reason) = ("ops".to_owned(), "test".to_owned());
        // Many strips are never seen in this time: those are refused.
        _ = self.ground.ask(Action { at: now, initial: false, actor, reason, act }, now);
    }
}

#[test]
fn whoever_is_killed_each_order_is_on_board_once_and_both_records_are_the_same() {
    let (mut orders, mut imaged, mut late) = (0, 0, 0);
    for seed in 0..40 {
        let (loss, kill) = ([0.0, 0.1, 0.5][seed as usize % 3], [0.0, 0.01, 0.05][seed as usize / 3 % 3]);
        let mut both = Both::new(seed, loss, kill);
        for tick in 0..BUSY + QUIET {
            if tick < BUSY && both.chance(0.05) {
                both.ask(Tick(tick), tick as usize);
            }
            both.step(tick, tick < BUSY);
        }
        both.kill = 0.0;
        (BUSY + QUIET..BUSY + 2 * QUIET).for_each(|tick| both.step(tick, false));
        let (ground, space) = (both.ground.requests(), both.space.requests());
        assert_eq!(ground.len(), space.len(), "seed {seed}");
        for id in (1..=ground.len() as u64).map(StripId) {
            assert_eq!(ground.request(id), space.request(id), "seed {seed}");
            let way = both.ground.way(id).unwrap();
            assert!(way.uplinked < way.on_board && way.on_board < way.acknowledged, "seed {seed}: {way:?}");
            let completed = ground.state(id) == Some(State::Completed);
            assert_eq!(way.delivered.is_some(), completed, "seed {seed}: {way:?}");
        }
        let mut once = both.imaged.clone();
        once.sort();
        once.dedup();
        assert_eq!(once.len(), both.imaged.len(), "seed {seed}: imaged twice");
        assert_eq!(once.len(), ground.count(State::Completed), "seed {seed}");
        assert!(both.ground.asked().iter().all(|it| it.answered.is_some()), "seed {seed}");
        assert_eq!((both.ground.misread(), both.space.misread(), both.ground.waiting()), (0, 0, 0), "seed {seed}");
        (orders, imaged) = (orders + ground.len(), imaged + once.len());
        late += both.ground.asked().iter().filter(|it| it.refusal.is_some()).count();
    }
    assert!(orders > 1000 && imaged > 300 && late > 20, "{orders} orders, {imaged} imaged, {late} too late");
}
