//! Strip requests from GeoJSON files.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write as _};
use std::path::{Path, PathBuf};

use geojson::{Feature, GeoJson, GeometryValue, Position};
use nalgebra::Vector3;
use swath_sim::config::SimConfig;
use swath_sim::world::frames::direction_E;
use swath_sim::world::strip::StripRequest;
use thiserror::Error;

use super::order::{MISSION, Order};
use crate::time_text;

/// What a file of requests holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Import {
    /// The strips, in the order of the file.
    pub requests: Vec<Order>,
    /// Lines found.
    pub lines: usize,
    /// Lines that were too long for one strip, and how many strips each became.
    pub cut: Vec<(String, usize)>,
    /// Features that are no strips: number from 1, and why.
    pub refused: Vec<(usize, String)>,
}

/// Why a file of requests cannot be used.
#[derive(Debug, Error)]
pub enum RequestsFileError {
    /// The file cannot be read.
    #[error("cannot read requests {path}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is larger than is reasonable.
    #[error("requests {path} has {megabytes} MB, the limit is {LIMIT_MB} MB")]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size [MB].
        megabytes: u64,
    },
    /// The file is no GeoJSON.
    #[error("requests {path} is not GeoJSON")]
    Parse {
        /// The file.
        path: PathBuf,
        /// Where and why.
        source: Box<geojson::Error>,
    },
    /// The file cannot be written.
    #[error("cannot write requests {path}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A feature is no strip.
    #[error("requests {path}, feature {feature}: {reason}")]
    Feature {
        /// The file.
        path: PathBuf,
        /// Number of the feature, from 1.
        feature: usize,
        /// What is wrong.
        reason: String,
    },
}

/// How long a strip may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lengths {
    /// Longest strip [km].
    pub longest_km: f64,
    /// Radius of the Earth [m].
    pub radius_m: f64,
}

impl Lengths {
    /// What a configuration allows.
    #[must_use]
    pub fn of(config: &SimConfig) -> Self {
        Self { longest_km: config.requests.length_max_km, radius_m: config.earth.radius_m }
    }
}

/// Arc beyond which two points have no great circle between them [rad].
const ANTIPODAL_ARC: f64 = std::f64::consts::PI - 1e-6;
/// A line that is longer by so small a share of the longest strip is not cut: what was cut is not cut again.
const CUT_SLACK: f64 = 1e-6;
/// Largest file of requests [MB]: about 100 000 strips.
const LIMIT_MB: u64 = 100;
/// Priority of a feature that gives none.
const DEFAULT_PRIORITY: f64 = 0.5;
/// Acquisition speed of a feature that gives none [m/s].
const DEFAULT_SPEED_M_S: f64 = 3000.0;

/// Reads requests from a GeoJSON file: each LineString, or each line of a MultiLineString, is a strip from its first to
/// its last point, or, when it is longer than `lengths` allow, several strips of equal length one after the other, whose
/// ends lie on the line.
///
/// Properties: `name`, `client_ref`, `submitter`, `priority` (0 to 1), `acquisition_speed_m_s`, `bidirectional`,
/// `valid_from` and `valid_until` (RFC 3339), `hold_for_approval`, `max_attempts`.
///
/// # Errors
/// When the file cannot be read, is too large or is no GeoJSON.
pub fn import(path: &Path, lengths: Lengths) -> Result<Import, RequestsFileError> {
    let unreadable = |source| RequestsFileError::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(unreadable)?;
    let megabytes = file.metadata().map_err(unreadable)?.len() / 1_000_000;
    if megabytes > LIMIT_MB {
        return Err(RequestsFileError::TooLarge { path: path.to_owned(), megabytes });
    }
    let mut text = String::new();
    BufReader::new(file).read_to_string(&mut text).map_err(unreadable)?;
    let geojson = text
        .parse::<GeoJson>()
        .map_err(|source| RequestsFileError::Parse { path: path.to_owned(), source: Box::new(source) })?;
    let features = match geojson {
        GeoJson::FeatureCollection(collection) => collection.features,
        GeoJson::Feature(feature) => vec![feature],
        GeoJson::Geometry(geometry) => vec![Feature::from(geometry)],
    };
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut import = Import::default();
    for (number, feature) in (1..).zip(&features) {
        if let Err(reason) = take_feature(feature, &format!("{stem}-{number}"), lengths, &mut import) {
            import.refused.push((number, reason));
        }
    }
    Ok(import)
}

/// Reads requests from a GeoJSON file of which every feature must be usable; see [`import`].
///
/// # Errors
/// When the file cannot be read, is too large, is no GeoJSON, or holds something that is no strip.
pub fn read(path: &Path, lengths: Lengths) -> Result<Vec<Order>, RequestsFileError> {
    let import = import(path, lengths)?;
    match import.refused.into_iter().next() {
        Some((feature, reason)) => Err(RequestsFileError::Feature { path: path.to_owned(), feature, reason }),
        None => Ok(import.requests),
    }
}

/// Writes requests to a GeoJSON file that [`read`] gives back as they are.
///
/// # Errors
/// When the file cannot be written.
pub fn write(path: &Path, requests: &[Order]) -> Result<(), RequestsFileError> {
    let unwritable = |source| RequestsFileError::Write { path: path.to_owned(), source };
    let mut file = BufWriter::new(File::create(path).map_err(unwritable)?);
    file.write_all(b"{\"type\":\"FeatureCollection\",\"features\":[").map_err(unwritable)?;
    for (i, order) in requests.iter().enumerate() {
        let separator = if i == 0 { "\n" } else { ",\n" };
        write!(file, "{separator}{}", feature_of(order)).map_err(unwritable)?;
    }
    file.write_all(b"\n]}\n").and_then(|()| file.flush()).map_err(unwritable)
}

/// A request as a GeoJSON feature.
#[must_use]
pub fn feature_of(order: &Order) -> serde_json::Value {
    let request = &order.request;
    let mut feature = serde_json::json!({
        "type": "Feature",
        "properties": {
            "name": order.name,
            "client_ref": order.client_ref,
            "submitter": order.submitter,
            "priority": request.priority,
            "acquisition_speed_m_s": request.acquisition_speed_m_s,
            "bidirectional": request.bidirectional,
        },
        "geometry": {
            "type": "LineString",
            "coordinates": [
                [request.start_longitude_deg, request.start_latitude_deg],
                [request.end_longitude_deg, request.end_latitude_deg],
            ],
        },
    });
    let properties = &mut feature["properties"];
    for (key, ns) in [("valid_from", order.valid_from_ns), ("valid_until", order.valid_until_ns)] {
        if ns > 0 {
            properties[key] = time_text::format(ns).into();
        }
    }
    if order.hold_for_approval {
        properties["hold_for_approval"] = true.into();
    }
    if order.max_attempts > 0 {
        properties["max_attempts"] = order.max_attempts.into();
    }
    feature
}

fn take_feature(feature: &Feature, fallback: &str, lengths: Lengths, import: &mut Import) -> Result<(), String> {
    let lines = match feature.geometry.as_ref().map(|geometry| &geometry.value) {
        Some(GeometryValue::LineString { coordinates }) => vec![coordinates],
        Some(GeometryValue::MultiLineString { coordinates }) => coordinates.iter().collect(),
        Some(other) => {
            return Err(format!("a {} is no strip: expected LineString or MultiLineString", other.type_name()));
        }
        None => return Err("it has no geometry".to_owned()),
    };
    let template = properties_of(feature, fallback)?;
    let several = lines.len() > 1;
    let mut requests = Vec::new();
    let mut cut = Vec::new();
    for (i, line) in lines.iter().enumerate() {
        let pieces = cut_line(line, lengths)?;
        let numbered = |text: &str| if several { format!("{text} {}", i + 1) } else { text.to_owned() };
        let (name, client_ref) = (numbered(&template.name), numbered(&template.client_ref));
        let count = pieces.len();
        if count > 1 {
            cut.push((name.clone(), count));
        }
        for (k, (start, end)) in (1..).zip(pieces) {
            let piece = |text: &str| if count > 1 { format!("{text} {k}/{count}") } else { text.to_owned() };
            requests.push(Order {
                client_ref: piece(&client_ref),
                name: piece(&name),
                request: StripRequest {
                    start_latitude_deg: start[1],
                    start_longitude_deg: start[0],
                    end_latitude_deg: end[1],
                    end_longitude_deg: end[0],
                    ..template.request.clone()
                },
                ..template.clone()
            });
        }
    }
    import.lines += lines.len();
    import.requests.extend(requests);
    import.cut.extend(cut);
    Ok(())
}

/// A request with a feature's properties and without a place.
fn properties_of(feature: &Feature, fallback: &str) -> Result<Order, String> {
    let text = |key: &str| match feature.property(key) {
        None | Some(serde_json::Value::Null) => Ok(None),
        Some(value) => value.as_str().map(|s| Some(s.to_owned())).ok_or(format!("`{key}` must be a text")),
    };
    let number = |key: &str, default: f64| match feature.property(key) {
        None => Ok(default),
        Some(value) => value.as_f64().ok_or(format!("`{key}` must be a number")),
    };
    let flag = |key: &str| match feature.property(key) {
        None => Ok(false),
        Some(value) => value.as_bool().ok_or(format!("`{key}` must be true or false")),
    };
    let time = |key: &str| match text(key)? {
        None => Ok(0),
        Some(text) => time_text::parse(&text).map_err(|error| format!("`{key}`: {error}")),
    };
    let max_attempts = match feature.property("max_attempts") {
        None => 0,
        Some(value) => {
            let count = value.as_u64().and_then(|count| u32::try_from(count).ok());
            count.ok_or("`max_attempts` must be a whole number")?
        }
    };
    Ok(Order {
        client_ref: text("client_ref")?.unwrap_or_else(|| fallback.to_owned()),
        submitter: text("submitter")?.unwrap_or_else(|| MISSION.to_owned()),
        name: text("name")?.unwrap_or_else(|| fallback.to_owned()),
        request: StripRequest {
            start_latitude_deg: 0.0,
            start_longitude_deg: 0.0,
            end_latitude_deg: 0.0,
            end_longitude_deg: 0.0,
            priority: number("priority", DEFAULT_PRIORITY)?,
            acquisition_speed_m_s: number("acquisition_speed_m_s", DEFAULT_SPEED_M_S)?,
            bidirectional: flag("bidirectional")?,
        },
        valid_from_ns: time("valid_from")?,
        valid_until_ns: time("valid_until")?,
        hold_for_approval: flag("hold_for_approval")?,
        max_attempts,
    })
}

/// Start and end of a strip: longitude and latitude [deg].
type Ends = ([f64; 2], [f64; 2]);

/// The strips that a line becomes.
fn cut_line(line: &[Position], lengths: Lengths) -> Result<Vec<Ends>, String> {
    let points: Vec<[f64; 2]> =
        line.iter().filter(|point| point.len() >= 2).map(|point| [point[0], point[1]]).collect();
    let [first, .., last] = points[..] else {
        return Err("a line needs two points of longitude and latitude".to_owned());
    };
    if points.len() != line.len() {
        return Err("a line needs two points of longitude and latitude".to_owned());
    }
    // What is wrong with a coordinate is told when the strip is submitted.
    let outside = |p: &[f64; 2]| !(-180.0..=360.0).contains(&p[0]) || !(-90.0..=90.0).contains(&p[1]);
    if points.iter().any(outside) {
        return Ok(vec![(first, last)]);
    }
    let directions: Vec<_> = points.iter().map(|p| direction_E(p[1], p[0])).collect();
    let arcs: Vec<_> = directions.windows(2).map(|ends| angle(&ends[0], &ends[1])).collect();
    if points.len() == 2 && arcs[0] > ANTIPODAL_ARC {
        return Ok(vec![(first, last)]);
    }
    let total: f64 = arcs.iter().sum();
    let count = (total * lengths.radius_m / 1e3 / lengths.longest_km - CUT_SLACK).ceil().max(1.0) as usize;
    let at = |k: usize| match k {
        0 => first,
        k if k == count => last,
        k => point_along(&points, &directions, &arcs, total * k as f64 / count as f64),
    };
    Ok((0..count).map(|k| (at(k), at(k + 1))).collect())
}

/// The point of a line that lies `arc` from its beginning [rad].
fn point_along(points: &[[f64; 2]], directions: &[Vector3<f64>], arcs: &[f64], arc: f64) -> [f64; 2] {
    let mut before = 0.0;
    for (i, &length) in arcs.iter().enumerate() {
        if length > 0.0 && arc <= before + length {
            let share = (arc - before) / length;
            let (a, b) = (directions[i], directions[i + 1]);
            // On the great circle between two points.
            let between = (a * ((1.0 - share) * length).sin() + b * (share * length).sin()) / length.sin();
            let horizontal = between.x.hypot(between.y);
            return [between.y.atan2(between.x).to_degrees(), between.z.atan2(horizontal).to_degrees()];
        }
        before += length;
    }
    points[points.len() - 1]
}

fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Vec<Order>, String> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        read(file.path(), lengths()).map_err(|error| format!("{:#}", anyhow::Error::from(error)))
    }

    fn lengths() -> Lengths {
        Lengths::of(&SimConfig::default())
    }

    #[test]
    fn lines_become_strips_with_their_properties() {
        let requests = read_text(
            r#"{"type":"FeatureCollection","features":[
              {"type":"Feature","properties":{"name":"Po","priority":0.9,"bidirectional":true},
               "geometry":{"type":"LineString","coordinates":[[8.1,45.1],[9.0,45.2],[10.5,45.0]]}},
              {"type":"Feature","properties":{},
               "geometry":{"type":"MultiLineString","coordinates":[[[0,0],[2,0]],[[5,5],[7,5]]]}}]}"#,
        )
        .unwrap();
        assert_eq!(requests.len(), 3);
        assert_eq!(requests[0].name, "Po");
        assert_eq!(requests[0].request.end_longitude_deg, 10.5);
        assert!(requests[0].request.bidirectional);
        assert_eq!(requests[0].submitter, MISSION);
        assert_eq!(requests[1].request.acquisition_speed_m_s, DEFAULT_SPEED_M_S);
        assert!(requests[2].name.ends_with(" 2"));
    }

    #[test]
    fn random_requests_survive_a_file_to_the_last_bit() {
        let scenario = swath_sim::requests::scenario::ScenarioConfig::default();
        let random = scenario.generate(&mut swath_sim::rng::stream(3, 1), 500, 6_378_136.6);
        let order = |(i, request)| Order::new(format!("r{i}"), format!("strip {i}"), request);
        let mut requests: Vec<_> = random.into_iter().enumerate().map(order).collect();
        requests[3].valid_from_ns = 1_767_225_600_500_000_000;
        requests[3].valid_until_ns = 1_767_229_200_000_000_000;
        requests[4].hold_for_approval = true;
        requests[5].max_attempts = 3;
        let file = tempfile::NamedTempFile::new().unwrap();
        write(file.path(), &requests).unwrap();
        assert_eq!(read(file.path(), lengths()).unwrap(), requests);
    }

    #[test]
    fn what_is_no_strip_is_told_with_its_place() {
        let error = read_text(r#"{"type":"Point","coordinates":[1,2]}"#).unwrap_err();
        assert!(error.contains("feature 1: a Point is no strip"), "{error}");
        let error = read_text(r#"{"type":"LineString","coordinates":[[1,2]"#).unwrap_err();
        assert!(error.contains("is not GeoJSON"), "{error}");
        let error = read_text(
            r#"{"type":"Feature","properties":{"priority":"high"},
                "geometry":{"type":"LineString","coordinates":[[1,2],[3,4]]}}"#,
        )
        .unwrap_err();
        assert!(error.contains("`priority` must be a number"), "{error}");
    }

    #[test]
    fn long_lines_are_cut_into_equal_strips_along_the_great_circle() {
        let text = r#"{"type":"Feature","properties":{"name":"long","client_ref":"l"},
            "geometry":{"type":"LineString","coordinates":[[0,0],[12,0]]}}"#;
        let requests = read_text(text).unwrap();
        assert_eq!(requests.iter().map(|r| r.name.as_str()).collect::<Vec<_>>(), ["long 1/3", "long 2/3", "long 3/3"]);
        assert_eq!(requests[1].client_ref, "l 2/3");
        for (k, order) in requests.iter().enumerate() {
            let request = &order.request;
            assert!((request.start_longitude_deg - 4.0 * k as f64).abs() < 1e-9);
            assert!((request.end_longitude_deg - 4.0 * (k + 1) as f64).abs() < 1e-9);
        }
        let north = r#"{"type":"LineString","coordinates":[[0,60],[20,60]]}"#;
        let requests = read_text(north).unwrap();
        let highest = requests.iter().map(|r| r.request.end_latitude_deg).fold(0.0, f64::max);
        assert!(highest > 60.2, "a great circle goes north of its parallel: {highest}");
    }

    #[test]
    fn what_was_cut_is_not_cut_again_and_bends_are_followed() {
        let bent: Vec<_> = (0..200).map(|i| [f64::from(i) * 0.2, 5.0 * (f64::from(i) * 0.1).sin()]).collect();
        let text = serde_json::json!({"type": "LineString", "coordinates": bent}).to_string();
        let requests = read_text(&text).unwrap();
        assert!(requests.len() > 10);
        let file = tempfile::NamedTempFile::new().unwrap();
        write(file.path(), &requests).unwrap();
        assert_eq!(read(file.path(), lengths()).unwrap(), requests);
        let config = SimConfig::default();
        for (one, next) in requests.iter().zip(&requests[1..]) {
            assert_eq!(one.request.end_longitude_deg, next.request.start_longitude_deg);
            one.request.to_strip(&config.requests, config.earth.radius_m).unwrap();
        }
    }
}
