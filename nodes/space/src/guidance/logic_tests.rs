//! Tests of guidance without ROS.

use std::collections::VecDeque;
use std::sync::Arc;

use swath_sim::config::SimConfig;
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::planner::{Heuristic, Planner};
use swath_sim::rng;
use swath_sim::task::{Task, TaskOutcome};
use swath_sim::time::Tick;
use swath_sim::vehicle::errors::PlantErrors;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model;
use swath_sim::vehicle::spacecraft::Spacecraft;

use super::logic::{Effect, GuidanceLogic, TaskError, TaskOrder};
use crate::spacecraft::logic::SpacecraftLogic;

const SEED: u64 = 4;

fn model() -> Model {
    Model::new(SimConfig::default()).unwrap()
}

fn satellite(model: &Model) -> Spacecraft {
    let initial = InitialState::draw(&model.config, &mut rng::stream(SEED, rng::INITIAL_STATE));
    Spacecraft::new(model, &initial)
}

/// Spacecraft and guidance as two nodes with two ticks under way, against the environment in one process.
#[test]
fn two_nodes_fly_what_the_environment_flies() {
    for errors in ["none", "noise", "torque-10%,inertia+5%,noise,delay"] {
        let flown = compare(&errors.parse().unwrap());
        assert!(flown > 20, "{errors}: only {flown} tasks");
    }
}

fn compare(errors: &PlantErrors) -> u64 {
    let model = model();
    let config = EpisodeConfig { orbits: 0.5, ..EpisodeConfig::evaluation() };
    let mut env = Env::episode(Arc::new(model.clone()), &config, SEED);
    env.differ(errors, SEED).unwrap();
    let mut satellite = satellite(&model);
    satellite.differ(&model, errors, SEED).unwrap();
    let mut spacecraft = SpacecraftLogic::new(satellite, env.horizon());
    let delay = model.period.ticks_ceil(errors.planning_delay_s);
    let mut guidance = GuidanceLogic::new(model, env.horizon(), 20).with_planning_delay(delay);
    let mut planner = Heuristic { t_pre_s: 60.0 };
    let mut expected = None;
    let mut states = VecDeque::from([spacecraft.sample()]);
    let mut over = false;
    while !over {
        let mut effects = VecDeque::new();
        if spacecraft.ready() && !spacecraft.done() {
            states.push_back(spacecraft.advance());
        }
        if let Some(state) = states.pop_front() {
            effects.extend(guidance.on_state(state));
        }
        while let Some(effect) = effects.pop_front() {
            match effect {
                Effect::Strike => unreachable!("nothing was ordered"),
                Effect::Command(command) => spacecraft.command(command.tick, command.guidance.torque).unwrap(),
                Effect::Decide(point) => {
                    over = point.mission_over;
                    let decision = planner.decide(&env.context()).unwrap();
                    assert_eq!(&point.situation, env.context().situation);
                    assert_eq!(point.finished.as_ref().map(|finished| &finished.record), expected.as_ref());
                    if over {
                        break;
                    }
                    let kind = decision.to_task(&env.context()).unwrap();
                    let order = TaskOrder { task: point.task, kind, name: "strip".to_owned() };
                    expected = Some(env.fly(decision, env.horizon()).unwrap().record);
                    effects.extend(guidance.on_task(order).unwrap());
                }
            }
        }
    }
    assert!(env.truncated());
    assert_eq!((spacecraft.missed, guidance.late), (0, 0));
    guidance.kept().task
}

#[test]
fn a_late_task_is_replaced_by_holding_the_attitude() {
    let model = model();
    let mut spacecraft = SpacecraftLogic::new(satellite(&model), Tick(100));
    let mut guidance = GuidanceLogic::new(model, Tick(100), 10);
    assert!(matches!(guidance.on_state(spacecraft.sample())[..], [Effect::Decide(_)]));
    assert!(guidance.on_state(spacecraft.advance()).is_empty(), "the next state waits for the task");
    let effects = guidance.on_deadline();
    assert!(matches!(effects[..], [Effect::Command(_), Effect::Command(_)]));
    assert_eq!(guidance.late, 1);
    let order = TaskOrder { task: 0, kind: Task::Wait { ticks: 5 }, name: String::new() };
    assert_eq!(guidance.on_task(order), Err(TaskError::NotWanted { task: 0, wanted: None }));
}

#[test]
fn a_task_is_given_up_while_slewing_and_not_once_imaging_has_begun() {
    let model = model();
    let env = Env::episode(Arc::new(model.clone()), &EpisodeConfig::evaluation(), SEED);
    let candidate = env.context().candidates[0];
    for (ticks, given_up) in [(10, true), (60, false)] {
        let mut spacecraft = SpacecraftLogic::new(satellite(&model), Tick(1000));
        let mut guidance = GuidanceLogic::new(model.clone(), Tick(1000), 10);
        guidance.on_state(spacecraft.sample());
        let kind = Task::Image { id: candidate.id, strip: candidate.strip, t_pre: 40, t_acq: candidate.t_acq };
        let order = TaskOrder { task: 0, kind, name: "strip".to_owned() };
        guidance.on_task(order).unwrap();
        let mut sample = |guidance: &mut GuidanceLogic| {
            let effects = guidance.on_state(spacecraft.advance());
            if let Some(Effect::Command(command)) = effects.first() {
                spacecraft.command(command.tick, command.guidance.torque).unwrap();
            }
            effects
        };
        for _ in 1..ticks {
            sample(&mut guidance);
        }
        assert!(!guidance.on_abort(7), "another task");
        assert_eq!(guidance.on_abort(0), given_up);
        match &sample(&mut guidance)[..] {
            [Effect::Decide(point)] => {
                let finished = point.finished.as_ref().unwrap();
                assert!(given_up);
                assert_eq!(finished.record.outcome, TaskOutcome::NOT_BEGUN);
                assert_eq!(finished.record.end, Tick(ticks));
                assert_eq!(point.last_imaging.as_ref(), Some(finished));
            }
            effects => assert!(!given_up, "{effects:?}"),
        }
    }
}

/// Of two states under way the first one may be lost: its command is not left out.
#[test]
fn a_state_that_was_lost_is_waited_for() {
    let model = model();
    let mut spacecraft = SpacecraftLogic::new(satellite(&model), Tick(1000));
    let mut guidance = GuidanceLogic::new(model, Tick(1000), 20);
    let states: Vec<_> = std::iter::once(spacecraft.sample()).chain((0..6).map(|_| spacecraft.advance())).collect();
    let commanded = |effects: Vec<Effect>| -> Vec<u64> {
        let tick = |effect: Effect| match effect {
            Effect::Command(command) => Some(command.tick.0),
            _ => None,
        };
        effects.into_iter().filter_map(tick).collect()
    };
    assert!(guidance.on_state(states[1]).is_empty(), "the first one comes again");
    assert!(matches!(guidance.on_state(states[0])[..], [Effect::Decide(_)]));
    assert_eq!(commanded(guidance.on_absence(100)), [0]);
    assert!(guidance.on_state(states[2]).is_empty());
    assert_eq!(commanded(guidance.on_state(states[1])), [1]);
    assert_eq!(commanded(guidance.on_state(states[2])), [2]);
    // In a paced mission time goes on without it.
    assert_eq!(commanded(guidance.on_state(states[5])), [5]);
}
