//! The radio between ground and satellite: stations and passes, the protocol, what each end keeps.

pub mod apart;
pub mod catalogue;
pub mod channel;
pub mod config;
pub mod end;
pub mod frame;
pub mod ground;
mod inbox;
pub mod message;
mod outbox;
pub mod passes;
pub mod radio;
pub mod response;
pub mod told;

#[cfg(test)]
mod both_tests;
#[cfg(test)]
mod end_tests;
