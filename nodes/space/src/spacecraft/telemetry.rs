//! The spacecraft for ROS tools, in standard messages where one fits: frames, wheels, sub-satellite point, resources.

use anyhow::Result;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use swath_msgs::geometry_msgs::{Quaternion, Transform, TransformStamped};
use swath_msgs::sensor_msgs::{BatteryState, JointState, NavSatFix, NavSatStatus};
use swath_msgs::std_msgs::Header;
use swath_msgs::swath_msgs as msg;
use swath_msgs::tf2_msgs::TFMessage;
use swath_ros::{Parameters, Publisher, Spec, graph};
use swath_sim::vehicle::mrp;
use swath_sim::world::frames::latitude_longitude_deg;

use swath_node::messages::numbers::vector3;
use swath_node::messages::resource_state::resource_message;
use swath_node::node::MissionNode;
use swath_node::program::Parameter;
use swath_node::stamp::{BODY_FRAME, EARTH_FRAME, INERTIAL_FRAME, ORBIT_FRAME};
use swath_sim::vehicle::resources::{Failure, ResourceState};
use swath_sim::vehicle::spacecraft::StateSample;

/// How often.
pub const PERIOD: Parameter =
    Parameter { name: "telemetry_period_s", about: "Simulated time between frames, wheels and ground track [s]." };

/// Its default [s].
const PERIOD_S: f64 = 10.0;

/// Writers of standard messages, once in a while.
pub struct Telemetry {
    frames: Publisher<TFMessage>,
    wheels: Publisher<JointState>,
    sub_satellite: Publisher<NavSatFix>,
    /// There are none where resources have no bounds.
    resources: Option<(Publisher<BatteryState>, Publisher<msg::ResourceState>)>,
}

impl Telemetry {
    /// Declares how often.
    ///
    /// # Errors
    /// When the value given is out of range.
    pub fn declare(parameters: &Parameters) -> Result<()> {
        let period = Spec::new(PERIOD.name, PERIOD_S, PERIOD.about);
        parameters.declare(period.in_range(0.1..=3600.0))?;
        Ok(())
    }

    /// Telemetry every `telemetry_period_s` of simulated time, as that is set at the moment.
    ///
    /// # Errors
    /// When DDS fails.
    pub fn new(base: &MissionNode) -> Result<Self> {
        Ok(Self {
            frames: base.node.publisher(&graph::TF)?,
            wheels: base.node.publisher(&graph::WHEELS)?,
            sub_satellite: base.node.publisher(&graph::SUB_SATELLITE_POINT)?,
            resources: match base.model.config.resources {
                Some(_) => Some((base.node.publisher(&graph::BATTERY)?, base.node.publisher(&graph::RESOURCES)?)),
                None => None,
            },
        })
    }

    /// Sends telemetry of a state when it is due.
    ///
    /// # Errors
    /// When it cannot be sent.
    pub fn publish(&self, base: &MissionNode, sample: &StateSample) -> Result<()> {
        // It may be set at any time.
        let period = base.node.parameters().get(PERIOD.name).unwrap_or(PERIOD_S);
        if !sample.tick.0.is_multiple_of(u64::from(base.model.period.ticks_ceil(period).max(1))) {
            return Ok(());
        }
        let (cos, sin) = base.model.earth.clone().cos_sin(sample.tick);
        self.frames.publish(&frames(base, sample, cos, sin))?;
        self.wheels.publish(&JointState {
            header: base.stamper.header(sample.tick, BODY_FRAME),
            name: ["wheel_x", "wheel_y", "wheel_z"].map(str::to_owned).to_vec(),
            velocity: sample.body.wheel_speed.as_slice().to_vec(),
            effort: sample.torque_applied.as_slice().to_vec(),
            ..JointState::default()
        })?;
        let r = sample.r_BN_N;
        let r_E = Vector3::new(cos * r.x + sin * r.y, cos * r.y - sin * r.x, r.z);
        let (latitude, longitude) = latitude_longitude_deg(&r_E);
        let mut fix = NavSatFix {
            header: base.stamper.header(sample.tick, EARTH_FRAME),
            latitude,
            longitude,
            altitude: r.norm() - base.model.config.earth.radius_m,
            position_covariance_type: NavSatFix::COVARIANCE_TYPE_UNKNOWN,
            ..NavSatFix::default()
        };
        fix.status.status = NavSatStatus::STATUS_FIX;
        self.sub_satellite.publish(&fix)?;
        if let (Some((battery, resources)), Some(state)) = (&self.resources, &sample.resources) {
            battery.publish(&battery_state(base.stamper.header(sample.tick, BODY_FRAME), state))?;
            resources.publish(&resource_message(&base.stamper, sample.tick, state))?;
        }
        Ok(())
    }
}

/// The battery as ROS tools know batteries. The bus has no voltage here, so there is no charge in A h either.
fn battery_state(header: Header, state: &ResourceState) -> BatteryState {
    let status = if state.charge_j >= state.capacity_j {
        BatteryState::POWER_SUPPLY_STATUS_FULL
    } else if state.generated_w > state.asked_w {
        BatteryState::POWER_SUPPLY_STATUS_CHARGING
    } else {
        BatteryState::POWER_SUPPLY_STATUS_DISCHARGING
    };
    let health = match state.safe_mode {
        Some(Failure::BatteryEmpty) => BatteryState::POWER_SUPPLY_HEALTH_DEAD,
        _ => BatteryState::POWER_SUPPLY_HEALTH_GOOD,
    };
    BatteryState {
        header,
        voltage: f32::NAN,
        temperature: f32::NAN,
        current: f32::NAN,
        charge: f32::NAN,
        capacity: f32::NAN,
        design_capacity: f32::NAN,
        percentage: state.level() as f32,
        power_supply_status: status,
        power_supply_health: health,
        power_supply_technology: BatteryState::POWER_SUPPLY_TECHNOLOGY_UNKNOWN,
        present: true,
        ..BatteryState::default()
    }
}

fn frames(base: &MissionNode, sample: &StateSample, cos: f64, sin: f64) -> TFMessage {
    let header = base.stamper.header(sample.tick, INERTIAL_FRAME);
    // The orientation of a child frame in its parent: dcm_NB, whose quaternion has the Euler parameters of σ_BN.
    let [w, x, y, z] = mrp::to_euler_parameters(&sample.body.sigma_BN);
    let body = TransformStamped {
        header: header.clone(),
        child_frame_id: base.stamper.frame(BODY_FRAME),
        transform: Transform { translation: vector3(&sample.r_BN_N), rotation: Quaternion { x, y, z, w } },
    };
    // Half-angle from the angle's cosine and sine.
    let half = 0.5 * sin.atan2(cos);
    let earth = TransformStamped {
        header: header.clone(),
        child_frame_id: base.stamper.frame(EARTH_FRAME),
        transform: Transform {
            rotation: Quaternion { x: 0.0, y: 0.0, z: half.sin(), w: half.cos() },
            ..Transform::default()
        },
    };
    let orbit = TransformStamped {
        header,
        child_frame_id: base.stamper.frame(ORBIT_FRAME),
        transform: Transform { translation: vector3(&sample.r_BN_N), rotation: hill(&sample.r_BN_N, &sample.v_BN_N) },
    };
    TFMessage { transforms: vec![body, earth, orbit] }
}

/// Orientation of the orbit's frame in the inertial one, by position [m] and velocity [m/s] there.
fn hill(r_BN_N: &Vector3<f64>, v_BN_N: &Vector3<f64>) -> Quaternion {
    let radial = r_BN_N.normalize();
    let normal = r_BN_N.cross(v_BN_N).normalize();
    let axes = Rotation3::from_basis_unchecked(&[radial, normal.cross(&radial), normal]);
    let q = UnitQuaternion::from_rotation_matrix(&axes);
    Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_orbit_s_frame_points_up_and_along_the_orbit() {
        let Quaternion { x, y, z, w } = hill(&Vector3::new(0.0, 7e6, 0.0), &Vector3::new(-5e3, 0.0, 5e3));
        let orbit = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        let forward = Vector3::new(-1.0, 0.0, 1.0).normalize();
        for (axis, expected) in
            [(Vector3::x(), Vector3::y()), (Vector3::y(), forward), (Vector3::z(), Vector3::y().cross(&forward))]
        {
            assert!((orbit * axis - expected).norm() < 1e-12, "{axis}");
        }
    }
}
