//! Messages that more than one node reads or writes: checked coming in, infallible going out.

pub mod activity;
pub mod decision_point;
pub mod numbers;
pub mod resource_state;
pub mod spacecraft_state;
pub mod strip;
pub mod task_result;
pub mod upcoming;
