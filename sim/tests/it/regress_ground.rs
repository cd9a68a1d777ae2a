//! Plans made on the ground: better than any planner that sees forty strips, below the bound, and worth what they say.

use std::sync::Arc;

use swath_sim::config::SimConfig;
use swath_sim::foresight::{CANDIDATES, GroundSettings, OpenLoop, Plan, plan, upper_bound};
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::planner::{Beam, Planner};
use swath_sim::requests::scenario::ScenarioConfig;
use swath_sim::task::{TaskRecord, Totals};
use swath_sim::time::Tick;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model;
use swath_sim::world::strip::StripRequest;

const SMALL: GroundSettings = GroundSettings { width: 2, branches: 5, weakness: 0.0 };

fn model(candidates: usize) -> Arc<Model> {
    let mut config = SimConfig::default();
    config.planning.candidates = candidates;
    Arc::new(Model::new(config).unwrap())
}

fn env(orbits: f64, candidates: usize, seed: u64) -> Env {
    Env::episode(model(candidates), &EpisodeConfig { orbits, ..EpisodeConfig::evaluation() }, seed)
}

fn fly(mut env: Env, planner: &mut dyn Planner) -> (Vec<TaskRecord>, Totals) {
    let (mut records, mut totals) = (Vec::new(), Totals::default());
    env.run(planner, |settled| {
        records.push(settled.record.clone());
        totals.add(settled);
    })
    .unwrap();
    (records, totals)
}

#[test]
fn a_plan_flown_on_the_true_plant_brings_what_it_promises_and_beats_the_beam() {
    let env = env(1.0, CANDIDATES, 1);
    let plan = plan(&env, &SMALL);
    let (_, totals) = fly(env.clone(), &mut OpenLoop::new(&plan));
    assert!((totals.reward - plan.reward).abs() < 1e-9, "{} {}", totals.reward, plan.reward);
    assert_eq!(totals.attempts, plan.tasks.len() as u64);
    assert_eq!(totals.fulfilled, totals.attempts);
    let (_, beam) = fly(self::env(1.0, 40, 1), &mut Beam::default());
    assert!(plan.reward > beam.reward, "{} {}", plan.reward, beam.reward);
    assert!(plan.reward < upper_bound(&env), "{} {}", plan.reward, upper_bound(&env));
    assert_eq!(plan, self::plan(&env, &SMALL));
    for pair in plan.tasks.windows(2) {
        assert_eq!(pair[0].end(), pair[1].begin);
    }
}

#[test]
fn a_wider_beam_finds_a_better_plan() {
    let env = env(0.5, CANDIDATES, 3);
    let narrow = plan(&env, &GroundSettings { width: 1, branches: 2, ..SMALL });
    let wide = plan(&env, &GroundSettings { width: 6, branches: 6, ..SMALL });
    assert!(wide.reward > narrow.reward && wide.ticks > narrow.ticks, "{} {}", wide.reward, narrow.reward);
}

#[test]
fn a_plan_flown_blindly_keeps_its_times_and_loses_on_another_plant() {
    let mut env = env(1.0, CANDIDATES, 2);
    let plan = plan(&env, &SMALL);
    let careful = self::plan(&env, &GroundSettings { weakness: 0.1, ..SMALL });
    env.differ(&"torque-10%".parse().unwrap(), 2).unwrap();
    let (_, with_margin) = fly(env.clone(), &mut OpenLoop::new(&careful));
    let (records, totals) = fly(env, &mut OpenLoop::new(&plan));
    assert!(careful.reward < plan.reward && with_margin.reward > totals.reward, "{with_margin:?} {totals:?}");
    let flown: Vec<_> = records.iter().filter(|record| record.strip.is_some()).collect();
    assert_eq!(flown.len(), plan.tasks.len());
    for (record, task) in flown.iter().zip(&plan.tasks) {
        assert_eq!((record.strip, record.start, record.end), (Some(task.strip), task.begin, task.end()));
    }
    assert!(totals.failed_attitude > 0 && totals.reward < plan.reward, "{totals:?}");
}

#[test]
fn a_plan_knows_nothing_of_what_comes_in_flight() {
    let episode = EpisodeConfig { orbits: 0.5, arrivals: 0.5, ..EpisodeConfig::evaluation() };
    let env = Env::episode(model(CANDIDATES), &episode, 4);
    let plan = plan(&env, &SMALL);
    let known = env.catalogue().len() as u64;
    assert!(!plan.tasks.is_empty() && plan.tasks.iter().all(|task| task.strip.0 <= known));
    let (_, totals) = fly(env, &mut OpenLoop::new(&plan));
    assert!((totals.reward - plan.reward).abs() < 1e-9);
}

#[test]
fn without_strips_there_is_an_empty_plan() {
    let episode = EpisodeConfig {
        orbits: 0.1,
        scenario: ScenarioConfig { count: [0, 0], ..ScenarioConfig::default() },
        ..EpisodeConfig::default()
    };
    let env = Env::episode(model(40), &episode, 1);
    let plan = plan(&env, &SMALL);
    assert_eq!(plan, Plan { ticks: plan.ticks, ..Plan::default() });
    assert_eq!(upper_bound(&env), 0.0);
    assert_eq!(fly(env, &mut OpenLoop::new(&plan)).1.attempts, 0);
}

/// Few strips beside each other: all of them fit, so the bound is their sum; in a mission shorter than one of them it is
/// its share.
#[test]
fn the_bound_is_exact_where_time_does_not_matter_and_counts_twins_once() {
    let model = model(40);
    let initial = InitialState::draw(&model.config, &mut swath_sim::rng::stream(5, swath_sim::rng::INITIAL_STATE));
    let request = |latitude: f64, priority: f64, bidirectional: bool| StripRequest {
        start_latitude_deg: latitude,
        start_longitude_deg: 20.0,
        end_latitude_deg: latitude + 2.0,
        end_longitude_deg: 21.0,
        acquisition_speed_m_s: 3000.0,
        priority,
        bidirectional,
    };
    let mut env = Env::empty(model, &initial, Tick(200_000));
    env.submit(&[request(0.0, 0.5, false), request(10.0, 0.25, true), request(20.0, 1.0, false)]);
    assert!((upper_bound(&env) - 1.75).abs() < 1e-12, "{}", upper_bound(&env));
}

/// Many strips that can only be imaged at the same time: the bound is the most valuable of the time.
#[test]
fn the_bound_is_the_best_use_of_time_where_strips_compete() {
    let env = env(0.2, 40, 6);
    let mut strips: Vec<(f64, f64)> = Vec::new();
    for id in 1..=env.catalogue().len() as u64 {
        let entry = env.catalogue().get(swath_sim::world::strip::StripId(id)).unwrap();
        if entry.windows[0].open < env.horizon() {
            strips.push((entry.strip.priority, f64::from(entry.t_acq)));
        }
    }
    strips.sort_by(|a, b| (b.0 / b.1).total_cmp(&(a.0 / a.1)));
    let (mut left, mut knapsack) = (env.horizon().0 as f64, 0.0);
    for (priority, need) in strips {
        let share = (left / need).min(1.0);
        knapsack += priority * share;
        left -= need * share;
    }
    let bound = upper_bound(&env);
    assert!(bound <= knapsack + 1e-9, "{bound} {knapsack}");
    assert!(bound > 0.6 * knapsack, "{bound} {knapsack}");
}
