//! What a run logs, and the event files that TensorBoard reads.

pub mod events;
pub mod scalars;
