//! Strip requests from GeoJSON files.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write as _};
use std::path::{Path, PathBuf};

use geojson::{Feature, GeoJson, GeometryValue, Position};
use swath_sim::strip::StripRequest;
use thiserror::Error;

/// A request with the names that its submitter gave it.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedRequest {
    /// Submitter's own reference.
    pub client_ref: String,
    /// Name for people.
    pub name: String,
    /// What is asked for.
    pub request: StripRequest,
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

/// Largest file of requests [MB]: about 100 000 strips.
const LIMIT_MB: u64 = 100;
/// Priority of a feature that gives none.
const DEFAULT_PRIORITY: f64 = 0.5;
/// Acquisition speed of a feature that gives none [m/s].
const DEFAULT_SPEED_M_S: f64 = 3000.0;

/// Reads requests from a GeoJSON file: each LineString, or each line of a MultiLineString, is a strip from its first to
/// its last point. Properties: `name`, `client_ref`, `priority` (0 to 1), `acquisition_speed_m_s`, `bidirectional`.
///
/// # Errors
/// When the file cannot be read, is too large, is no GeoJSON, or holds something that is no strip.
pub fn read(path: &Path) -> Result<Vec<NamedRequest>, RequestsFileError> {
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
    let mut requests = Vec::new();
    for (i, feature) in features.iter().enumerate() {
        let found = strips_of(feature, &format!("{stem}-{}", i + 1)).map_err(|reason| RequestsFileError::Feature {
            path: path.to_owned(),
            feature: i + 1,
            reason,
        })?;
        requests.extend(found);
    }
    Ok(requests)
}

/// Writes requests to a GeoJSON file that [`read`] gives back as they are.
///
/// # Errors
/// When the file cannot be written.
pub fn write(path: &Path, requests: &[NamedRequest]) -> Result<(), RequestsFileError> {
    let unwritable = |source| RequestsFileError::Write { path: path.to_owned(), source };
    let mut file = BufWriter::new(File::create(path).map_err(unwritable)?);
    file.write_all(b"{\"type\":\"FeatureCollection\",\"features\":[").map_err(unwritable)?;
    for (i, named) in requests.iter().enumerate() {
        let separator = if i == 0 { "\n" } else { ",\n" };
        write!(file, "{separator}{}", feature_of(named)).map_err(unwritable)?;
    }
    file.write_all(b"\n]}\n").and_then(|()| file.flush()).map_err(unwritable)
}

fn feature_of(named: &NamedRequest) -> serde_json::Value {
    let request = &named.request;
    serde_json::json!({
        "type": "Feature",
        "properties": {
            "name": named.name,
            "client_ref": named.client_ref,
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
    })
}

fn strips_of(feature: &Feature, fallback: &str) -> Result<Vec<NamedRequest>, String> {
    let lines = match feature.geometry.as_ref().map(|geometry| &geometry.value) {
        Some(GeometryValue::LineString { coordinates }) => vec![coordinates],
        Some(GeometryValue::MultiLineString { coordinates }) => coordinates.iter().collect(),
        Some(other) => {
            return Err(format!("a {} is no strip: expected LineString or MultiLineString", other.type_name()));
        }
        None => return Err("it has no geometry".to_owned()),
    };
    let text = |key: &str| match feature.property(key) {
        None => Ok(None),
        Some(value) => value.as_str().map(|s| Some(s.to_owned())).ok_or(format!("`{key}` must be a text")),
    };
    let number = |key: &str, default: f64| match feature.property(key) {
        None => Ok(default),
        Some(value) => value.as_f64().ok_or(format!("`{key}` must be a number")),
    };
    let bidirectional = match feature.property("bidirectional") {
        None => false,
        Some(value) => value.as_bool().ok_or("`bidirectional` must be true or false")?,
    };
    let name = text("name")?.unwrap_or_else(|| fallback.to_owned());
    let client_ref = text("client_ref")?.unwrap_or_else(|| fallback.to_owned());
    let priority = number("priority", DEFAULT_PRIORITY)?;
    let acquisition_speed_m_s = number("acquisition_speed_m_s", DEFAULT_SPEED_M_S)?;
    let several = lines.len() > 1;
    let strips = lines.into_iter().enumerate().map(|(i, line)| {
        let (start, end) = ends(line)?;
        let numbered = |text: &str| if several { format!("{text} {}", i + 1) } else { text.to_owned() };
        Ok(NamedRequest {
            client_ref: numbered(&client_ref),
            name: numbered(&name),
            request: StripRequest {
                start_latitude_deg: start[1],
                start_longitude_deg: start[0],
                end_latitude_deg: end[1],
                end_longitude_deg: end[0],
                priority,
                acquisition_speed_m_s,
                bidirectional,
            },
        })
    });
    strips.collect()
}

fn ends(line: &[Position]) -> Result<(&[f64], &[f64]), String> {
    match line {
        [start, .., end] if start.len() >= 2 && end.len() >= 2 => Ok((start.as_slice(), end.as_slice())),
        _ => Err("a line needs two points of longitude and latitude".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Vec<NamedRequest>, String> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        read(file.path()).map_err(|error| format!("{:#}", anyhow::Error::from(error)))
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
        assert_eq!(requests[1].request.acquisition_speed_m_s, DEFAULT_SPEED_M_S);
        assert!(requests[2].name.ends_with(" 2"));
    }

    #[test]
    fn random_requests_survive_a_file_to_the_last_bit() {
        let scenario = swath_sim::scenario::ScenarioConfig::default();
        let random = scenario.generate(&mut swath_sim::rng::stream(3, 1), 500, 6_378_136.6);
        let named = |(i, request)| NamedRequest { client_ref: format!("r{i}"), name: format!("strip {i}"), request };
        let requests: Vec<_> = random.into_iter().enumerate().map(named).collect();
        let file = tempfile::NamedTempFile::new().unwrap();
        write(file.path(), &requests).unwrap();
        assert_eq!(read(file.path()).unwrap(), requests);
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
}
