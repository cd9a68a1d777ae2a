//! The closed loop in process: spacecraft and task executive, one tick after the other.

use nalgebra::Vector3;

use crate::task::{Task, TaskOutcome, TaskRecord};
use crate::time::Tick;
use crate::vehicle::dynamics::BodyState;
use crate::vehicle::executive::{Executive, Sight};
use crate::vehicle::guidance::GuidanceTick;
use crate::vehicle::health;
use crate::vehicle::health::Health;
use crate::vehicle::model::Model;
use crate::vehicle::resources::ResourceState;
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
    /// Attitude, rate and wheel speeds as they are best known.
    pub body: BodyState,
    /// The servo's rate-error integral [rad].
    pub servo_integral: Vector3<f64>,
    /// Torque commanded one tick ago, which acts until the next tick [N m].
    pub torque_pending: Vector3<f64>,
    /// Share of its torque limit that each wheel is known to give; 1 for a sound one.
    pub wheels: Vector3<f64>,
    /// How power and data stand, where they have bounds.
    pub resources: Option<ResourceState>,
}

/// Spacecraft and executive in one process, with the latency of one tick between them.
#[derive(Clone, Debug)]
pub struct Flight {
    /// The spacecraft.
    pub spacecraft: Spacecraft,
    executive: Executive,
    torque_pending: Vector3<f64>,
}

impl Flight {
    /// A flight of a spacecraft by what `model` says of it.
    #[must_use]
    pub fn new(model: &Model, spacecraft: Spacecraft) -> Self {
        Self { spacecraft, executive: Executive::new(model), torque_pending: Vector3::zeros() }
    }

    /// Gives it an executive that watches wheels and sensors; `noisy` is whether the sensors are known to be.
    pub fn watch(&mut self, model: &Model, noisy: bool) {
        self.executive = Executive::watching(model, noisy);
    }

    /// A flight in a planner's head: from what is known of the satellite, by what the model says of it.
    #[must_use]
    pub fn predicted(model: &Model, situation: &Situation) -> Self {
        let orbit = Orbit::through(&situation.r_BN_N, &situation.v_BN_N, situation.now, model.period);
        let mut flight = Self::new(model, Spacecraft::on_orbit(model, orbit, situation.body, situation.now));
        flight.spacecraft.refit(model.plant.limited(&situation.wheels));
        flight.executive.guidance.wheel_lost = health::lost(&situation.wheels);
        flight.rewind(situation);
        flight
    }

    /// Goes back to a situation on the same orbit.
    pub fn rewind(&mut self, situation: &Situation) {
        self.spacecraft.body = situation.body;
        self.spacecraft.now = situation.now;
        self.executive.guidance.servo_integral = situation.servo_integral;
        self.torque_pending = situation.torque_pending;
    }

    /// Goes on from what is known of the satellite at another time, with the wheels that it is known to have.
    pub fn resume(&mut self, model: &Model, situation: &Situation) {
        self.rewind(situation);
        if health::lost(&situation.wheels) {
            self.spacecraft.refit(model.plant.limited(&situation.wheels));
            self.executive.guidance.wheel_lost = true;
        }
    }

    /// Simulated time.
    #[must_use]
    pub fn now(&self) -> Tick {
        self.spacecraft.now
    }

    /// What a planner may know now.
    pub fn situation(&mut self) -> Situation {
        let now = self.now();
        let body = self.executive.look(&sight(&mut self.spacecraft));
        Situation {
            now,
            r_BN_N: self.spacecraft.orbit.position(now),
            v_BN_N: self.spacecraft.orbit.velocity(now),
            body,
            servo_integral: self.executive.guidance.servo_integral,
            torque_pending: self.torque_pending,
            wheels: self.executive.health().wheels,
            resources: self.spacecraft.onboard().map(|onboard| *onboard.state()),
        }
    }

    /// What is known of wheels and sensors.
    #[must_use]
    pub fn health(&self) -> Health {
        self.executive.health()
    }

    /// Takes up a task now.
    pub fn begin(&mut self, task: Task) {
        let spacecraft = &mut self.spacecraft;
        let sight = sight(spacecraft);
        self.executive.begin(0, task, 0, &sight);
    }

    /// Flies a task to its end, or to `until` when that comes first; then the task counts as interrupted.
    pub fn fly(&mut self, task: Task, until: Tick) -> TaskOutcome {
        self.fly_number(0, task, 0, until).outcome
    }

    /// The same to its end, showing the spacecraft after each tick.
    pub fn fly_showing(&mut self, task: Task, mut show: impl FnMut(&mut Spacecraft)) -> TaskOutcome {
        self.begin(task);
        for _ in 0..task.ticks() {
            self.tick();
            show(&mut self.spacecraft);
        }
        let sight_then = sight(&mut self.spacecraft);
        self.executive.finish(&sight_then).map_or(TaskOutcome::NOT_BEGUN, |record| record.outcome)
    }

    /// Flies task `number` after `delay` ticks in which the attitude is held, to its end or to `until`.
    pub fn fly_number(&mut self, number: u64, task: Task, delay: u32, until: Tick) -> TaskRecord {
        let sight_now = sight(&mut self.spacecraft);
        self.executive.begin(number, task, delay, &sight_now);
        let end = self.now().after(delay).after(task.ticks()).min(until);
        while self.now() < end {
            self.tick();
        }
        let sight_then = sight(&mut self.spacecraft);
        let none = || TaskRecord::new(number, &task, end, end, TaskOutcome::NOT_BEGUN);
        self.executive.finish(&sight_then).unwrap_or_else(none)
    }

    /// Flies task `number` until guidance is lost with all that it knew, before it sees the state at `lost`; a fresh one,
    /// `executive`, is there at `back`, a tick later at least. Meanwhile the wheels hold no torque. The task counts as
    /// interrupted, and nothing is known of its images.
    pub fn fly_lost(
        &mut self,
        number: u64,
        task: Task,
        delay: u32,
        lost: Tick,
        back: Tick,
        executive: Executive,
    ) -> TaskRecord {
        let start = self.now().after(delay);
        self.executive.begin(number, task, delay, &sight(&mut self.spacecraft));
        while self.now() < lost {
            self.tick();
        }
        self.without_guidance(back, executive);
        TaskRecord::new(number, &task, start.min(lost), lost, TaskOutcome::NOT_BEGUN)
    }

    /// Flies without guidance until `back`, a tick at least; `executive` takes over then.
    pub fn without_guidance(&mut self, back: Tick, executive: Executive) {
        // What the lost one had come to know was told at once.
        let told = self.executive.take_changes();
        self.executive = executive;
        self.executive.precede_changes(told);
        loop {
            self.advance();
            self.torque_pending = Vector3::zeros();
            if self.now() >= back {
                return;
            }
        }
    }

    /// What came to be known of wheels and sensors since the last call, each with its tick.
    pub fn take_changes(&mut self) -> Vec<(Tick, Health)> {
        self.executive.take_changes()
    }

    /// One closed-loop tick: the command computed from this tick's state waits while the previous one acts.
    #[inline]
    pub fn tick(&mut self) -> GuidanceTick {
        let tick = self.executive.tick(&sight(&mut self.spacecraft));
        self.advance();
        self.torque_pending = tick.torque;
        tick
    }

    #[inline]
    fn advance(&mut self) {
        if self.spacecraft.onboard().is_some() {
            let activity = self.executive.activity(self.spacecraft.now);
            self.spacecraft.advance_doing(&self.torque_pending, activity);
        } else {
            self.spacecraft.advance(&self.torque_pending);
        }
    }
}

/// The spacecraft as its executive is told of it.
#[inline(always)]
fn sight(spacecraft: &mut Spacecraft) -> Sight<'_> {
    let now = spacecraft.now;
    let r_BN_N = spacecraft.orbit.position(now);
    Sight { now, r_BN_N, measured: spacecraft.measured(), truth: spacecraft.truth() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::SimConfig;
    use crate::rng;
    use crate::vehicle::errors::PlantErrors;
    use crate::vehicle::faults::{FOR_GOOD, Fault, TimedFault};
    use crate::vehicle::guidance::Guidance;
    use crate::vehicle::initial::InitialState;
    use crate::world::strip::{StripId, StripRequest};

    /// A model, its spacecraft, and a task of it.
    fn to_fly() -> (Model, Spacecraft, Task) {
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
        let spacecraft = Spacecraft::new(&model, &initial);
        (model, spacecraft, Task::Image { id: StripId(1), strip, t_pre: 200, t_acq: 100 })
    }

    #[test]
    fn a_sensor_that_fails_on_the_way_is_judged_alike_whenever_that_is_known() {
        let (model, spacecraft, task) = to_fly();
        let out = TimedFault { fault: Fault::StarTrackerOut, from: Tick(250), until: FOR_GOOD };
        let flown = |known_from: u64| {
            let mut flight = Flight::new(&model, spacecraft.clone());
            flight.begin(task);
            let mut seen = 0.0_f64;
            while flight.now() < Tick(u64::from(task.ticks())) {
                if flight.now() == Tick(known_from) {
                    flight.spacecraft.suffer([out]);
                }
                let tick = flight.tick();
                seen = seen.max(if tick.imaging { tick.error.sigma_BR.norm() } else { 0.0 });
            }
            let outcome = flight.executive.finish(&sight(&mut flight.spacecraft)).unwrap().outcome;
            (outcome, seen)
        };
        let (known_before, seen) = flown(1);
        assert_eq!(known_before, flown(249).0);
        assert_ne!(known_before.max_attitude_error, seen, "what guidance saw is not what was");
    }

    #[test]
    fn a_noisy_flight_is_judged_by_the_true_attitude() {
        let (model, mut spacecraft, task) = to_fly();
        spacecraft.differ(&model, &PlantErrors::noise(), 1).unwrap();
        let mut flight = Flight::new(&model, spacecraft);
        let mut by_hand = flight.clone();
        let outcome = flight.fly(task, Tick(u64::MAX));

        let mut truth = Guidance::new(&model);
        truth.start(task, Tick(0), &by_hand.spacecraft.body);
        let seen = by_hand.situation().body;
        assert_ne!(seen, by_hand.spacecraft.body);
        by_hand.executive.guidance.start(task, Tick(0), &seen);
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
        let seen = by_hand.executive.guidance.finish(now, &r_BN_N, &by_hand.spacecraft.body).unwrap();
        assert_ne!(seen.max_attitude_error, outcome.max_attitude_error);
    }
}
