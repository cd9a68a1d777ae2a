//! Planners: which strip next, and how long a transition before it.

mod decision;
mod frugal;
mod handmade;
mod heuristic;
mod lookahead;
mod nobody;
mod random;
mod repair;
mod shield;
mod spec;
mod transitions;

pub use decision::{Decision, DecisionContext, Planner, PlannerError, Rationale, wait_for_a_window};
pub use frugal::{Frugal, Tariff};
pub use handmade::Handmade;
pub use heuristic::Heuristic;
pub use lookahead::{Allowance, Beam, BeamSearch, Experience, Found, Lookahead, Meter, Prices, Search, Sequence};
pub use nobody::Nobody;
pub use random::Random;
pub use repair::{Aspen, Method, Repair};
pub use shield::{Shield, decide};
pub use spec::{PlannerSpec, UnknownPlanner};
pub use transitions::Transitions;
