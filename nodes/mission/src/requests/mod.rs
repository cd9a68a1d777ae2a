//! Strip requests without ROS and without a store: their life cycle, their logic, and every reason to refuse one.

mod apart;
pub mod index;
mod intake;
pub mod journal;
pub mod lifecycle;
pub mod logic;
pub mod query;
pub mod reason;
pub mod refusal;
pub mod register;
pub mod request;
pub mod restart;
mod reward;
mod sharing;

#[cfg(test)]
mod tests;
