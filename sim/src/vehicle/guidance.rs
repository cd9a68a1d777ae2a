//! Strip guidance (paper, eqs 1-13): reference attitude, tracking error, constraints, and the task in hand.

use nalgebra::Vector3;

use crate::task::{Duty, FailureReason, Task, TaskOutcome};
use crate::time::Tick;
use crate::vehicle::control::{ControlLaw, TrackingError};
use crate::vehicle::dynamics::{BodyState, Plant};
use crate::vehicle::model::Model;
use crate::vehicle::mrp;
use crate::vehicle::mrp::EulerParameters;
use crate::world::frames::{reference_dcm, sin_elevation};
use crate::world::strip::Strip;
use crate::world::turn::Turn;

/// What guidance knows and commands at one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuidanceTick {
    /// Wheel torque, saturated [N m]; acts one tick later.
    pub torque: Vector3<f64>,
    /// Tracking error.
    pub error: TrackingError,
    /// Sine of the elevation of the satellite seen from the target; 1 without one.
    pub sin_elevation: f64,
    /// Whether the strip is being imaged.
    pub imaging: bool,
}

impl GuidanceTick {
    /// No torque, and nothing that is tracked.
    pub const IDLE: Self = Self {
        torque: Vector3::new(0.0, 0.0, 0.0),
        error: TrackingError { sigma_BR: Vector3::new(0.0, 0.0, 0.0), omega_BR_B: Vector3::new(0.0, 0.0, 0.0) },
        sin_elevation: 1.0,
        imaging: false,
    };

    /// Elevation of the satellite seen from the target [rad]; π/2 without one.
    #[must_use]
    pub fn elevation(&self) -> f64 {
        libm::asin(self.sin_elevation)
    }
}

/// The guidance and control computer: one task at a time, one torque command a tick.
#[derive(Clone, Debug)]
pub struct Guidance {
    law: ControlLaw,
    plant: Plant,
    limits: ImagingLimits,
    ground: Ground,
    dt: f64,
    axes: Option<Axes>,
    /// Rate-error integral z of the servo [rad]; persists from task to task.
    pub servo_integral: Vector3<f64>,
    /// Whether a wheel is lost, so that an attitude cannot be held in general: waits damp the rates instead, and so does
    /// everything else once they are beyond a share of the steering rate's limit. A body that is only damped loses
    /// energy whatever wheels are left, while a servo that asks a lost wheel for torque can drive it into a tumble.
    pub wheel_lost: bool,
    active: Option<ActiveTask>,
}

/// Share of the steering rate's limit beyond which rates are damped when a wheel is lost.
const DAMPED_FROM: f64 = 0.5;

/// Body axes that duties point, and the Sun.
#[derive(Clone, Copy, Debug)]
struct Axes {
    panel_B: Vector3<f64>,
    antenna_B: Vector3<f64>,
    sun_N: Vector3<f64>,
}

impl Axes {
    fn new(model: &Model) -> Option<Self> {
        let resources = model.config.resources.as_ref()?;
        let sun = resources.sun(model.config.earth.radius_m);
        Some(Self {
            panel_B: Vector3::from(resources.panel_normal_b).normalize(),
            antenna_B: Vector3::from(resources.antenna_axis_b).normalize(),
            sun_N: *sun.direction_N(),
        })
    }
}

/// The turning Earth whose strips are followed.
#[derive(Clone, Debug)]
struct Ground {
    earth: Turn,
    radius: f64,
    /// Length of a tick [s].
    dt: f64,
}

impl Ground {
    /// σ_BR and the sine of the elevation while following a strip that is imaged from a tick on.
    #[inline]
    fn track(
        &mut self,
        strip: &Strip,
        imaged_from: Tick,
        now: Tick,
        r_BN_N: &Vector3<f64>,
        body: &BodyState,
    ) -> (Vector3<f64>, f64) {
        let elapsed = now.since(imaged_from) as f64 * self.dt;
        let (target_N, scan_N) = strip.target_N(elapsed, self.earth.cos_sin(now), self.radius);
        let rn = mrp::euler_parameters_from_dcm(&reference_dcm(r_BN_N, &target_N, &scan_N));
        let bn = mrp::to_euler_parameters(&body.sigma_BN);
        let sigma_BR = mrp::from_euler_parameters(&mrp::relative_euler_parameters(&bn, &rn));
        (sigma_BR, sin_elevation(r_BN_N, &target_N))
    }
}

#[derive(Clone, Copy, Debug)]
struct ImagingLimits {
    sigma_max: f64,
    sin_elevation_min: f64,
    required_fraction: f64,
}

#[derive(Clone, Debug)]
struct ActiveTask {
    task: Task,
    start: Tick,
    hold: EulerParameters,
    previous_sigma: Option<Vector3<f64>>,
    record: ImagingRecord,
}

/// Running evaluation of eqs 12 and 13.
#[derive(Clone, Copy, Debug)]
struct ImagingRecord {
    samples: u32,
    kept: u32,
    elevation_broken: bool,
    max_error_squared: f64,
    min_sin_elevation: f64,
}

impl ImagingRecord {
    const NEW: Self =
        Self { samples: 0, kept: 0, elevation_broken: false, max_error_squared: 0.0, min_sin_elevation: 1.0 };

    #[inline]
    fn add(&mut self, limits: &ImagingLimits, error_squared: f64, sin_elevation: f64) {
        let elevation_kept = sin_elevation > limits.sin_elevation_min;
        self.samples += 1;
        self.kept += u32::from(elevation_kept && error_squared < limits.sigma_max * limits.sigma_max);
        self.elevation_broken |= !elevation_kept;
        self.max_error_squared = self.max_error_squared.max(error_squared);
        self.min_sin_elevation = self.min_sin_elevation.min(sin_elevation);
    }

    fn outcome(&self, limits: &ImagingLimits, interrupted: bool) -> TaskOutcome {
        let enough = f64::from(self.kept) >= limits.required_fraction * f64::from(self.samples);
        let failure = if interrupted {
            Some(FailureReason::Interrupted)
        } else if enough {
            None
        } else if self.elevation_broken {
            // No attitude could have helped.
            Some(FailureReason::Elevation)
        } else {
            Some(FailureReason::Attitude)
        };
        TaskOutcome {
            failure,
            max_attitude_error: self.max_error_squared.sqrt(),
            min_elevation: libm::asin(self.min_sin_elevation),
        }
    }
}

impl Guidance {
    /// A guidance computer with an empty servo integral and no task.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let config = &model.config;
        Self {
            law: model.law.clone(),
            plant: model.plant.clone(),
            limits: ImagingLimits {
                sigma_max: config.imaging.sigma_max,
                sin_elevation_min: libm::sin(config.imaging.elevation_min_deg.to_radians()),
                required_fraction: config.imaging.required_fraction,
            },
            ground: Ground { earth: model.earth.clone(), radius: config.earth.radius_m, dt: model.period.seconds() },
            dt: model.period.seconds(),
            axes: Axes::new(model),
            servo_integral: Vector3::zeros(),
            wheel_lost: false,
            active: None,
        }
    }

    /// Takes up a task at tick `start`, at which `body` is the state.
    pub fn start(&mut self, task: Task, start: Tick, body: &BodyState) {
        self.active = Some(ActiveTask {
            task,
            start,
            hold: mrp::to_euler_parameters(&body.sigma_BN),
            previous_sigma: None,
            record: ImagingRecord::NEW,
        });
    }

    /// Tick at which the task in hand ends.
    #[must_use]
    pub fn end(&self) -> Option<Tick> {
        self.active.as_ref().map(|active| active.start.after(active.task.ticks()))
    }

    /// The task in hand.
    #[must_use]
    pub fn task(&self) -> Option<&Task> {
        self.active.as_ref().map(|active| &active.task)
    }

    /// Evaluates the last sample of the task in hand at its end and puts it away. Before its end the task counts as
    /// interrupted. `None` when there is no task.
    pub fn finish(&mut self, now: Tick, r_BN_N: &Vector3<f64>, body: &BodyState) -> Option<TaskOutcome> {
        let mut active = self.active.take()?;
        let interrupted = now < active.start.after(active.task.ticks());
        if let (Task::Image { strip, t_pre, .. }, false) = (&active.task, interrupted) {
            let (sigma_BR, sin_el) = self.ground.track(strip, active.start.after(*t_pre), now, r_BN_N, body);
            active.record.add(&self.limits, sigma_BR.norm_squared(), sin_el);
        }
        Some(active.record.outcome(&self.limits, interrupted))
    }

    /// One control tick: the torque command computed from the state at `now`. Without a task the torque is zero.
    #[inline]
    pub fn tick(&mut self, now: Tick, r_BN_N: &Vector3<f64>, body: &BodyState) -> GuidanceTick {
        let Some(active) = &mut self.active else {
            return GuidanceTick::IDLE;
        };
        let mut boresight_B = None;
        let (sigma_BR, sin_elevation, imaging) = match &active.task {
            Task::Image { strip, t_pre, .. } => {
                let imaged_from = active.start.after(*t_pre);
                let (sigma_BR, sin_el) = self.ground.track(strip, imaged_from, now, r_BN_N, body);
                let imaging = now >= imaged_from;
                if imaging {
                    active.record.add(&self.limits, sigma_BR.norm_squared(), sin_el);
                }
                (sigma_BR, sin_el, imaging)
            }
            Task::Serve { duty, .. } if let Some(axes) = &self.axes => {
                let (axis_B, direction_N) = match duty {
                    Duty::Charge | Duty::Desaturate => (axes.panel_B, axes.sun_N),
                    Duty::Downlink => (axes.antenna_B, -r_BN_N.normalize()),
                };
                boresight_B = Some(axis_B);
                (pointing_error(&axis_B, &direction_N, &body.sigma_BN), 1.0, false)
            }
            Task::Wait { .. } | Task::Serve { .. } => {
                let bn = mrp::to_euler_parameters(&body.sigma_BN);
                (mrp::from_euler_parameters(&mrp::relative_euler_parameters(&bn, &active.hold)), 1.0, false)
            }
        };
        let mut omega_BR_B = match &active.previous_sigma {
            Some(previous) => rate_error(&sigma_BR, previous, self.dt),
            None => Vector3::zeros(),
        };
        if let Some(axis_B) = boresight_B {
            // No direction says how the satellite turns about the axis: it should not.
            omega_BR_B += axis_B * (body.omega_BN_B - omega_BR_B).dot(&axis_B);
        }
        active.previous_sigma = Some(sigma_BR);
        let waits = matches!(active.task, Task::Wait { .. });
        let error = TrackingError { sigma_BR, omega_BR_B };
        if self.wheel_lost && (waits || body.omega_BN_B.norm() > DAMPED_FROM * self.law.omega_max()) {
            let torque = self.plant.wheels.saturate(&self.law.damping(&body.omega_BN_B), &body.wheel_speed);
            return GuidanceTick { torque, error, sin_elevation, imaging };
        }
        let integral = &mut self.servo_integral;
        let command = self.law.torque(&self.plant, &error, &body.omega_BN_B, &body.wheel_speed, integral, self.dt);
        GuidanceTick { torque: self.plant.wheels.saturate(&command, &body.wheel_speed), error, sin_elevation, imaging }
    }
}

/// Shortest turn, as σ_BR, from where a unit vector of B points to a direction in N (Basilisk locationPointing).
#[must_use]
pub fn pointing_error(axis_B: &Vector3<f64>, direction_N: &Vector3<f64>, sigma_BN: &Vector3<f64>) -> Vector3<f64> {
    let direction_B = mrp::Rotation::new(sigma_BN).apply(direction_N);
    let across = axis_B.cross(&direction_B);
    let (sine, cosine) = (across.norm(), axis_B.dot(&direction_B));
    let angle = libm::atan2(sine, cosine);
    if sine > POINTING_EPSILON * direction_B.norm() {
        across * (-libm::tan(angle / 4.0) / sine)
    } else if cosine > 0.0 {
        Vector3::zeros()
    } else {
        // Opposite: any axis across will do.
        let across = axis_B.cross(&Vector3::ith(axis_B.iamin(), 1.0)).normalize();
        across * -libm::tan(angle / 4.0)
    }
}

/// Sine below which a direction is taken as along the axis.
const POINTING_EPSILON: f64 = 1e-10;

/// ω_BR by backward difference of σ_BR over one tick (after eq. 11), over whichever MRP set of the previous error is
/// nearer, so that a switch of sets is not read as a jump.
#[inline]
#[must_use]
pub fn rate_error(sigma: &Vector3<f64>, previous: &Vector3<f64>, dt: f64) -> Vector3<f64> {
    let mut difference = sigma - previous;
    // Sets can only be confused when both are near the sphere ‖σ‖ = 1, where the jump is near 2.
    if difference.norm_squared() > 1.0 {
        let other = sigma - mrp::shadow(previous);
        if other.norm_squared() < difference.norm_squared() {
            difference = other;
        }
    }
    mrp::rate_to_omega(sigma, &(difference / dt))
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn the_pointing_error_is_the_shortest_turn_to_the_direction() {
        let sigma_BN = Vector3::new(0.2, -0.3, 0.1);
        let axis_B = Vector3::new(0.0, 0.0, -1.0);
        for direction_N in [Vector3::x(), Vector3::new(0.3, 0.4, -0.6).normalize()] {
            let sigma_BR = pointing_error(&axis_B, &direction_N, &sigma_BN);
            // R is B turned so that the axis points there: dcm_RN = dcm_BRᵀ·dcm_BN.
            let dcm_RN = mrp::to_dcm(&sigma_BR).transpose() * mrp::to_dcm(&sigma_BN);
            assert_relative_eq!(dcm_RN * direction_N, axis_B, epsilon = 1e-12);
            let angle = (mrp::to_dcm(&sigma_BN) * direction_N).angle(&axis_B);
            assert_relative_eq!(mrp::principal_angle(&sigma_BR), angle, epsilon = 1e-12);
        }
        let along_N = mrp::to_dcm(&sigma_BN).transpose() * axis_B;
        assert_eq!(pointing_error(&axis_B, &along_N, &sigma_BN), Vector3::zeros());
        let opposite = pointing_error(&axis_B, &-along_N, &sigma_BN);
        assert_relative_eq!(opposite.norm(), 1.0, epsilon = 1e-9);
        assert_relative_eq!(opposite.dot(&axis_B), 0.0);
    }

    #[test]
    fn a_switch_of_mrp_sets_is_no_jump() {
        let before = Vector3::new(0.0, 0.0, 0.999);
        let after = mrp::shadow(&Vector3::new(0.0, 0.0, 1.003));
        let omega = rate_error(&after, &before, 0.5);
        // σ = tan(θ/4): θ̇ = 4·atan difference over dt.
        let expected = 4.0 * (libm::atan(1.003) - libm::atan(0.999)) / 0.5;
        assert_relative_eq!(omega.z, expected, max_relative = 1e-2);
    }
}
