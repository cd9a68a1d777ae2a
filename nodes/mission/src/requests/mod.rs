//! Strip requests without ROS and without a store: their life cycle, their logic, and every reason to refuse one.

mod apart;
mod duplicates;
pub mod index;
mod intake;
pub mod journal;
pub mod lifecycle;
pub mod logic;
pub mod query;
pub mod reason_number;
pub mod refusal;
pub mod register;
pub mod request;
pub mod resume;
mod sharing;
mod task_reward;

#[cfg(test)]
mod tests;
