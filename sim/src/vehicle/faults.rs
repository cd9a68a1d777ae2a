//! Faults of the wheels and the sensors, each from a tick to a tick.

use serde::{Deserialize, Serialize};

use crate::time::Tick;
use crate::vehicle::dynamics::Plant;

/// What can befall the satellite.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// A wheel, 0 to 2 for those on the body's x, y and z axis.
    Wheel(usize, WheelFault),
    /// The gyro adds this to the rate about each body axis [rad/s].
    GyroBias(f64),
    /// The star tracker has no attitude: what it tells is the last one that it had.
    StarTrackerOut,
}

/// What can befall a wheel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WheelFault {
    /// Its motor gives no torque; it coasts without friction.
    Dead,
    /// Its speed relative to the body stays what it is.
    Stuck,
    /// It has lost this share of its torque limit, 0 to 1.
    Weak(f64),
}

/// A fault and when it acts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimedFault {
    /// What happens.
    pub fault: Fault,
    /// First tick at which it acts.
    pub from: Tick,
    /// First tick at which it does not act any more; [`FOR_GOOD`] when it stays.
    pub until: Tick,
}

/// End of a fault that stays.
pub const FOR_GOOD: Tick = Tick(u64::MAX);

impl TimedFault {
    /// Whether it acts at a tick.
    #[must_use]
    pub fn acts(&self, now: Tick) -> bool {
        (self.from..self.until).contains(&now)
    }
}

/// The faults of a satellite, and when something changes next.
#[derive(Clone, Debug)]
pub(super) struct Faults {
    /// Body and wheels without faults.
    sound: Plant,
    all: Vec<TimedFault>,
    next: Tick,
}

/// What the faults of a tick make of body and sensors.
#[derive(Clone, Debug)]
pub(super) struct Effects {
    /// Body and wheels.
    pub plant: Plant,
    /// What the gyro adds to each axis [rad/s].
    pub gyro_bias: f64,
    /// Whether the star tracker repeats its last attitude.
    pub tracker_out: bool,
}

impl Faults {
    /// No faults yet, of a satellite with this body and these wheels.
    pub fn new(sound: Plant) -> Self {
        Self { sound, all: Vec::new(), next: FOR_GOOD }
    }

    /// More faults.
    pub fn add(&mut self, faults: impl IntoIterator<Item = TimedFault>) {
        self.all.extend(faults);
    }

    /// Whether any of them changes what sensors tell.
    pub fn touch_sensors(&self) -> bool {
        self.all.iter().any(|it| matches!(it.fault, Fault::GyroBias(_) | Fault::StarTrackerOut))
    }

    /// Whether something changes at a tick.
    #[inline]
    pub fn due(&self, now: Tick) -> bool {
        now >= self.next
    }

    /// What those that act at a tick make of the satellite.
    pub fn at(&mut self, now: Tick) -> Effects {
        let edges = self.all.iter().flat_map(|it| [it.from, it.until]);
        self.next = edges.filter(|&edge| edge > now).min().unwrap_or(FOR_GOOD);
        let mut effects = Effects { plant: self.sound.clone(), gyro_bias: 0.0, tracker_out: false };
        for timed in self.all.iter().filter(|it| it.acts(now)) {
            match timed.fault {
                Fault::Wheel(wheel, WheelFault::Dead) => effects.plant = limited(&effects.plant, wheel, 0.0),
                Fault::Wheel(wheel, WheelFault::Weak(lost)) => {
                    effects.plant = limited(&effects.plant, wheel, 1.0 - lost)
                }
                Fault::Wheel(wheel, WheelFault::Stuck) => effects.plant = effects.plant.seized(wheel),
                Fault::GyroBias(rad_s) => effects.gyro_bias += rad_s,
                Fault::StarTrackerOut => effects.tracker_out = true,
            }
        }
        effects
    }
}

fn limited(plant: &Plant, wheel: usize, share: f64) -> Plant {
    let mut shares = nalgebra::Vector3::repeat(1.0);
    shares[wheel] = share;
    plant.limited(&shares)
}
