//! The spacecraft: the truth of its orbit, body and wheels, and what its sensors tell of it.

use nalgebra::Vector3;

use crate::error::SimError;
use crate::rng;
use crate::time::Tick;
use crate::vehicle::dynamics::{BodyState, Plant};
use crate::vehicle::errors::{PlantErrors, Sensor};
use crate::vehicle::faults::{Faults, TimedFault};
use crate::vehicle::initial::InitialState;
use crate::vehicle::model::Model;
use crate::vehicle::resources::{Activity, Onboard, ResourceState};
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
    /// Attitude, rate and wheel speeds as the sensors measure them.
    pub body: BodyState,
    /// Attitude, rate and wheel speeds as they are, where the sensors are not exact.
    pub truth: Option<BodyState>,
    /// Torque that acted over the tick that ended here [N m].
    pub torque_applied: Vector3<f64>,
    /// How power, data and momentum stand, where they have bounds.
    pub resources: Option<ResourceState>,
}

/// The spacecraft: it integrates what it is told.
#[derive(Clone, Debug)]
pub struct Spacecraft {
    /// Orbit.
    pub orbit: Orbit,
    /// True attitude, rate and wheel speeds at `now`.
    pub body: BodyState,
    /// Simulated time.
    pub now: Tick,
    /// Torque that acted over the tick that ended at `now` [N m].
    pub torque_applied: Vector3<f64>,
    plant: Plant,
    measured: Option<Box<Measured>>,
    faults: Option<Box<Faults>>,
    onboard: Option<Box<Onboard>>,
}

/// What sensors that are not exact tell.
#[derive(Clone, Debug)]
struct Measured {
    sensor: Option<Sensor>,
    /// What the gyro adds to each axis [rad/s].
    gyro_bias: f64,
    /// Whether the star tracker repeats its last attitude.
    tracker_out: bool,
    /// The state as it is measured at the present tick.
    body: BodyState,
}

impl Measured {
    fn measure(&mut self, truth: &BodyState) {
        let mut body = self.sensor.as_mut().map_or(*truth, |sensor| sensor.measure(truth));
        body.omega_BN_B.add_scalar_mut(self.gyro_bias);
        if self.tracker_out {
            body.sigma_BN = self.body.sigma_BN;
        }
        self.body = body;
    }
}

impl Spacecraft {
    /// A spacecraft at the epoch, with the resources of its model.
    #[must_use]
    pub fn new(model: &Model, initial: &InitialState) -> Self {
        let orbit = Orbit::new(&model.config, initial.orbit, model.period);
        let onboard = Onboard::new(model, &orbit).map(Box::new);
        Self { onboard, ..Self::on_orbit(model, orbit, initial.body, Tick(0)) }
    }

    /// A spacecraft on an orbit at some tick, with nothing acting on it yet and boundless resources.
    #[must_use]
    pub fn on_orbit(model: &Model, orbit: Orbit, body: BodyState, now: Tick) -> Self {
        let (torque_applied, plant) = (Vector3::zeros(), model.plant.clone());
        Self { orbit, body, now, torque_applied, plant, measured: None, faults: None, onboard: None }
    }

    /// Its power, data and momentum, where they are not boundless.
    #[must_use]
    pub fn onboard(&self) -> Option<&Onboard> {
        self.onboard.as_deref()
    }

    /// Its power, data and momentum, where they are not boundless.
    pub fn onboard_mut(&mut self) -> Option<&mut Onboard> {
        self.onboard.as_deref_mut()
    }

    /// From now on it differs from its model; `seed` is that of the sensors' noise.
    ///
    /// # Errors
    /// When an error, or what it makes of the configuration, is out of range.
    pub fn differ(&mut self, model: &Model, errors: &PlantErrors, seed: u64) -> Result<(), SimError> {
        self.plant = errors.plant(model)?;
        let body = self.body;
        self.measured = errors.sensor(rng::stream(seed, rng::SENSORS)).map(|mut sensor| {
            let seen = sensor.measure(&body);
            Box::new(Measured { sensor: Some(sensor), gyro_bias: 0.0, tracker_out: false, body: seen })
        });
        Ok(())
    }

    /// From now on faults befall it at their ticks; those that it suffers already stay.
    pub fn suffer(&mut self, faults: impl IntoIterator<Item = TimedFault>) {
        let all = self.faults.get_or_insert_with(|| Box::new(Faults::new(self.plant.clone())));
        all.add(faults);
        if self.measured.is_none() && all.touch_sensors() {
            let body = self.body;
            self.measured = Some(Box::new(Measured { sensor: None, gyro_bias: 0.0, tracker_out: false, body }));
        }
        self.mind_faults();
    }

    /// Brings body and sensors into the state that the faults of this tick leave them in.
    #[cold]
    fn mind_faults(&mut self) {
        let Some(faults) = &mut self.faults else { return };
        let effects = faults.at(self.now);
        self.plant = effects.plant;
        if let Some(measured) = &mut self.measured {
            measured.body.omega_BN_B.add_scalar_mut(effects.gyro_bias - measured.gyro_bias);
            measured.gyro_bias = effects.gyro_bias;
            measured.tracker_out = effects.tracker_out;
        }
    }

    /// From now on it has another body and wheels.
    pub fn refit(&mut self, plant: Plant) {
        self.plant = plant;
    }

    /// Attitude, rate and wheel speeds as the sensors measure them.
    #[inline]
    #[must_use]
    pub fn measured(&self) -> &BodyState {
        self.measured.as_ref().map_or(&self.body, |measured| &measured.body)
    }

    /// Attitude, rate and wheel speeds as they are, where the sensors are not exact.
    #[inline]
    #[must_use]
    pub fn truth(&self) -> Option<&BodyState> {
        self.measured.as_ref().map(|_| &self.body)
    }

    /// What it tells of itself now.
    pub fn sample(&mut self) -> StateSample {
        StateSample {
            tick: self.now,
            r_BN_N: self.orbit.position(self.now),
            v_BN_N: self.orbit.velocity(self.now),
            body: *self.measured(),
            truth: self.truth().copied(),
            torque_applied: self.torque_applied,
            resources: self.onboard().map(|onboard| *onboard.state()),
        }
    }

    /// Integrates one tick under a torque command [N m], saturated as the wheels do it.
    #[inline]
    pub fn advance(&mut self, command: &Vector3<f64>) {
        self.advance_doing(command, Activity::default());
    }

    /// The same, while imager, transmitter and thrusters do something.
    #[inline(always)]
    pub fn advance_doing(&mut self, command: &Vector3<f64>, activity: Activity) {
        if self.onboard.is_some() {
            self.live(command, activity);
        } else {
            self.torque_applied = self.plant.wheels.saturate(command, &self.body.wheel_speed);
            self.plant.step(&mut self.body, &self.torque_applied);
        }
        self.now = self.now.after(1);
        if self.faults.as_ref().is_some_and(|faults| faults.due(self.now)) {
            self.mind_faults();
        }
        if let Some(measured) = &mut self.measured {
            measured.measure(&self.body);
        }
    }

    /// A tick with torques from outside, and its books. Not inlined: without resources a tick is small.
    #[inline(never)]
    fn live(&mut self, command: &Vector3<f64>, activity: Activity) {
        let Some(onboard) = &mut self.onboard else { return };
        let then = self.now.after(1);
        let positions_N = [self.orbit.position(self.now), self.orbit.position(then)];
        let plant = &self.plant;
        let (external, feed_forward) = onboard.torques(self.now, &positions_N, &self.body, plant, activity);
        self.torque_applied = plant.wheels.saturate(&(command + feed_forward), &self.body.wheel_speed);
        let torque = &self.torque_applied;
        plant.step_under(&mut self.body, torque, |stage, _| external[stage.index()]);
        onboard.book(then, &positions_N[1], &self.body, plant, torque, activity);
    }
}
