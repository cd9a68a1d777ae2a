//! Files of requests: their features become orders.

use std::fs::File;
use std::io::{BufReader, Read, Write as _};
use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};
use swath_sim::world::strip::StripRequest;
use thiserror::Error;

use super::cutting::{CutStrip, Cutting};
use super::feature::{Feature, Part};
use super::formats::{self, FormatError};
use super::geojson::feature_of;
use super::order::{MISSION, Order, Part as OrderPart};
use crate::shapes::sphere::Place;
use crate::time_text;

/// What files of requests hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Import {
    /// The strips, in the order of the files.
    pub orders: Vec<Order>,
    /// Lines and areas found.
    pub shapes: usize,
    /// What became of those that became several strips, or other strips than themselves.
    pub cut: Vec<Cut>,
    /// What is no strip.
    pub refused: Vec<Fault>,
}

/// What became of a line or an area.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// Its name.
    pub name: String,
    /// Its strips.
    pub strips: usize,
    /// How well they show it.
    pub shown: Shown,
}

/// How well strips show what they were made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shown {
    /// A line.
    Line {
        /// Its length [km].
        length_km: f64,
        /// Its greatest distance from its strips [km].
        farthest_km: f64,
    },
    /// An area.
    Area {
        /// Its size [km²].
        square_km: f64,
        /// Share of it that is shown.
        covered: f64,
        /// Share of it that is shown more than once.
        twice: f64,
    },
}

/// Something that is no strip.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("requests {path}, feature {feature}{}: {reason}", part.map_or_else(String::new, |part| format!(", part {part}")))]
pub struct Fault {
    /// The file.
    pub path: String,
    /// Number of the feature, from 1.
    pub feature: usize,
    /// Number of the part of the feature, from 1, if it has several.
    pub part: Option<usize>,
    /// What is wrong.
    pub reason: String,
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
/// Priority of a feature that gives none.
const DEFAULT_PRIORITY: f64 = 0.5;
/// Acquisition speed of a feature that gives none [m/s].
const DEFAULT_SPEED_M_S: f64 = 3000.0;
/// Names under which features have their names.
const NAMES: [&str; 4] = ["name", "Name", "NAME", "title"];

/// Reads requests from a file of any format that is read, `-` for standard input: lines are followed and areas are
/// covered by strips. What is wrong costs itself alone, and all of it is told.
///
/// Properties: `name`, `client_ref`, `submitter`, `priority` (0 to 1; of a feature that becomes several strips, each has
/// its share), `acquisition_speed_m_s`, `bidirectional`, `valid_from` and `valid_until` (RFC 3339), `hold_for_approval`,
/// `max_attempts`; of a strip that is part of an order, `order_ref`, `part`, `parts`, `share`.
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
pub fn features(path: &Path) -> Result<formats::Features, RequestsFileError> {
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
    formats::read(&bytes, path).map_err(|why| RequestsFileError::Format { path: path.to_owned(), why })
}

/// Makes orders of a file's features.
#[must_use]
pub fn import_features(features: formats::Features, path: &Path, cutting: &Cutting) -> Import {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut import = Import::default();
    for (number, feature) in (1..).zip(features) {
        let mut faults = Vec::new();
        match feature.and_then(|feature| Template::new(&feature, &format!("{stem}-{number}")).map(|it| (feature, it))) {
            Ok((feature, template)) => take_feature(&feature, &template, cutting, &mut import, &mut faults),
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

/// What the strips of a feature have in common.
struct Template {
    order: Order,
    /// Whether the feature has a reference of its submitter's own.
    referenced: bool,
}

impl Template {
    fn new(feature: &Feature, fallback: &str) -> Result<Self, String> {
        let time = |key: &str| match feature.text(&[key])? {
            None => Ok(0),
            Some(text) => time_text::parse(&text).map_err(|error| format!("`{key}`: {error}")),
        };
        let max_attempts = whole(feature, "max_attempts")?;
        let client_ref = feature.text(&["client_ref"])?;
        let request = StripRequest {
            start_latitude_deg: 0.0,
            start_longitude_deg: 0.0,
            end_latitude_deg: 0.0,
            end_longitude_deg: 0.0,
            priority: feature.number("priority")?.unwrap_or(DEFAULT_PRIORITY),
            acquisition_speed_m_s: feature.number("acquisition_speed_m_s")?.unwrap_or(DEFAULT_SPEED_M_S),
            bidirectional: feature.flag("bidirectional")?,
        };
        let order = Order {
            submitter: feature.text(&["submitter"])?.unwrap_or_else(|| MISSION.to_owned()),
            valid_from_ns: time("valid_from")?,
            valid_until_ns: time("valid_until")?,
            hold_for_approval: feature.flag("hold_for_approval")?,
            max_attempts,
            part: part(feature)?,
            ..Order::new(
                client_ref.clone().unwrap_or_default(),
                feature.text(&NAMES)?.unwrap_or_else(|| fallback.to_owned()),
                request,
            )
        };
        Ok(Self { order, referenced: client_ref.is_some_and(|text| !text.is_empty()) })
    }

    /// Orders for the strips of a feature's lines and areas: one order of several strips, or a strip that is one itself.
    fn orders(&self, shapes: &[Shape]) -> Vec<Order> {
        let total: f64 = shapes.iter().map(|shape| shape.worth).sum();
        let requests: Vec<Vec<StripRequest>> = shapes
            .iter()
            .map(|shape| {
                let worth = shape.worth / total;
                shape.strips.iter().map(|strip| self.request(strip, strip.share * worth)).collect()
            })
            .collect();
        let all = requests.concat();
        let order_ref = if self.referenced { self.order.client_ref.clone() } else { self.identity(&all) };
        let mut orders = Vec::new();
        for (shape, requests) in shapes.iter().zip(requests) {
            let suffix = &shape.suffix;
            let reference = if self.referenced { format!("{order_ref}{suffix}") } else { self.identity(&requests) };
            let count = requests.len();
            for (k, (strip, request)) in (1..).zip(shape.strips.iter().zip(requests)) {
                let piece = if count > 1 { format!(" {k}/{count}") } else { String::new() };
                let (number, of) = (orders.len() as u32 + 1, all.len() as u32);
                let share = strip.share * (shape.worth / total);
                let part = OrderPart { order_ref: order_ref.clone(), number, of, share };
                orders.push(Order {
                    client_ref: format!("{reference}{piece}"),
                    name: format!("{}{suffix}{piece}", self.order.name),
                    request,
                    part: if all.len() > 1 { Some(part) } else { self.order.part.clone() },
                    ..self.order.clone()
                });
            }
        }
        orders
    }

    fn request(&self, strip: &CutStrip, share: f64) -> StripRequest {
        StripRequest {
            start_latitude_deg: strip.start[1],
            start_longitude_deg: strip.start[0],
            end_latitude_deg: strip.end[1],
            end_longitude_deg: strip.end[0],
            priority: self.order.request.priority * share,
            ..self.order.request.clone()
        }
    }

    /// A reference that is the same whenever the same is asked for, in whatever file and place.
    fn identity(&self, requests: &[StripRequest]) -> String {
        let mut hash = Sha256::new();
        for request in requests {
            let order = Order { name: String::new(), request: request.clone(), part: None, ..self.order.clone() };
            hash.update(feature_of(&order).to_string());
        }
        let digits: String = hash.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect();
        format!("strip-{digits}")
    }
}

fn whole(feature: &Feature, key: &str) -> Result<u32, String> {
    let number = feature.number(key)?.unwrap_or(0.0);
    if number.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&number) {
        return Err(format!("`{key}` must be a whole number"));
    }
    Ok(number as u32)
}

/// Which part of an order a feature is, if it says so.
fn part(feature: &Feature) -> Result<Option<OrderPart>, String> {
    let Some(order_ref) = feature.text(&["order_ref"])?.filter(|text| !text.is_empty()) else { return Ok(None) };
    let share = feature.number("share")?.unwrap_or(1.0);
    Ok(Some(OrderPart { order_ref, number: whole(feature, "part")?, of: whole(feature, "parts")?, share }))
}

/// The strips of a line, or of a feature's areas.
struct Shape {
    strips: Vec<CutStrip>,
    /// What it is worth beside the others of its feature: the ground that it shows [km²].
    worth: f64,
    /// Its number in its feature, behind a name.
    suffix: String,
    /// How well it is shown, when that is worth a word.
    shown: Option<Shown>,
}

/// Takes the lines and areas of a feature; what is wrong with a part goes to `faults` with the part's number.
fn take_feature(
    feature: &Feature,
    template: &Template,
    cutting: &Cutting,
    import: &mut Import,
    faults: &mut Vec<(Option<usize>, String)>,
) {
    if feature.parts.is_empty() {
        return faults.push((None, "it has no geometry".to_owned()));
    }
    let several = feature.parts.len() > 1;
    let mut shapes = Vec::new();
    let mut areas = Vec::new();
    for (number, part) in (1..).zip(&feature.parts) {
        let numbered = several.then_some(number);
        match part {
            Part::Line(line) => match line_shape(line, numbered, cutting) {
                Ok((shape, left_out)) => {
                    shapes.push(shape);
                    faults.extend(left_out.into_iter().map(|reason| (numbered, reason)));
                }
                Err(reason) => faults.push((numbered, reason)),
            },
            Part::Area(rings) => areas.push(rings),
            Part::Other(kind) => {
                faults.push((numbered, format!("a {kind} is no strip: expected a line or an area")));
            }
        }
    }
    if !areas.is_empty() {
        let lines = feature.parts.iter().any(|part| matches!(part, Part::Line(_)));
        match area_shape(&areas, if lines { " area" } else { "" }, cutting) {
            Ok(shape) => shapes.push(shape),
            Err(reason) => faults.push((None, reason)),
        }
    }
    import.shapes += shapes.len();
    import.orders.extend(template.orders(&shapes));
    let cut = shapes.iter().filter_map(|shape| {
        let name = format!("{}{}", template.order.name, shape.suffix);
        Some(Cut { name, strips: shape.strips.len(), shown: shape.shown? })
    });
    import.cut.extend(cut);
}

fn line_shape(line: &[Place], number: Option<usize>, cutting: &Cutting) -> Result<(Shape, Vec<String>), String> {
    let cut = cutting.line(line)?;
    let bent = cut.strips.len() > 1 || cut.farthest_km > 0.01;
    let shape = Shape {
        shown: bent.then_some(Shown::Line { length_km: cut.length_km, farthest_km: cut.farthest_km }),
        worth: cut.length_km.max(cutting.shortest_km) * cutting.swath_km,
        strips: cut.strips,
        suffix: number.map_or_else(String::new, |number| format!(" {number}")),
    };
    Ok((shape, cut.left_out))
}

fn area_shape(areas: &[&Vec<Vec<Place>>], suffix: &str, cutting: &Cutting) -> Result<Shape, String> {
    let (strips, cover) = cutting.area(areas)?;
    let square_km = cutting.square_km(&cover);
    let shown = Some(Shown::Area { square_km, covered: cover.covered, twice: cover.twice });
    Ok(Shape { strips, worth: square_km.max(f64::MIN_POSITIVE), suffix: suffix.to_owned(), shown })
}

#[cfg(test)]
mod tests {
    use swath_sim::config::SimConfig;

    use super::*;
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
