//! A request that has a number, as it stands and as it is kept.

use swath_sim::time::Tick;
use swath_sim::world::strip::StripId;
use swath_sim::world::windows::Window;

use super::journal::Standing;
use super::lifecycle::State;
use super::reason_number::Reason;
use crate::orders::order::Order;

/// A request that has a number.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// What was asked for.
    pub order: Order,
    /// Where it stands.
    pub state: State,
    /// Why, and in words.
    pub reason: (Reason, String),
    /// Who brought it there.
    pub actor: String,
    /// When it was taken.
    pub created: Tick,
    /// When it changed last.
    pub changed: Tick,
    /// What it has gone through.
    pub standing: Standing,
    /// The request that it replaces.
    pub supersedes: Option<StripId>,
    /// Number of the order that it is a strip of: that of the order's first strip.
    pub order_id: StripId,
}

/// A request as the store gives it back.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
    /// The request.
    pub request: Request,
    /// Its start windows.
    pub windows: Vec<Window>,
    /// The same strip scanned the other way.
    pub linked: Option<StripId>,
}

/// Name of the request manager in the history.
pub const SYSTEM: &str = "request_manager";
/// Name of guidance in the history.
pub(super) const GUIDANCE: &str = "guidance";
/// Name of the planner in the history.
pub(super) const PLANNER: &str = "planner";
