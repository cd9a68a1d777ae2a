//! Planning on the ground: the whole catalogue is known and there are minutes to think.
//!
//! [`plan`] seeks the best open-loop plan that it can find, [`OpenLoop`] flies it blindly, and [`upper_bound`] says what
//! no plan can exceed.

mod bound;
mod passes;
mod plan;
mod search;

pub use bound::upper_bound;
pub use plan::{CANDIDATES, OpenLoop, Plan, PlannedTask};
pub use search::{GroundSettings, plan};
