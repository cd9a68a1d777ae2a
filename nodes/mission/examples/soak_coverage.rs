//! How well strips show what people bring: each file of lines and areas in `target/soak/sets` is one set.
//!
//! Judged from the outside, by the strips as they would be submitted: the share of the lines' length within the
//! tolerance, strips over the fewest that ordered stabbing needs, and the shares of areas that are shown at all and
//! twice. The first seed is a line and an area of 100 000 points each, and tells how long they take.
#![allow(missing_docs, clippy::print_stdout, reason = "a program for people")]

mod common;
mod judge;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};
use swath_mission::orders::feature::{Feature, Part};
use swath_mission::orders::feature_strips::Cutting;
use swath_mission::orders::import::{features, import_features};
use swath_sim::config::SimConfig;

/// Where sets lie.
const SETS: &str = "target/soak/sets";
/// Points of the line and the area that are timed.
const POINTS: u32 = 100_000;

fn main() -> Result<ExitCode> {
    let sets = sets()?;
    let (first, count) = match common::asked()? {
        common::Asked::Plan => {
            println!("{}", json!({ "seeds": sets.len() + 1, "chunk": 1 }));
            return Ok(ExitCode::SUCCESS);
        }
        common::Asked::Seeds(first, count) => (usize::try_from(first)?, usize::try_from(count)?),
    };
    for number in first..first + count {
        let found = match number.checked_sub(1) {
            None => timed(),
            Some(set) => json!({ "sets": [judged(&sets[set])?] }),
        };
        println!("{found}");
    }
    Ok(ExitCode::SUCCESS)
}

fn sets() -> Result<Vec<PathBuf>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = root.join(SETS);
    let entries = std::fs::read_dir(&folder).with_context(|| {
        format!("{SETS} holds no files: put public sets there, such as examples/requests/README.md names")
    })?;
    let mut sets: Vec<_> = entries.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    sets.sort();
    ensure!(!sets.is_empty(), "{SETS} is empty");
    Ok(sets)
}

fn judged(path: &Path) -> Result<Value> {
    let cutting = Cutting::of(&SimConfig::default());
    let read: Vec<Feature> = features(path)?.into_iter().flatten().collect();
    let mut lines = judge::Lines::default();
    let mut areas = judge::Areas::default();
    let mut seconds = 0.0;
    for feature in &read {
        // Each part alone, so that its strips are known.
        for part in feature.parts.iter().filter(|part| matches!(part, Part::Line(_))) {
            let alone = Feature { parts: vec![part.clone()], ..Feature::default() };
            let begun = Instant::now();
            let import = import_features(vec![Ok(alone)], path, &cutting);
            seconds += begun.elapsed().as_secs_f64();
            if let Part::Line(line) = part {
                lines.add(line, &import, &cutting);
            }
        }
        let rings: Vec<_> = feature.parts.iter().filter(|part| matches!(part, Part::Area(_))).cloned().collect();
        if !rings.is_empty() {
            let alone = Feature { parts: rings.clone(), ..Feature::default() };
            let begun = Instant::now();
            let import = import_features(vec![Ok(alone)], path, &cutting);
            seconds += begun.elapsed().as_secs_f64();
            areas.add(&rings, &import, &cutting);
        }
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Ok(json!({ "set": name, "seconds": seconds, "lines": lines.told(), "areas": areas.told() }))
}

/// Seconds that a coast and a lake of many points take.
fn timed() -> Value {
    let cutting = Cutting::of(&SimConfig::default());
    let coast: Vec<[f64; 2]> = (0..POINTS)
        .map(|i| {
            let t = f64::from(i) / f64::from(POINTS);
            let wave = |cycles: f64| (std::f64::consts::TAU * cycles * t).sin();
            [-60.0 + 120.0 * t + 0.3 * wave(301.0), 20.0 + 20.0 * wave(3.0) + 0.2 * wave(997.0)]
        })
        .collect();
    let lake: Vec<[f64; 2]> = (0..POINTS)
        .map(|i| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(POINTS);
            let radius = 2.0 + 0.3 * (37.0 * angle).sin() + 0.02 * (2999.0 * angle).sin();
            [20.0 + radius * angle.cos(), 10.0 + radius * angle.sin()]
        })
        .collect();
    let seconds = |part: Part| {
        let feature = Feature { parts: vec![part], ..Feature::default() };
        let begun = Instant::now();
        let _ = import_features(vec![Ok(feature)], Path::new("timed"), &cutting);
        begun.elapsed().as_secs_f64()
    };
    json!({
        "max_line_of_100000_points_s": seconds(Part::Line(coast)),
        "max_area_of_100000_points_s": seconds(Part::Area(vec![lake])),
    })
}
