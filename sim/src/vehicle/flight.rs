//! The closed loop in process: spacecraft and guidance, one tick after the other.

use nalgebra::Vector3;

use crate::model::Model;
use crate::task::{Task, TaskOutcome};
use crate::time::Tick;
use crate::vehicle::dynamics::{BodyState, Plant};
use crate::vehicle::errors::Sensor;
use crate::vehicle::guidance::{Guidance, GuidanceTick};
use crate::vehicle::initial::InitialState;
use crate::vehicle::spacecraft::Spacecraft;
use crate::world::orbit::Orbit;

/// What a planner may know of the satellite when it decides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Situation {
    /// Simulated time.
    pub now: Tick,
    /// Position in N [m].
    pub r_BN_N: Vector3<f64>,
    /// Velocity in N [m/s].
    pub v_BN_N: Vector3<f64>,
    /// Attitude, rate and wheel speeds.
    pub body: BodyState,
    /// The servo's rate-error integral [rad].
    pub servo_integral: Vector3<f64>,
    /// Torque commanded one tick ago, which acts until the next tick [N m].
    pub torque_pending: Vector3<f64>,
}

/// Spacecraft and guidance in one process, with the latency of one tick between them.
#[derive(Clone, Debug)]
pub struct Flight {
    /// The spacecraft.
    pub spacecraft: Spacecraft,
    /// Its guidance computer.
    pub guidance: Guidance,
    torque_pending: Vector3<f64>,
    seen: Option<Box<Seen>>,
}

/// What is seen of a satellite whose sensors are not exact.
#[derive(Clone, Debug)]
struct Seen {
    sensor: Sensor,
    /// The state as it is seen at the present tick.
    body: BodyState,
    /// Follows the task by the true state, to judge it.
    judge: Guidance,
}

impl Flight {
    /// A flight at the epoch. `plant_model` is what is flown, `guidance_model` what guidance believes.
    #[must_use]
    pub fn new(plant_model: &Model, guidance_model: &Model, initial: &InitialState) -> Self {
        Self {
            spacecraft: Spacecraft::new(plant_model, initial),
            guidance: Guidance::new(guidance_model),
            torque_pending: Vector3::zeros(),
            seen: None,
        }
    }

    /// From now on the satellite has another body and wheels than guidance believes, and what guidance and planners see
    /// of it goes through a sensor.
    pub fn differ(&mut self, plant: Plant, sensor: Option<Sensor>) {
        self.spacecraft.refit(plant);
        let body = self.spacecraft.body;
        self.seen = sensor
            .map(|mut sensor| Box::new(Seen { body: sensor.measure(&body), sensor, judge: self.guidance.clone() }));
    }

    /// A flight in a planner's head: from what is known of the satellite, by what the model says of it.
    #[must_use]
    pub fn predicted(model: &Model, situation: &Situation) -> Self {
        let orbit = Orbit::through(&situation.r_BN_N, &situation.v_BN_N, situation.now, model.period);
        let spacecraft = Spacecraft::on_orbit(model, orbit, situation.body, situation.now);
        let guidance = Guidance::new(model);
        let mut flight = Self { spacecraft, guidance, torque_pending: situation.torque_pending, seen: None };
        flight.guidance.servo_integral = situation.servo_integral;
        flight
    }

    /// Goes back to a situation on the same orbit.
    pub fn rewind(&mut self, situation: &Situation) {
        self.spacecraft.body = situation.body;
        self.spacecraft.now = situation.now;
        self.guidance.servo_integral = situation.servo_integral;
        self.torque_pending = situation.torque_pending;
    }

    /// Simulated time.
    #[must_use]
    pub fn now(&self) -> Tick {
        self.spacecraft.now
    }

    /// What a planner may know now.
    pub fn situation(&mut self) -> Situation {
        let now = self.now();
        Situation {
            now,
            r_BN_N: self.spacecraft.orbit.position(now),
            v_BN_N: self.spacecraft.orbit.velocity(now),
            body: self.seen.as_ref().map_or(self.spacecraft.body, |seen| seen.body),
            servo_integral: self.guidance.servo_integral,
            torque_pending: self.torque_pending,
        }
    }

    /// Flies a task to its end, or to `until` when that comes first; then the task counts as interrupted.
    pub fn fly(&mut self, task: Task, until: Tick) -> TaskOutcome {
        let start = self.now();
        let end = start.after(task.ticks()).min(until);
        let body = &self.spacecraft.body;
        self.guidance.start(task, start, self.seen.as_ref().map_or(body, |seen| &seen.body));
        if let Some(seen) = &mut self.seen {
            seen.judge.start(task, start, body);
        }
        while self.now() < end {
            self.tick();
        }
        let r_BN_N = self.spacecraft.orbit.position(end);
        let body = &self.spacecraft.body;
        let outcome = self.guidance.finish(end, &r_BN_N, body);
        let judged = self.seen.as_mut().and_then(|seen| seen.judge.finish(end, &r_BN_N, body));
        judged.or(outcome).unwrap_or(TaskOutcome::NOT_BEGUN)
    }

    /// One closed-loop tick: the command computed from this tick's state waits while the previous one acts.
    #[inline]
    pub fn tick(&mut self) -> GuidanceTick {
        let spacecraft = &mut self.spacecraft;
        let r_BN_N = spacecraft.orbit.position(spacecraft.now);
        let tick = match &mut self.seen {
            None => self.guidance.tick(spacecraft.now, &r_BN_N, &spacecraft.body),
            Some(seen) => {
                seen.judge.tick(spacecraft.now, &r_BN_N, &spacecraft.body);
                self.guidance.tick(spacecraft.now, &r_BN_N, &seen.body)
            }
        };
        spacecraft.advance(&self.torque_pending);
        self.torque_pending = tick.torque;
        if let Some(seen) = &mut self.seen {
            seen.body = seen.sensor.measure(&spacecraft.body);
        }
        tick
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SimConfig;
    use crate::rng;
    use crate::vehicle::errors::PlantErrors;
    use crate::world::strip::StripRequest;

    #[test]
    fn a_noisy_flight_is_judged_by_the_true_attitude() {
        let model = Model::new(SimConfig::default()).unwrap();
        let initial = InitialState::draw(&model.config, &mut rng::stream(1, rng::INITIAL_STATE));
        let request = StripRequest {
            start_latitude_deg: 10.0,
            start_longitude_deg: 20.0,
            end_latitude_deg: 12.0,
            end_longitude_deg: 21.0,
            priority: 0.5,
            acquisition_speed_m_s: 3000.0,
            bidirectional: false,
        };
        let strip = request.to_strip(&model.config.requests, model.config.earth.radius_m).unwrap();
        let task = Task::Image { strip, t_pre: 200, t_acq: 100 };
        let mut flight = Flight::new(&model, &model, &initial);
        flight.differ(model.plant.clone(), PlantErrors::noise().sensor(rng::stream(1, rng::SENSORS)));
        let mut by_hand = flight.clone();
        let outcome = flight.fly(task, Tick(u64::MAX));

        let mut truth = Guidance::new(&model);
        truth.start(task, Tick(0), &by_hand.spacecraft.body);
        let seen = by_hand.situation().body;
        assert_ne!(seen, by_hand.spacecraft.body);
        by_hand.guidance.start(task, Tick(0), &seen);
        for _ in 0..task.ticks() {
            let now = by_hand.now();
            let r_BN_N = by_hand.spacecraft.orbit.position(now);
            truth.tick(now, &r_BN_N, &by_hand.spacecraft.body);
            by_hand.tick();
        }
        let now = by_hand.now();
        let r_BN_N = by_hand.spacecraft.orbit.position(now);
        assert_eq!(truth.finish(now, &r_BN_N, &by_hand.spacecraft.body), Some(outcome));
        assert_eq!(flight.spacecraft.body, by_hand.spacecraft.body);
        // What guidance saw of itself is something else.
        let seen = by_hand.guidance.finish(now, &r_BN_N, &by_hand.spacecraft.body).unwrap();
        assert_ne!(seen.max_attitude_error, outcome.max_attitude_error);
    }
}
