//! The request manager's node: its topics, its services, and the store that keeps what was acknowledged.

mod desk;
pub mod json;
mod lock;
pub mod messages;
pub mod orders;
mod outgoing;
mod rows;
pub mod store;
pub mod wiring;
pub mod writer;

#[cfg(test)]
mod model_tests;
#[cfg(test)]
mod store_tests;
