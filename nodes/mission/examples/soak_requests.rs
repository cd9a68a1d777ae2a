//! Small files of every format that is read, each with a few bytes changed: they are read or refused, in little time and
//! memory, and nothing panics.
//!
//! Each seed changes a line and an area of every format in memory. All are read, lines become strips, and so does one
//! area in a hundred: covering takes long.
#![allow(missing_docs, clippy::print_stdout, reason = "a program for people")]

mod common;

use std::collections::BTreeMap;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use rand::rngs::StdRng;
use rand::{RngExt as _, SeedableRng as _};
use serde_json::json;
use swath_mission::orders::feature_strips::Cutting;
use swath_mission::orders::formats::{self, Source};
use swath_mission::orders::import::import_features;
use swath_sim::config::SimConfig;

/// Longest time that an input may take [s]; the machine may be busy.
const SECONDS_MAX: f64 = 5.0;
/// Greatest memory of the process [MB].
const MEGABYTES_MAX: u64 = 200;
/// One area in so many becomes strips.
const AREAS_CUT: u64 = 100;

const LINE_JSON: &str = r#"{"type":"Feature","id":7,"properties":{"name":"x","priority":0.5},"geometry":{"type":"LineString","coordinates":[[10,45],[12,46]]}}"#;
const AREA_JSON: &str =
    r#"{"type":"Polygon","coordinates":[[[0,0],[1,0],[1,1],[0,0]],[[0.5,0.2],[0.8,0.2],[0.8,0.5],[0.5,0.2]]]}"#;
const LINE_KML: &str = r#"<kml><Placemark id="k"><name>x</name><ExtendedData><Data name="priority"><value>0.7</value></Data></ExtendedData><LineString><coordinates>10,45,0 12,46,0</coordinates></LineString></Placemark></kml>"#;
const AREA_KML: &str = r#"<kml><Placemark><Polygon><outerBoundaryIs><LinearRing><coordinates>0,0 1,0 1,1 0,0</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark></kml>"#;
const LINE_GPX: &str = r#"<gpx version="1.1" creator="c"><trk><name>x</name><trkseg><trkpt lat="45" lon="10"/><trkpt lat="46" lon="12"/></trkseg></trk></gpx>"#;
const ROUTE_GPX: &str =
    r#"<gpx version="1.1" creator="c"><rte><rtept lat="45" lon="10"/><rtept lat="46" lon="12"/></rte></gpx>"#;

fn main() -> Result<ExitCode> {
    let (first, count) = match common::asked()? {
        common::Asked::Plan => {
            println!("{}", json!({ "seeds": 5_000_000, "chunk": 5_000 }));
            return Ok(ExitCode::SUCCESS);
        }
        common::Asked::Seeds(first, count) => (first, count),
    };
    let seeds = seeds()?;
    let cutting = Cutting::of(&SimConfig::default());
    let (mut read, mut slowest) = (BTreeMap::new(), 0.0_f64);
    for seed in first..first + count {
        for (number, (format, area, source)) in (0..).zip(&seeds) {
            let input = changed(source, seed * seeds.len() as u64 + number);
            let begun = Instant::now();
            let features = formats::read(&input);
            *read.entry(format!("read_{format}")).or_insert(0_u64) += u64::from(features.is_ok());
            if let Ok(features) = features
                && (!area || seed % AREAS_CUT == 0)
            {
                let _ = import_features(features, Path::new("x"), &cutting);
            }
            let seconds = begun.elapsed().as_secs_f64();
            ensure!(seconds < SECONDS_MAX, "seed {seed}, {format}: {seconds} s");
            slowest = slowest.max(seconds);
        }
    }
    let memory = memory_mb()?;
    ensure!(memory < MEGABYTES_MAX, "{memory} MB");
    let mut found = json!({ "inputs": count * seeds.len() as u64, "max_s": slowest, "max_mb": memory });
    read.into_iter().for_each(|(format, count)| found[format] = count.into());
    println!("{found}");
    Ok(ExitCode::SUCCESS)
}

/// Peak of this process's resident memory [MB].
fn memory_mb() -> Result<u64> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).context("no VmHWM")?;
    Ok(line.split_whitespace().next().context("no number")?.parse::<u64>()? / 1000)
}

/// The files that are changed: format, whether they are areas, and what they hold.
fn seeds() -> Result<Vec<(&'static str, bool, Source)>> {
    let text = |format, area, name: &str, text: &str| (format, area, Source::alone(name, text));
    let mut seeds = vec![
        text("geojson", false, "a.geojson", LINE_JSON),
        text("geojson", true, "a.geojson", AREA_JSON),
        text("geojsonseq", false, "a.geojsons", &format!("\u{1e}{LINE_JSON}\n\u{1e}{LINE_JSON}\n")),
        text("geojsonseq", true, "a.geojsonl", &format!("{AREA_JSON}\n{LINE_JSON}\n")),
        text("kml", false, "a.kml", LINE_KML),
        text("kml", true, "a.kml", AREA_KML),
        text("gpx", false, "a.gpx", LINE_GPX),
        text("gpx", false, "a.gpx", ROUTE_GPX),
        text("wkt", false, "a.wkt", "SRID=4326;MULTILINESTRING Z ((10 45 0, 12 46 0))"),
        text("wkt", true, "a.wkt", "POLYGON((0 0, 1 0, 1 1, 0 0))"),
        text("csv", false, "a.csv", "name,start_lat,start_lon,end_lat,end_lon\nx,45,10,46,12\n"),
        text("csv", true, "a.csv", "name;wkt;priority\nx;\"POLYGON((0 0, 1 0, 1 1, 0 0))\";0.5\n"),
    ];
    for (area, name) in [(false, "lines"), (true, "areas")] {
        let bytes = |ending: &str| {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/formats").join(format!("{name}.{ending}"));
            std::fs::read(&path).with_context(|| format!("cannot read {}", path.display()))
        };
        let mut shapes = Source::alone(format!("{name}.shp"), bytes("shp")?);
        shapes.beside.table = Some(bytes("dbf")?);
        shapes.beside.reference_system = Some(bytes("prj")?);
        shapes.beside.encoding = Some(bytes("cpg")?);
        seeds.push(("shapefile", area, shapes));
        seeds.push(("flatgeobuf", area, Source::alone(format!("{name}.fgb"), bytes("fgb")?)));
        seeds.push(("geopackage", area, Source::alone(format!("{name}.gpkg"), small_package(&bytes("gpkg")?)?)));
    }
    Ok(seeds)
}

/// A GeoPackage of what is read of it alone, so that changes meet that.
fn small_package(bytes: &[u8]) -> Result<Vec<u8>> {
    let mut database = swath_gpkg::rusqlite::Connection::open_in_memory()?;
    database.deserialize_read_exact(swath_gpkg::rusqlite::MAIN_DB, bytes, bytes.len(), false)?;
    let unread = "SELECT name FROM sqlite_master WHERE type = 'table' AND (name LIKE 'gpkg_%' OR name LIKE 'rtree_%') \
                  AND name NOT IN ('gpkg_geometry_columns', 'gpkg_spatial_ref_sys')";
    let names: Vec<String> =
        database.prepare(unread)?.query_map([], |row| row.get(0))?.collect::<swath_gpkg::rusqlite::Result<_>>()?;
    let triggers = "SELECT name FROM sqlite_master WHERE type = 'trigger'";
    let triggers: Vec<String> =
        database.prepare(triggers)?.query_map([], |row| row.get(0))?.collect::<swath_gpkg::rusqlite::Result<_>>()?;
    database.execute_batch("PRAGMA foreign_keys = OFF")?;
    for trigger in triggers {
        database.execute_batch(&format!("DROP TRIGGER \"{trigger}\""))?;
    }
    for name in names {
        database.execute_batch(&format!("DROP TABLE \"{name}\""))?;
    }
    database.execute_batch("UPDATE gpkg_spatial_ref_sys SET definition = ''; VACUUM")?;
    Ok(database.serialize(swath_gpkg::rusqlite::MAIN_DB)?.to_vec())
}

/// The same file with one to four changes, in it or in what lies beside it.
fn changed(source: &Source, seed: u64) -> Source {
    let mut rng = StdRng::seed_from_u64(seed);
    let mut source = source.clone();
    for _ in 0..rng.random_range(1..=4) {
        let beside = source.beside.table.as_mut().filter(|_| rng.random_bool(0.4));
        change(beside.unwrap_or(&mut source.bytes), &mut rng);
    }
    source
}

fn change(bytes: &mut Vec<u8>, rng: &mut StdRng) {
    if bytes.is_empty() {
        return;
    }
    let at = rng.random_range(0..bytes.len());
    match rng.random_range(0..12) {
        0 | 1 => bytes[at] = rng.random_range(0..=255),
        2 => bytes[at] ^= 1 << rng.random_range(0..8),
        3 => bytes[at] = [0, 1, 0x7f, 0x80, 0xff][rng.random_range(0..5)],
        4 => bytes.truncate(at),
        5 => bytes.insert(at, b"0123456789-.e,[]{}<>\"\n "[rng.random_range(0..23)]),
        6 => drop(bytes.remove(at)),
        // Numbers become other numbers, so that much is still read.
        7..=10 => {
            let digits = (0..bytes.len()).filter(|i| bytes[*i].is_ascii_digit()).collect::<Vec<_>>();
            if let Some(&digit) = digits.get(rng.random_range(0..digits.len().max(1))) {
                bytes[digit] = b"0123456789-.e"[rng.random_range(0..13)];
            }
        }
        _ => {
            let end = (at + rng.random_range(1..16)).min(bytes.len());
            let part = bytes[at..end].to_vec();
            let to = rng.random_range(0..=bytes.len());
            bytes.splice(to..to, part);
        }
    }
}
