//! Stamps and headers: ticks as ROS times, and the names of frames.

use swath_msgs::builtin_interfaces::Time;
use swath_msgs::std_msgs::Header;
use swath_sim::time::{Tick, TickPeriod};

/// Turns ticks into stamps.
#[derive(Clone, Copy, Debug)]
pub struct Stamper {
    epoch_unix_s: u32,
    period: TickPeriod,
}

/// Name of the inertial frame N in headers.
pub const INERTIAL_FRAME: &str = "eci";

/// Name of the planet-fixed frame E in headers.
pub const EARTH_FRAME: &str = "ecef";

/// Name of the body frame B in headers.
pub const BODY_FRAME: &str = "body";

impl Stamper {
    /// A stamper for a mission's epoch.
    #[must_use]
    pub fn new(epoch_unix_s: u32, period: TickPeriod) -> Self {
        Self { epoch_unix_s, period }
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

    /// The first tick at a time or after it; the epoch for times before it.
    #[must_use]
    pub fn tick_from(&self, time: &Time) -> Tick {
        let ns = nanoseconds(time).saturating_sub(self.nanoseconds(Tick(0)));
        Tick(ns.div_ceil(self.period.nanoseconds()))
    }

    /// Header of a message at a tick.
    #[must_use]
    pub fn header(&self, tick: Tick, frame: &str) -> Header {
        Header { stamp: self.time(tick), frame_id: frame.to_owned() }
    }
}

/// A time [ns since 1970-01-01 UTC]; 0 for times before.
#[must_use]
pub fn nanoseconds(time: &Time) -> u64 {
    u64::try_from(time.sec).map_or(0, |seconds| seconds * 1_000_000_000 + u64::from(time.nanosec))
}
