//! Stamps and headers: ticks as ROS times, and the names of frames.

use swath_msgs::builtin_interfaces::Time;
use swath_msgs::std_msgs::Header;
use swath_ros::graph;
use swath_sim::time::{Tick, TickPeriod};

/// Turns ticks into stamps, and names frames.
#[derive(Clone, Debug)]
pub struct Stamper {
    epoch_unix_s: u32,
    period: TickPeriod,
    /// What frames begin with.
    prefix: String,
}

/// Name of the inertial frame N in headers.
pub const INERTIAL_FRAME: &str = "eci";

/// Name of the planet-fixed frame E in headers.
pub const EARTH_FRAME: &str = "ecef";

/// Name of the orbit frame in headers: x away from the Earth, z along the angular momentum (Hill frame).
pub const ORBIT_FRAME: &str = "orbit";

/// Name of the body frame B in headers.
pub const BODY_FRAME: &str = "body";

/// What frames of nodes in a namespace begin with.
fn prefix(namespace: &str) -> String {
    let own = namespace.trim_matches('/');
    let shared = namespace == graph::NAMESPACE || own.is_empty();
    if shared { String::new() } else { format!("{own}/") }
}

/// Full name of a frame of nodes in a namespace.
#[must_use]
pub fn frame_in(namespace: &str, name: &str) -> String {
    format!("{}{name}", prefix(namespace))
}

impl Stamper {
    /// A stamper for a mission's epoch.
    #[must_use]
    pub fn new(epoch_unix_s: u32, period: TickPeriod) -> Self {
        Self { epoch_unix_s, period, prefix: String::new() }
    }

    /// The same for nodes in a namespace: in another than the usual one, frames have it before their names, so that
    /// two satellites do not share one.
    #[must_use]
    pub fn in_namespace(self, namespace: &str) -> Self {
        Self { prefix: prefix(namespace), ..self }
    }

    /// Full name of a frame.
    #[must_use]
    pub fn frame(&self, name: &str) -> String {
        format!("{}{name}", self.prefix)
    }

    /// Simulated time of a tick [ns since 1970-01-01 UTC].
    #[must_use]
    pub fn nanoseconds(&self, tick: Tick) -> u64 {
        u64::from(self.epoch_unix_s) * 1_000_000_000 + tick.0 * self.period.nanoseconds()
    }

    /// Simulated time of a tick.
    #[must_use]
    pub fn time(&self, tick: Tick) -> Time {
        swath_ros::stamp(self.nanoseconds(tick))
    }

    /// Length of a number of ticks [s].
    #[must_use]
    pub fn seconds(&self, ticks: u32) -> f64 {
        self.period.duration_s(ticks)
    }

    /// The first tick at a time or after it; the epoch for times before it.
    #[must_use]
    pub fn tick_from(&self, time: &Time) -> Tick {
        let ns = nanoseconds(time).saturating_sub(self.nanoseconds(Tick(0)));
        Tick(ns.div_ceil(self.period.nanoseconds()))
    }

    /// Header of a message at a tick.
    #[must_use]
    pub fn header(&self, tick: Tick, frame: &str) -> Header {
        Header { stamp: self.time(tick), frame_id: self.frame(frame) }
    }
}

/// A time [ns since 1970-01-01 UTC]; 0 for times before.
#[must_use]
pub fn nanoseconds(time: &Time) -> u64 {
    u64::try_from(time.sec).map_or(0, |seconds| seconds * 1_000_000_000 + u64::from(time.nanosec))
}
