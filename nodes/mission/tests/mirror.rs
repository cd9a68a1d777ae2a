//! What the ground says the satellite is going to do, and what it does.
#![expect(clippy::unwrap_used, reason = "a test may panic")]

use swath_mission::approval::{Gate, GatedPlanner};
use swath_mission::fallback::GuardedPlanner;
use swath_mission::file::Mission;
use swath_mission::in_process::InProcessMission;
use swath_mission::mirror::parting::Cause;
use swath_mission::mirror::{Mirror, Prediction};
use swath_mission::orders::action::{Act, Action};
use swath_mission::orders::order::Order;
use swath_sim::task::TaskRecord;
use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;

const THREE: &str = "\"puertollano\", \"awarua\", \"punta-arenas\"";

fn mission(orbits: f64, count: u32, seed: u64, planner: &str, rest: &str) -> Mission {
    let text = format!(
        "orbits = {orbits}\nseed = {seed}\nplanner = \"{planner}\"\n[requests.random]\ncount = [{count}, {count}]\n{rest}\n"
    );
    let mission: Mission = toml::from_str(&text).unwrap();
    mission.validate().unwrap();
    mission.resolved()
}

fn planner(mission: &Mission) -> Box<GatedPlanner> {
    let gate = Gate::new(&mission.approval, mission.model().unwrap().period);
    let planner = GuardedPlanner::new(mission.planner.hand_written(mission.seed).unwrap());
    Box::new(GatedPlanner { gate, planner })
}

/// A flight with its mirror beside it: the mirror is told what the ground is told, as it comes.
struct Beside {
    tasks: Vec<TaskRecord>,
    mirror: Mirror,
    predictions: Vec<Prediction>,
}

/// Flies with the mirror beside, which predicts after each of `at`.
fn fly(mission: &Mission, actions: Vec<Action>, at: &[u64]) -> Beside {
    let mut flight = InProcessMission::watched(mission, actions).unwrap();
    let mut mirror = Mirror::new(mission, planner(mission)).unwrap();
    let (mut tasks, mut predictions, mut pilot) = (Vec::new(), Vec::new(), planner(mission));
    let mut at = at.iter().map(|tick| Tick(*tick)).peekable();
    loop {
        for told in flight.take_told() {
            while let Some(due) = at.next_if(|due| *due < told.at()) {
                predictions.push(mirror.predict(due, u64::MAX).unwrap());
            }
            mirror.tell(&told).unwrap();
        }
        match flight.step(pilot.as_mut(), Tick(u64::MAX)).unwrap() {
            Some((settled, _)) => tasks.push(settled.record),
            None => break,
        }
    }
    mirror.look(flight.horizon()).unwrap();
    Beside { tasks, mirror, predictions }
}

/// Strips of another mission, asked for one a tick.
fn late(from: u64, count: usize) -> Vec<Action> {
    let (orders, _) = mission(1.0, 1000, 99, "lookahead", "").initial_requests().unwrap();
    let action = |(at, mut order): (u64, Order)| {
        order.client_ref = format!("late {at}");
        order.request.priority = 1.0;
        let act = Act::Submit(StripId(0), Box::new(order));
        Action { at: Tick(at), initial: false, actor: "ops".to_owned(), reason: String::new(), act }
    };
    (from..).zip(orders).take(count).map(action).collect()
}

#[test]
fn with_the_exact_plant_and_nothing_lost_the_satellite_does_what_was_predicted_until_something_is_asked() {
    for name in ["lookahead", "repair:20000", "heuristic:90", "random"] {
        let link = format!("[link]\nstations = [{THREE}]\nstrip_bits = 50e6\nuplink_bps = 4000");
        let mission = mission(3.0, 500, 2, name, &link);
        // Before the epoch's end, in a pass or between two.
        let flown = fly(&mission, Vec::new(), &[0, 4000, 9001, 20_000]);
        assert!(flown.tasks.iter().filter(|it| it.strip.is_some()).count() > 5, "{name}");
        assert_eq!(flown.predictions.len(), 4);
        for prediction in &flown.predictions {
            let first = prediction.tasks.first().unwrap().task as usize;
            assert!(flown.tasks[first].end >= prediction.at, "{name}");
            assert_eq!(prediction.tasks, flown.tasks[first..], "{name} at {}", prediction.at);
            assert_eq!(prediction.since, Tick(0));
        }
        let score = flown.mirror.score();
        assert!(score.tasks > 5 && score.equal == score.tasks && score.partings.is_empty(), "{name}: {score:?}");
    }
}

#[test]
fn what_is_asked_on_the_way_changes_the_prediction_from_there_on_only() {
    let mission = mission(4.0, 500, 2, "lookahead", &format!("[link]\nstations = [{THREE}]\nstrip_bits = 50e6"));
    let (before, after) = (7999, 8000);
    let flown = fly(&mission, late(after, 200), &[before, after + 200]);
    let [blind, knowing] = &flown.predictions[..] else { panic!("two predictions") };
    let from = |prediction: &Prediction| flown.tasks[prediction.tasks[0].task as usize..].to_vec();
    let same = blind.tasks.iter().zip(from(blind)).take_while(|(predicted, flown)| **predicted == *flown).count();
    let parted = from(blind)[same].start;
    assert!(parted > Tick(8000), "{parted}");
    assert_eq!(knowing.tasks, from(knowing), "once it is asked it is known");
    let ways = &knowing.ways[knowing.ways.len() - 1];
    assert!(ways.uplinked_tick < ways.on_board_tick && ways.on_board_tick < ways.acknowledged_tick, "{ways:?}");
    assert_eq!(flown.mirror.score().share(), 1.0);
}

#[test]
fn the_ways_that_are_predicted_are_those_that_are_taken() {
    let mission = mission(3.0, 300, 5, "lookahead", &format!("[link]\nstations = [{THREE}]\nstrip_bits = 50e6"));
    let flown = fly(&mission, Vec::new(), &[100]);
    let mut flight = InProcessMission::new(&mission).unwrap();
    flight.run(planner(&mission).as_mut(), |_, _| {}).unwrap();
    assert_eq!(flown.predictions[0].ways, flight.ways());
    assert!(flight.ways().iter().any(|way| way.known_tick.is_some()));
}

#[test]
fn with_a_satellite_that_is_not_as_its_model_says_they_part_and_go_on_from_what_comes_down() {
    let rest = format!("[link]\nstations = [{THREE}]\nstrip_bits = 50e6\n[plant]\ntorque_limit_scale = 0.97\n");
    let flown = fly(&mission(6.0, 700, 2, "lookahead", &rest), Vec::new(), &[]);
    let score = flown.mirror.score();
    assert!(!score.partings.is_empty() && score.tasks > 20, "{score:?}");
    assert!(matches!(score.partings[0].cause, Cause::Tracking { task: 9, .. }), "{score:?}");
    // Later the planner on board has learned what the one on the ground has not.
    assert!(score.partings.iter().all(|it| !matches!(it.cause, Cause::Radio { .. })), "{score:?}");
    assert!(score.partings.iter().skip(1).all(|it| it.since > Tick(0) && it.since <= it.at), "{score:?}");
    assert!(score.equal > 0 && score.equal < score.tasks, "{score:?}");
    assert!(score.foretold > score.equal && score.foretold <= score.imaged, "{score:?}");
    let text = score.partings[0].text(|tick| tick.0.to_string());
    assert!(text.starts_with("task ") && text.contains("predicted"), "{text}");
}

#[test]
fn lost_frames_are_the_cause_where_requests_come_on_board_late() {
    let rest = format!("[link]\nstations = [{THREE}]\nstrip_bits = 50e6\nuplink_bps = 1000\nloss = 0.4\n");
    let flown = fly(&mission(5.0, 700, 2, "lookahead", &rest), Vec::new(), &[]);
    let score = flown.mirror.score();
    assert!(score.partings.iter().any(|it| matches!(it.cause, Cause::Radio { .. })), "{score:?}");
    assert!(score.share() > 0.2, "{score:?}");
}
