//! The sample bag: flown again, told, exported.

use std::fmt::Write as _;

use serde_json::Value;

use crate::pins::golden;
use crate::pins::place::{Place, sha256};

const SAMPLE: &str = "<repository>/bags/samples/mission";

/// A re-flight: what is compared in clear, and the digests of all decisions and of the tasks.
pub fn refly(place: &Place, bag: &str, options: &str) -> String {
    let line = format!("swath refly {bag} {options}--tasks tasks.jsonl --json");
    let mut said: Value = serde_json::from_str(&place.succeed(&line)).unwrap();
    let decisions = said.as_object_mut().unwrap().remove("decisions").unwrap();
    let tasks = place.read("tasks.jsonl");
    format!(
        "$ {line}\n{said:#}\n{} decisions {}\n{} tasks {}\n\n",
        decisions.as_array().unwrap().len(),
        sha256(decisions.to_string()),
        tasks.lines().count(),
        sha256(tasks),
    )
}

/// An export: each file's length and digest. Parquet files also tell the version of the library that wrote them.
pub fn export(place: &Place, bag: &str, options: &str) -> String {
    let line = format!("swath export {bag} -o export{options}");
    place.succeed(&line);
    let mut names: Vec<_> =
        std::fs::read_dir(place.path("export")).unwrap().map(|it| it.unwrap().file_name()).collect();
    names.sort();
    let mut text = format!("$ {line}\n");
    for name in names {
        let name = name.into_string().unwrap();
        let bytes = std::fs::read(place.path("export").join(&name)).unwrap();
        if name.ends_with(".parquet") {
            assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"), "{name}");
            _ = writeln!(text, "{name}");
            continue;
        }
        let lines = bytes.iter().filter(|byte| **byte == b'\n').count();
        _ = writeln!(text, "{name}: {} bytes, {lines} lines {}", bytes.len(), sha256(&bytes));
        if name.ends_with(".csv") {
            _ = writeln!(text, "    {}", std::str::from_utf8(&bytes).unwrap().lines().next().unwrap());
        }
    }
    std::fs::remove_dir_all(place.path("export")).unwrap();
    text + "\n"
}

/// A report: its facts and tables in clear, and how many shapes each figure has.
pub fn report(place: &Place, bag: &str) -> String {
    let line = format!("swath report {bag} -o report.html");
    place.succeed(&line);
    let page = place.read("report.html");
    let mut text = format!("$ {line}\n");
    for figure in page.split("<figure id=\"").skip(1) {
        let (id, rest) = figure.split_once('"').unwrap();
        let svg = rest.split("</figure>").next().unwrap();
        let caption = svg.split("<figcaption>").nth(1).unwrap().split("</figcaption>").next().unwrap();
        let shapes = ["<polyline", "<polygon", "<line", "<rect", "<circle", "<text"];
        let counts: Vec<_> = shapes.iter().map(|it| format!("{} {}", svg.matches(it).count(), &it[1..])).collect();
        _ = writeln!(text, "figure {id}: {caption} {}", counts.join(", "));
    }
    for table in ["facts", "tasks"] {
        let rows = page.split(&format!("<table id=\"{table}\">")).nth(1).unwrap().split("</table>").next().unwrap();
        for row in rows.split("<tr>").skip(1) {
            let cells = row.split('<').filter_map(|piece| piece.split_once('>')).map(|(_, cell)| cell.trim());
            let cells: Vec<&str> = cells.filter(|cell| !cell.is_empty()).collect();
            _ = writeln!(text, "{table}: {}", cells.join(" | "));
        }
    }
    let decisions = page.split("<div id=\"decisions\">").nth(1).unwrap();
    _ = writeln!(text, "{} decisions {}", decisions.matches("<details>").count(), sha256(decisions));
    _ = writeln!(text, "page {}\n", sha256(&page));
    text
}

#[test]
fn the_sample_is_read() {
    let place = Place::new();
    let mut text = String::new();
    for line in [
        "swath-bag info <repository>/bags/samples/mission",
        "swath-bag info <repository>/bags/samples/mission --json",
        "swath-bag validate <repository>/bags/samples/mission",
        "swath-bag validate <repository>/bags/samples/mission --json",
        "swath-bag cat <repository>/bags/samples/mission --topic /swath/planner/task /swath/planner/status",
        "swath-bag cat <repository>/bags/samples/mission --regex /swath/.* --from +60 --to +62",
    ] {
        let said = place.succeed(line);
        // The digest of what is long, its beginning in clear.
        let shown = said.chars().take(4000).collect::<String>();
        _ = writeln!(text, "$ {line}\n{}\n{} bytes {}\n", shown.trim_end(), said.len(), sha256(&said));
    }
    golden::check("sample/read.txt", &text);
}

#[test]
fn the_sample_is_copied() {
    let place = Place::new();
    place.succeed(&format!("swath-bag filter {SAMPLE} -o early --to +600 --compression lz4"));
    place.succeed(&format!("swath-bag filter {SAMPLE} -o late --from +600.000000001 --max-bag-size 100000"));
    let merged = place.succeed("swath-bag merge early late -o merged --compression none");
    let everything = |bag: &str| sha256(place.succeed(&format!("swath-bag cat {bag}")));
    assert_eq!(everything("merged"), everything(SAMPLE));
    let messages = merged.split(' ').next().unwrap();
    golden::check("sample/copied.txt", &format!("{messages} messages {}\n", everything("merged")));
}

#[test]
fn the_sample_is_flown_again() {
    let place = Place::new();
    let mut text = refly(&place, SAMPLE, "");
    for planner in ["heuristic:90", "random", "beam", "hop-ppo"] {
        text += &refly(&place, SAMPLE, &format!("--planner {planner} "));
    }
    golden::check("sample/refly.txt", &text);
}

#[test]
fn the_sample_is_told_and_exported() {
    let place = Place::new();
    golden::check("sample/report.txt", &report(&place, SAMPLE));
    let text = export(&place, SAMPLE, "") + &export(&place, SAMPLE, " --step 30 --format geojson czml csv");
    golden::check("sample/export.txt", &text);
}
