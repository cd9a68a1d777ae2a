//! The spacecraft: the truth of its orbit, body and wheels.

use nalgebra::Vector3;

use crate::model::Model;
use crate::time::Tick;
use crate::vehicle::dynamics::{BodyState, Plant};
use crate::vehicle::initial::InitialState;
use crate::world::orbit::Orbit;

/// What the spacecraft tells of itself at a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateSample {
    /// Simulated time.
    pub tick: Tick,
    /// Position in N [m].
    pub r_BN_N: Vector3<f64>,
    /// Velocity in N [m/s].
    pub v_BN_N: Vector3<f64>,
    /// Attitude, rate and wheel speeds.
    pub body: BodyState,
    /// Torque that acted over the tick that ended here [N m].
    pub torque_applied: Vector3<f64>,
}

/// The spacecraft: it integrates what it is told.
#[derive(Clone, Debug)]
pub struct Spacecraft {
    /// Orbit.
    pub orbit: Orbit,
    /// Attitude, rate and wheel speeds at `now`.
    pub body: BodyState,
    /// Simulated time.
    pub now: Tick,
    /// Torque that acted over the tick that ended at `now` [N m].
    pub torque_applied: Vector3<f64>,
    plant: Plant,
}

impl Spacecraft {
    /// A spacecraft at the epoch.
    #[must_use]
    pub fn new(model: &Model, initial: &InitialState) -> Self {
        Self::on_orbit(model, Orbit::new(&model.config, initial.orbit, model.period), initial.body, Tick(0))
    }

    /// A spacecraft on an orbit at some tick, with nothing acting on it yet.
    #[must_use]
    pub fn on_orbit(model: &Model, orbit: Orbit, body: BodyState, now: Tick) -> Self {
        Self { orbit, body, now, torque_applied: Vector3::zeros(), plant: model.plant.clone() }
    }

    /// From now on it has another body and wheels.
    pub fn refit(&mut self, plant: Plant) {
        self.plant = plant;
    }

    /// Integrates one tick under a torque command [N m], saturated as the wheels do it.
    #[inline]
    pub fn advance(&mut self, command: &Vector3<f64>) {
        self.torque_applied = self.plant.saturate(command, &self.body.wheel_speed);
        self.plant.step(&mut self.body, &self.torque_applied);
        self.now = self.now.after(1);
    }
}
