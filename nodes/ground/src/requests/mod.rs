//! The request manager's node: its topics, its services, and the store that keeps what was acknowledged.

mod book;
mod desk;
mod flight;
mod foresight;
pub mod ground_end;
pub mod json;
mod lock;
pub mod messages;
pub mod orders;
mod outgoing;
mod radio;
mod rows;
pub mod store;
mod ways;
pub mod wiring;
pub mod writer;

#[cfg(test)]
mod model_tests;
#[cfg(test)]
mod store_tests;
