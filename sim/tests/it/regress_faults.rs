//! Missions whose wheels and sensors fail: what is seen of it, how soon, and what can still be imaged.

use std::sync::Arc;

use nalgebra::Vector3;
use swath_sim::config::SimConfig;
use swath_sim::learn::episode::{Env, EpisodeConfig};
use swath_sim::planner::{Heuristic, Lookahead, Planner};
use swath_sim::rng;
use swath_sim::task::{SettledTask, Task, Totals};
use swath_sim::time::Tick;
use swath_sim::vehicle::errors::PlantErrors;
use swath_sim::vehicle::faults::{FOR_GOOD, Fault, TimedFault, WheelFault};
use swath_sim::vehicle::flight::Flight;
use swath_sim::vehicle::health::Health;
use swath_sim::vehicle::initial::InitialState;
use swath_sim::vehicle::model::Model;
use swath_sim::vehicle::mrp;
use swath_sim::vehicle::spacecraft::Spacecraft;
use swath_sim::world::strip::{StripId, StripRequest};

/// Faults begin here: a slew is under way.
const FROM: Tick = Tick(6);
/// Two seconds at 2 Hz.
const TWO_SECONDS: i64 = 4;
const BIAS: f64 = 0.01 / 180.0 * std::f64::consts::PI;

fn model() -> Arc<Model> {
    Arc::new(Model::new(SimConfig::default()).unwrap())
}

fn two_orbits(seed: u64) -> Env {
    Env::episode(model(), &EpisodeConfig { orbits: 2.0, ..EpisodeConfig::evaluation() }, seed)
}

fn fly(env: &mut Env, planner: &mut dyn Planner) -> (Vec<SettledTask>, Totals) {
    let (mut tasks, mut totals) = (Vec::new(), Totals::default());
    env.run(planner, |settled| {
        totals.add(settled);
        tasks.push(settled.clone());
    })
    .unwrap();
    (tasks, totals)
}

/// A satellite that slews to a strip and images it for five minutes.
fn slewing(errors: &PlantErrors, faults: &[TimedFault]) -> Flight {
    let model = model();
    let initial = InitialState::draw(&model.config, &mut rng::stream(1, rng::INITIAL_STATE));
    let mut spacecraft = Spacecraft::new(&model, &initial);
    spacecraft.differ(&model, errors, 1).unwrap();
    spacecraft.suffer(faults.iter().copied());
    let mut flight = Flight::new(&model, spacecraft);
    flight.watch(&model, errors.noisy());
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
    flight.begin(Task::Image { id: StripId(1), strip, t_pre: 300, t_acq: 300 });
    flight
}

/// Ticks at which what is known of a satellite under a fault came to satisfy `seen`, and ceased to.
fn seen(errors: &PlantErrors, fault: Fault, until: Tick, seen: impl Fn(&Health) -> bool) -> (Option<i64>, Option<i64>) {
    let mut flight = slewing(errors, &[TimedFault { fault, from: FROM, until }]);
    let (mut came, mut went) = (None, None);
    for _ in 0..500 {
        flight.tick();
        flight.situation();
        let now = flight.now();
        if came.is_none() && seen(&flight.health()) {
            assert!(now >= FROM, "seen at {now} before it began");
            came = Some(now.since(FROM));
        }
        if came.is_some() && went.is_none() && now >= until && !seen(&flight.health()) {
            went = Some(now.since(until));
        }
    }
    (came, went)
}

#[test]
fn a_watch_over_a_sound_satellite_sees_nothing_and_changes_nothing() {
    for (errors, seed) in [("none", 1), ("noise", 2), ("torque-10%,inertia+5%,noise", 3)] {
        let errors: PlantErrors = errors.parse().unwrap();
        let flown = |watched: bool| {
            let mut env = two_orbits(seed);
            env.differ(&errors, seed).unwrap();
            if watched {
                env.suffer(&[], errors.noisy());
            }
            let (mut health, mut planner) = (Vec::new(), Lookahead::default());
            let mut tasks = Vec::new();
            while let Some(settled) = env.fly_one(&mut planner, env.horizon()).unwrap() {
                tasks.push(settled);
                health.push(env.health());
            }
            assert!(health.iter().all(|it| *it == Health::default()), "{errors:?}");
            tasks
        };
        assert_eq!(flown(true), flown(false));
    }
}

#[test]
fn a_wheel_is_known_within_two_seconds_and_known_to_be_sound_again() {
    let exact = PlantErrors::default();
    for errors in [exact, PlantErrors::noise()] {
        for wheel in 0..3 {
            for (how, share) in [(WheelFault::Dead, 0.0), (WheelFault::Stuck, 0.0), (WheelFault::Weak(0.5), 0.5)] {
                let known = |health: &Health| {
                    let others = (0..3).filter(|&other| other != wheel).all(|other| health.wheels[other] == 1.0);
                    others && (health.wheels[wheel] - share).abs() < 0.01
                };
                let (came, _) = seen(&errors, Fault::Wheel(wheel, how), FOR_GOOD, known);
                assert!(came.is_some_and(|ticks| ticks <= TWO_SECONDS), "wheel {wheel} {how:?}: {came:?}");
                let (_, went) = seen(&errors, Fault::Wheel(wheel, how), Tick(16), known);
                assert!(went.is_some(), "wheel {wheel} {how:?} is never sound again");
            }
        }
    }
}

#[test]
fn a_star_tracker_that_is_out_is_known_at_once_and_the_gyro_carries_the_attitude() {
    for (errors, error_max) in [(PlantErrors::default(), 3e-4), (PlantErrors::noise(), 3e-3)] {
        let until = Tick(FROM.0 + 60);
        let (came, went) = seen(&errors, Fault::StarTrackerOut, until, |health| health.tracker_out);
        assert_eq!((came, went), (Some(0), Some(0)), "{errors:?}");
        let mut flight = slewing(&errors, &[TimedFault { fault: Fault::StarTrackerOut, from: FROM, until }]);
        while flight.now() < Tick(until.0 - 1) {
            flight.tick();
        }
        let estimate = flight.situation().body;
        let turned = |body: &Vector3<f64>| mrp::subtract(body, &flight.spacecraft.body.sigma_BN).norm() * 4.0;
        assert!(turned(&flight.spacecraft.measured().sigma_BN) > 0.05, "the last fix is old");
        assert!(turned(&estimate.sigma_BN) < error_max, "{} rad off", turned(&estimate.sigma_BN));
    }
}

#[test]
fn a_gyro_bias_is_known_and_taken_off() {
    // With sensors of the small-satellite class, its mean must stand out of their noise first.
    for (errors, latest, off) in [(PlantErrors::default(), TWO_SECONDS, 0.02), (PlantErrors::noise(), 120, 0.2)] {
        let biased = |health: &Health| health.gyro_bias != Vector3::zeros();
        let (came, went) = seen(&errors, Fault::GyroBias(BIAS), Tick(300), biased);
        assert!(came.is_some_and(|ticks| ticks <= latest), "{came:?}");
        assert!(went.is_some_and(|ticks| ticks <= 200), "{went:?}");
        let mut flight = slewing(&errors, &[TimedFault { fault: Fault::GyroBias(BIAS), from: FROM, until: FOR_GOOD }]);
        while flight.now() < Tick(400) {
            flight.tick();
        }
        let found = flight.health().gyro_bias;
        assert!((found - Vector3::repeat(BIAS)).amax() < off * BIAS, "{found:?}");
    }
}

/// With a wheel lost, the satellite comes to rest and images what its other wheels can point at; a planner that knows
/// of it tries nothing else.
#[test]
fn with_a_wheel_lost_the_mission_degrades() {
    for wheel in 0..3 {
        let lost = TimedFault { fault: Fault::Wheel(wheel, WheelFault::Dead), from: Tick(2000), until: FOR_GOOD };
        let flown = |faults: &[TimedFault], planner: &mut dyn Planner| {
            let mut env = two_orbits(0);
            env.suffer(faults, false);
            let totals = fly(&mut env, planner).1;
            (totals, env.context().situation.body.omega_BN_B.norm())
        };
        let (sound, _) = flown(&[], &mut Lookahead::default());
        let (degraded, rate) = flown(&[lost], &mut Lookahead::default());
        assert!(degraded.reward > 0.3 * sound.reward, "wheel {wheel}: {degraded:?}");
        assert!(degraded.success_rate() > 0.9, "wheel {wheel}: {degraded:?}");
        assert!(rate < 5f64.to_radians(), "wheel {wheel}: it tumbles at {rate} rad/s");
        // One that does not know fails task after task.
        let (blind, rate) = flown(&[lost], &mut Heuristic { t_pre_s: 90.0 });
        assert!(blind.success_rate() < 0.5, "wheel {wheel}: {blind:?}");
        assert!(rate < 5f64.to_radians(), "wheel {wheel}: it tumbles at {rate} rad/s");
    }
}

#[test]
fn a_planner_that_knows_of_a_weak_wheel_hardly_fails() {
    let weak = TimedFault { fault: Fault::Wheel(2, WheelFault::Weak(0.5)), from: Tick(2000), until: FOR_GOOD };
    let mut env = two_orbits(0);
    env.suffer(&[weak], false);
    let totals = fly(&mut env, &mut Lookahead::default()).1;
    assert!(totals.success_rate() > 0.97, "{totals:?}");
}

#[test]
fn faults_end_and_leave_a_sound_satellite() {
    let until = Tick(3000);
    let faults = [
        TimedFault { fault: Fault::Wheel(0, WheelFault::Dead), from: Tick(1000), until },
        TimedFault { fault: Fault::GyroBias(BIAS), from: Tick(1500), until },
        TimedFault { fault: Fault::StarTrackerOut, from: Tick(2000), until },
    ];
    let mut env = two_orbits(1);
    env.suffer(&faults, false);
    let mut planner = Lookahead::default();
    while env.now() < Tick(4000) {
        env.fly_one(&mut planner, env.horizon()).unwrap();
    }
    assert_eq!(env.health(), Health::default());
    let after = fly(&mut env, &mut planner).1;
    assert!(after.success_rate() > 0.97, "{after:?}");
}

/// However hard it is flown, also beyond what it can follow.
#[test]
fn nothing_is_found_wrong_with_a_sound_satellite() {
    for seed in 0..6 {
        for t_pre_s in [5.0, 20.0, 45.0] {
            let mut env = two_orbits(seed);
            env.suffer(&[], false);
            fly(&mut env, &mut Heuristic { t_pre_s });
            let found: Vec<_> = env.take_changes().into_iter().filter(|(_, it)| *it != Health::default()).collect();
            assert!(found.is_empty(), "seed {seed}, T_pre {t_pre_s} s: {} finds, such as {:?}", found.len(), found[0]);
        }
    }
}
