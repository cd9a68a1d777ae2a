//! Attitude, orbit and strips as CZML, which Cesium shows.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde_json::{Value, json};
use swath_mission::time_text::date;
use swath_msgs::swath_msgs as msg;

use super::track::Track;
use crate::debrief::places::strip_places;
use crate::debrief::recorded::Recorded;

/// How many times faster than the mission a viewer shows it at first.
const MULTIPLIER: u32 = 30;

/// A document with the satellite and the strips that were tried.
pub fn write_czml(recorded: &Recorded, track: &Track, folder: &Path) -> Result<()> {
    let epoch = u64::from(recorded.mission.epoch_unix_s);
    let time = |seconds: f64| format!("{}Z", date(epoch + seconds.ceil() as u64).replace(' ', "T"));
    let start = time(0.0);
    let end = time(track.points.last().map_or(0.0, |point| point.time_s));
    let availability = format!("{start}/{end}");
    let mut packets = vec![json!({
        "id": "document",
        "version": "1.0",
        "name": recorded.mission.name,
        "clock": { "interval": availability, "currentTime": start, "multiplier": MULTIPLIER },
    })];
    packets.push(satellite(recorded, track, &start, &availability));
    for (id, event) in recorded.last_events() {
        if event.attempts > 0 {
            packets.push(strip(recorded, id, event));
        }
    }
    let path = folder.join("mission.czml");
    fs::write(&path, Value::from(packets).to_string() + "\n")
        .with_context(|| format!("cannot write {}", path.display()))
}

fn satellite(recorded: &Recorded, track: &Track, epoch: &str, availability: &str) -> Value {
    let (mut positions, mut attitudes) = (Vec::new(), Vec::new());
    for point in &track.points {
        positions.extend([point.time_s, point.r_E.x, point.r_E.y, point.r_E.z]);
        let q = &point.attitude_E;
        attitudes.extend([point.time_s, q.i, q.j, q.k, q.w]);
    }
    json!({
        "id": "satellite",
        "name": recorded.mission.name,
        "availability": availability,
        "position": {
            "epoch": epoch,
            "referenceFrame": "FIXED",
            "interpolationAlgorithm": "LAGRANGE",
            "interpolationDegree": 5,
            "cartesian": positions,
        },
        "orientation": {
            "epoch": epoch,
            "interpolationAlgorithm": "LINEAR",
            "interpolationDegree": 1,
            "unitQuaternion": attitudes,
        },
        "point": { "pixelSize": 8, "color": { "rgba": [255, 255, 255, 255] } },
        "path": { "width": 1, "leadTime": 0, "trailTime": recorded.model.orbit_period_s(), "resolution": 30 },
    })
}

fn strip(recorded: &Recorded, id: u64, event: &msg::StripStatus) -> Value {
    let places = strip_places(&recorded.model, &event.strip);
    let degrees: Vec<f64> = places.iter().flat_map(|[longitude, latitude]| [*longitude, *latitude, 0.0]).collect();
    let colour = match event.state {
        msg::StripStatus::STATE_COMPLETED => [44, 160, 44, 255],
        _ => [214, 39, 40, 255],
    };
    json!({
        "id": format!("strip-{id}"),
        "name": event.strip.name,
        "polyline": {
            "positions": { "cartographicDegrees": degrees },
            "clampToGround": true,
            "width": 3,
            "material": { "solidColor": { "color": { "rgba": colour } } },
        },
    })
}
