//! What the planner may do by itself: fly what it chooses, propose it, or nothing.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use swath_sim::planner::{Decision, DecisionContext, Planner, PlannerError, Rationale};
use swath_sim::requests::catalogue::Candidate;
use swath_sim::time::{Tick, TickPeriod};
use swath_sim::world::strip::StripId;
use thiserror::Error;

use crate::fallback::GuardedPlanner;

/// What the planner may do by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// It chooses and the satellite flies.
    #[default]
    Autonomous,
    /// It proposes and an operator approves.
    Approve,
    /// It chooses nothing: the attitude is held.
    Hold,
}

/// What becomes of a proposal that nobody has decided on in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AtDeadline {
    /// It is flown.
    Fly,
    /// It is not proposed again in this window.
    #[default]
    Skip,
    /// It goes on waiting until its window closes.
    Wait,
}

/// How the planner is supervised.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ApprovalConfig {
    /// Mode at the start.
    pub mode: Mode,
    /// How long a proposal waits for an operator [s of simulated time].
    pub deadline_s: f64,
    /// What happens then.
    pub at_deadline: AtDeadline,
    /// How long the attitude is held before the planner looks again whether it may go on [s of simulated time].
    pub look_again_s: f64,
}

impl Default for ApprovalConfig {
    fn default() -> Self {
        Self { mode: Mode::default(), deadline_s: 120.0, at_deadline: AtDeadline::default(), look_again_s: 2.0 }
    }
}

/// Why an operator's decision is not taken.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum ReviewError {
    /// There is no open proposal.
    #[error("nothing is proposed")]
    Nothing,
    /// Another proposal is open.
    #[error("proposal {given} is not the one that is open, which is {open}")]
    Other {
        /// Number given.
        given: u64,
        /// Number that is open.
        open: u64,
    },
    /// It is approved already.
    #[error("proposal {number} is approved already")]
    Decided {
        /// Number given.
        number: u64,
    },
}

/// What the planner proposes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Proposal {
    /// Number, from 1.
    pub number: u64,
    /// The strip, with the window in which it would be imaged.
    pub candidate: Candidate,
    /// Transition, if the task had started when it was proposed [ticks].
    pub t_pre: u32,
    /// Tick after which it is decided without an operator; `None` when it waits.
    pub deadline: Option<Tick>,
    /// Whether an operator has approved it.
    pub approved: bool,
}

/// Stands between the planner and the satellite.
#[derive(Clone, Debug)]
pub struct Gate {
    mode: Mode,
    deadline: u32,
    at_deadline: AtDeadline,
    look_again: u32,
    proposal: Option<Proposal>,
    proposed: u64,
    /// Strips that are not proposed again before these ticks.
    skipped: BTreeMap<StripId, Tick>,
    last_outcome: String,
}

impl Gate {
    /// A gate as a mission configures it.
    #[must_use]
    pub fn new(config: &ApprovalConfig, period: TickPeriod) -> Self {
        Self {
            mode: config.mode,
            deadline: period.ticks_ceil(config.deadline_s).max(1),
            at_deadline: config.at_deadline,
            look_again: period.ticks_ceil(config.look_again_s).max(1),
            proposal: None,
            proposed: 0,
            skipped: BTreeMap::new(),
            last_outcome: String::new(),
        }
    }

    /// The mode in force.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// What is proposed.
    #[must_use]
    pub fn proposal(&self) -> Option<&Proposal> {
        self.proposal.as_ref()
    }

    /// Withdraws what is proposed and forgets what was skipped; the mode stays.
    pub fn forget(&mut self) {
        self.close("withdrawn: the planner was started again");
        self.skipped.clear();
    }

    /// What became of the proposal before, in words.
    #[must_use]
    pub fn last_outcome(&self) -> &str {
        &self.last_outcome
    }

    /// Changes the mode; what is proposed is withdrawn when nothing is to be approved any more.
    pub fn set_mode(&mut self, mode: Mode) {
        self.mode = mode;
        if mode != Mode::Approve {
            self.close("withdrawn: the mode was changed");
            self.skipped.clear();
        }
    }

    /// An operator decides on a proposal; 0 is the one that is open. Returns its number.
    ///
    /// # Errors
    /// When there is no such open proposal.
    pub fn review(&mut self, number: u64, approve: bool, actor: &str) -> Result<u64, ReviewError> {
        let proposal = self.proposal.as_mut().ok_or(ReviewError::Nothing)?;
        let open = proposal.number;
        if number != 0 && number != open {
            return Err(ReviewError::Other { given: number, open });
        }
        if proposal.approved {
            return Err(ReviewError::Decided { number: open });
        }
        if approve {
            proposal.approved = true;
        } else {
            self.skip(&format!("rejected by {actor}"));
        }
        Ok(open)
    }

    /// Decides with a planner, as far as it may; `plan` decides among the candidates that it is given.
    ///
    /// # Errors
    /// The planner's.
    pub fn decide(
        &mut self,
        now: Tick,
        candidates: &[Candidate],
        mut plan: impl FnMut(&[Candidate]) -> Result<Decision, PlannerError>,
    ) -> Result<Decision, PlannerError> {
        match self.mode {
            Mode::Autonomous => plan(candidates),
            Mode::Hold => Ok(Decision::Wait { ticks: self.look_again }),
            Mode::Approve => {
                self.mind_proposal(now, candidates);
                match self.proposal {
                    Some(proposal) if proposal.approved => self.fly_approved(&proposal, candidates, plan),
                    Some(_) => Ok(Decision::Wait { ticks: self.look_again }),
                    None => self.propose(now, candidates, plan),
                }
            }
        }
    }

    fn mind_proposal(&mut self, now: Tick, candidates: &[Candidate]) {
        self.skipped.retain(|_, until| *until >= now);
        let Some(proposal) = &mut self.proposal else { return };
        let offered = candidates.iter().any(|it| same(it, &proposal.candidate));
        let late = proposal.deadline.is_some_and(|deadline| now > deadline) && !proposal.approved;
        if !offered {
            self.close("withdrawn: the strip is no longer offered");
        } else if late && self.at_deadline == AtDeadline::Fly {
            proposal.approved = true;
        } else if late {
            self.skip("skipped: nobody decided in time");
        }
    }

    fn fly_approved(
        &mut self,
        proposal: &Proposal,
        candidates: &[Candidate],
        mut plan: impl FnMut(&[Candidate]) -> Result<Decision, PlannerError>,
    ) -> Result<Decision, PlannerError> {
        let Some(index) = candidates.iter().position(|it| same(it, &proposal.candidate)) else {
            return Ok(Decision::Wait { ticks: self.look_again });
        };
        match plan(&candidates[index..=index])? {
            Decision::Image { t_pre, .. } => {
                self.close("approved and flown");
                Ok(Decision::Image { candidate: index, t_pre })
            }
            Decision::Wait { ticks } => Ok(Decision::Wait { ticks: ticks.min(self.look_again) }),
            // What the satellite does for itself needs nobody's approval.
            duty @ Decision::Serve { .. } => Ok(duty),
        }
    }

    fn propose(
        &mut self,
        now: Tick,
        candidates: &[Candidate],
        mut plan: impl FnMut(&[Candidate]) -> Result<Decision, PlannerError>,
    ) -> Result<Decision, PlannerError> {
        let left: Vec<_> = candidates.iter().filter(|it| !self.skipped.contains_key(&it.id)).copied().collect();
        match plan(&left)? {
            Decision::Image { candidate, t_pre } => {
                let count = left.len();
                let chosen = *left.get(candidate).ok_or(PlannerError::NoSuchCandidate { candidate, count })?;
                self.proposed += 1;
                let deadline = (self.at_deadline != AtDeadline::Wait).then(|| now.after(self.deadline));
                let number = self.proposed;
                self.proposal = Some(Proposal { number, candidate: chosen, t_pre, deadline, approved: false });
                Ok(Decision::Wait { ticks: self.look_again })
            }
            Decision::Wait { ticks } => Ok(Decision::Wait { ticks: ticks.min(self.look_again) }),
            // What the satellite does for itself needs nobody's approval.
            duty @ Decision::Serve { .. } => Ok(duty),
        }
    }

    /// The strip proposed is not proposed again in this window.
    fn skip(&mut self, outcome: &str) {
        if let Some(proposal) = &self.proposal {
            self.skipped.insert(proposal.candidate.id, proposal.candidate.window.close);
        }
        self.close(outcome);
    }

    fn close(&mut self, outcome: &str) {
        if let Some(proposal) = self.proposal.take() {
            let Proposal { number, candidate, .. } = proposal;
            self.last_outcome = format!("proposal {number}, strip {}: {outcome}", candidate.id.0);
        }
    }
}

/// A guarded planner that may do by itself what its gate lets through.
pub struct GatedPlanner {
    /// What it may do by itself.
    pub gate: Gate,
    /// The planner.
    pub planner: GuardedPlanner,
}

impl Planner for GatedPlanner {
    fn name(&self) -> String {
        self.planner.name()
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let planner = &mut self.planner;
        // The guarded planner's decisions are allowed ones: the heuristic waits when nothing else is left.
        let plan = |left: &[Candidate]| planner.decide(&DecisionContext { candidates: left, ..*context });
        self.gate.decide(context.situation.now, context.candidates, plan)
    }

    fn forget(&mut self) {
        self.gate.forget();
        self.planner.forget();
    }

    fn replaced(&self) -> Option<&str> {
        self.planner.replaced()
    }

    fn minds_wheels(&self) -> bool {
        self.planner.minds_wheels()
    }

    fn minds_resources(&self) -> bool {
        self.planner.minds_resources()
    }

    fn rationale(&self) -> Option<Rationale> {
        self.planner.rationale()
    }

    fn fork(&self) -> Option<Box<dyn Planner + Send>> {
        Some(Box::new(Self { gate: self.gate.clone(), planner: self.planner.doubled()? }))
    }
}

fn same(a: &Candidate, b: &Candidate) -> bool {
    a.id == b.id && a.window.close == b.window.close
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use swath_sim::config::SimConfig;
    use swath_sim::learn::episode::{Env, EpisodeConfig};
    use swath_sim::vehicle::model::Model;

    use super::*;

    const PERIOD_S: f64 = 0.5;

    fn gate(at_deadline: AtDeadline) -> Gate {
        let config = ApprovalConfig { mode: Mode::Approve, at_deadline, ..ApprovalConfig::default() };
        Gate::new(&config, TickPeriod::from_frequency(1.0 / PERIOD_S).unwrap())
    }

    fn candidates() -> Vec<Candidate> {
        let model = Arc::new(Model::new(SimConfig::default()).unwrap());
        Env::episode(model, &EpisodeConfig::default(), 2).context().candidates[..5].to_vec()
    }

    /// A planner that always takes the last candidate.
    fn last(candidates: &[Candidate]) -> Result<Decision, PlannerError> {
        match candidates.len() {
            0 => Ok(Decision::Wait { ticks: 120 }),
            count => Ok(Decision::Image { candidate: count - 1, t_pre: 60 }),
        }
    }

    #[test]
    fn nothing_is_flown_before_it_is_approved() {
        let mut gate = gate(AtDeadline::Skip);
        let candidates = candidates();
        let waits = Ok(Decision::Wait { ticks: 4 });
        assert_eq!(gate.decide(Tick(0), &candidates, last), waits);
        let proposal = *gate.proposal().unwrap();
        assert_eq!((proposal.number, proposal.candidate.id, proposal.deadline), (1, candidates[4].id, Some(Tick(240))));
        assert_eq!(gate.decide(Tick(4), &candidates, |_| unreachable!()), waits, "the proposal stays");
        assert_eq!(gate.review(2, true, "ops"), Err(ReviewError::Other { given: 2, open: 1 }));
        assert_eq!(gate.review(0, true, "ops"), Ok(1));
        assert_eq!(gate.review(1, true, "ops"), Err(ReviewError::Decided { number: 1 }));
        let flown = gate.decide(Tick(8), &candidates, last);
        assert_eq!(flown, Ok(Decision::Image { candidate: 4, t_pre: 60 }));
        assert_eq!(gate.last_outcome(), format!("proposal 1, strip {}: approved and flown", candidates[4].id.0));
        assert_eq!(gate.review(0, true, "ops"), Err(ReviewError::Nothing));
    }

    #[test]
    fn a_rejected_strip_is_not_proposed_again_in_its_window() {
        let mut gate = gate(AtDeadline::Skip);
        let candidates = candidates();
        gate.decide(Tick(0), &candidates, last).unwrap();
        gate.review(1, false, "ops").unwrap();
        gate.decide(Tick(4), &candidates, last).unwrap();
        assert_eq!(gate.proposal().unwrap().candidate.id, candidates[3].id);
        let later = Tick(candidates[4].window.close.0 + 1);
        gate.decide(later, &[], last).unwrap();
        gate.decide(later, &candidates, last).unwrap();
        assert_eq!(gate.proposal().unwrap().candidate.id, candidates[4].id);
    }

    #[test]
    fn at_the_deadline_the_configuration_decides() {
        let candidates = candidates();
        for (at_deadline, flies, left) in
            [(AtDeadline::Fly, true, None), (AtDeadline::Skip, false, Some(2)), (AtDeadline::Wait, false, Some(1))]
        {
            let mut gate = gate(at_deadline);
            gate.decide(Tick(0), &candidates, last).unwrap();
            gate.decide(Tick(240), &candidates, last).unwrap();
            assert_eq!(gate.proposal().unwrap().number, 1, "in time");
            let decision = gate.decide(Tick(241), &candidates, last).unwrap();
            assert_eq!(matches!(decision, Decision::Image { .. }), flies, "{at_deadline:?}");
            assert_eq!(gate.proposal().map(|proposal| proposal.number), left, "{at_deadline:?}");
        }
    }

    #[test]
    fn hold_chooses_nothing_and_autonomous_everything() {
        let mut gate = gate(AtDeadline::Skip);
        let candidates = candidates();
        gate.decide(Tick(0), &candidates, last).unwrap();
        gate.set_mode(Mode::Hold);
        assert_eq!(gate.proposal(), None);
        assert_eq!(gate.decide(Tick(4), &candidates, last), Ok(Decision::Wait { ticks: 4 }));
        gate.set_mode(Mode::Autonomous);
        assert_eq!(gate.decide(Tick(8), &candidates, last), last(&candidates));
    }

    #[test]
    fn a_strip_that_is_no_longer_offered_is_no_longer_proposed() {
        let mut gate = gate(AtDeadline::Wait);
        let candidates = candidates();
        gate.decide(Tick(0), &candidates, last).unwrap();
        gate.decide(Tick(4), &candidates[..3], last).unwrap();
        assert_eq!(gate.proposal().unwrap().number, 2);
        assert!(gate.last_outcome().ends_with("withdrawn: the strip is no longer offered"));
    }
}
