//! The Earth and the strips on it for 3D panels, which draw shapes but no GeoJSON.

use std::collections::BTreeMap;
use std::sync::Arc;

use foxglove::messages::line_primitive::Type;
use foxglove::messages::{
    Color, LinePrimitive, Point3, Pose, Quaternion, SceneEntity, SceneUpdate, SpherePrimitive, Timestamp, Vector3,
};
use foxglove::{ChannelBuilder, Context, Encode as _, RawChannel};

use crate::latched::{Kept, send_latched};

/// Radius of the sphere that stands for the Earth [m].
const EARTH_M: f64 = 6_371_000.0;
/// How far above it strips are drawn, so that no chord of one is below it [m].
const ABOVE_M: f64 = 20_000.0;
/// Width of strips on the screen [px].
const WIDTH_PX: f64 = 2.0;

/// Longitude and latitude [deg] of a strip's ends.
pub type Ends = [[f64; 2]; 2];

/// A channel of shapes, whole and latched.
pub struct Scene {
    channel: Option<Arc<RawChannel>>,
    kept: Arc<Kept>,
    frame: String,
}

impl Scene {
    /// The channel `strips/scene` of a namespace; `frame` turns with the Earth.
    #[must_use]
    pub fn new(context: &Arc<Context>, kept: Arc<Kept>, namespace: &str, frame: String) -> Self {
        let made = ChannelBuilder::new(format!("{namespace}/strips/scene"))
            .message_encoding(SceneUpdate::get_message_encoding())
            .schema(SceneUpdate::get_schema())
            .context(context)
            .build_raw();
        let channel = made.map_err(|error| tracing::warn!("no channel for 3D panels: {error}")).ok();
        Self { channel, kept, frame }
    }

    /// Tells how everything stands: the strips of each group, with its colour (`#rrggbb`).
    pub fn tell(&self, groups: &BTreeMap<&'static str, (&'static str, Vec<Ends>)>, log_time: u64) {
        let Some(channel) = &self.channel else { return };
        let entity = |id: &str| SceneEntity {
            timestamp: stamp(log_time),
            frame_id: self.frame.clone(),
            id: id.to_owned(),
            frame_locked: true,
            ..SceneEntity::default()
        };
        let mut entities = vec![SceneEntity { spheres: vec![earth()], ..entity("earth") }];
        entities.extend(
            groups
                .iter()
                .map(|(name, (colour, strips))| SceneEntity { lines: vec![lines(colour, strips)], ..entity(name) }),
        );
        let mut message = Vec::new();
        match (SceneUpdate { deletions: Vec::new(), entities }).encode(&mut message) {
            Ok(()) => send_latched(&self.kept, channel, log_time, &message),
            Err(error) => tracing::warn!("the scene cannot be told: {error}"),
        }
    }
}

/// A time [ns since 1970-01-01 UTC]; none beyond the year 2106, which no stamp can tell.
fn stamp(log_time: u64) -> Option<Timestamp> {
    let (seconds, rest) = (log_time / 1_000_000_000, log_time % 1_000_000_000);
    Timestamp::new_checked(u32::try_from(seconds).ok()?, u32::try_from(rest).ok()?)
}

fn at_rest() -> Option<Pose> {
    let orientation = Quaternion { x: 0.0, y: 0.0, z: 0.0, w: 1.0 };
    Some(Pose { position: Some(Vector3::default()), orientation: Some(orientation) })
}

fn earth() -> SpherePrimitive {
    let across = 2.0 * EARTH_M;
    let size = Some(Vector3 { x: across, y: across, z: across });
    SpherePrimitive { pose: at_rest(), size, color: Some(Color { r: 0.1, g: 0.2, b: 0.3, a: 1.0 }) }
}

fn lines(colour: &str, strips: &[Ends]) -> LinePrimitive {
    LinePrimitive {
        r#type: Type::LineList.into(),
        pose: at_rest(),
        thickness: WIDTH_PX,
        scale_invariant: true,
        points: strips.iter().flatten().map(|place| above(*place)).collect(),
        color: Some(parsed(colour)),
        ..LinePrimitive::default()
    }
}

/// A place in the frame that turns with the Earth, x to longitude 0, z to the north [m].
fn above([longitude, latitude]: [f64; 2]) -> Point3 {
    let (longitude, latitude) = (longitude.to_radians(), latitude.to_radians());
    let (radius, out) = (EARTH_M + ABOVE_M, latitude.cos());
    Point3 { x: radius * out * longitude.cos(), y: radius * out * longitude.sin(), z: radius * latitude.sin() }
}

fn parsed(colour: &str) -> Color {
    let part = |at: usize| {
        let digits = colour.get(at..at + 2).unwrap_or("ff");
        f64::from(u8::from_str_radix(digits, 16).unwrap_or(u8::MAX)) / 255.0
    };
    Color { r: part(1), g: part(3), b: part(5), a: 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_lie_above_their_places() {
        let radius = EARTH_M + ABOVE_M;
        let near = |a: Point3, b: [f64; 3]| {
            assert!((a.x - b[0]).abs() < 1.0 && (a.y - b[1]).abs() < 1.0 && (a.z - b[2]).abs() < 1.0, "{a:?}");
        };
        near(above([0.0, 0.0]), [radius, 0.0, 0.0]);
        near(above([90.0, 0.0]), [0.0, radius, 0.0]);
        near(above([-45.0, 90.0]), [0.0, 0.0, radius]);
        // The middle of a line of 450 km is still above the sphere.
        let (a, b) = (above([0.0, 0.0]), above([4.05, 0.0]));
        let middle = ((a.x + b.x).powi(2) + (a.y + b.y).powi(2)).sqrt() / 2.0;
        assert!(middle > EARTH_M, "{middle}");
    }

    #[test]
    fn colours_are_those_of_maps() {
        assert_eq!(parsed("#ff8000"), Color { r: 1.0, g: 128.0 / 255.0, b: 0.0, a: 1.0 });
    }
}
