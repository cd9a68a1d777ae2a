//! Numbers in messages: vectors by their components, and what is absurd.

use nalgebra::Vector3;
use swath_msgs::geometry_msgs;

use crate::error::MessageError;

/// Largest rate that makes sense [rad/s].
pub const RATE_MAX: f64 = 100.0;
/// Largest torque that makes sense [N m].
pub const TORQUE_MAX: f64 = 1e3;

/// A vector by its components.
#[must_use]
pub fn vector3(v: &Vector3<f64>) -> geometry_msgs::Vector3 {
    geometry_msgs::Vector3 { x: v.x, y: v.y, z: v.z }
}

/// Three numbers of a field, finite and at most `limit`.
///
/// # Errors
/// The first that is not.
pub fn checked(field: &'static str, v: [f64; 3], limit: f64) -> Result<Vector3<f64>, MessageError> {
    match v.into_iter().find(|value| value.is_nan() || value.abs() > limit) {
        Some(value) => Err(MessageError::Number { field, value, limit }),
        None => Ok(Vector3::from(v)),
    }
}

/// The components of a vector.
#[must_use]
pub fn components(v: &geometry_msgs::Vector3) -> [f64; 3] {
    [v.x, v.y, v.z]
}
