//! Random lines and areas through `ogr2ogr` into every format that is read, and back: the same strips.
//!
//! Needs GDAL's `ogr2ogr`, of Debian's package `gdal-bin`.
#![allow(missing_docs, clippy::print_stdout, reason = "a program for people")]

mod common;
#[path = "../tests/common/mod.rs"]
mod same;

use std::path::Path;
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result, ensure};
use serde_json::json;
use swath_mission::orders::feature_strips::Cutting;
use swath_mission::orders::import::import;
use swath_sim::config::SimConfig;

/// Formats by the ending of their files, and what `ogr2ogr` is told.
const FORMATS: [(&str, &[&str]); 7] = [
    ("geojsons", &["-f", "GeoJSONSeq"]),
    ("kml", &["-f", "KML"]),
    ("csv", &["-f", "CSV", "-lco", "GEOMETRY=AS_WKT"]),
    ("shp", &["-f", "ESRI Shapefile", "-lco", "ENCODING=UTF-8"]),
    ("fgb", &["-f", "FlatGeobuf"]),
    ("gpkg", &["-f", "GPKG"]),
    ("gpx", &["-f", "GPX", "-nlt", "MULTILINESTRING", "-select", "name"]),
];

fn main() -> Result<ExitCode> {
    let (first, count) = match common::asked()? {
        common::Asked::Plan => {
            println!("{}", json!({ "seeds": 300, "chunk": 20 }));
            return Ok(ExitCode::SUCCESS);
        }
        common::Asked::Seeds(first, count) => (first, count),
    };
    let folder = tempfile::tempdir()?;
    let (mut files, mut strips, mut differ) = (0, 0, Vec::new());
    for seed in first..first + count {
        for (name, features) in ["lines", "areas"].into_iter().zip(common::features(seed)) {
            let path = folder.path().join(format!("{name}-{seed}.geojson"));
            std::fs::write(&path, features.to_string())?;
            for (format, options) in FORMATS {
                if (name, format) == ("areas", "gpx") {
                    continue;
                }
                let (found, difference) = compare(&path, format, options)?;
                (files, strips) = (files + 1, strips + found);
                differ.extend(difference.map(|it| format!("seed {seed}, {name}.{format}: {it}")));
            }
        }
    }
    println!("{}", json!({ "files": files, "strips": strips, "differ": differ }));
    Ok(if differ.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Converts a file and reads both: how many strips there are, and what differs.
fn compare(path: &Path, format: &str, options: &[&str]) -> Result<(usize, Option<String>)> {
    let out = path.with_extension(format);
    let mut ogr2ogr = Command::new("ogr2ogr");
    let converted = ogr2ogr.args(options).arg(&out).arg(path).stderr(Stdio::null()).status();
    ensure!(converted.context("cannot run ogr2ogr of gdal-bin")?.success(), "ogr2ogr failed for {}", out.display());
    let cutting = Cutting::of(&SimConfig::default());
    let (expected, found) = (import(path, &cutting)?, import(&out, &cutting)?);
    Ok((found.orders.len(), same::difference(&found, &expected, format != "gpx")))
}
