//! What a learner meets: episodes, observations, hybrid actions.

pub mod episode;
pub mod hybrid;
pub mod observation;
pub mod statistics;
