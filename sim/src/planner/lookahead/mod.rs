//! Planners that fly candidates in their heads.

mod beam;
mod experience;
mod greedy;
mod meter;
mod search;

pub use beam::{Beam, BeamSearch, Sequence};
pub use experience::{Allowance, Experience};
pub use greedy::Lookahead;
pub use meter::{Meter, Prices};
pub use search::{Found, Search};
