//! An operator's orders that are refused before anybody is asked, or because nobody is there.

use super::{Case, refuse};
use crate::place::Place;

const WORDS: &[Case] = &[
    (&[], "swath strips"),
    (&[], "swath strips submit"),
    (&[], "swath strips submit nowhere.geojson"),
    (&[("s.geojson", r#"{"type":"FeatureCollection","features":[{"type":"Feat"#)], "swath strips submit s.geojson"),
    (&[("s.geojson", r#"{"type":"Point","coordinates":[1,2]}"#)], "swath strips submit s.geojson"),
    (&[("s.geojson", r#"{"type":"Polygon","coordinates":[]}"#)], "swath strips submit s.geojson --json"),
    (
        &[("s.geojson", r#"{"type":"MultiLineString","coordinates":[[[0,0],[2,0]],[[5,5]]]}"#)],
        "swath strips submit s.geojson --dry-run",
    ),
    (&[], "swath strips submit s.geojson --max-length-km 0.5"),
    (&[], "swath strips submit s.geojson --max-length-km far"),
    (&[], "swath strips preview"),
    (&[], "swath strips preview s.geojson --id 3"),
    (&[], "swath strips list --state lost"),
    (&[], "swath strips list --area 1,2,3"),
    (&[], "swath strips list --from yesterday"),
    (&[], "swath strips list --limit -1"),
    (&[], "swath strips show"),
    (&[], "swath strips show 1 --ref a"),
    (&[], "swath strips show first"),
    (&[], "swath strips cancel"),
    (&[], "swath strips hold 1 two"),
    (&[], "swath strips replace 1 nowhere.geojson"),
    (
        &[("two.geojson", r#"{"type":"MultiLineString","coordinates":[[[0,0],[2,0]],[[5,5],[7,5]]]}"#)],
        "swath strips replace 1 two.geojson",
    ),
    (&[], "swath strips export --store nowhere.sqlite"),
    (
        &[(
            "text.sqlite",
            "This is a text, and as long as a header of SQLite must be: one hundred bytes. It goes on until then.",
        )],
        "swath strips export --store text.sqlite",
    ),
    (&[("empty.sqlite", "")], "swath strips export --store empty.sqlite"),
    (&[], "swath planner"),
    (&[], "swath planner mode clever"),
    (&[], "swath planner approve next"),
];

const NOBODY: &[Case] = &[
    (&[], "swath strips list"),
    (&[], "swath strips cancel 1"),
    (&[], "swath planner mode hold"),
    (&[], "swath planner status"),
];

#[test]
fn orders() {
    refuse("orders", &Place::new(), WORDS);
}

#[test]
fn orders_that_nobody_takes() {
    // Each waits for ten seconds.
    let threads = NOBODY
        .iter()
        .enumerate()
        .map(|(number, case)| std::thread::spawn(move || refuse(&format!("nobody_{number}"), &Place::new(), &[*case])));
    threads.collect::<Vec<_>>().into_iter().for_each(|thread| thread.join().unwrap());
}
