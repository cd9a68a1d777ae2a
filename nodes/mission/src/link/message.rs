//! What goes up and what comes down.

use nalgebra::Vector3;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use swath_sim::time::Tick;
use swath_sim::vehicle::dynamics::BodyState;
use swath_sim::vehicle::flight::Situation;
use swath_sim::world::strip::StripId;

use super::frame::Item;
use crate::orders::action::Review;
use crate::orders::order::Order;
use crate::requests::journal::{Attempt, Change};

/// Class of changes on the way up: they overtake orders.
pub const CHANGES: usize = 0;
/// Class of orders on the way up, and of changes of orders that are still on their way.
pub const ORDERS: usize = 1;

/// Class of results on the way down.
pub const RESULTS: usize = 0;
/// Class of housekeeping on the way down.
pub const HOUSEKEEPING: usize = 1;
/// Class of images on the way down.
pub const IMAGES: usize = 2;

/// What goes up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Up {
    /// A request, under the number that the ground gave it.
    Order {
        /// Its number; that of the first way, if there are two.
        id: StripId,
        /// When the ground took it.
        at: Tick,
        /// The request whose place it takes.
        replaces: Option<StripId>,
        /// What is asked for.
        order: Box<Order>,
    },
    /// A change of a request.
    Change {
        /// Number of the change, from 1.
        number: u64,
        /// The request.
        id: StripId,
        /// What is asked for.
        wish: Wish,
        /// Who asks.
        actor: String,
        /// Why, in words.
        reason: String,
    },
}

/// What is asked of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Wish {
    /// It is taken back.
    Cancel,
    /// It is held, released or rejected.
    Review(Review),
}

/// What comes down.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Down {
    /// Requests were taken up.
    OnBoard {
        /// When.
        at: Tick,
        /// Number of the first.
        first: StripId,
        /// How many.
        count: u64,
    },
    /// The answer to a change.
    Answer {
        /// Number of the change.
        number: u64,
        /// When it was decided.
        at: Tick,
        /// Why it was refused, if it was.
        refusal: Option<String>,
    },
    /// A request has changed.
    Changed(Change),
    /// An attempt has ended.
    Attempted(Attempt),
    /// How the satellite does.
    Housekeeping(Housekeeping),
    /// Part of an image, whose data come with it.
    Image {
        /// The strip.
        id: StripId,
        /// Part, from 0.
        part: u32,
        /// How many parts there are.
        of: u32,
    },
}

/// How the satellite does, at the start of a task.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Housekeeping {
    /// When.
    pub at: Tick,
    /// Number of the task.
    pub task: u64,
    /// Attitude σ_BN (MRP).
    pub sigma_bn: [f64; 3],
    /// Rate ω_BN_B [rad/s].
    pub omega_bn_b: [f64; 3],
    /// Speeds of the wheels [rad/s].
    pub wheel_speed: [f64; 3],
    /// The servo's rate-error integral [rad].
    pub servo_integral: [f64; 3],
    /// Torque that acts until the next tick [N m].
    pub torque_pending: [f64; 3],
    /// Share of its torque limit that each wheel is known to give.
    pub wheels: [f64; 3],
    /// Number of the next item in the class of results: the ones before tell of what was until then.
    pub results: u64,
    /// Strips that are to be imaged.
    pub pending: u64,
    /// Strips imaged.
    pub imaged: u64,
}

impl Housekeeping {
    /// Attitude, rate and wheel speeds.
    #[must_use]
    pub fn body(&self) -> BodyState {
        BodyState {
            sigma_BN: self.sigma_bn.into(),
            omega_BN_B: self.omega_bn_b.into(),
            wheel_speed: self.wheel_speed.into(),
        }
    }

    /// The satellite at a position [m] and with a velocity [m/s].
    #[must_use]
    pub fn situation(&self, r_BN_N: Vector3<f64>, v_BN_N: Vector3<f64>) -> Situation {
        Situation {
            now: self.at,
            r_BN_N,
            v_BN_N,
            body: self.body(),
            servo_integral: self.servo_integral.into(),
            torque_pending: self.torque_pending.into(),
            wheels: self.wheels.into(),
            resources: None,
        }
    }
}

/// The item of a message, with data beside it [bit].
pub(super) fn item(message: &impl Serialize, data_bits: u64) -> Item {
    // Only a writer that is full could fail, and a vector is not.
    Item { bytes: postcard::to_allocvec(message).unwrap_or_default(), data_bits }
}

/// The message of an item; none if it is no such message.
pub(super) fn message<M: DeserializeOwned>(item: &Item) -> Option<M> {
    match postcard::take_from_bytes(&item.bytes) {
        Ok((message, [])) => Some(message),
        _ => None,
    }
}
