//! What a learner meets: episodes, observations, hybrid actions.

pub mod env;
pub mod observation;
