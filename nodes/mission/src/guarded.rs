//! Planners as missions fly them: whatever happens to one, somebody decides.

use std::collections::BTreeMap;

use anyhow::Result;
use swath_sim::planner::{Decision, DecisionContext, Heuristic, Planner, PlannerError, PlannerSpec, Rationale};

/// Learned policies as a program links them. Programs hand this in, so that those which do not plan are not linked with
/// what policies need.
#[derive(Clone, Copy, Debug)]
pub struct Policies {
    /// Makes a planner for a mission of a seed.
    pub make: fn(&PlannerSpec, u64) -> Result<Box<dyn Planner + Send>>,
    /// SHA-256 of a planner's policy, in hexadecimal; nothing for a hand-written one.
    pub digest: fn(&PlannerSpec) -> Result<Option<String>>,
    /// Revision of the program's source.
    pub revision: &'static str,
}

/// Transition of the heuristic that takes over from a planner that fails [s].
const FALLBACK_T_PRE_S: f64 = 90.0;

/// The planner that takes over.
const FALLBACK: Heuristic = Heuristic { t_pre_s: FALLBACK_T_PRE_S };

/// Who made the decisions of a mission: their numbers by name of the planner.
pub type Deciders = BTreeMap<String, u64>;

/// The decisions that the heuristic made in the place of the planner that was asked for.
#[must_use]
pub fn made_instead(mut deciders: Deciders, asked_for: &PlannerSpec) -> Deciders {
    let name = FALLBACK.name();
    deciders.retain(|decider, _| *decider == name && asked_for.to_string() != name);
    deciders
}

/// A planner with the heuristic behind it, which decides when the planner cannot.
pub struct GuardedPlanner {
    /// None when it could not be made.
    planner: Option<Box<dyn Planner + Send>>,
    /// Why the planner itself did not make the last decision.
    fault: Option<String>,
    /// Why it could not be made.
    missing: Option<String>,
    deciders: Deciders,
}

impl GuardedPlanner {
    /// Makes a mission's planner; [`GuardedPlanner::missing`] tells when it could not be made.
    #[must_use]
    pub fn make(policies: &Policies, spec: &PlannerSpec, seed: u64) -> Self {
        match (policies.make)(spec, seed) {
            Ok(planner) => Self::new(planner),
            Err(error) => {
                Self { planner: None, fault: None, deciders: Deciders::new(), missing: Some(format!("{error:#}")) }
            }
        }
    }

    /// Guards a planner.
    #[must_use]
    pub fn new(planner: Box<dyn Planner + Send>) -> Self {
        Self { planner: Some(planner), fault: None, missing: None, deciders: Deciders::new() }
    }

    /// Why there is no planner but the heuristic.
    #[must_use]
    pub fn missing(&self) -> Option<&str> {
        self.missing.as_deref()
    }

    /// Who has made the decisions.
    #[must_use]
    pub fn deciders(&self) -> &Deciders {
        &self.deciders
    }

    /// Why the heuristic made the last decision in the planner's place.
    #[must_use]
    pub fn fault(&self) -> Option<&str> {
        self.fault.as_deref()
    }
}

/// A decision that the context allows.
fn usable(planner: &mut dyn Planner, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
    let decision = planner.decide(context)?;
    decision.to_task(context).map(|_| decision)
}

impl Planner for GuardedPlanner {
    /// Name of the planner that made the last decision, or will make the first.
    fn name(&self) -> String {
        let own = self.planner.as_ref().filter(|_| self.fault.is_none());
        own.map_or_else(|| FALLBACK.name(), |planner| planner.name())
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let mut fallback = FALLBACK;
        self.fault = None;
        let decision = match &mut self.planner {
            Some(planner) => usable(planner.as_mut(), context).or_else(|error| {
                self.fault = Some(error.to_string());
                usable(&mut fallback, context)
            }),
            None => usable(&mut fallback, context),
        };
        *self.deciders.entry(self.name()).or_insert(0) += 1;
        decision
    }

    fn rationale(&self) -> Option<Rationale> {
        self.planner.as_ref().filter(|_| self.fault.is_none())?.rationale()
    }
}
