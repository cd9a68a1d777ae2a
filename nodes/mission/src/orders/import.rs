//! Files of requests: their features become orders.

use std::fs::File;
use std::io::{BufReader, Read, Write as _};
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::feature_strips::Cutting;
use super::formats::{self, Beside, Features, FormatError, Source};
use super::found::{Fault, Import};
use super::geojson::feature_of;
use super::order::Order;
use super::template::{Template, take_feature};

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
    #[error("requests {path} has more than the limit of {LIMIT_MB} MB")]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// The file is not what it looks like, or of a format that is not read.
    #[error("requests {path} {why}")]
    Format {
        /// The file.
        path: PathBuf,
        /// Why.
        why: FormatError,
    },
    /// The file cannot be written.
    #[error("cannot write requests {path}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
}

/// Largest file of requests [MB]: about 100 000 strips.
const LIMIT_MB: u64 = 100;
/// Reads requests from a file of any format that is read, `-` for standard input: lines are followed and areas are
/// covered by strips. What is wrong costs itself alone, and all of it is told.
///
/// Properties: `name`, `client_ref`, `submitter`, `priority` (0 to 1; of a feature that becomes several strips, each has
/// its share), `acquisition_speed_m_s`, `bidirectional`, `valid_from` and `valid_until` (RFC 3339), `hold_for_approval`,
/// `max_attempts`, `rows`, `short_lines`; of a strip that is part of an order, `order_ref`, `part`, `parts`, `share`.
///
/// # Errors
/// When the file as a whole cannot be read.
pub fn import(path: &Path, cutting: &Cutting) -> Result<Import, RequestsFileError> {
    Ok(import_features(features(path)?, path, cutting))
}

/// Reads the features of a file, `-` for standard input, as they are.
///
/// # Errors
/// When the file as a whole cannot be read.
pub fn features(path: &Path) -> Result<Features, RequestsFileError> {
    let source = Source { path: path.to_owned(), bytes: bytes(path)?, beside: beside(path)? };
    formats::read(&source).map_err(|why| RequestsFileError::Format { path: path.to_owned(), why })
}

fn bytes(path: &Path) -> Result<Vec<u8>, RequestsFileError> {
    let unreadable = |source| RequestsFileError::Read { path: path.to_owned(), source };
    let mut bytes = Vec::new();
    let limit = LIMIT_MB * 1_000_000 + 1;
    if path.as_os_str() == "-" {
        std::io::stdin().lock().take(limit).read_to_end(&mut bytes).map_err(unreadable)?;
    } else {
        let file = BufReader::new(File::open(path).map_err(unreadable)?);
        file.take(limit).read_to_end(&mut bytes).map_err(unreadable)?;
    }
    if bytes.len() as u64 >= limit {
        return Err(RequestsFileError::TooLarge { path: path.to_owned() });
    }
    Ok(bytes)
}

/// What lies beside a Shapefile or a GeoPackage.
fn beside(path: &Path) -> Result<Beside, RequestsFileError> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let other = |path: PathBuf| path.is_file().then(|| bytes(&path)).transpose();
    let mut beside = Beside::default();
    if extension.eq_ignore_ascii_case("shp") {
        let large = extension == "SHP";
        let of = |kind: &str| other(path.with_extension(if large { kind.to_uppercase() } else { kind.to_owned() }));
        (beside.table, beside.encoding, beside.reference_system) = (of("dbf")?, of("cpg")?, of("prj")?);
    } else if extension.eq_ignore_ascii_case("gpkg") {
        let mut log = path.as_os_str().to_owned();
        log.push("-wal");
        beside.log = other(log.into())?;
    }
    Ok(beside)
}

/// Makes orders of a file's features.
#[must_use]
pub fn import_features(features: Features, path: &Path, cutting: &Cutting) -> Import {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut import = Import::default();
    for (number, feature) in (1..).zip(features) {
        let mut faults = Vec::new();
        let name = format!("{stem}-{number}");
        match feature.and_then(|feature| Template::new(&feature, &name, cutting).map(|template| (feature, template))) {
            Ok((feature, template)) => take_feature(&feature, &template, &mut import, &mut faults),
            Err(reason) => faults.push((None, reason)),
        }
        let path = path.display().to_string();
        let fault = |(part, reason)| Fault { path: path.clone(), feature: number, part, reason };
        import.refused.extend(faults.into_iter().map(fault));
    }
    import
}

/// Writes requests to a GeoJSON file that [`import`] gives back as they are.
///
/// # Errors
/// When the file cannot be written.
pub fn write(path: &Path, orders: &[Order]) -> Result<(), RequestsFileError> {
    let unwritable = |source| RequestsFileError::Write { path: path.to_owned(), source };
    let mut file = std::io::BufWriter::new(File::create(path).map_err(unwritable)?);
    file.write_all(b"{\"type\":\"FeatureCollection\",\"features\":[").map_err(unwritable)?;
    for (i, order) in orders.iter().enumerate() {
        let separator = if i == 0 { "\n" } else { ",\n" };
        write!(file, "{separator}{}", feature_of(order)).map_err(unwritable)?;
    }
    file.write_all(b"\n]}\n").and_then(|()| file.flush()).map_err(unwritable)
}

#[cfg(test)]
mod tests {
    use swath_sim::config::SimConfig;

    use super::*;
    use crate::orders::order::{MISSION, Part as OrderPart};
    use crate::orders::template::DEFAULT_SPEED_M_S;
    use crate::shapes::sphere::{angle, direction};

    const EARTH_KM: f64 = 6378.1366;

    fn read(path: &Path) -> Result<Vec<Order>, String> {
        let import = import(path, &cutting()).map_err(|error| format!("{:#}", anyhow::Error::from(error)))?;
        import.refused.first().map_or(Ok(import.orders), |fault| Err(fault.to_string()))
    }

    fn read_text(text: &str) -> Result<Vec<Order>, String> {
        let mut file = tempfile::Builder::new().suffix(".geojson").tempfile().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        read(file.path())
    }

    fn cutting() -> Cutting {
        Cutting::of(&SimConfig::default())
    }

    #[test]
    fn lines_become_strips_with_their_properties() {
        let requests = read_text(
            r#"{"type":"FeatureCollection","features":[
              {"type":"Feature","properties":{"name":"Po","priority":0.9,"bidirectional":true},
               "geometry":{"type":"LineString","coordinates":[[8.1,45.1],[9.0,45.1],[10.5,45.0]]}},
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
    fn a_feature_is_one_order_whose_strips_share_its_priority() {
        let text = r#"{"type":"Feature","properties":{"name":"delta","client_ref":"d","priority":0.8},
            "geometry":{"type":"GeometryCollection","geometries":[
              {"type":"LineString","coordinates":[[0,0],[12,0]]},
              {"type":"LineString","coordinates":[[20,0],[24,0]]},
              {"type":"Polygon","coordinates":[[[30,0],[32,0],[32,0.3],[30,0.3],[30,0]]]}]}}"#;
        let orders = read_text(text).unwrap();
        let parts: Vec<_> = orders.iter().map(|order| order.part.clone().unwrap()).collect();
        assert!(parts.len() > 6, "{parts:?}");
        let whole = |(number, part): (u32, &OrderPart)| {
            part.order_ref == "d" && part.number == number && part.of == parts.len() as u32
        };
        assert!((1..).zip(&parts).all(whole), "{parts:?}");
        assert!((parts.iter().map(|part| part.share).sum::<f64>() - 1.0).abs() < 1e-12);
        assert!((parts[0].share - parts[3].share).abs() < 1e-9, "strips of the same length are worth the same");
        let priced = |(order, part): (&Order, &OrderPart)| (order.request.priority - 0.8 * part.share).abs() < 1e-15;
        assert!(orders.iter().zip(&parts).all(priced));
        let alone = read_text(r#"{"type":"LineString","coordinates":[[1,2],[3,4]]}"#).unwrap();
        assert_eq!(alone[0].part, None);
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
        assert_eq!(read(file.path()).unwrap(), requests);
        let config = SimConfig::default();
        for (one, next) in requests.iter().zip(&requests[1..]) {
            // Neighbours meet, or pass each other within the tolerance on either side.
            let ends = [
                [one.request.end_longitude_deg, one.request.end_latitude_deg],
                [next.request.start_longitude_deg, next.request.start_latitude_deg],
            ];
            let gap = angle(&direction(ends[0]), &direction(ends[1])) * EARTH_KM;
            assert!(gap <= 2.0 * cutting().tolerance_km, "{gap} km");
            one.request.to_strip(&config.requests, config.earth.radius_m).unwrap();
        }
    }
}
