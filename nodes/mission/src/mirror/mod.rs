//! The ground's mirror of the satellite: the same mission, flown in the head on what the ground knows, so that it can
//! say what the satellite is going to do, and at each pass where that was not what it did.

mod flying;
mod logic;
pub mod parting;
mod score;

pub use logic::{Mirror, MirrorError, Prediction};
pub use score::Score;
