//! Missions whose satellite is not the one that its planner believes in, and requests that come in flight.

use std::sync::Arc;

use swath_sim::config::SimConfig;
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::planner::{Beam, Experience, Heuristic, Lookahead, Planner};
use swath_sim::task::{SettledTask, Totals};
use swath_sim::time::Tick;
use swath_sim::vehicle::errors::PlantErrors;
use swath_sim::vehicle::model::Model;

fn env(episode: &EpisodeConfig, seed: u64) -> Env {
    Env::episode(Arc::new(Model::new(SimConfig::default()).unwrap()), episode, seed)
}

fn two_orbits() -> EpisodeConfig {
    EpisodeConfig { orbits: 2.0, ..EpisodeConfig::evaluation() }
}

fn fly(errors: &str, planner: &mut dyn Planner, seed: u64) -> (Vec<SettledTask>, Totals) {
    let mut env = env(&two_orbits(), seed);
    env.differ(&errors.parse().unwrap(), seed).unwrap();
    let (mut records, mut totals) = (Vec::new(), Totals::default());
    env.run(planner, |record| {
        records.push(record.clone());
        totals.add(record);
    })
    .unwrap();
    (records, totals)
}

#[test]
fn a_plant_without_errors_changes_nothing_to_the_last_bit() {
    let mut records = Vec::new();
    env(&two_orbits(), 3).run(&mut Lookahead::default(), |record| records.push(record.clone())).unwrap();
    assert_eq!(fly("none", &mut Lookahead::default(), 3).0, records);
}

#[test]
fn the_margin_is_worth_its_time_on_every_plant() {
    for errors in ["torque-10%", "inertia+5%", "inertia-5%", "noise", "delay"] {
        let (mut adaptive, mut fixed, mut best) = (Totals::default(), Totals::default(), [Totals::default(); 3]);
        for seed in 0..2 {
            let flown = |planner: &mut dyn Planner, totals: &mut Totals| {
                fly(errors, planner, seed).0.iter().for_each(|record| totals.add(record));
            };
            flown(&mut Lookahead::default(), &mut adaptive);
            flown(&mut Lookahead::with_margin(0), &mut fixed);
            for (t_pre_s, totals) in [80.0, 90.0, 100.0].into_iter().zip(&mut best) {
                flown(&mut Heuristic { t_pre_s }, totals);
            }
        }
        let heuristic = best.map(|totals| totals.reward).into_iter().fold(0.0, f64::max);
        assert!(adaptive.reward > 1.4 * heuristic, "{errors}: {adaptive:?} {heuristic}");
        assert!(adaptive.success_rate() > 0.9, "{errors}: {adaptive:?}");
        assert!(adaptive.success_rate() > fixed.success_rate(), "{errors}: {adaptive:?} {fixed:?}");
    }
}

#[test]
fn without_errors_a_learned_margin_stays_at_nothing() {
    let (adaptive, totals) = fly("none", &mut Lookahead::default(), 5);
    assert_eq!(adaptive, fly("none", &mut Lookahead::with_margin(0), 5).0);
    assert_eq!((totals.failed_attitude, totals.failed_elevation), (0, 0));
}

#[test]
fn a_decision_takes_effect_when_its_delay_has_passed() {
    let (records, totals) = fly("delay", &mut Beam::default(), 1);
    for pair in records.windows(2) {
        assert_eq!(pair[1].record.start.since(pair[0].record.end), 2, "one second at 2 Hz");
    }
    assert!(totals.success_rate() > 0.99, "{totals:?}");
    let (late, _) = fly("delay", &mut Lookahead::with_margin(0), 1);
    assert_ne!(late[5..], fly("none", &mut Lookahead::with_margin(0), 1).0[5..]);
}

/// Flies one decision, on the same situation, with and without an error.
#[test]
fn weaker_wheels_make_the_same_slew_worse() {
    let error = |name: &str| {
        let mut env = env(&two_orbits(), 4);
        env.differ(&name.parse().unwrap(), 4).unwrap();
        let decision = Lookahead::default().decide(&env.context()).unwrap();
        env.step(decision).unwrap().record.outcome.max_attitude_error
    };
    let exact = error("none");
    assert!(exact < 0.1);
    assert!(error("torque-10%") > exact + 1e-3);
    assert!((error("noise") - exact).abs() > 1e-6);
}

#[test]
fn noise_is_seen_by_the_planner() {
    let exact = env(&two_orbits(), 2);
    let mut noisy = env(&two_orbits(), 2);
    noisy.differ(&PlantErrors { attitude_noise_rad: 1e-3, ..PlantErrors::default() }, 2).unwrap();
    let body = |env: &Env| env.context().situation.body;
    let difference = (body(&exact).sigma_BN - body(&noisy).sigma_BN).norm();
    assert!((1e-5..2e-3).contains(&difference), "{difference}");
    assert_eq!(body(&exact).wheel_speed, body(&noisy).wheel_speed);
}

#[test]
fn noise_follows_from_the_seed() {
    assert_eq!(fly("noise", &mut Lookahead::default(), 6), fly("noise", &mut Lookahead::default(), 6));
    let with_seed = |seed| {
        let mut env = env(&two_orbits(), 6);
        env.differ(&PlantErrors::noise(), seed).unwrap();
        env.context().situation.body
    };
    assert_ne!(with_seed(1), with_seed(2));
}

#[test]
fn requests_come_in_flight_and_never_before_their_time() {
    let episode = EpisodeConfig { arrivals: 0.5, ..two_orbits() };
    let whole = env(&two_orbits(), 7).catalogue().len();
    let mut env = env(&episode, 7);
    let horizon = env.horizon();
    let known = env.catalogue().len();
    assert!((whole / 2).abs_diff(known) < whole / 20, "{known} of {whole}");
    let mut before = known;
    let mut planner = Heuristic { t_pre_s: 80.0 };
    let mut halfway = 0;
    while !env.truncated() {
        let decision = planner.decide(&env.context()).unwrap();
        env.fly(decision, env.horizon()).unwrap();
        assert!(env.catalogue().len() >= before);
        before = env.catalogue().len();
        if env.now() < Tick(horizon.0 / 2) {
            halfway = before;
        }
    }
    // Poisson: half of those to come have come halfway, give or take a few standard deviations; some lie where no
    // window is left by the time they come.
    let share = (halfway - known) as f64 / (whole - known) as f64;
    assert!((0.4..0.55).contains(&share), "{share}");
    assert!((whole as f64 * 0.85..=whole as f64).contains(&(before as f64)), "{before} of {whole}");
}

#[test]
fn the_first_requests_are_the_same_whether_others_come_or_not() {
    let (all, some) = (env(&two_orbits(), 8), env(&EpisodeConfig { arrivals: 0.3, ..two_orbits() }, 8));
    for id in 1..=some.catalogue().len() as u64 {
        let strip = |env: &Env| env.catalogue().get(swath_sim::world::strip::StripId(id)).unwrap().strip;
        assert_eq!(strip(&all), strip(&some));
    }
    assert!(EpisodeConfig { arrivals: 1.5, ..two_orbits() }.validate().is_err());
}

#[test]
fn a_fixed_margin_learns_nothing() {
    let mut planner = Lookahead::with_margin(3);
    let (_, totals) = fly("torque-10%", &mut planner, 1);
    assert!(totals.failed_attitude > 5, "{totals:?}");
    assert_eq!(planner.name(), "lookahead:3");
    assert_eq!(Experience::fixed(3).margin(), Some(3));
}
