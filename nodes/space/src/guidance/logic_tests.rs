//! Tests of guidance without ROS.

use std::collections::VecDeque;
use std::sync::Arc;

use swath_sim::config::SimConfig;
use swath_sim::config::resources::{Profile, ResourcesConfig};
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::planner::Heuristic;
use swath_sim::rng;
use swath_sim::task::{Duty, Task, TaskOutcome};
use swath_sim::time::Tick;
use swath_sim::vehicle::errors::PlantErrors;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model;
use swath_sim::vehicle::spacecraft::Spacecraft;

use super::logic::{Command, Effect, GuidanceLogic, TaskError, TaskOrder};
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
        let flown = compare(model(), &errors.parse().unwrap(), 0.5).len();
        assert!(flown > 20, "{errors}: only {flown} tasks");
    }
}

/// The same where power, data and momentum have bounds: what is done besides turning comes with the commands.
#[test]
fn two_nodes_live_as_the_environment_lives() {
    for (profile, battery_initial) in [(Profile::Minisat, 0.3), (Profile::Bsk, 0.4), (Profile::Bsk, 1.0)] {
        let resources = ResourcesConfig { battery_initial, ..ResourcesConfig::of(profile) };
        let config = SimConfig { resources: Some(Box::new(resources)), ..SimConfig::default() };
        let model = Model::new(config).unwrap();
        for errors in ["none", "noise,delay"] {
            let duties = compare(model.clone(), &errors.parse().unwrap(), 2.0);
            let has = |wanted: Option<Duty>| duties.contains(&wanted);
            assert!(has(None) && has(Some(Duty::Charge)), "{profile:?} {battery_initial} {errors}: {duties:?}");
            let tasks = has(Some(Duty::Downlink)) && has(Some(Duty::Desaturate));
            assert_eq!(tasks, profile == Profile::Bsk, "{battery_initial} {errors}: {duties:?}");
        }
    }
}

fn give(spacecraft: &mut SpacecraftLogic, command: &Command) {
    let activity = command.activity.unwrap_or_default();
    spacecraft.command(command.tick, command.guidance.torque, activity).unwrap();
}

/// What was done in each task beside imaging and waiting.
fn compare(model: Model, errors: &PlantErrors, orbits: f64) -> Vec<Option<Duty>> {
    let config = EpisodeConfig { orbits, ..EpisodeConfig::evaluation() };
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
    let (mut over, mut duties) = (false, Vec::new());
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
                Effect::Command(command) => give(&mut spacecraft, &command),
                Effect::Decide(point) => {
                    over = point.mission_over;
                    let decision = env.decide(&mut planner).unwrap();
                    assert_eq!(&point.situation, env.context().situation);
                    assert_eq!(point.finished.as_ref().map(|finished| &finished.record), expected.as_ref());
                    if over {
                        break;
                    }
                    let kind = decision.to_task(&env.context()).unwrap();
                    duties.push(kind.duty());
                    let order = TaskOrder { task: point.task, kind, name: "strip".to_owned() };
                    expected = Some(env.fly(decision, env.horizon()).unwrap().record);
                    effects.extend(guidance.on_task(order).unwrap());
                }
            }
        }
    }
    assert!(env.truncated());
    assert_eq!((spacecraft.missed, guidance.late), (0, 0));
    assert_eq!(spacecraft.sample().resources.as_ref(), env.onboard().map(|onboard| onboard.state()));
    duties
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
                give(&mut spacecraft, command);
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
