//! Planners: which strip next, and how long a transition before it.

mod decision;
mod heuristic;
mod lookahead;
mod random;
mod repair;
mod shield;
mod spec;
mod transitions;

pub use decision::{Decision, DecisionContext, Planner, PlannerError, Rationale, wait_for_a_window};
pub use heuristic::Heuristic;
pub use lookahead::{Allowance, Beam, BeamSearch, Experience, Found, Lookahead, Search, Sequence};
pub use random::Random;
pub use repair::{Aspen, Method, Repair};
pub use shield::Shield;
pub use spec::{PlannerSpec, UnknownPlanner};
pub use transitions::Transitions;
