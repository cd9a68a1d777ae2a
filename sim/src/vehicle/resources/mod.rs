//! Power, data and momentum: what the satellite lives on besides its attitude.

mod account;
pub mod battery;
pub mod momentum;
pub mod storage;

pub use account::{Activity, Delivered, Failure, Imager, Onboard, ResourceState};
