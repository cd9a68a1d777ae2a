//! Planners as missions fly them: whatever happens to one, somebody decides.

use std::collections::BTreeMap;

use anyhow::{Context as _, Result};
use swath_sim::config::SimConfig;
use swath_sim::planner::{
    Decision, DecisionContext, Heuristic, Lookahead, Planner, PlannerError, PlannerSpec, Rationale,
};
use swath_sim::vehicle::health::lost;

/// Learned policies as a program links them. Programs hand this in, so that those which do not plan are not linked with
/// what policies need.
#[derive(Clone, Copy, Debug)]
pub struct Policies {
    /// Makes a planner for a mission of a seed.
    pub make: fn(&PlannerSpec, u64) -> Result<Box<dyn Planner + Send>>,
    /// SHA-256 of a planner's policy, in hexadecimal; nothing for a hand-written one.
    pub digest: fn(&PlannerSpec) -> Result<Option<String>>,
    /// What an operator is told of a policy that was trained on another satellite than this one.
    pub other_satellite: fn(&PlannerSpec, &SimConfig) -> Result<Option<String>>,
    /// Revision of the program's source.
    pub revision: &'static str,
}

impl Policies {
    /// No learned policies: hand-written planners only.
    pub const HAND_WRITTEN: Self = Self {
        make: |spec, seed| {
            spec.hand_written(seed).with_context(|| format!("{spec} is a policy, which this program lacks"))
        },
        digest: |_| Ok(None),
        other_satellite: |_, _| Ok(None),
        revision: "",
    };

    /// What an operator is told of a planner before it flies a satellite. That its policy cannot be read is told where
    /// it is made.
    #[must_use]
    pub fn warning(&self, spec: &PlannerSpec, satellite: &SimConfig) -> Option<String> {
        (self.other_satellite)(spec, satellite).ok().flatten()
    }
}

/// Transition of the heuristic that takes over from a planner that fails [s].
const FALLBACK_T_PRE_S: f64 = 90.0;

/// Why a planner that does not fly its slews in its head does not decide any more.
const WHEEL_LOST: &str = "a wheel is lost, and the planner does not know what the others can point at";

/// The planner that takes over.
const FALLBACK: Heuristic = Heuristic { t_pre_s: FALLBACK_T_PRE_S };

/// Name of the planner that takes over.
#[must_use]
pub fn fallback() -> String {
    FALLBACK.name()
}

/// Who made the decisions of a mission: their numbers by name of the planner.
pub type Deciders = BTreeMap<String, u64>;

/// The decisions that another one made in the place of the planner that was asked for.
#[must_use]
pub fn made_instead(mut deciders: Deciders, asked_for: &PlannerSpec) -> Deciders {
    let asked_for = asked_for.to_string();
    let others = [FALLBACK.name(), Lookahead::default().name()];
    deciders.retain(|decider, _| others.contains(decider) && *decider != asked_for);
    deciders
}

/// A planner with the heuristic behind it, which decides when the planner cannot.
pub struct GuardedPlanner {
    /// None when it could not be made.
    planner: Option<Box<dyn Planner + Send>>,
    /// Decides once a wheel is lost, where the planner does not know what is left to point with.
    degraded: Lookahead,
    /// Whether it made the last decision.
    degraded_decided: bool,
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
                let degraded = Lookahead::default();
                let (fault, missing, deciders) = (None, Some(format!("{error:#}")), Deciders::new());
                Self { planner: None, degraded, degraded_decided: false, fault, missing, deciders }
            }
        }
    }

    /// Guards a planner.
    #[must_use]
    pub fn new(planner: Box<dyn Planner + Send>) -> Self {
        let degraded = Lookahead::default();
        let (fault, missing, deciders) = (None, None, Deciders::new());
        Self { planner: Some(planner), degraded, degraded_decided: false, fault, missing, deciders }
    }

    /// Another one that goes on from here as this one would; none where its planner cannot be doubled.
    #[must_use]
    pub fn doubled(&self) -> Option<Self> {
        let planner = match &self.planner {
            Some(planner) => Some(planner.fork()?),
            None => None,
        };
        Some(Self {
            planner,
            degraded: self.degraded.clone(),
            degraded_decided: self.degraded_decided,
            fault: self.fault.clone(),
            missing: self.missing.clone(),
            deciders: self.deciders.clone(),
        })
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

    /// Why another one made the last decision in the planner's place.
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
        if self.degraded_decided {
            return self.degraded.name();
        }
        let own = self.planner.as_ref().filter(|_| self.fault.is_none());
        own.map_or_else(|| FALLBACK.name(), |planner| planner.name())
    }

    fn decide(&mut self, context: &DecisionContext<'_>) -> Result<Decision, PlannerError> {
        let mut fallback = FALLBACK;
        self.fault = None;
        let minds = self.planner.as_ref().is_some_and(|planner| planner.minds_wheels());
        self.degraded_decided = lost(&context.situation.wheels) && !minds;
        let decision = match &mut self.planner {
            _ if self.degraded_decided => {
                self.fault = Some(WHEEL_LOST.to_owned());
                usable(&mut self.degraded, context)
            }
            Some(planner) => usable(planner.as_mut(), context).or_else(|error| {
                self.fault = Some(error.to_string());
                usable(&mut fallback, context)
            }),
            None => usable(&mut fallback, context),
        };
        *self.deciders.entry(self.name()).or_insert(0) += 1;
        decision
    }

    fn forget(&mut self) {
        self.planner.iter_mut().for_each(|planner| planner.forget());
        self.degraded.forget();
    }

    fn replaced(&self) -> Option<&str> {
        self.fault().or(self.missing())
    }

    fn minds_wheels(&self) -> bool {
        true
    }

    fn fork(&self) -> Option<Box<dyn Planner + Send>> {
        Some(Box::new(self.doubled()?))
    }

    fn minds_resources(&self) -> bool {
        self.planner.as_ref().is_some_and(|planner| planner.minds_resources())
    }

    fn rationale(&self) -> Option<Rationale> {
        self.planner.as_ref().filter(|_| self.fault.is_none())?.rationale()
    }
}
