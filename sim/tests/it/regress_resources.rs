//! Power, data and momentum in flight: books that close, duties that do what they say, failures that are told.

use std::sync::Arc;

use nalgebra::Vector3;
use swath_sim::config::SimConfig;
use swath_sim::config::resources::{Profile, ResourcesConfig};
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::planner::{Decision, Heuristic, Planner, PlannerError};
use swath_sim::requests::scenario::ScenarioConfig;
use swath_sim::rng;
use swath_sim::task::{Duty, Task};
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::Flight;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model;
use swath_sim::vehicle::resources::Failure;
use swath_sim::vehicle::spacecraft::Spacecraft;

fn model(profile: Profile, change: impl Fn(&mut ResourcesConfig)) -> Arc<Model> {
    let mut resources = ResourcesConfig::of(profile);
    change(&mut resources);
    let config = SimConfig { resources: Some(Box::new(resources)), ..SimConfig::default() };
    Arc::new(Model::new(config).unwrap())
}

fn flight(model: &Model, seed: u64) -> Flight {
    let initial = InitialState::draw(&model.config, &mut rng::stream(seed, rng::INITIAL_STATE));
    Flight::new(model, Spacecraft::new(model, &initial))
}

fn episode(model: &Arc<Model>, orbits: f64, seed: u64) -> Env {
    let scenario = ScenarioConfig { count: [2000, 2000], ..ScenarioConfig::default() };
    Env::episode(model.clone(), &EpisodeConfig { orbits, scenario, ..EpisodeConfig::default() }, seed)
}

/// Flies duties for a time and hands each tick to `each`.
fn serve(flight: &mut Flight, duty: Duty, ticks: u32, mut each: impl FnMut(&Flight)) {
    flight.begin(Task::Serve { duty, ticks });
    for _ in 0..ticks {
        flight.tick();
        each(flight);
    }
}

#[test]
fn books_close_over_missions_of_both_profiles() {
    for (profile, seed) in [(Profile::Minisat, 1), (Profile::Bsk, 2)] {
        // The shield would send.
        let model = model(profile, |it| it.shield = false);
        let mut env = episode(&model, 4.0, seed);
        let mut imaged = 0.0;
        env.run(&mut Heuristic { t_pre_s: 80.0 }, |task| imaged += task.reward).unwrap();
        let (onboard, delivered) = (env.onboard().unwrap(), env.delivered());
        assert!(onboard.battery().books_close() && onboard.storage().books_close());
        let energy = onboard.battery().books();
        assert!(energy.generated_nj > 0 && energy.asked_nj > 0);
        assert!(onboard.storage().books().imaged > 0);
        assert!(imaged > 10.0 && delivered.reward <= imaged, "{delivered:?} of {imaged}");
        match profile {
            // Data come down in every contact, without any task for it.
            Profile::Minisat => assert!(delivered.strips > 20 && delivered.reward > 0.5 * imaged, "{delivered:?}"),
            Profile::Bsk => assert_eq!(delivered.strips, 0, "no downlink task was flown"),
        }
    }
}

#[test]
fn the_same_mission_twice_is_the_same_to_the_bit() {
    let model = model(Profile::Minisat, |_| {});
    let fly = || {
        let mut env = episode(&model, 1.5, 7);
        let mut tasks = Vec::new();
        env.run(&mut Heuristic { t_pre_s: 70.0 }, |task| tasks.push(task.clone())).unwrap();
        (tasks, *env.onboard().unwrap().battery(), *env.delivered())
    };
    assert_eq!(fly(), fly());
}

#[test]
fn charging_points_the_array_at_the_sun() {
    let model = model(Profile::Minisat, |_| {});
    let mut flight = flight(&model, 3);
    serve(&mut flight, Duty::Charge, 600, |_| {});
    let mut sunlit = 0;
    serve(&mut flight, Duty::Charge, 12_000, |flight| {
        let state = flight.spacecraft.onboard().unwrap().state();
        if state.illumination >= 1.0 {
            assert!((449.0..450.0).contains(&state.generated_w), "{state:?}");
            sunlit += 1;
        } else if state.illumination <= 0.0 {
            assert_eq!(state.generated_w, 0.0);
        }
    });
    assert!((6000..12_000).contains(&sunlit), "{sunlit} ticks in the Sun");
}

#[test]
fn a_body_fixed_antenna_sends_in_downlink_tasks_alone() {
    let model = model(Profile::Bsk, |it| it.downlink_order = swath_sim::config::resources::DownlinkOrder::Oldest);
    let mut env = episode(&model, 15.0, 5);
    let mut heuristic = Heuristic { t_pre_s: 100.0 };
    let mut sent_elsewhere = 0;
    while env.delivered().strips == 0 && !env.truncated() {
        let sent = env.onboard().unwrap().storage().books().sent;
        let stored = env.context().situation.resources.unwrap().to_send_bits;
        let decision = if stored > 20_000_000 {
            Decision::Serve { duty: Duty::Downlink, ticks: 240 }
        } else {
            heuristic.decide(&env.context()).unwrap()
        };
        env.step(decision).unwrap();
        if !matches!(decision, Decision::Serve { .. }) {
            sent_elsewhere += env.onboard().unwrap().storage().books().sent - sent;
        }
    }
    assert!(env.delivered().strips > 0, "nothing came down");
    assert_eq!(sent_elsewhere, 0);
}

#[test]
fn thrusters_and_rods_take_momentum_out_of_the_wheels() {
    let of = |flight: &Flight, model: &Model| flight.spacecraft.body.wheel_speed.norm() * model.plant.wheels.inertia;
    let thrusters = model(Profile::Bsk, |it| it.disturbance_nm = [0.0; 3]);
    let mut flown = flight(&thrusters, 4);
    let before = of(&flown, &thrusters);
    serve(&mut flown, Duty::Desaturate, 1200, |_| {});
    let after = of(&flown, &thrusters);
    assert!(before > 5.0 && after < 0.05 * before, "{before} to {after} N m s by thrusters");
    let rods = model(Profile::Minisat, |_| {});
    let mut flown = flight(&rods, 4);
    let before = of(&flown, &rods);
    serve(&mut flown, Duty::Charge, 3 * 11_400, |_| {});
    let after = of(&flown, &rods);
    assert!(after < 0.2 * before, "{before} to {after} N m s by rods");
    let none = model(Profile::Minisat, |it| {
        it.desaturation = swath_sim::config::resources::Desaturation::None;
        (it.gravity_gradient, it.disturbance_nm, it.residual_dipole_am2) = (false, [0.0; 3], [0.0; 3]);
    });
    let mut flown = flight(&none, 4);
    let before = none.plant.momentum_N(&flown.spacecraft.body);
    serve(&mut flown, Duty::Charge, 1200, |_| {});
    let change: Vector3<f64> = none.plant.momentum_N(&flown.spacecraft.body) - before;
    assert!(change.norm() < 1e-4, "momentum changed by {change}");
}

#[test]
fn an_empty_battery_ends_an_episode_and_is_safe_mode_in_flight() {
    let model = model(Profile::Minisat, |it| {
        (it.battery_capacity_wh, it.battery_initial, it.failure_penalty) = (60.0, 0.3, 5.0);
        it.shield = false;
    });
    let mut env = episode(&model, 3.0, 11);
    let mut heuristic = Heuristic { t_pre_s: 60.0 };
    let mut ended = None;
    while ended.is_none() && !env.truncated() {
        let decision = heuristic.decide(&env.context()).unwrap();
        let step = env.step(decision).unwrap();
        ended = step.terminated.then_some(step.reward);
    }
    assert!(ended.is_some_and(|reward| reward <= -3.0), "{ended:?}");
    assert_eq!(env.safe_mode(), Some(Failure::BatteryEmpty));
    // In flight the mission goes on: it charges first.
    let mut in_safe_mode = 0;
    while let Some(task) = env.fly_one(&mut heuristic, Tick(u64::MAX)).unwrap() {
        if env.safe_mode().is_none() {
            break;
        }
        assert_eq!(task.record.strip, None);
        in_safe_mode += 1;
    }
    assert!(in_safe_mode > 3 && env.safe_mode().is_none(), "{in_safe_mode} tasks in safe mode");
    assert!(env.onboard().unwrap().battery().level() >= 0.25);
    assert!(env.onboard().unwrap().battery().books_close());
}

#[test]
fn the_shield_keeps_the_battery_above_its_floor_and_sends_and_desaturates() {
    for (profile, seed) in [(Profile::Minisat, 21), (Profile::Minisat, 22), (Profile::Bsk, 23), (Profile::Bsk, 24)] {
        // A bus that a planner which does not know of power cannot feed.
        let change = |it: &mut ResourcesConfig, shield| {
            it.shield = shield;
            it.battery_initial = 0.5;
            it.bus_w = if profile == Profile::Minisat { 140.0 } else { 20.0 };
        };
        let fly = |shield| {
            let model = model(profile, |it| change(it, shield));
            let mut env = episode(&model, 6.0, seed);
            let (mut lowest, mut imaged) = (1.0f64, 0.0);
            let mut planner = Heuristic { t_pre_s: 80.0 };
            while let Some(task) = env.fly_one(&mut planner, env.horizon()).unwrap() {
                lowest = lowest.min(env.onboard().unwrap().battery().level());
                imaged += task.reward;
            }
            let momentum = env.context().situation.body.wheel_speed.amax() * model.plant.wheels.inertia;
            (lowest, imaged, *env.delivered(), momentum)
        };
        let (lowest, imaged, delivered, momentum) = fly(true);
        assert!(lowest >= 0.25 && delivered.failures == 0, "{profile:?} {seed}: {lowest} {delivered:?}");
        assert!(imaged > 20.0 && delivered.strips > 0, "{profile:?} {seed}: {imaged} {delivered:?}");
        assert!(momentum < 12.5 || profile == Profile::Minisat);
        assert!(fly(false).0 < 0.25, "{profile:?} {seed}: without the shield the floor holds too");
    }
}

#[test]
fn the_observation_of_resources_adds_to_that_of_the_dynamics() {
    use swath_sim::learn::observation::ObservationSet;
    let model = model(Profile::Minisat, |_| {});
    let mut env = episode(&model, 2.0, 31);
    let mut heuristic = Heuristic { t_pre_s: 80.0 };
    for _ in 0..20 {
        env.fly_one(&mut heuristic, env.horizon()).unwrap();
    }
    let observe = |set: ObservationSet| {
        let (mut features, mut mask) = (vec![0.0; 40 * set.features()], vec![false; 40]);
        env.observe(set, &mut features, &mut mask);
        features[..set.features()].to_vec()
    };
    let (dynamics, resources) = (observe(ObservationSet::Dynamics), observe(ObservationSet::Resources));
    assert_eq!((dynamics.len(), resources.len()), (22, 38));
    assert_eq!(dynamics, resources[..22]);
    let context = env.context();
    let state = context.situation.resources.unwrap();
    assert!((f64::from(resources[22]) - state.level()).abs() < 1e-6);
    assert!((f64::from(resources[23]) - (state.level() - 0.25)).abs() < 1e-6);
    assert_eq!(f64::from(resources[24]), state.illumination);
    // The shadow ends after it begins, and so does the contact; the end of either is still to come.
    assert!(resources[26] > resources[25] && resources[26] > 0.0);
    assert!(resources[30] > resources[29] && resources[30] > 0.0);
    assert_eq!(resources[29] <= 0.0, state.in_contact);
    let sun: f32 = resources[31..34].iter().map(|x| x * x).sum();
    assert!((sun - 1.0).abs() < 1e-5);
    assert!(resources[34..].iter().sum::<f32>() > 0.1);
}

#[test]
fn thrusters_that_help_are_no_fault_of_the_wheels() {
    let model = model(Profile::Bsk, |_| {});
    let mut flown = flight(&model, 4);
    flown.watch(&model, false);
    for duty in [Duty::Desaturate, Duty::Charge, Duty::Desaturate] {
        serve(&mut flown, duty, 240, |_| {});
    }
    let changes = flown.take_changes();
    assert!(changes.iter().all(|(_, health)| health.wheels.min() >= 1.0), "{changes:?}");
}

#[test]
fn duties_need_resources() {
    let model = Arc::new(Model::new(SimConfig::default()).unwrap());
    let mut env = episode(&model, 1.0, 1);
    assert!(env.onboard().is_none() && env.context().situation.resources.is_none());
    let error = env.step(Decision::Serve { duty: Duty::Charge, ticks: 10 }).unwrap_err();
    assert_eq!(error, PlannerError::NoResources { duty: Duty::Charge });
    assert_eq!(error.to_string(), "Charge was chosen, but the mission has no [resources]");
}
