//! Makes planners by name, learned ones included.

use std::path::{Path, PathBuf};

use swath_sim::planner::{Planner, PlannerSpec};

use crate::error::{Result, TrainingError};
use crate::lookahead::PolicyLookahead;
use crate::policy::{LearnedPlanner, Policy};

/// Policies that are part of the program.
const SHIPPED: [(&str, &[u8]); 4] = [
    ("hop-ppo", include_bytes!("../policies/hop_ppo.safetensors")),
    ("hop-ppo-mlp", include_bytes!("../policies/hop_ppo_mlp.safetensors")),
    ("h-ppo", include_bytes!("../policies/h_ppo.safetensors")),
    ("discrete-ppo", include_bytes!("../policies/discrete_ppo.safetensors")),
];

/// Makes the planner for a mission of this seed.
///
/// # Errors
/// A policy that is not shipped, cannot be read, is damaged or is of another kind.
pub fn make(spec: &PlannerSpec, seed: u64) -> Result<Box<dyn Planner + Send>> {
    if let PlannerSpec::Learned { kind, file, lookahead } = spec {
        let policy = policy(kind, file.as_deref())?;
        return Ok(if *lookahead {
            Box::new(PolicyLookahead::new(policy))
        } else {
            Box::new(LearnedPlanner::new(policy))
        });
    }
    let planner = spec.hand_written(seed);
    planner.ok_or_else(|| TrainingError::Environment(format!("{spec} cannot be made")))
}

/// SHA-256 of the policy that a planner would decide with, in hexadecimal; `None` for a hand-written planner.
///
/// # Errors
/// As [`make`].
pub fn digest(spec: &PlannerSpec) -> Result<Option<String>> {
    match spec {
        PlannerSpec::Learned { kind, file, .. } => Ok(Some(policy(kind, file.as_deref())?.digest().to_owned())),
        _ => Ok(None),
    }
}

fn policy(kind: &str, file: Option<&Path>) -> Result<Policy> {
    let (policy, path) = match file {
        Some(path) => (Policy::load(path)?, path.to_owned()),
        None => {
            let shipped = SHIPPED.iter().find(|(shipped, _)| *shipped == kind);
            let (_, bytes) = shipped.ok_or(TrainingError::NotShipped { kind: kind.to_owned() })?;
            let path = PathBuf::from(format!("shipped {kind} policy"));
            (Policy::from_bytes(bytes, &path)?, path)
        }
    };
    let found = policy.run().network.kind();
    if found != kind {
        return Err(TrainingError::damaged(&path, format!("it holds a {found} policy, not {kind}")));
    }
    Ok(policy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shipped_policies_are_what_they_are_called() {
        for (kind, _) in SHIPPED {
            assert_eq!(policy(kind, None).unwrap().run().network.kind(), kind);
        }
    }

    #[test]
    fn a_policy_of_another_kind_is_refused() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("policies/hop_ppo.safetensors");
        let error = policy("h-ppo", Some(&file)).unwrap_err().to_string();
        assert!(error.contains("it holds a hop-ppo policy, not h-ppo"), "{error}");
        let error = policy("hop-ppo", Some(Path::new("nowhere.safetensors"))).unwrap_err().to_string();
        assert!(error.contains("nowhere.safetensors"), "{error}");
    }
}
