//! What the programs of a mission link besides the nodes: the learned policies.

use swath_mission::fallback::Policies;

/// The policies that these programs can fly.
pub const POLICIES: Policies = Policies {
    make: |spec, seed| Ok(swath_training::planners::make(spec, seed)?),
    digest: |spec| Ok(swath_training::planners::digest(spec)?),
    other_satellite: |spec, satellite| {
        Ok(swath_training::planners::origin(spec, satellite)?.and_then(|origin| origin.warning()))
    },
    revision: swath_training::weights::REVISION,
};
