//! The request manager: it accepts or refuses strips and offers the upcoming ones.

mod desk;
pub mod index;
mod intake;
pub mod journal;
pub mod lifecycle;
pub mod logic;
pub mod query;
pub mod refusal;
mod settle;
pub mod store;
pub mod wiring;
pub mod writer;

#[cfg(test)]
mod model_tests;
#[cfg(test)]
mod store_tests;
#[cfg(test)]
mod tests;
