//! The fixed-transition heuristic meets the paper's operating points (section V.A): T* = 80 s, 81 % success there, 99 %
//! at 120 s.

use std::sync::Arc;

use swath_sim::config::SimConfig;
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::planner::Heuristic;
use swath_sim::task::Totals;
use swath_sim::vehicle::model::Model;

const MISSIONS: u64 = 60;

/// All missions of a day with one fixed time.
fn fly(t_pre_s: f64) -> Totals {
    let model = Arc::new(Model::new(SimConfig::default()).unwrap());
    let mut totals = Totals::default();
    for seed in 0..MISSIONS {
        let mut env = Env::episode(Arc::clone(&model), &EpisodeConfig::evaluation(), seed);
        env.run(&mut Heuristic { t_pre_s }, |record| totals.add(record)).unwrap();
    }
    totals
}

#[test]
fn fixed_transition_times_succeed_as_often_as_in_the_paper() {
    let [at_50, at_80, at_120] = [50.0, 80.0, 120.0].map(fly);
    assert!((at_80.success_rate() - 0.81).abs() < 0.03, "{at_80:?}");
    assert!((at_120.success_rate() - 0.98).abs() < 0.015, "{at_120:?}");
    assert!(at_80.reward > at_50.reward && at_80.reward > at_120.reward, "{at_50:?} {at_80:?} {at_120:?}");
}
