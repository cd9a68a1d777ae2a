//! Strips and ground track as GeoJSON.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde_json::{Value, json};
use swath_msgs::swath_msgs as msg;

use super::track::Track;
use crate::debrief::places::{Place, cut_at_antimeridian, strip_places};
use crate::debrief::recorded::Recorded;
use crate::requests::json::status_json;

/// Each strip with where it stands at the end.
///
/// # Errors
/// When the file cannot be written.
pub fn write_strips(recorded: &Recorded, folder: &Path) -> Result<()> {
    let feature = |event: &&msg::StripStatus| feature(&strip_places(&recorded.model, &event.strip), status_json(event));
    write(folder, "strips.geojson", recorded.last_events().values().map(feature).collect())
}

/// The points below the satellite.
///
/// # Errors
/// When the file cannot be written.
pub fn write_ground_track(track: &Track, name: &str, folder: &Path) -> Result<()> {
    let places: Vec<Place> = track.points.iter().map(|point| point.place).collect();
    let ends = |point: Option<&super::track::TrackPoint>| point.map(|point| point.time_s);
    let properties = json!({ "name": name, "start_s": ends(track.points.first()), "end_s": ends(track.points.last()) });
    write(folder, "ground_track.geojson", vec![feature(&places, properties)])
}

fn feature(places: &[Place], properties: Value) -> Value {
    let lines = cut_at_antimeridian(places);
    let geometry = match &lines[..] {
        [line] => json!({ "type": "LineString", "coordinates": line }),
        lines => json!({ "type": "MultiLineString", "coordinates": lines }),
    };
    json!({ "type": "Feature", "properties": properties, "geometry": geometry })
}

fn write(folder: &Path, file: &str, features: Vec<Value>) -> Result<()> {
    let path = folder.join(file);
    let text = json!({ "type": "FeatureCollection", "features": features }).to_string();
    fs::write(&path, text + "\n").with_context(|| format!("cannot write {}", path.display()))
}
