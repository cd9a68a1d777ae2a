//! Transitions between strips, from where imaging the one leaves the satellite.

use nalgebra::Vector3;

use super::lookahead::{Allowance, Search};
use crate::requests::catalogue::Candidate;
use crate::time::Tick;
use crate::vehicle::dynamics::BodyState;
use crate::vehicle::flight::Situation;
use crate::vehicle::model::Model;
use crate::vehicle::mrp;
use crate::world::frames::reference_dcm;
use crate::world::orbit::Orbit;
use crate::world::strip::Strip;
use crate::world::turn::Turn;

/// Flights from strip to strip that do not depend on what was flown before.
///
/// Whoever images a strip follows its reference: where that ends is known from the strip and the time, and so are the
/// wheels' speeds, since nothing but the wheels exchanges momentum with the body. What is left over of the transition
/// before, the servo's integral among it, is taken as settled.
pub struct Transitions<'a> {
    model: &'a Model,
    /// The flights.
    pub search: Search<'a>,
    orbit: Orbit,
    earth: Turn,
    momentum_N: Vector3<f64>,
}

impl<'a> Transitions<'a> {
    /// Flights on the orbit and with the momentum of a situation.
    #[must_use]
    pub fn new(model: &'a Model, situation: &Situation, allowance: &Allowance) -> Self {
        Self {
            model,
            search: Search::new(model, situation, allowance),
            orbit: Orbit::through(&situation.r_BN_N, &situation.v_BN_N, situation.now, model.period),
            earth: model.earth.clone(),
            momentum_N: model.plant.momentum_N(&situation.body),
        }
    }

    /// Where the satellite stands at tick `at` if it follows a strip exactly whose imaging begins at `start`.
    #[must_use]
    pub fn following(&mut self, strip: &Strip, start: Tick, at: Tick) -> Situation {
        let dt = self.model.period.seconds();
        let sigma_BN = self.reference(strip, start, at);
        let next = self.reference(strip, start, at.after(1));
        // σ = tan(θ/4)·e of the small turn of one tick.
        let omega_BN_B = mrp::subtract(&next, &sigma_BN) * (4.0 / dt);
        let plant = &self.model.plant;
        let wheels = mrp::to_dcm(&sigma_BN) * self.momentum_N - plant.inertia.component_mul(&omega_BN_B);
        Situation {
            now: at,
            r_BN_N: self.orbit.position(at),
            v_BN_N: self.orbit.velocity(at),
            body: BodyState { sigma_BN, omega_BN_B, wheel_speed: wheels / plant.wheels.inertia },
            servo_integral: Vector3::zeros(),
            torque_pending: Vector3::zeros(),
            wheels: self.search.begin.wheels,
            resources: self.search.begin.resources,
        }
    }

    /// Where imaging a candidate from `start` on leaves the satellite.
    #[must_use]
    pub fn imaged(&mut self, candidate: &Candidate, start: Tick) -> Situation {
        self.following(&candidate.strip, start, start.after(candidate.t_acq))
    }

    /// The reference attitude of a strip, σ_RN.
    fn reference(&mut self, strip: &Strip, start: Tick, at: Tick) -> Vector3<f64> {
        let elapsed = at.since(start) as f64 * self.model.period.seconds();
        let turn = self.earth.cos_sin(at);
        let (target_N, scan_N) = strip.target_N(elapsed, turn, self.model.config.earth.radius_m);
        mrp::from_dcm(&reference_dcm(&self.orbit.position(at), &target_N, &scan_N))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use approx::assert_abs_diff_eq;

    use super::*;
    use crate::config::SimConfig;
    use crate::learn::episode::{Env, EpisodeConfig};

    #[test]
    fn imaging_ends_where_the_reference_ends() {
        let model = Arc::new(Model::new(SimConfig::default()).unwrap());
        let env = Env::episode(model, &EpisodeConfig { orbits: 0.1, ..EpisodeConfig::default() }, 2);
        let context = env.context();
        let mut transitions = Transitions::new(context.model, context.situation, &Allowance::default());
        let mut compared = 0;
        for candidate in context.candidates.iter().filter(|it| it.t_acq > 100) {
            let begin = transitions.search.begin;
            let Some(found) = transitions.search.shortest(&begin, candidate, u32::MAX) else { continue };
            let start = begin.now.after(found.t_pre);
            let told = transitions.imaged(candidate, start);
            assert_eq!(told.now, found.end.now);
            let off = mrp::principal_angle(&mrp::subtract(&found.end.body.sigma_BN, &told.body.sigma_BN));
            assert_abs_diff_eq!(off, 0.0, epsilon = 0.03);
            assert_abs_diff_eq!((found.end.body.omega_BN_B - told.body.omega_BN_B).norm(), 0.0, epsilon = 3e-3);
            assert_abs_diff_eq!((found.end.body.wheel_speed - told.body.wheel_speed).norm(), 0.0, epsilon = 10.0);
            compared += 1;
        }
        assert!(compared > 3, "{compared}");
    }
}
