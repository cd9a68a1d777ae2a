//! Measures the hot paths and prints one JSON object; `cargo xtask bench` merges it with those of the other crates.
#![allow(clippy::print_stdout, clippy::disallowed_methods, missing_docs, reason = "a measuring tool")]

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use swath_sim::config::SimConfig;
use swath_sim::config::resources::{Profile, ResourcesConfig};
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::learn::observation::ObservationSet;
use swath_sim::planner::{Beam, Frugal, Heuristic, Lookahead, Planner};
use swath_sim::requests::catalogue::Catalogue;
use swath_sim::requests::scenario::ScenarioConfig;
use swath_sim::rng;
use swath_sim::time::Tick;
use swath_sim::vehicle::flight::Flight;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model;
use swath_sim::vehicle::spacecraft::Spacecraft;
use swath_sim::world::orbit::Orbit;
use swath_sim::world::strip::StripRequest;

/// Each figure is the median of this many runs.
const RUNS: usize = 9;
/// Ticks in 24 h at 2 Hz.
const DAY: u64 = 172_800;

fn main() -> Result<()> {
    let model = Arc::new(Model::new(SimConfig::default())?);
    let day = day_of_requests(&model);
    println!(
        "{}",
        serde_json::json!({
            "closed_loop_ticks_per_s": closed_loop(&model)?,
            "closed_loop_resources_ticks_per_s": closed_loop(&with_resources()?)?,
            "decision_steps_per_s": decision_steps(&model, ObservationSet::Table1)?,
            "decision_resources_steps_per_s": decision_steps(&with_resources()?, ObservationSet::Resources)?,
            "windows_5000x24h_s": windows(&model, &day),
            "window_one_strip_ms": one_window(&model, &day[0]),
            "lookahead_p99_ms": decision_p99(&model, &mut Lookahead::default())?,
            "beam_p99_ms": decision_p99(&model, &mut Beam::default())?,
            "frugal_p99_ms": decision_p99(&with_resources()?, &mut Frugal::default())?,
        })
    );
    Ok(())
}

/// The same satellite with power, data and momentum, all modules on.
fn with_resources() -> Result<Arc<Model>> {
    let resources = Some(Box::new(ResourcesConfig::of(Profile::Minisat)));
    Ok(Arc::new(Model::new(SimConfig { resources, ..SimConfig::default() })?))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn day_of_requests(model: &Model) -> Vec<StripRequest> {
    ScenarioConfig::default().generate(&mut rng::stream(1, rng::CATALOGUE), 5000, model.config.earth.radius_m)
}

/// Reference, steering, servo and RK4 over image tasks, without planning.
fn closed_loop(model: &Arc<Model>) -> Result<f64> {
    let mut rates = Vec::new();
    for seed in 0..RUNS as u64 {
        let env = Env::episode(model.clone(), &EpisodeConfig::evaluation(), seed);
        let initial = InitialState::draw(&model.config, &mut rng::stream(seed, rng::INITIAL_STATE));
        let mut flight = Flight::new(model, Spacecraft::new(model, &initial));
        let context = env.context();
        let tasks = (0..context.candidates.len())
            .map(|candidate| swath_sim::planner::Decision::Image { candidate, t_pre: 160 }.to_task(&context))
            .collect::<Result<Vec<_>, _>>()?;
        let started = Instant::now();
        for task in tasks.iter().cycle().take(1500) {
            black_box(flight.fly(*task, Tick(u64::MAX)));
        }
        rates.push(flight.now().0 as f64 / started.elapsed().as_secs_f64());
    }
    Ok(median(rates))
}

/// Environment steps with 5000 strips, N = 40, the observation written each time.
fn decision_steps(model: &Arc<Model>, set: ObservationSet) -> Result<f64> {
    let scenario = ScenarioConfig { count: [5000, 5000], ..ScenarioConfig::default() };
    let config = EpisodeConfig { orbits: 15.0, scenario, ..EpisodeConfig::default() };
    let mut planner = Heuristic { t_pre_s: 80.0 };
    let mut features = vec![0.0; 40 * set.features()];
    let mut mask = vec![false; 40];
    let mut rates = Vec::new();
    for seed in 0..RUNS as u64 {
        let mut env = Env::episode(model.clone(), &config, seed);
        let mut steps = 0;
        let started = Instant::now();
        while !env.truncated() {
            env.observe(set, &mut features, &mut mask);
            black_box(&features);
            let decision = planner.decide(&env.context())?;
            env.step(decision)?;
            steps += 1;
        }
        rates.push(f64::from(steps) / started.elapsed().as_secs_f64());
    }
    Ok(median(rates))
}

/// 99th percentile of a decision in a mission of 6 orbits with 5000 strips [ms].
fn decision_p99(model: &Arc<Model>, planner: &mut dyn Planner) -> Result<f64> {
    let scenario = ScenarioConfig { count: [5000, 5000], ..ScenarioConfig::default() };
    let mut env = Env::episode(model.clone(), &EpisodeConfig { orbits: 6.0, scenario, ..EpisodeConfig::default() }, 1);
    let mut times = Vec::new();
    while !env.truncated() {
        let started = Instant::now();
        let decision = env.decide(planner)?;
        times.push(started.elapsed().as_secs_f64() * 1e3);
        env.step(decision)?;
    }
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() * 99 / 100])
}

/// Seconds for the windows of 5000 strips over 24 h.
fn windows(model: &Model, requests: &[StripRequest]) -> f64 {
    let phase = InitialState::draw(&model.config, &mut rng::stream(1, 0)).orbit;
    let orbit = Orbit::new(&model.config, phase, model.period);
    let seconds = (0..RUNS).map(|_| {
        let mut catalogue = Catalogue::new(model, &orbit, Tick(DAY));
        let started = Instant::now();
        black_box(catalogue.add_all(model, requests, Tick(0)));
        started.elapsed().as_secs_f64()
    });
    median(seconds.collect())
}

/// Milliseconds to add one more strip to a catalogue.
fn one_window(model: &Model, request: &StripRequest) -> f64 {
    let phase = InitialState::draw(&model.config, &mut rng::stream(1, 0)).orbit;
    let orbit = Orbit::new(&model.config, phase, model.period);
    let mut catalogue = Catalogue::new(model, &orbit, Tick(DAY));
    let milliseconds = (0..1001).map(|_| {
        let started = Instant::now();
        let _ = black_box(catalogue.add(model, request, Tick(0)));
        started.elapsed().as_secs_f64() * 1e3
    });
    median(milliseconds.collect())
}
