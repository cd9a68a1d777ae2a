//! What a flight in the head costs in energy, and what images cost in data.

use nalgebra::Vector3;

use crate::task::Task;
use crate::vehicle::model::Model;
use crate::vehicle::mrp::Rotation;
use crate::vehicle::resources::battery::{SolarArray, WheelPower};
use crate::vehicle::spacecraft::Spacecraft;
use crate::world::sun::Sun;

/// What energy and data are worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prices {
    /// Priority per joule.
    pub joule: f64,
    /// Priority per bit.
    pub bit: f64,
    /// Bits that there is room for: a larger image is worth nothing.
    pub room: f64,
}

impl Default for Prices {
    /// Energy and data cost nothing.
    fn default() -> Self {
        Self { joule: 0.0, bit: 0.0, room: f64::INFINITY }
    }
}

/// The array's power is looked at once in so many ticks: the satellite turns little meanwhile.
const EVERY: u32 = 8;

/// Measures what flights take from the battery.
///
/// It tells what is missing to a satellite that has full sunshine on its array and no load: so no task costs less than
/// nothing, and what a task could be worth at best is known before it is flown.
#[derive(Clone, Debug)]
pub struct Meter {
    sun: Sun,
    array: SolarArray,
    wheels: WheelPower,
    /// Power of the array at its best [W].
    full_w: f64,
    /// Loads that are always there, without the wheels [W].
    always_w: f64,
    imager_w: f64,
    warm_up_s: f64,
    bits_per_s: f64,
    dt: f64,
}

impl Meter {
    /// The meter of a satellite; none where resources have no bounds.
    #[must_use]
    pub fn new(model: &Model) -> Option<Self> {
        let config = model.config.resources.as_deref()?;
        let array = config.array();
        Some(Self {
            sun: config.sun(model.config.earth.radius_m),
            full_w: array.full_w(),
            array,
            wheels: config.wheel_power(),
            always_w: config.bus_w,
            imager_w: config.imager_w,
            warm_up_s: config.imager_warm_up_s,
            bits_per_s: config.imager_rate_bps,
            dt: model.period.seconds(),
        })
    }

    /// The Sun.
    #[must_use]
    pub fn sun(&self) -> &Sun {
        &self.sun
    }

    /// Power of the array at its best [W].
    #[must_use]
    pub fn full_w(&self) -> f64 {
        self.full_w
    }

    /// What a task takes besides what turning takes [J].
    #[must_use]
    pub fn still_j(&self, task: &Task) -> f64 {
        let imager_s = match *task {
            Task::Image { t_pre, t_acq, .. } => {
                f64::from(t_acq) * self.dt + self.warm_up_s.min(f64::from(t_pre) * self.dt)
            }
            Task::Wait { .. } | Task::Serve { .. } => 0.0,
        };
        (self.always_w + self.full_w) * f64::from(task.ticks()) * self.dt + self.imager_w * imager_s
    }

    /// What turning took over the tick that ended, less what the array gave [J].
    #[inline]
    #[must_use]
    pub fn turning_j(&self, spacecraft: &mut Spacecraft) -> f64 {
        let body = &spacecraft.body;
        let powers = body.wheel_speed.iter().zip(spacecraft.torque_applied.iter());
        let wheels_w: f64 = powers.map(|(speed, torque)| self.wheels.power_w(*speed, *torque)).sum();
        if !spacecraft.now.0.is_multiple_of(u64::from(EVERY)) {
            return wheels_w * self.dt;
        }
        let normal_N = Rotation::new(&body.sigma_BN).back().apply(&self.array.normal_B);
        let r_BN_N = spacecraft.orbit.position(spacecraft.now);
        (wheels_w - f64::from(EVERY) * self.array_w(&normal_N, &r_BN_N)) * self.dt
    }

    /// Power of an array whose normal points somewhere, at a position [W].
    #[must_use]
    pub fn array_w(&self, normal_N: &Vector3<f64>, r_BN_N: &Vector3<f64>) -> f64 {
        let illumination = self.sun.illumination(r_BN_N);
        if illumination <= 0.0 {
            return 0.0;
        }
        self.array.power_w(normal_N, &(self.sun.r_SE_N - r_BN_N), illumination)
    }

    /// Bits of an image that takes so long [ticks].
    #[must_use]
    pub fn bits(&self, t_acq: u32) -> f64 {
        self.bits_per_s * f64::from(t_acq) * self.dt
    }
}
