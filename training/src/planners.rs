//! Makes planners by name, learned ones included.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Serialize;
use swath_sim::config::SimConfig;
use swath_sim::planner::{Planner, PlannerSpec};

use crate::error::{Result, TrainingError};
use crate::lookahead::PolicyLookahead;
use crate::policy::{self, Difference, LearnedPlanner, Policy};

/// Policies that are part of the program.
const SHIPPED: [(&str, &[u8]); 4] = [
    ("hop-ppo", include_bytes!("../policies/hop_ppo.safetensors")),
    ("hop-ppo-mlp", include_bytes!("../policies/hop_ppo_mlp.safetensors")),
    ("h-ppo", include_bytes!("../policies/h_ppo.safetensors")),
    ("discrete-ppo", include_bytes!("../policies/discrete_ppo.safetensors")),
];

/// A planner by name with the policy that it needs, read once: what is flown is what its digest says.
#[derive(Debug, Clone)]
pub struct Prepared {
    spec: PlannerSpec,
    policy: Option<PolicyFile>,
}

/// A policy's file, kept in memory.
#[derive(Debug, Clone)]
struct PolicyFile {
    bytes: Arc<[u8]>,
    /// What errors call it.
    path: PathBuf,
}

/// Which policy a planner flies.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PolicyOrigin {
    /// The planner's name.
    pub planner: String,
    /// SHA-256 of header and weights, in hexadecimal.
    pub sha256: String,
    /// Name of the run that trained it.
    pub run: String,
    /// Seed of that run.
    pub seed: u64,
    /// Environment steps that it was trained for.
    pub steps: u64,
    /// Where the satellite flown is not the one that it was trained on.
    pub other_satellite: Vec<Difference>,
}

impl Prepared {
    /// Reads what a planner needs.
    ///
    /// # Errors
    /// A policy that is not shipped, cannot be read, is damaged or is of another kind.
    pub fn new(spec: &PlannerSpec) -> Result<Self> {
        let PlannerSpec::Learned { kind, file, .. } = spec else {
            return Ok(Self { spec: spec.clone(), policy: None });
        };
        let policy = PolicyFile::find(kind, file.as_deref())?;
        let found = policy.parse()?.run().network.kind();
        if found != kind {
            return Err(TrainingError::unsuitable(&policy.path, format!("it holds a {found} policy, not {kind}")));
        }
        Ok(Self { spec: spec.clone(), policy: Some(policy) })
    }

    /// The name that it was prepared by.
    #[must_use]
    pub fn spec(&self) -> &PlannerSpec {
        &self.spec
    }

    /// Makes the planner for a mission of a seed.
    ///
    /// # Errors
    /// What libtorch refuses.
    pub fn make(&self, seed: u64) -> Result<Box<dyn Planner + Send>> {
        match (&self.policy, &self.spec) {
            (Some(file), PlannerSpec::Learned { lookahead: true, .. }) => {
                Ok(Box::new(PolicyLookahead::new(file.parse()?)))
            }
            (Some(file), _) => Ok(Box::new(LearnedPlanner::new(file.parse()?))),
            (None, spec) => {
                let planner = spec.hand_written(seed);
                planner.ok_or_else(|| TrainingError::Environment(format!("{spec} cannot be made")))
            }
        }
    }

    /// The policy, and how the satellite that it is to fly differs from the one that it was trained on; `None` for a
    /// hand-written planner.
    ///
    /// # Errors
    /// A satellite that JSON cannot hold.
    pub fn origin(&self, flown: &SimConfig) -> Result<Option<PolicyOrigin>> {
        let Some(file) = &self.policy else { return Ok(None) };
        let policy = file.parse()?;
        Ok(Some(PolicyOrigin {
            planner: self.spec.to_string(),
            sha256: policy.digest().to_owned(),
            run: policy.run().name.clone(),
            seed: policy.run().seed,
            steps: policy.steps(),
            other_satellite: policy.differences(flown)?,
        }))
    }
}

impl PolicyOrigin {
    /// What an operator is told when the policy was trained on another satellite.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        let first = self.other_satellite.first()?;
        let count = self.other_satellite.len();
        let more =
            if count == 1 { String::new() } else { format!("; it is the first of {count} settings that differ") };
        Some(format!(
            "{} was trained on another satellite: {} was {} there and is {} here{more}",
            self.planner, first.setting, first.trained, first.flown
        ))
    }
}

impl PolicyFile {
    fn find(kind: &str, file: Option<&Path>) -> Result<Self> {
        if let Some(path) = file {
            return Ok(Self { bytes: policy::read(path)?.into(), path: path.to_owned() });
        }
        let shipped = SHIPPED.iter().find(|(shipped, _)| *shipped == kind);
        let (_, bytes) = shipped.ok_or(TrainingError::NotShipped { kind: kind.to_owned() })?;
        Ok(Self { bytes: (*bytes).into(), path: PathBuf::from(format!("shipped {kind} policy")) })
    }

    fn parse(&self) -> Result<Policy> {
        Policy::from_bytes(&self.bytes, &self.path)
    }
}

/// Makes the planner for a mission of this seed.
///
/// ```
/// use swath_training::planners;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let planner = planners::make(&"hop-ppo+lookahead".parse()?, 0)?;
/// assert_eq!(planner.name(), "hop-ppo+lookahead");
/// let missing = planners::make(&"hop-ppo:nowhere.safetensors".parse()?, 0).map(|_| ());
/// assert_eq!(missing.unwrap_err().to_string(), "cannot read nowhere.safetensors");
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// As [`Prepared::new`].
pub fn make(spec: &PlannerSpec, seed: u64) -> Result<Box<dyn Planner + Send>> {
    Prepared::new(spec)?.make(seed)
}

/// SHA-256 of the policy that a planner would decide with, in hexadecimal; `None` for a hand-written planner.
///
/// # Errors
/// As [`Prepared::new`].
pub fn digest(spec: &PlannerSpec) -> Result<Option<String>> {
    Ok(origin(spec, &SimConfig::default())?.map(|origin| origin.sha256))
}

/// The policy that a planner would decide with, and how the satellite that it is to fly differs from the one that it was
/// trained on; `None` for a hand-written planner.
///
/// # Errors
/// As [`Prepared::new`].
pub fn origin(spec: &PlannerSpec, flown: &SimConfig) -> Result<Option<PolicyOrigin>> {
    Prepared::new(spec)?.origin(flown)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn learned(kind: &str, file: Option<PathBuf>) -> PlannerSpec {
        PlannerSpec::Learned { kind: kind.to_owned(), file, lookahead: false }
    }

    #[test]
    fn shipped_policies_are_what_they_are_called() {
        for (kind, _) in SHIPPED {
            let prepared = Prepared::new(&learned(kind, None)).unwrap();
            assert_eq!(prepared.policy.unwrap().parse().unwrap().run().network.kind(), kind);
        }
    }

    #[test]
    fn a_policy_of_another_kind_is_refused() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("policies/hop_ppo.safetensors");
        let error = Prepared::new(&learned("h-ppo", Some(file))).unwrap_err().to_string();
        assert!(error.contains("cannot be used here: it holds a hop-ppo policy, not h-ppo"), "{error}");
        let error = Prepared::new(&learned("hop-ppo", Some("nowhere.safetensors".into()))).unwrap_err().to_string();
        assert!(error.contains("nowhere.safetensors"), "{error}");
    }

    #[test]
    fn a_policy_says_on_which_settings_its_satellite_differs() {
        let spec = learned("hop-ppo", None);
        let mut flown = SimConfig::default();
        let origin = |flown: &SimConfig| origin(&spec, flown).unwrap().unwrap();
        assert_eq!(origin(&flown).warning(), None);
        assert_eq!(Some(origin(&flown).sha256), digest(&spec).unwrap());
        flown.spacecraft.wheel_torque_max_nm = 0.25;
        let text =
            "hop-ppo was trained on another satellite: spacecraft.wheel_torque_max_nm was 0.3 there and is 0.25 here";
        assert_eq!(origin(&flown).warning().unwrap(), text);
        flown.spacecraft.inertia_kg_m2 = [80.0, 98.4, 121.0];
        let text = "spacecraft.inertia_kg_m2 was [82.1,98.4,121.0] there and is [80.0,98.4,121.0] here; it is the first of 2 settings that differ";
        assert!(origin(&flown).warning().unwrap().ends_with(text), "{:?}", origin(&flown));
    }
}
