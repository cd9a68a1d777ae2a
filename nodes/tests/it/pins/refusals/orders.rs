//! An operator's orders that are refused before anybody is asked, or because nobody is there.

use super::{Case, refusals, refuse};
use crate::pins::golden;
use crate::pins::place::Place;

const WORDS: &[Case] = &[
    (&[], "swath strips submit nowhere.geojson"),
    (&[("s.geojson", r#"{"type":"FeatureCollection","features":[{"type":"Feat"#)], "swath strips submit s.geojson"),
    (&[("s.geojson", r#"{"type":"Point","coordinates":[1,2]}"#)], "swath strips submit s.geojson"),
    (
        &[("s.geojson", r#"{"type":"MultiLineString","coordinates":[[[0,0],[2,0]],[[5,5]]]}"#)],
        "swath strips submit s.geojson --dry-run",
    ),
    (&[], "swath strips submit s.geojson --max-length-km 0.5"),
    (&[], "swath strips preview s.geojson --id 3"),
    (&[], "swath strips list --state lost"),
    (&[], "swath strips list --area 1,2,3"),
    (&[], "swath strips list --from yesterday"),
    (&[], "swath strips cancel"),
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
    (&[], "swath planner mode clever"),
];

const NOBODY: &[&str] =
    &["swath strips list", "swath strips cancel 1", "swath planner mode hold", "swath planner status"];

#[test]
fn orders() {
    refuse("orders", &Place::new(), WORDS);
}

#[test]
fn orders_that_nobody_takes() {
    // Each waits for ten seconds.
    let threads = NOBODY.iter().map(|line| std::thread::spawn(|| refusals(&Place::with_domain(), &[(&[], line)])));
    let threads: Vec<_> = threads.collect();
    let text: String = threads.into_iter().map(|thread| thread.join().unwrap()).collect();
    golden::check("refusals/nobody.txt", &text);
}
