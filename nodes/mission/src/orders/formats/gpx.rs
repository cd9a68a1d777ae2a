//! GPX: tracks and routes are lines, waypoints are not.

use gpx::Waypoint;

use super::super::feature::{Feature, Part};
use super::error::{Features, FormatError};

/// Reads a text that begins like XML and has a `gpx` element.
pub(super) fn read(text: &str) -> Result<Features, FormatError> {
    let malformed = |error: gpx::errors::GpxError| FormatError::Malformed { format: "GPX", reason: error.to_string() };
    let gpx = gpx::read(text.as_bytes()).map_err(malformed)?;
    let line = |points: &[Waypoint]| Part::Line(points.iter().map(|it| [it.point().x(), it.point().y()]).collect());
    let feature = |name: Option<String>, parts: Vec<Part>| {
        let mut feature = Feature { parts, ..Feature::default() };
        feature.properties.extend(name.map(|name| ("name".to_owned(), name.into())));
        Ok(feature)
    };
    let tracks = gpx.tracks.into_iter();
    let tracks = tracks.map(|it| feature(it.name, it.segments.iter().map(|segment| line(&segment.points)).collect()));
    let routes = gpx.routes.into_iter().map(|route| feature(route.name, vec![line(&route.points)]));
    let points = gpx.waypoints.into_iter().map(|point| feature(point.name, vec![Part::Other("waypoint".to_owned())]));
    Ok(tracks.chain(routes).chain(points).collect())
}
