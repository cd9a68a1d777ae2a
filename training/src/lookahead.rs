//! A policy whose proposals are flown in the head: exact transition times, and the critic's word on what comes after.

use swath_sim::learn::observation::observe;
use swath_sim::planner::{
    Allowance, BeamSearch, Decision, DecisionContext, Experience, Planner, PlannerError, Rationale, Sequence,
};
use swath_sim::requests::catalogue::Candidate;

use crate::error::{Result, TrainingError};
use crate::policy::{Judgement, LearnedPlanner, Policy};

/// A policy with the satellite's model at hand.
///
/// The discrete actor proposes strips, beam search flies sequences of them with the shortest transitions that succeed,
/// and the critic values the situations that the sequences lead to. The greatest Σ γ^t·p + γ^T·V wins.
pub struct PolicyLookahead {
    learned: LearnedPlanner,
    /// Discount of the critic, per second.
    gamma: f64,
    judgement: Option<Judgement>,
    experience: Experience,
}

/// Strips that are flown in the head, the most probable first.
const PROPOSALS: usize = 20;

impl PolicyLookahead {
    /// A planner around a policy.
    #[must_use]
    pub fn new(policy: Policy) -> Self {
        let gamma = policy.run().ppo.gamma;
        Self { learned: LearnedPlanner::new(policy), gamma, judgement: None, experience: Experience::default() }
    }

    fn best(&self, context: &DecisionContext<'_>, judgement: &Judgement, allowance: &Allowance) -> Result<Decision> {
        let proposals = proposals(context.candidates, judgement);
        let strips: Vec<Candidate> = proposals.iter().map(|&i| context.candidates[i]).collect();
        let narrowed = DecisionContext { candidates: &strips, ..*context };
        let sequences = BeamSearch::default().sequences(&narrowed, allowance);
        let values = self.values(context, &narrowed, &sequences)?;
        let worth = |(sequence, value): (&Sequence, f32)| self.worth(&narrowed, sequence, value);
        let best = sequences.iter().zip(values).max_by(|a, b| worth(*a).total_cmp(&worth(*b)));
        Ok(best.map_or_else(
            || swath_sim::planner::wait_for_a_window(context),
            |(sequence, _)| Decision::Image { candidate: proposals[sequence.imaged[0]], t_pre: sequence.first_t_pre },
        ))
    }

    /// Σ γ^t·p + γ^T·V of a sequence.
    fn worth(&self, context: &DecisionContext<'_>, sequence: &Sequence, value: f32) -> f64 {
        let discount = |ticks: u32| self.gamma.powf(f64::from(ticks) * context.model.period.seconds());
        let imaged = sequence.imaged.iter().zip(&sequence.ends);
        let own: f64 = imaged.map(|(&i, &end)| discount(end) * context.candidates[i].strip.priority).sum();
        own + discount(sequence.elapsed) * f64::from(value)
    }

    /// The critic's value of where each sequence of narrowed candidates ends; 0 when it leaves no strip that is known.
    fn values(
        &self,
        context: &DecisionContext<'_>,
        narrowed: &DecisionContext<'_>,
        sequences: &[Sequence],
    ) -> Result<Vec<f32>> {
        let policy = self.learned.policy();
        let shape = policy.shape();
        let (mut features, mut valid) = (Vec::new(), Vec::new());
        let mut known = Vec::with_capacity(sequences.len());
        for sequence in sequences {
            let left = left(context.candidates, narrowed.candidates, sequence);
            known.push(!left.is_empty());
            if left.is_empty() {
                continue;
            }
            let after = DecisionContext { situation: &sequence.end, candidates: &left, ..*context };
            let (numbers, tokens) = (features.len(), valid.len());
            features.resize(numbers + shape.len(), 0.0);
            valid.resize(tokens + shape.tokens, false);
            observe(&after, policy.observation_set(), &mut features[numbers..], &mut valid[tokens..]);
        }
        if valid.is_empty() {
            return Ok(vec![0.0; sequences.len()]);
        }
        let mut values = policy.values(&features, &valid)?.into_iter();
        Ok(known.into_iter().map(|known| if known { values.next().unwrap_or(0.0) } else { 0.0 }).collect())
    }
}

/// The candidates that the actor finds most probable.
fn proposals(candidates: &[Candidate], judgement: &Judgement) -> Vec<usize> {
    let mut order: Vec<usize> = (0..candidates.len()).collect();
    order.sort_by(|&a, &b| judgement.probabilities[b].total_cmp(&judgement.probabilities[a]).then(a.cmp(&b)));
    order.truncate(PROPOSALS);
    order
}

/// Candidates that are left after a sequence; those further ahead than the ones known now stay unknown.
fn left(candidates: &[Candidate], narrowed: &[Candidate], sequence: &Sequence) -> Vec<Candidate> {
    let imaged = |candidate: &Candidate| sequence.imaged.iter().any(|&i| narrowed[i].id == candidate.id);
    let left = candidates.iter().filter(|candidate| candidate.window.close > sequence.end.now && !imaged(candidate));
    left.copied().collect()
}

impl Planner for PolicyLookahead {
    fn name(&self) -> String {
        format!("{}+lookahead", self.learned.name())
    }

    fn forget(&mut self) {
        self.experience.forget();
    }

    fn minds_wheels(&self) -> bool {
        true
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> std::result::Result<Decision, PlannerError> {
        self.judgement = None;
        let allowance = self.experience.learn(context);
        if context.candidates.is_empty() {
            return self.learned.decide(context);
        }
        let failed = |error: TrainingError| PlannerError::Policy(error.to_string());
        let judgement = self.learned.consider(context).map_err(failed)?;
        let decision = self.best(context, &judgement, &allowance).map_err(failed)?;
        self.experience.remember(context, decision);
        self.judgement = Some(judgement);
        Ok(decision)
    }

    fn rationale(&self) -> Option<Rationale> {
        let judgement = self.judgement.as_ref()?;
        let policy = self.learned.policy().digest().to_owned();
        Some(Rationale { probabilities: judgement.probabilities.clone(), value: judgement.value, policy })
    }
}
