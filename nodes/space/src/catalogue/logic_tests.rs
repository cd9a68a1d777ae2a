//! What the radio brings and what guidance flies, in the order of time.

use swath_mission::file::Mission;
use swath_mission::link::catalogue::Catalogue;
use swath_mission::link::ground::Ground;
use swath_mission::link::radio::Radio;
use swath_mission::orders::action::{Act, Action};
use swath_mission::requests::logic::RequestLogic;
use swath_sim::task::{FailureReason, TaskOutcome, TaskRecord};
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::{Flight, Situation};
use swath_sim::world::strip::StripId;

use super::logic::{CatalogueLogic, Effect, Point, Reached};
use crate::link::logic::Turn;

/// A catalogue and a ground whose orders are on their way to it.
struct Trial {
    logic: CatalogueLogic,
    ground: Ground,
    situation: Situation,
}

fn trial() -> Trial {
    let text = "orbits = 2.0\n[requests.random]\ncount = [300, 300]\n[link]\nmode = \"always\"\n";
    let mission: Mission = toml::from_str::<Mission>(text).unwrap().resolved();
    let model = mission.model().unwrap();
    let radio = Radio::of(&mission, &model).unwrap().unwrap();
    let requests = RequestLogic::new(model.clone(), &mission.initial(), mission.horizon(&model), mission.rules());
    let mut ground = Ground::new(requests.clone(), radio.rates().0);
    for order in mission.initial_requests().unwrap().0 {
        let act = Act::Submit(StripId(0), Box::new(order));
        let action = Action { at: Tick(0), initial: true, actor: "test".to_owned(), reason: String::new(), act };
        // Some of them have no window.
        _ = ground.ask(action, Tick(0));
    }
    let catalogue = Catalogue::new(requests, radio.rates().1, radio.config(), model.period);
    let situation = Flight::new(&model, mission.spacecraft(&model).unwrap()).situation();
    Trial { logic: CatalogueLogic::new(catalogue), ground, situation }
}

impl Trial {
    fn turn(&mut self, tick: u64) -> Vec<Effect> {
        let sent = self.ground.transmit(Tick(tick));
        let frames = sent.into_iter().map(|sent| sent.bytes).collect();
        self.logic.on_turn(Turn { tick: Tick(tick), next: Tick(tick + 1), open: true, frames })
    }

    fn point(&mut self, task: u64, tick: u64, results: Vec<TaskRecord>) -> Vec<Effect> {
        self.logic.on_point(&Point { task, situation: Situation { now: Tick(tick), ..self.situation }, results })
    }

    fn reached(&mut self, tick: u64) -> Vec<Effect> {
        self.logic.on_reached(Reached { tick: Tick(tick), flown: None })
    }
}

fn kinds(effects: &[Effect]) -> Vec<&'static str> {
    let kind = |effect: &Effect| match effect {
        Effect::Heard(_) => "heard",
        Effect::Sent(..) => "sent",
        Effect::Offer(_) => "offer",
        Effect::Settled(..) => "settled",
    };
    effects.iter().map(kind).collect()
}

#[test]
fn a_turn_waits_for_guidance_and_what_is_sent_waits_for_its_tick() {
    let mut trial = trial();
    assert_eq!(kinds(&trial.turn(0)), ["heard"]);
    // A decision at the tick: it sends first, then the planner may choose.
    assert_eq!(kinds(&trial.point(0, 0, Vec::new())), ["sent", "offer"]);
    assert_eq!(trial.point(0, 0, Vec::new()), [], "the same question again is no news");
    assert_eq!(trial.turn(1), [], "guidance has not answered the state before");
    assert_eq!(kinds(&trial.reached(0)), ["heard"]);
    assert_eq!(kinds(&trial.reached(1)), ["sent"]);
    assert_eq!(trial.reached(1), [], "the same again is no news");
    assert!(!trial.logic.awaits_turn(Tick(1)) && trial.logic.awaits_turn(Tick(2)));
}

#[test]
fn a_result_tells_of_the_task_that_was_flown_between_two_turns() {
    let mut trial = trial();
    // All orders come up.
    for tick in 0..40 {
        trial.turn(tick);
        trial.reached(tick);
    }
    let offer = trial.point(0, 40, Vec::new());
    let Some(Effect::Offer(offer)) = offer.last() else { panic!("{offer:?}") };
    let candidate = offer.candidates[0];
    let record = TaskRecord {
        task: 0,
        start: Tick(40),
        end: Tick(90),
        strip: Some(candidate.id),
        duty: None,
        t_pre: 30,
        t_acq: 20,
        outcome: TaskOutcome { failure: Some(FailureReason::Attitude), max_attitude_error: 0.5, min_elevation: 1.0 },
    };
    let effects = trial.point(1, 90, vec![record.clone(), record.clone()]);
    assert_eq!(kinds(&effects), ["settled", "offer"], "a result counts once");
    assert_eq!(effects[0], Effect::Settled(record.clone(), 0.0));
    assert_eq!(kinds(&trial.point(2, 95, vec![record])), ["offer"], "also one that is told again later");
    let request = trial.logic.catalogue().requests().request(candidate.id).unwrap();
    assert_eq!((request.standing.attempts, request.standing.imaging), (1, Tick(70)));
}
