use std::sync::Arc;

use proptest::prelude::*;

use super::*;
use crate::config::SimConfig;
use crate::learn::episode::{Env, EpisodeConfig};

fn env(seed: u64) -> Env {
    let episode = EpisodeConfig { orbits: 0.2, ..EpisodeConfig::evaluation() };
    Env::episode(Arc::new(Model::new(SimConfig::default()).unwrap()), &episode, seed)
}

fn problem<'a, 'm>(context: &DecisionContext<'a>, memo: &'m mut Memo, ticks: u64) -> Problem<'a, 'm> {
    let model = context.model;
    let transitions = Transitions::new(model, context.situation, &Allowance::default());
    let limits = (model.t_pre_max(), |seconds| model.period.ticks_ceil(seconds));
    Problem::new(context.candidates, transitions, limits, (0.004, ticks), memo)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn whatever_a_plan_is_made_of_its_conflicts_are_repaired_or_it_is_given_up(
        seed in 0..6u64,
        parts in prop::collection::vec((0..40usize, 0..1200u32), 0..10),
    ) {
        let env = env(seed);
        let context = env.context();
        let mut memo = Memo::default();
        let mut problem = problem(&context, &mut memo, u64::MAX);
        let goals = context.candidates.len();
        let mut rng = rng::planner(seed, 0);
        let activity = |&(goal, start): &(usize, u32)| Activity { goal: goal % goals, start: context.situation.now.after(start) };
        let mut plan = Schedule(parts.iter().map(activity).collect());
        if resolve(&mut plan, &mut problem, &mut rng, 0) {
            prop_assert!(plan.conflicts(&mut problem).is_empty());
            for (at, pair) in plan.0.windows(2).enumerate() {
                prop_assert!(pair[1].start >= problem.end(&pair[0]));
                let window = context.candidates[pair[1].goal].window;
                prop_assert!(pair[1].start <= window.close);
                prop_assert!(plan.0[..=at].iter().all(|it| !problem.same(it.goal, pair[1].goal)));
            }
        }
    }
}

#[test]
fn every_method_returns_plans_without_conflicts_that_are_no_worse() {
    for seed in 0..4 {
        let env = env(seed);
        let context = env.context();
        for method in [Method::Repair, Method::Annealing, Method::Squeaky] {
            let mut memo = Memo::default();
            let mut problem = problem(&context, &mut memo, 200_000);
            let begin = greedy(&mut problem, Schedule::default(), 0, by_priority(context.candidates));
            let before = begin.score(&problem);
            let mut rng = rng::planner(seed, 1);
            let better = improve(&mut problem, &mut rng, (method, 300), begin, 0);
            assert!(better.conflicts(&mut problem).is_empty(), "{method:?}");
            assert!(better.score(&problem) >= before, "{method:?}");
        }
    }
}

#[test]
fn what_is_committed_stays() {
    let env = env(2);
    let context = env.context();
    let mut memo = Memo::default();
    let mut problem = problem(&context, &mut memo, 400_000);
    let begin = greedy(&mut problem, Schedule::default(), 0, by_priority(context.candidates));
    assert!(begin.0.len() > 2, "{}", begin.0.len());
    for method in [Method::Repair, Method::Annealing, Method::Squeaky] {
        let mut rng = rng::planner(3, 1);
        let better = improve(&mut problem, &mut rng, (method, 300), begin.clone(), 2);
        assert_eq!(better.0[..2], begin.0[..2], "{method:?}");
    }
}

#[test]
fn the_effort_is_bounded() {
    let env = env(2);
    let context = env.context();
    let mut desk = Desk::new(Method::Repair, 0);
    let mut memo = Memo::default();
    let mut problem = problem(&context, &mut memo, 5000);
    let plan = greedy(&mut problem, Schedule::default(), 0, by_priority(context.candidates));
    let mut rng = rng::planner(0, 0);
    improve(&mut problem, &mut rng, (Method::Repair, 1000), plan, 0);
    assert!(problem.exhausted());
    // One round may be under way when the ticks are spent.
    assert!(problem.transitions.search.ticks < 5000 + 60 * 240, "{}", problem.transitions.search.ticks);
    let plan = desk.plan(&context, &Allowance::default(), Effort { ticks: 60_000, rounds: 100 }, &[]);
    assert!(!plan.is_empty());
}
