//! Hot paths: a closed-loop tick, an environment step, windows, the observation.
#![allow(missing_docs, clippy::unwrap_used, reason = "a bench")]

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use swath_sim::config::SimConfig;
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::learn::observation::ObservationSet;
use swath_sim::planner::{Decision, Heuristic, Planner};
use swath_sim::requests::catalogue::Catalogue;
use swath_sim::requests::scenario::ScenarioConfig;
use swath_sim::rng;
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::Flight;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model;
use swath_sim::vehicle::spacecraft::Spacecraft;
use swath_sim::world::orbit::Orbit;

fn model() -> Arc<Model> {
    Arc::new(Model::new(SimConfig::default()).unwrap())
}

fn closed_loop(c: &mut Criterion) {
    let model = model();
    let env = Env::episode(model.clone(), &EpisodeConfig::evaluation(), 1);
    let context = env.context();
    let task = Decision::Image { candidate: 3, t_pre: 160 }.to_task(&context).unwrap();
    let initial = InitialState::draw(&model.config, &mut rng::stream(1, rng::INITIAL_STATE));
    c.bench_function("fly one task of some 300 ticks", |b| {
        b.iter_batched(
            || Flight::new(&model, Spacecraft::new(&model, &initial)),
            |mut flight| flight.fly(task, Tick(u64::MAX)),
            criterion::BatchSize::SmallInput,
        );
    });
}

fn environment(c: &mut Criterion) {
    let scenario = ScenarioConfig { count: [5000, 5000], ..ScenarioConfig::default() };
    let mut env = Env::episode(model(), &EpisodeConfig { orbits: 1000.0, scenario, ..EpisodeConfig::default() }, 1);
    let mut planner = Heuristic { t_pre_s: 80.0 };
    let set = ObservationSet::Table1;
    let (mut features, mut mask) = (vec![0.0; 40 * set.features()], vec![false; 40]);
    c.bench_function("observe 40 strips", |b| b.iter(|| env.observe(set, black_box(&mut features), &mut mask)));
    c.bench_function("environment step", |b| {
        b.iter(|| {
            let decision = planner.decide(&env.context()).unwrap();
            env.step(decision).unwrap()
        });
    });
}

fn windows(c: &mut Criterion) {
    let model = model();
    let requests =
        ScenarioConfig::default().generate(&mut rng::stream(1, rng::CATALOGUE), 1000, model.config.earth.radius_m);
    let phase = InitialState::draw(&model.config, &mut rng::stream(1, rng::INITIAL_STATE)).orbit;
    let orbit = Orbit::new(&model.config, phase, model.period);
    c.bench_function("windows of 1000 strips over 24 h", |b| {
        b.iter(|| {
            let mut catalogue = Catalogue::new(&model, &orbit, Tick(172_800));
            catalogue.add_all(&model, &requests, Tick(0))
        });
    });
}

criterion_group!(benches, closed_loop, environment, windows);
criterion_main!(benches);
